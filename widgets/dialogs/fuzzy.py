"""How well a few letters fit a title; no Qt."""

from __future__ import annotations


def score(typed: str, title: str) -> float | None:
    """The higher the better, None if the letters do not occur in order.

    Whole words and their beginnings count most, then letters that follow each other.
    """
    typed, text = typed.casefold().strip(), title.casefold()
    if not typed:
        return 0.0
    if typed in text:
        start = text.index(typed)
        at_word = start == 0 or not text[start - 1].isalnum()
        return 100.0 + (50.0 if at_word else 0.0) - 0.1 * start - 0.01 * len(text)
    words = typed.split()
    if len(words) > 1:
        parts = [score(word, title) for word in words]
        return None if any(part is None for part in parts) else min(part for part in parts if part is not None) - 5.0
    total, last = 0.0, -1
    for letter in typed:
        begins = [k for k in range(last + 1, len(text)) if text[k] == letter and (k == 0 or not text[k - 1].isalnum())]
        following = last + 1 < len(text) and text[last + 1] == letter
        at = last + 1 if following and last >= 0 else (begins[0] if begins else text.find(letter, last + 1))
        if at < 0:
            return None
        total += 8.0 if following and last >= 0 else (6.0 if begins and at == begins[0] else 1.0)
        last = at
    return total - 0.1 * last
