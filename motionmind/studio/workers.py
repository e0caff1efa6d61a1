"""Worker processes: the engine at work apart from the server, so that a job can be watched, and ended at once."""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import sys
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from contextlib import suppress
from itertools import count
from pathlib import Path
from typing import Any, Literal, Protocol

from motionmind.errors import MotionMindError
from motionmind.studio.preparation import Told
from motionmind.studio.worker_loop import words_of, work

JobState = Literal["waiting", "running", "done", "failed", "cancelled"]
_TRIES = 3  # starts of a worker that ends before it has begun
_JOBS = 200  # that are over and can still be asked for
_FEW = 2  # processors with which a second worker does not slow the first
_LOST = "this took more than this computer has, and was ended"
_LOOK = 0.2  # seconds between two looks at how far a preparation is
_MEMORY = 2**30  # bytes that are free, of which a second worker takes less than a fifth


class Report(Protocol):
    """Tells how far a job has come."""

    def __call__(self, done: int, of: int, words: str = "", partial: Any = None) -> None:
        """Tell it.

        Args:
            done: the number of steps that are done.
            of: the number of all steps.
            words: what is going on.
            partial: a part of the result, if there is a new one.
        """


class JobCancelledError(MotionMindError):
    """The job was cancelled before it was done."""


class WorkerLostError(MotionMindError):
    """The worker ended in the middle of the job, as where memory is short; another one may do it."""


