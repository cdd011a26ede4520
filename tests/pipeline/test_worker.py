"""Work in a child process: messages arrive, errors too, and cancelling leaves the store whole."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.progress import Found
from markerscope.solver.pipeline.stage import Event
from markerscope.solver.pipeline.store import Store
from markerscope.solver.pipeline.worker import Failed, Finished, Job, Progressed, WorkerDied
from tests.pipeline import jobs


def test_progress_events_and_the_value_arrive_in_order() -> None:
    messages = list(Job(jobs.add, 2, b=3).messages())
    assert messages == [
        Progressed(0.5, "adding"),
        Event("add", "running", "k"),
        Progressed(1.0, "added"),
        Finished(5),
    ]


def test_what_a_user_can_mend_arrives_whole() -> None:
    with pytest.raises(InputError) as caught:
        Job(jobs.refuse).result()
    assert str(caught.value) == "a.trc: has no markers; export it again."
    assert caught.value.remedy == "export it again"


def test_any_other_error_arrives_with_its_traceback() -> None:
    (*_, last) = Job(jobs.stumble).messages()
    assert isinstance(last, Failed)
    assert "ZeroDivisionError: of all things" in str(last.error)
    assert "in stumble" in last.details


@pytest.mark.parametrize(("function", "error"), [(jobs.die, WorkerDied), (jobs.unsendable, RuntimeError)])
def test_a_child_that_dies_or_cannot_answer_is_noticed(function, error) -> None:
    with pytest.raises(error):
        Job(function).result()


def test_cancelling_ends_the_child_and_leaves_the_store_whole(tmp_path: Path) -> None:
    store = Store(tmp_path)
    job = Job(jobs.graph_that_hangs, tmp_path, store=store)
    for message in job.messages():
        if isinstance(message, Progressed) and message.text == "waiting to be ended":
            break
    assert job.running
    assert len(list(tmp_path.rglob(".tmp-*"))) == 1
    job.cancel()
    assert not job.running
    with pytest.raises(Cancelled):
        job.result()
    assert [entry.stage for entry in store.list()] == ["quick"]
    assert os.listdir(tmp_path / "endless") == []


def test_polling_does_not_wait() -> None:
    job = Job(jobs.add, 1, b=1)
    seen = []
    while not any(isinstance(message, Finished) for message in seen):
        seen += job.poll()
    assert job.poll() == []


def test_what_several_threads_find_arrives_whole() -> None:
    found = [message for message in Job(jobs.seek).messages() if isinstance(message, Found)]
    assert sorted(found, key=lambda f: f.index) == [Found("chain", i, {"cost": float(i)}) for i in range(40)]
