"""Text and JSON that any program can read, whatever the values and names are."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from typing import Any

_LONE = re.compile("[\ud800-\udfff]")
"""Half a character: how Python carries bytes of a file name that are not UTF-8. No file or screen can hold one."""


def shown(text: str) -> str:
    r"""The text with every byte that is no character as ``\xff``; any other text as it is."""
    return _LONE.sub(_code, text)


def _code(match: re.Match[str]) -> str:
    number = ord(match[0])
    return f"\\x{number - 0xDC00:02x}" if 0xDC80 <= number <= 0xDCFF else f"\\u{number:04x}"


def plain(value: Any) -> Any:
    """JSON values: what is not a finite number becomes null, arrays lists, text such as ``shown`` gives."""
    if isinstance(value, Mapping):
        return {shown(str(key)): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy's arrays and scalars
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if value is None or isinstance(value, bool | int | float):
        return value
    return shown(str(value))


def json_text(value: Any, indent: int | None = 1) -> str:
    """Strict JSON of ``plain(value)``, without a line feed at its end."""
    return json.dumps(plain(value), indent=indent, allow_nan=False)