class Job:
    """A function that a worker runs.

    Attributes:
        id: its name.
        kind: what it is for.
        urgent: whether somebody waits for it.
        state: how it stands.
        done, of, words: how far it has come.
        partial: parts of the result so far, plain values for JSON.
        shown: the result as plain values for JSON; None as long as there is none to show.
    """

    def __init__(
        self,
        workers: Workers,
        number: int,
        kind: str,
        task: tuple[Callable[..., Any], tuple[Any, ...]],
        finish: Callable[[Any], Any] | None,
        collect: Callable[[Any], Any] | None,
        urgent: bool,
    ) -> None:
        self.id, self.kind, self.urgent = f"j{number}", kind, urgent
        self.state: JobState = "waiting"
        self.done, self.of, self.words = 0, 0, ""
        self.partial: list[Any] = []
        self.shown: Any = None
        self._workers, self._task, self._finish, self._collect = workers, task, finish, collect
        self._result: asyncio.Future[Any] = asyncio.get_running_loop().create_future()
        self._result.add_done_callback(_seen)

    async def result(self) -> Any:
        """Wait for what the function returns.

        Raises:
            JobCancelledError: it was cancelled.
            WorkerLostError: its worker ended.
            MotionMindError: the function failed with it.
        """
        return await asyncio.shield(self._result)

    def cancel(self) -> None:
        """End it at once; nothing happens if it is over."""
        self._workers.cancel(self)

    def view(self) -> dict[str, Any]:
        """Return it as the page sees it."""
        found = {"id": self.id, "kind": self.kind, "state": self.state, "done": self.done, "of": self.of}
        found["words"] = self.words
        if self.partial:
            found["partial"] = self.partial
        if self.shown is not None:
            found["result"] = self.shown
        return found

    @property
    def task(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        """The function and its arguments."""
        return self._task

    def take_partial(self, value: Any) -> None:
        """Take in a part of the result."""
        self.partial.append(self._collect(value) if self._collect else value)

    def end(
        self, state: JobState, value: Any = None, words: str = "", error: type[MotionMindError] = MotionMindError
    ) -> None:
        """Take in how it ended; whatever goes wrong with the result makes it fail."""
        if self._result.done():
            return
        if state == "done":
            try:
                self.shown = self._finish(value) if self._finish else None
            except Exception as wrong:
                state, words = "failed", words_of(wrong)
        self.state, self.words = state, words or self.words
        if state == "done":
            self._result.set_result(value)
        else:
            self._result.set_exception((JobCancelledError if state == "cancelled" else error)(words))


def _seen(future: asyncio.Future[Any]) -> None:
    """Mark an error as seen: a job that nobody awaits tells of it by its state."""
    if not future.cancelled():
        future.exception()


class Workers:
    """The worker processes, and the jobs that wait for them: the urgent ones first, and of those the oldest.

    Where there are several, one does nothing but what is urgent: nobody waits for what goes on in the background.
    """

    def __init__(
        self, home: Path | None, tell: Callable[[Job], None], warm: str = "", number: int | None = None
    ) -> None:
        """Set up the workers, which start with `begin`, or else with the first job.

        Args:
            home: the folder of the user's corpora; None for the usual one.
            tell: called, in the event loop, whenever a job has changed.
            warm: a corpus that each worker loads at once.
            number: of processes; by default as many as this computer has room for.
        """
        self._theirs, self._tell = (home, warm), tell
        self._loop = asyncio.get_running_loop()
        self._numbers = count(time.time_ns())  # no job of a studio that ran before has one of them
        self._waiting: deque[Job] = deque()
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._number = number or _room()
        self._has_begun = False  # whether the processes are started
        self._held_by: Job | None = None  # the job that all others wait for
        self._workers: list[_Worker] = []
        self._failures = 0  # workers that have ended before they began, one after another

    @property
    def jobs(self) -> list[Job]:
        """The jobs that wait or run."""
        return [job for job in self._jobs.values() if job.state in ("waiting", "running")]

    def begin(self) -> None:
        """Start the processes, unless they are started."""
        if not self._has_begun:
            self._has_begun = True
            self._workers = [_Worker(self, *self._theirs) for _ in range(self._number)]

    def submit(
        self,
        kind: str,
        function: Callable[..., Any],
        *arguments: Any,
        finish: Callable[[Any], Any] | None = None,
        collect: Callable[[Any], Any] | None = None,
        urgent: bool = False,
    ) -> Job:
        """Have a worker call `function(report, *arguments)` when one is free.

        Args:
            kind: what it is for, as the page knows it.
            function: a function at the top of a module; `report` is a `Report`.
            arguments: what can be pickled.
            finish: called here with the result, returns what the page is shown of it, plain values for JSON.
            collect: called here with each partial result, in the same way.
            urgent: whether somebody waits for it.
        """
        job = self._add(Job(self, next(self._numbers), kind, (function, arguments), finish, collect, urgent))
        self._waiting.append(job)
        self._tell(job)
        self.begin()
        self.go_on()
        return job

    async def prepare(self, kind: str, steps: Told) -> None:
        """Take steps that spare the workers work, as a job that all others wait for until they may begin.

        Args:
            kind: what it is for, as the page knows it.
            steps: the steps; to close them ends it.
        """
        job = self._held_by = self._add(Job(self, next(self._numbers), kind, (_nothing, ()), None, None, False))
        job.state = "running"
        try:
            while job.state == "running" and (step := next(steps, None)):
                job.done, job.of, job.words, may_begin = step
                if may_begin:
                    self._release(job)
                self._tell(job)
                await asyncio.sleep(_LOOK)
        finally:
            steps.close()
            job.end("done")
            self._tell(job)
            self._release(job)

    def _release(self, job: Job) -> None:
        """Let the jobs begin that wait for this one."""
        if self._held_by is job:
            self._held_by = None
            self.go_on()

    def _add(self, job: Job) -> Job:
        """Know a job, and forget those that have been over for long."""
        self._jobs[job.id] = job
        over = [one.id for one in self._jobs.values() if one.state not in ("waiting", "running")]
        for old in over[: max(0, len(over) - _JOBS)]:
            del self._jobs[old]
        return job

    def find(self, job: str) -> Job:
        """Return the job of an id; MotionMindError if it is not known, or no more."""
        if job not in self._jobs:
            raise MotionMindError("there is no such job, or no more")
        return self._jobs[job]

    def cancel(self, job: Job) -> None:
        """End a job at once."""
        if job in self._waiting:
            self._waiting.remove(job)
        for place, worker in enumerate(self._workers):
            if worker.job is job:
                worker.kill()
                self._workers[place] = _Worker(self, *self._theirs)
        if job.state in ("waiting", "running"):
            job.end("cancelled", words="cancelled")
            self._tell(job)
        self.go_on()

    def close(self) -> None:
        """End all workers, for good."""
        self._has_begun = True
        for job in self.jobs:
            job.end("cancelled", words="the studio ends")
        self._waiting.clear()
        for worker in self._workers:
            worker.kill()
        self._workers.clear()

    def go_on(self) -> None:
        """Give the workers that are free the jobs that wait."""
        while self._waiting and not self._workers:
            job = self._waiting.popleft()
            job.end("failed", words="the engine does not start; the terminal says why")
            self._tell(job)
        for worker in self._workers:
            if self._held_by is None and worker.has_begun and worker.job is None and (chosen := self._next()):
                self._waiting.remove(chosen)
                worker.run(chosen)
                self._tell(chosen)

    def _next(self) -> Job | None:
        """The job that a worker is to do next; None if there is none for now."""
        urgent = next((job for job in self._waiting if job.urgent), None)
        if urgent or not self._waiting:
            return urgent
        patient = sum(worker.job is not None and not worker.job.urgent for worker in self._workers)
        return self._waiting[0] if patient < max(len(self._workers) - 1, 1) else None

    def hear(self, worker: _Worker, message: tuple[Any, ...] | None) -> None:
        """Take in what a worker says; None if it has ended."""
        if worker not in self._workers:  # one that was killed
            return
        job = worker.job
        if message is None:
            self._failures += not worker.has_begun
            self._workers.remove(worker)
            if self._failures < _TRIES:
                self._workers.append(_Worker(self, *self._theirs))
            if job:
                job.end("failed", words=_LOST, error=WorkerLostError)
        elif message[0] == "begun":
            worker.has_begun, self._failures = True, 0
        elif job is None:
            return
        elif message[0] == "report":
            _, job.done, job.of, words, partial = message
            job.words = words or job.words
            try:
                if partial is not None:
                    job.take_partial(partial)
            except Exception as error:
                job.end("failed", words=words_of(error))
                self.cancel(job)
        else:
            worker.job = None
            state, value = message
            job.end(state, value, value if state == "failed" else "")
        if job:
            self._tell(job)
        self.go_on()

    def post(self, worker: _Worker, message: tuple[Any, ...] | None) -> None:
        """Hand what a worker says to the event loop, from another thread."""
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self.hear, worker, message)


