"""Every decision since the session was opened, one step each, to go back and forth in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from markerscope.solver.pipeline.session import Session

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
    answers : by stage, the key of the result that was last in force while the session was so
    before : the same session in the words it had before it was saved; a run that was begun with them may still go on
    """

    sentence: str
    when: float
    session: Session
    merge: str = ""
    answers: Mapping[str, str] = field(default_factory=dict)
    before: tuple[Session, ...] = ()


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
        if dialled:  # what was in force on the way was so on this line
            step = replace(step, answers={**last.answers, **step.answers})
        del self.steps[self.position + (0 if dialled else 1) :]
        if not (dialled and step.session == self.steps[-1].session):  # dialled back to where it was: no step at all
            self.steps.append(step)
        self.position = len(self.steps) - 1
        if len(self.steps) > _MOST:
            first = len(self.steps) - _MOST + 1
            kept = replace(self.steps[first], answers=self.answers_at(first))
            self.steps[1 : first + 1] = [kept]
            self.position = len(self.steps) - 1

    def note(self, answers: Mapping[str, str]) -> bool:
        """Remember results that are in force now, key by stage; False where nothing of it is new."""
        return self._note(self.position, answers)

    def note_for(self, session: Session, answers: Mapping[str, str]) -> bool:
        """Remember results for every step whose session is this one, wherever it is; False where nothing is new."""
        same = [i for i, step in enumerate(self.steps) if session == step.session or session in step.before]
        return sum(self._note(i, answers) for i in same) > 0  # every one is told

    def in_force_before(self, stage: str) -> Iterator[str]:
        """Keys of a stage's results that were in force on the way to the session as it is now, the last first.

        What was in force only on a way that was undone is not among them.
        """
        for step in self.steps[self.position :: -1]:
            if stage in step.answers:
                yield step.answers[stage]

    def _note(self, place: int, answers: Mapping[str, str]) -> bool:
        step = self.steps[place]
        known = {**step.answers, **answers}
        if known == step.answers:
            return False
        self.steps[place] = replace(step, answers=known)
        return True

    def answers_at(self, position: int) -> dict[str, str]:
        """The results, key by stage, that were last in force on the way to a step."""
        found: dict[str, str] = {}
        for step in self.steps[: position + 1]:
            found |= step.answers
        return found

    def restate(self, session: Session) -> None:
        """Have the session that is there now say the same in other words."""
        step = self.steps[self.position]
        if session != step.session:
            self.steps[self.position] = replace(step, session=session, before=(*step.before, step.session))

    def go_to(self, position: int) -> bool:
        """Have the session as it was after a step; False where there is no such step or it is there already."""
        if position == self.position or not 0 <= position < len(self.steps):
            return False
        self.position = position
        return True
