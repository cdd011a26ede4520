"""Signals reach who listens, once, and only them."""

from __future__ import annotations

import pytest

from markerscope.app.models.signal import Signal


def test_listeners_are_told_in_order_and_once() -> None:
    signal: Signal[[int]] = Signal()
    heard: list[tuple[str, int]] = []
    signal.connect(lambda value: heard.append(("a", value)))
    second = signal.connect(lambda value: heard.append(("b", value)))
    signal.connect(second)
    signal.emit(1)
    assert heard == [("a", 1), ("b", 1)]
    signal.disconnect(second)
    signal.disconnect(second)
    signal.emit(2)
    assert heard[2:] == [("a", 2)]


def test_bound_methods_can_be_disconnected() -> None:
    signal: Signal[[int]] = Signal()
    heard: list[int] = []
    signal.connect(heard.append)
    signal.disconnect(heard.append)
    signal.emit(1)
    assert heard == []


def test_a_blocked_signal_is_silent_until_the_last_block_ends() -> None:
    signal: Signal[[]] = Signal()
    heard: list[int] = []
    signal.connect(lambda: heard.append(1))
    with signal.block():
        with signal.block():
            signal.emit()
        signal.emit()
    assert heard == []
    signal.emit()
    assert heard == [1]


def test_one_that_fails_does_not_keep_the_others_from_hearing() -> None:
    signal: Signal[[]] = Signal()
    heard: list[int] = []

    def stumble() -> None:
        raise ZeroDivisionError

    signal.connect(stumble)
    signal.connect(lambda: heard.append(1))
    with pytest.raises(ZeroDivisionError):
        signal.emit()
    assert heard == [1]


def test_one_disconnected_while_telling_is_not_told() -> None:
    signal: Signal[[]] = Signal()
    heard: list[int] = []
    signal.connect(lambda: signal.disconnect(later))
    later = signal.connect(lambda: heard.append(1))
    signal.emit()
    assert heard == []
