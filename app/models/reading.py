"""The marker file read in a thread, so that there is something to look at before anything is run."""

from __future__ import annotations

import threading

from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import Session


class Reading:
    """The marker file of a session being read; its result then lies in the session's store.

    Attributes
    ----------
    key : of that result
    error : why it cannot be read, once ``done``
    """

    def __init__(self, session: Session, key: str) -> None:
        self.key = key
        self.error: Exception | None = None
        self._thread = threading.Thread(target=self._run, args=(session,), name="markers", daemon=True)
        self._thread.start()

    @property
    def done(self) -> bool:
        """Whether it has ended, well or not."""
        return not self._thread.is_alive()

    def _run(self, session: Session) -> None:
        try:
            run_stages(session, ["markers"])
        except Exception as error:
            self.error = error