class _Worker:
    """A worker process, and the thread that listens to it.

    Attributes:
        job: the job that it does; None if it is free.
        has_begun: whether it has come to wait for jobs.
    """

    def __init__(self, workers: Workers, home: Path | None, warm: str) -> None:
        self.job: Job | None = None
        self._workers, self._is_killed, self.has_begun = workers, False, False
        context = _context()
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=work, args=(theirs, home, warm), daemon=True, name="motionmind studio")
        self._theirs = theirs
        # Starting a process takes a tenth of a second, in which the server would not answer.
        threading.Thread(target=self._listen, daemon=True).start()

    def run(self, job: Job) -> None:
        """Begin a job."""
        self.job, job.state = job, "running"
        # In a thread: large arguments wait until the worker takes them.
        threading.Thread(target=self._send, args=(job.task,), daemon=True).start()

    def kill(self) -> None:
        """End the process at once."""
        self._is_killed = True
        with suppress(AttributeError):  # it is yet to be started, and killed then
            self._process.kill()

    def _send(self, task: Any) -> None:
        with suppress(OSError):  # it has ended, and the listener says so
            self._connection.send(task)

    def _listen(self) -> None:
        try:
            self._process.start()  # which fails if the process that it is forked from dies just then
            self._theirs.close()
            if self._is_killed:
                self._process.kill()
            while True:
                self._workers.post(self, self._connection.recv())
        except (EOFError, OSError):
            self._workers.post(self, None)
        with suppress(AssertionError):
            self._process.join()


def _context() -> Any:
    """Return how processes start: forked from one that has all loaded, where that is safe, or else afresh."""
    if sys.platform != "linux":  # elsewhere, what the system's libraries have begun may not survive a fork
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["motionmind.studio.preloaded"])
    return context


def _nothing(_: Report) -> None:
    """Do nothing: a preparation has no function that a worker calls."""


def _room() -> int:
    """Return the number of workers that this computer has room for."""
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_AVPHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        memory = 0
    return 2 if processors >= _FEW and memory >= _MEMORY else 1
