"""Faults amid smoothing in the background: it says what is wrong, tries again, and repeats no search."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest
from piece_page import wait_for

from motionmind.studio import seams
from motionmind.studio.findings import Finding
from motionmind.studio.journal import Journal
from motionmind.studio.movements import MovementLine
from motionmind.studio.project import Project
from motionmind.studio.seams import Smoother
from motionmind.studio.workers import WorkerLostError

if TYPE_CHECKING:
    from studio_server import Served

ERRORS = {
    "No space left on device": OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)),
    "Input/output error": OSError(errno.EIO, os.strerror(errno.EIO)),
    "not enough memory": MemoryError(),
    "RuntimeError: odd": RuntimeError("odd"),
}


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One studio for all tests of this module, which tries again at once."""
    from studio_server import serving

    project = Project.create(tmp_path_factory.mktemp("faults") / "piece.motionmind", "ballet")
    with pytest.MonkeyPatch.context() as patch, serving(project) as one:
        patch.setattr(seams, "_RETRY_S", 0.02)
        yield one


@pytest.fixture
def emptied(served: Served) -> Served:
    """The studio with an empty piece, and nothing to smooth."""
    served.send("DELETE", "/api/seams")  # until the next edit
    served.edit(edit="arrange", blocks=[], about={"words": "begin"})
    return served


def until(is_so: Callable[[], bool], seconds: float = 300.0) -> None:
    """Wait for the studio."""
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


def state(served: Served) -> str:
    """The state of the last seam."""
    found: str = served.project()["piece"]["seams"][-1]["state"]
    return found


def says(served: Served, words: str) -> bool:
    """Whether there is one notice, which ends like this."""
    notices = served.project()["words"]
    return len(notices) == 1 and str(notices[0]).startswith("smoothing waits") and str(notices[0]).endswith(words)


@pytest.mark.parametrize(("words", "error"), ERRORS.items())
@pytest.mark.parametrize("where", ["write", "append", "lacks"])
def test_smoothing_waits_while_something_fails_and_goes_on(
    emptied: Served, monkeypatch: pytest.MonkeyPatch, words: str, error: Exception, where: str
) -> None:
    append, write, failed = Journal.append, Journal._write, []
    number = len(emptied.studio.project.changes)

    def fail(*_: Any) -> Any:
        failed.append(where)
        raise error

    def appending(journal: Journal, record: Any) -> Any:
        """Fail before or while a finding is written; write edits."""
        if not isinstance(record, Finding):
            return append(journal, record)
        if where == "append":
            fail()
        monkeypatch.setattr(Journal, "_write", fail)
        try:
            return append(journal, record)
        finally:
            monkeypatch.setattr(Journal, "_write", write)

    if where == "lacks":
        monkeypatch.setattr(Project, "lacks", fail)
    else:
        monkeypatch.setattr(Journal, "append", appending)
    frame = 1 + number % 60  # a seam that has not been judged
    emptied.insert(f"a{number}", "ballet/adagio", 0, frame)
    emptied.insert(f"b{number}", "ballet/adagio", frame + 2, frame + 4)
    until(lambda: says(emptied, words))
    until(lambda: len(failed) > 3)
    assert len(emptied.project()["words"]) == 1  # it repeats itself for nobody
    assert state(emptied) == "waiting"
    monkeypatch.undo()
    until(lambda: state(emptied) != "waiting" and emptied.project()["words"] == [])


@pytest.mark.long
def test_a_search_whose_result_cannot_be_written_is_not_repeated(
    emptied: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    append, failed, searched = Journal.append, [], []
    submit = emptied.studio.workers.submit

    def failing(journal: Journal, record: Any) -> Any:
        if isinstance(record, MovementLine) or (isinstance(record, Finding) and record.insertions):
            failed.append(record)
            raise ERRORS["No space left on device"]
        return append(journal, record)

    def counted(kind: str, *arguments: Any, **named: Any) -> Any:
        searched.append(kind)
        return submit(kind, *arguments, **named)

    monkeypatch.setattr(Journal, "append", failing)
    monkeypatch.setattr(emptied.studio.workers, "submit", counted)
    emptied.insert("c", "ballet/arabesque")
    emptied.insert("d", "ballet/passe")
    until(lambda: len(failed) > 3)
    assert state(emptied) == "abrupt"
    monkeypatch.setattr(Journal, "append", append)
    until(lambda: state(emptied) == "inserted" and emptied.project()["words"] == [])
    assert searched == ["seams", "seam"]


@pytest.mark.long
@pytest.mark.parametrize("losses", [1, 2])
def test_seams_whose_worker_is_lost_are_checked_once_more(
    emptied: Served, monkeypatch: pytest.MonkeyPatch, losses: int
) -> None:
    result, lost = Smoother._result, []

    async def losing(smoother: Smoother, kind: str, *arguments: Any) -> Any:
        if kind == "seams" and len(lost) < losses:
            lost.append(kind)
            raise WorkerLostError("stopped: this computer ran out of memory")
        return await result(smoother, kind, *arguments)

    monkeypatch.setattr(Smoother, "_result", losing)
    emptied.insert(f"e{losses}", "ballet/adagio", 0, 9)
    emptied.insert(f"f{losses}", "ballet/plies", losses, 9)  # a seam that has not been judged
    until(lambda: len(lost) == losses)
    if losses == 2:
        paused = ["the seams cannot be checked: stopped: this computer ran out of memory"]
        until(lambda: emptied.studio.has_stopped and emptied.project()["words"] == paused)
        emptied.post("/api/seams", {})  # as the page resumes it
    until(lambda: state(emptied) != "waiting" and emptied.project()["words"] == [])


@pytest.mark.long
def test_the_page_says_that_smoothing_waits_once_for_each_time(
    studio_server: Served, studio_page: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(seams, "_RETRY_S", 0.05)
    studio_page.get_by_test_id("posture-bow").wait_for()
    append = Journal.append

    def failing(journal: Journal, record: Any) -> Any:
        if isinstance(record, Finding):
            raise ERRORS["No space left on device"]
        return append(journal, record)

    for number in range(2):
        with monkeypatch.context() as patch:
            patch.setattr(Journal, "append", failing)
            for name, first in (("a", 0), ("b", 30 + number)):
                studio_server.insert(f"{name}{number}", "ballet/adagio", first, first + 9)
            toast = studio_page.get_by_text("smoothing waits, and tries again")
            toast.wait_for(timeout=20_000)
            assert toast.count() == 1
        wait_for(studio_page, "studio.store.state.words.length === 0", 60.0)
        toast.wait_for(state="detached")  # it goes with its cause
