"""Every decision since the session was opened, one step each, to go back and forth in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from solver.pipeline.session import Session

_MOST = 500
_DIALLED_S = 2.0
"""Edits of the same value that follow each other within this time are one step."""


@dataclass(frozen=True)
class Step:
    """One decision, and the session as it left it; the first step is the session as it was opened.

    Attributes
    ----------
    sentence : what was done
    when : s since the epoch
    session : afterwards
    merge : what was dialled, if a value was
    """

    sentence: str
    when: float
    session: Session
    merge: str = ""


class History:
    """Steps, and which of them the session is at.

    Parameters
    ----------
    steps : at least one
    position : the step the session is at
    """

    def __init__(self, steps: Sequence[Step], position: int = 0) -> None:
        self.steps = list(steps)
        self.position = position

    @property
    def session(self) -> Session:
        """As it is now."""
        return self.steps[self.position].session

    @property
    def undo_sentence(self) -> str | None:
        """What undo would take back."""
        return self.steps[self.position].sentence if self.position else None

    @property
    def redo_sentence(self) -> str | None:
        """What redo would do again."""
        return self.steps[self.position + 1].sentence if self.position + 1 < len(self.steps) else None

    def add(self, step: Step) -> None:
        """Go on from here with a new step; what was undone is gone."""
        last = self.steps[self.position]
        dialled = step.merge and step.merge == last.merge and step.when - last.when < _DIALLED_S and self.position
        del self.steps[self.position + (0 if dialled else 1) :]
        if not (dialled and step.session == self.steps[-1].session):  # dialled back to where it was: no step at all
            self.steps.append(step)
        if len(self.steps) > _MOST:
            del self.steps[1 : len(self.steps) - _MOST + 1]
        self.position = len(self.steps) - 1

    def restate(self, session: Session) -> None:
        """Have the session that is there now say the same in other words."""
        self.steps[self.position] = replace(self.steps[self.position], session=session)

    def go_to(self, position: int) -> bool:
        """Have the session as it was after a step; False where there is no such step or it is there already."""
        if position == self.position or not 0 <= position < len(self.steps):
            return False
        self.position = position
        return True
