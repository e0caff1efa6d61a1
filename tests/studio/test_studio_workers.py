"""Workers: jobs are told of, cancelled at once, and fail in a line; events reach every window."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from itertools import count
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest
import working
from bundled_clips import ballet_clip
from faults import failing_at
from studio_server import Served

from motionmind.corpus import store
from motionmind.errors import MotionMindError
from motionmind.studio import events as events_module
from motionmind.studio import workers as workers_module
from motionmind.studio.events import Events
from motionmind.studio.preparation import Steps, Told, told
from motionmind.studio.workers import Job, JobCancelledError, Workers
from motionmind.tween.engine import Engine


def run(check: Callable[[Workers, list[dict[str, Any]]], Any], home: Path | None = None, number: int = 1) -> None:
    """Run a check with workers, and all that was told of jobs."""
    told: list[dict[str, Any]] = []

    async def checked() -> None:
        workers = Workers(home, lambda job: told.append(job.view()), "", number)
        try:
            async with asyncio.timeout(60):
                await check(workers, told)
        finally:
            workers.close()

    asyncio.run(checked())


async def until(job: Job, state: str) -> None:
    """Wait for a job to come to a state."""
    while job.state != state:
        await asyncio.sleep(0.01)


def test_a_job_is_told_of_from_its_beginning_to_its_end() -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        job = workers.submit(
            "sum", working.add, 2, 3, finish=lambda sum_: {"sum": sum_}, collect=lambda part: 10 * part
        )
        assert await job.result() == 5
        await asyncio.sleep(0)
        assert [one["state"] for one in told] == ["waiting", "running", "running", "running", "done"]
        assert [one["done"] for one in told] == [0, 0, 1, 2, 2]
        assert told[-1] == {
            **{"id": job.id, "kind": "sum", "state": "done", "done": 2, "of": 2, "words": "the second"},
            **{"partial": [20, 30], "result": {"sum": 5}},
        }
        assert workers.find(job.id) is job

    run(check)


def test_a_job_that_runs_is_cancelled_at_once_and_the_next_one_runs() -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        long, waiting = workers.submit("long", working.sleep, 1000.0), workers.submit("waits", working.sleep, 1000.0)
        last = workers.submit("sum", working.add, 2, 3)
        await until(long, "running")
        while not long.words:
            await asyncio.sleep(0.01)
        waiting.cancel()
        long.cancel()
        assert (long.state, waiting.state) == ("cancelled", "cancelled")
        for job in (long, waiting):
            with pytest.raises(JobCancelledError):
                await job.result()
        assert await last.result() == 5
        long.cancel()  # which is over
        assert long.state == "cancelled"

    run(check)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (working.refuse, "this cannot be"),
        (working.crash, "internal error: see the terminal"),
        (working.die, "stopped: this computer ran out of memory"),
    ],
)
def test_a_job_that_fails_says_so_in_a_line_and_the_next_one_runs(function: Any, words: str) -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        job, after = workers.submit("fails", function), workers.submit("sum", working.add, 2, 3)
        with pytest.raises(MotionMindError, match=words):
            await job.result()
        assert (job.state, job.words) == ("failed", words)
        assert await after.result() == 5

    run(check)


@pytest.mark.parametrize("hook", ["finish", "collect"])
@pytest.mark.parametrize(
    ("error", "words"), [(MotionMindError("no space left"), "no space left"), (KeyError(), "internal error")]
)
def test_what_cannot_be_taken_in_fails_and_the_next_job_runs(hook: str, error: Exception, words: str) -> None:
    def broken(_: int) -> None:
        raise error

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        job = workers.submit("sum", working.add, 2, 3, **{hook: broken})
        with pytest.raises(MotionMindError, match=words):
            await job.result()
        assert await workers.submit("sum", working.add, 2, 3).result() == 5
        assert [one["state"] for one in told if one["id"] == job.id][-1] == "failed"

    run(check)


def test_a_worker_keeps_its_corpus() -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        first = await workers.submit("know", working.know, "ballet").result()
        assert await workers.submit("know", working.know, "ballet").result() == first
        with pytest.raises(MotionMindError, match="no corpus"):
            await workers.submit("know", working.know, "nothing").result()

    run(check)


def test_a_corpus_that_was_built_anew_is_loaded_anew(tmp_path: Path) -> None:
    def learn(*clips: str) -> None:
        Engine.fit([ballet_clip(clip) for clip in clips], name="mine").save(store.place_for("mine", tmp_path))

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        learn("plies")
        small, process, _ = await workers.submit("know", working.know, "mine").result()
        learn("plies", "tendus")
        assert await workers.submit("know", working.know, "mine").result() > (small, process, 0)
        store.delete("mine", tmp_path)
        with pytest.raises(MotionMindError, match="no corpus"):
            await workers.submit("know", working.know, "mine").result()

    run(check, tmp_path)


def test_workers_that_do_not_begin_are_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    began: list[object] = []

    class Broken(workers_module._Worker):
        def _listen(self) -> None:
            began.append(self)
            self._workers.post(self, None)

    monkeypatch.setattr(workers_module, "_Worker", Broken)

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        for _ in range(2):
            with pytest.raises(MotionMindError, match="the engine failed to start"):
                await workers.submit("sum", working.add, 2, 3).result()

    run(check)
    assert len(began) == 4  # three for the first job, and one more try for the next


@pytest.mark.parametrize("error", [OSError(24, "Too many open files"), RuntimeError("can't start new thread")])
@pytest.mark.parametrize("number", [1, 2])
def test_a_process_that_the_system_does_not_start_is_started_for_the_next_job(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: Exception, number: int
) -> None:
    monkeypatch.setattr(workers_module, "_Worker", failing_at(number, workers_module._Worker, error))

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        with pytest.raises(MotionMindError, match="failed to start" if number == 1 else "ran out of memory"):
            await workers.submit("die", working.die).result()
        assert await workers.submit("sum", working.add, 2, 3).result() == 5

    run(check)
    assert f"cannot start a process: {error}" in capsys.readouterr().err


@pytest.mark.parametrize("function", [lambda _: 0, working.answer_with_a_function])
def test_what_cannot_be_sent_fails_and_the_next_job_runs(function: Any) -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        for _ in range(2):
            with pytest.raises(MotionMindError, match="internal error: see the terminal"):
                await workers.submit("fails", function).result()
        assert await workers.submit("sum", working.add, 2, 3).result() == 5

    run(check)


def test_an_answer_that_cannot_be_read_ends_its_worker_and_the_next_job_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    receive = Connection.recv
    monkeypatch.setattr(Connection, "recv", failing_at(3, receive, MemoryError()))  # after "begun" and a report

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        with pytest.raises(MotionMindError, match="ran out of memory"):
            await workers.submit("sum", working.add, 2, 3).result()
        assert await workers.submit("sum", working.add, 2, 3).result() == 5

    run(check)


def test_a_corpus_that_cannot_be_loaded_ahead_ends_no_worker() -> None:
    async def check() -> None:
        workers = Workers(None, lambda _: None, 5, 1)  # type: ignore[arg-type]  # an error that nobody foresaw
        try:
            assert await workers.submit("sum", working.sleep, 0.0).result() == (
                await workers.submit("sum", working.sleep, 0.0).result()
            )
        finally:
            workers.close()

    asyncio.run(check())


def test_a_preparation_that_fails_keeps_no_job_waiting() -> None:
    def steps() -> Told:
        yield 1, 2, "once", False
        raise OSError("no space")

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        preparing = asyncio.create_task(workers.prepare("getting ready", steps()))
        await asyncio.sleep(0)
        assert await workers.submit("sum", working.add, 2, 3).result() == 5
        await preparing
        assert [one["state"] for one in told if one["kind"] == "getting ready"][-1] == "failed"

    run(check)


def test_two_workers_work_side_by_side() -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        jobs = [workers.submit("long", working.sleep, 0.2, urgent=True) for _ in range(4)]
        assert len({await job.result() for job in jobs}) == 2

    run(check, number=2)


def test_what_somebody_waits_for_goes_before_what_waited_longer() -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        jobs = [workers.submit("long", working.sleep, 0.05) for _ in range(3)]
        urgent = [workers.submit("sum", working.add, number, 0, urgent=True) for number in range(2)]
        for job in (*jobs, *urgent):
            await job.result()
        done = [one["id"] for one in told if one["state"] == "done"]
        assert done.index(urgent[0].id) < done.index(urgent[1].id) < done.index(jobs[1].id) < done.index(jobs[2].id)

    run(check)


def test_one_of_two_workers_is_there_for_what_somebody_waits_for() -> None:
    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        long = [workers.submit("long", working.sleep, 1000.0) for _ in range(2)]
        await until(long[0], "running")
        assert await workers.submit("sum", working.add, 2, 3, urgent=True).result() == 5
        assert long[1].state == "waiting"

    run(check, number=2)


def test_cancelling_leaves_the_project_whole(studio_server: Served) -> None:
    studio_server.insert("b1", "ballet/adagio", 0, 9)
    studio_server.insert("b2", "ballet/jetes", 0, 9)  # whose seam is judged and smoothed in the background
    before = studio_server.project()
    begun = studio_server.post("/api/between", {"a": {"key": "ballet/arabesque"}, "b": {"key": "ballet/fifth"}})
    cancelled = studio_server.send("DELETE", f"/api/jobs/{begun['job']}").value
    assert cancelled["state"] == "cancelled"
    after = studio_server.project()
    assert after["piece"]["blocks"] == before["piece"]["blocks"]
    assert studio_server.edit(edit="delete", block="b2")["undo"] == "delete a stretch"
    assert studio_server.send("GET", "/api/jobs/j999").status == 404


def test_a_window_that_reads_slowly_is_told_the_latest_of_each_thing() -> None:
    async def check() -> None:
        hub = Events()
        stream = hub.open({("project", ""): {"sequence": 0}})
        assert await anext(stream) == b"retry: 1000\n\n"
        for number in range(10_000):
            hub.send("project", {"sequence": number})
            hub.send("job", {"id": "j1", "done": number}, "j1")
            hub.send("job", {"id": "j2", "done": -number}, "j2")
        text = await anext(stream)
        assert text.count(b"\n\n") == 3
        assert b'{"sequence":9999}' in text
        assert b'{"id":"j1","done":9999}' in text
        hub.close()
        assert [one async for one in stream] == []

    asyncio.run(check())


def test_a_stream_says_that_it_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(events_module, "_HEARTBEAT_S", 0.01)

    async def check() -> None:
        stream = Events().open({})
        assert [await anext(stream) for _ in range(3)] == [b"retry: 1000\n\n"] + 2 * [b"event: here\ndata: {}\n\n"]

    asyncio.run(check())


def test_streams_are_limited_and_those_that_end_make_room() -> None:
    async def check() -> None:
        hub = Events()
        streams: list[AsyncIterator[bytes]] = [hub.open({}) for _ in range(events_module._MAX_STREAMS)]
        with pytest.raises(MotionMindError, match="too many open windows"):
            hub.open({})
        await anext(streams[0])
        await streams[0].aclose()  # type: ignore[attr-defined]
        hub.open({})

    asyncio.run(check())


def test_jobs_wait_for_what_makes_them_fast_and_no_longer() -> None:
    ended: list[bool] = []

    def steps(may_begin: threading.Event, over: threading.Event) -> Told:
        try:
            for number in count(1):
                if over.is_set():
                    return
                yield number, 1000, "once", may_begin.is_set()
        finally:
            ended.append(True)

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        may_begin, over = threading.Event(), threading.Event()
        await workers.submit("sum", working.add, 1, 1).result()  # the worker has begun
        preparing = asyncio.create_task(workers.prepare("getting ready", steps(may_begin, over)))
        await asyncio.sleep(0)
        job = workers.submit("sum", working.add, 2, 3, urgent=True)
        while sum(one["kind"] == "getting ready" for one in told) < 3:
            await asyncio.sleep(0.01)
        assert job.state == "waiting"
        may_begin.set()
        assert await job.result() == 5
        assert [one["state"] for one in told if one["kind"] == "getting ready"][-1] == "running"
        over.set()
        await preparing
        last = [one for one in told if one["kind"] == "getting ready"][-1]
        assert (last["state"], last["words"], last["of"]) == ("done", "once", 1000)
        # One that is cancelled keeps nobody waiting.
        over.clear()
        again = asyncio.create_task(workers.prepare("getting ready", steps(threading.Event(), over)))
        await asyncio.sleep(0)
        waiting = workers.submit("sum", working.add, 3, 4)
        next(one for one in workers.jobs if one.kind == "getting ready").cancel()
        assert await waiting.result() == 7
        await again
        assert ended == [True, True]

    run(check)


def test_no_process_starts_during_a_preparation_which_does_its_work(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[bool] = []
    begin = Workers._begin_one

    def note(workers: Workers, *given: Any) -> None:
        begun.append(may_begin.is_set())
        begin(workers, *given)

    monkeypatch.setattr(Workers, "_begin_one", note)
    may_begin = threading.Event()

    def steps() -> Told:
        for number in count(1):
            yield number, 1000, "once", may_begin.is_set()

    async def check(workers: Workers, told: list[dict[str, Any]]) -> None:
        preparing = asyncio.create_task(workers.prepare("getting ready", steps()))
        await asyncio.sleep(0)
        workers.begin()
        job = workers.submit("sum", working.add, 2, 3)
        await asyncio.sleep(0.3)
        assert (job.state, begun) == ("waiting", [])
        may_begin.set()
        assert await job.result() == 5
        assert all(begun)
        next(one for one in workers.jobs if one.kind == "getting ready").cancel()
        await preparing

    run(check)


def test_it_is_told_how_long_it_takes_to_get_ready_at_the_pace_that_it_goes() -> None:
    clock = [0.0]
    ended: list[bool] = []

    def steps() -> Steps:
        try:
            for done in range(100, 104):
                clock[0] += 1.0
                yield done, 160, False
            clock[0] = 20.0
            yield 110, 160, False  # ten in 19 s
            clock[0] = 219.0
            yield 120, 160, False  # the computer has come to be busy
            clock[0] = 220.0
            yield 130, 190, True
            clock[0] = 300.0
            yield 189, 190, True
        finally:
            ended.append(True)

    found = told(steps(), lambda: clock[0])
    assert [next(found)[2] for _ in range(4)] == ["getting ready, first time only"] * 4
    assert [next(found) for _ in range(4)] == [
        (110, 160, "getting ready, first time only: about 2 minutes", False),
        (120, 160, "getting ready, first time only: about 8.5 minutes", False),
        (130, 190, "getting the rest ready", True),
        (189, 190, "getting the rest ready: a few seconds", True),
    ]
    found.close()
    assert ended == [True]
