"""Worker processes that run the engine apart from the server, so that jobs report progress and can be killed."""

from __future__ import annotations

import asyncio
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
from motionmind.studio.worker_loop import process_context, room_for_workers, words_of, work

_MAX_FAILURES = 3  # consecutive workers that die before they are ready
JobState = Literal["waiting", "running", "done", "failed", "cancelled"]


class Report(Protocol):
    """Callback for a job's progress."""

    def __call__(self, done: int, of: int, words: str = "", partial: Any = None) -> None:
        """Report the progress.

        Args:
            done: number of steps done.
            of: number of all steps.
            words: description of the current step.
            partial: a new part of the result, if there is one.
        """


class JobCancelledError(MotionMindError):
    """The job was cancelled before it was done."""


class WorkerLostError(MotionMindError):
    """The worker died during the job, for example for lack of memory; another one may succeed."""


class Job:
    """A function that a worker runs.

    Attributes:
        id: its id.
        kind: its purpose.
        urgent: whether the user waits for it.
        state: its state.
        done, of, words: its progress.
        partial: parts of the result so far, plain values for JSON.
        shown: the result as plain values for JSON; None if there is none to show yet.
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
        """Wait for the function's result.

        Raises:
            JobCancelledError: the job was cancelled.
            WorkerLostError: its worker died.
            MotionMindError: the function failed.
        """
        return await asyncio.shield(self._result)

    def cancel(self) -> None:
        """Stop the job at once, unless it is over."""
        self._workers.cancel(self)

    def view(self) -> dict[str, Any]:
        """Return the job as the page sees it."""
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
        """Add a part of the result."""
        self.partial.append(self._collect(value) if self._collect else value)

    def end(
        self, state: JobState, value: Any = None, words: str = "", error: type[MotionMindError] = MotionMindError
    ) -> None:
        """Set the final state; an error in `finish` makes the job fail."""
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
    """Mark an error as retrieved: a job that nobody awaits reports it by its state."""
    if not future.cancelled():
        future.exception()


class Workers:
    """The worker processes and their queue of jobs: urgent jobs first, then the oldest.

    If there are several workers, one is reserved for urgent jobs, so that these never wait for background work.
    """

    def __init__(
        self, home: Path | None, tell: Callable[[Job], None], warm: str = "", number: int | None = None
    ) -> None:
        """Set up the workers, which start with `begin` or with the first job.

        Args:
            home: the folder of the user's corpora; None for the default folder.
            tell: called, in the event loop, whenever a job has changed.
            warm: a corpus that each worker loads at once.
            number: number of processes; by default as many as this computer has room for.
        """
        self._theirs, self._tell = (home, warm), tell
        self._loop = asyncio.get_running_loop()
        self._numbers = count(time.time_ns())  # ids differ from those of earlier studios
        self._waiting: deque[Job] = deque()
        self._jobs: OrderedDict[str, Job] = OrderedDict()
        self._number = number or room_for_workers()
        self._is_closed = False
        self._held_by: Job | None = None  # the job that all others wait for
        self._workers: list[_Worker] = []
        self._failures = 0  # consecutive workers that died before they were ready

    @property
    def jobs(self) -> list[Job]:
        """Waiting and running jobs."""
        return [job for job in self._jobs.values() if job.state in ("waiting", "running")]

    def begin(self) -> None:
        """Start the processes, unless they run or jobs wait for a preparation; if none could start before, try again.

        During a preparation, which compiles and learns, each would compile and learn the same.
        """
        if not self._workers and not self._is_closed and self._held_by is None:
            for _ in range(self._number):
                self._begin_one(*self._theirs)

    def _begin_one(self, home: Path | None, warm: str) -> None:
        """Start a process, if the system lets it."""
        try:
            self._workers.append(_Worker(self, home, warm))
        except (OSError, RuntimeError, MemoryError) as error:  # no more pipes, threads or memory
            print(f"motionmind studio: cannot start a process: {error or 'not enough memory'}", file=sys.stderr)

    def submit(
        self,
        kind: str,
        function: Callable[..., Any],
        *arguments: Any,
        finish: Callable[[Any], Any] | None = None,
        collect: Callable[[Any], Any] | None = None,
        urgent: bool = False,
    ) -> Job:
        """Queue a job: the next free worker calls `function(report, *arguments)`.

        Args:
            kind: its purpose, for the page.
            function: a function at the top level of a module; `report` is a `Report`.
            arguments: picklable arguments.
            finish: called in this process with the result; returns what the page shows of it, plain values for JSON.
            collect: called in this process with each partial result; returns likewise.
            urgent: whether the user waits for it.
        """
        job = self._add(Job(self, next(self._numbers), kind, (function, arguments), finish, collect, urgent))
        self._waiting.append(job)
        self._tell(job)
        self.begin()
        self.go_on()
        return job

    async def prepare(self, kind: str, steps: Told) -> None:
        """Run preparatory steps as a job; all others wait until a step lets them begin.

        Args:
            kind: its purpose, for the page.
            steps: the steps; closing the iterator ends the job.
        """
        job = self._held_by = self._add(Job(self, next(self._numbers), kind, (_nothing, ()), None, None, False))
        job.state = "running"
        try:
            while job.state == "running" and (step := next(steps, None)):
                job.done, job.of, job.words, may_begin = step
                if may_begin:
                    self._release(job)
                self._tell(job)
                await asyncio.sleep(0.2)
        except Exception as error:  # searches compile what they need
            job.end("failed", words=words_of(error))
        finally:
            steps.close()
            job.end("done")
            self._tell(job)
            self._release(job)

    def _release(self, job: Job) -> None:
        """Let the jobs begin that wait for a preparation."""
        if self._held_by is job:
            self._held_by = None
            self.begin()
            self.go_on()

    def _add(self, job: Job) -> Job:
        """Register a job, and drop all but the latest 200 finished ones."""
        self._jobs[job.id] = job
        over = [one.id for one in self._jobs.values() if one.state not in ("waiting", "running")]
        for old in over[: max(0, len(over) - 200)]:
            del self._jobs[old]
        return job

    def find(self, job: str) -> Job:
        """Return a job by id; raise MotionMindError if it is unknown or was dropped."""
        if job not in self._jobs:
            raise MotionMindError("no such job")
        return self._jobs[job]

    def cancel(self, job: Job) -> None:
        """Cancel a job at once, killing its worker."""
        if job in self._waiting:
            self._waiting.remove(job)
        for worker in [one for one in self._workers if one.job is job]:
            worker.kill()
            self._workers.remove(worker)
            self._begin_one(*self._theirs)
        if job.state in ("waiting", "running"):
            job.end("cancelled", words="cancelled")
            self._tell(job)
        self.go_on()

    def close(self) -> None:
        """Cancel all jobs and kill all workers."""
        self._is_closed = True
        for job in self.jobs:
            job.end("cancelled", words="the studio is closing")
        self._waiting.clear()
        for worker in self._workers:
            worker.kill()
        self._workers.clear()

    def go_on(self) -> None:
        """Give waiting jobs to free workers."""
        while self._waiting and not self._workers and self._held_by is None:
            job = self._waiting.popleft()
            job.end("failed", words="the engine failed to start: see the terminal")
            self._tell(job)
        for worker in self._workers:
            if self._held_by is None and worker.has_begun and worker.job is None and (chosen := self._next()):
                self._waiting.remove(chosen)
                worker.run(chosen)
                self._tell(chosen)

    def _next(self) -> Job | None:
        """Return the next job to run; None if there is none for now."""
        urgent = next((job for job in self._waiting if job.urgent), None)
        if urgent or not self._waiting:
            return urgent
        patient = sum(worker.job is not None and not worker.job.urgent for worker in self._workers)
        return self._waiting[0] if patient < max(len(self._workers) - 1, 1) else None

    def hear(self, worker: _Worker, message: tuple[Any, ...] | None) -> None:
        """Handle a worker's message; None if it has died."""
        if worker not in self._workers:  # it was killed
            return
        job = worker.job
        if message is None:
            self._failures += not worker.has_begun
            self._workers.remove(worker)
            if self._failures < _MAX_FAILURES:
                self._begin_one(self._theirs[0], "")  # loading the corpus at once may be what killed it
            else:
                self._failures -= 1  # the next job tries once more
            if job:
                job.end("failed", words="stopped: this computer ran out of memory", error=WorkerLostError)
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
        """Pass a worker's message from another thread to the event loop."""
        with suppress(RuntimeError):  # the loop has ended
            self._loop.call_soon_threadsafe(self.hear, worker, message)


class _Worker:
    """A worker process, and the thread that listens to it.

    Attributes:
        job: its job; None if it is free.
        has_begun: whether it is ready for jobs.
    """

    def __init__(self, workers: Workers, home: Path | None, warm: str) -> None:
        self.job: Job | None = None
        self._workers, self._is_killed, self.has_begun = workers, False, False
        context = process_context()
        self._connection, theirs = context.Pipe()
        self._process = context.Process(target=work, args=(theirs, home, warm), daemon=True, name="motionmind studio")
        self._theirs = theirs
        # Starting a process takes 0.1 s, which would block the server.
        threading.Thread(target=self._listen, daemon=True).start()

    def run(self, job: Job) -> None:
        """Start a job."""
        self.job, job.state = job, "running"
        # In a thread: sending large arguments blocks until the worker reads them.
        threading.Thread(target=self._send, args=(job.task,), daemon=True).start()

    def kill(self) -> None:
        """Kill the process."""
        self._is_killed = True
        with suppress(AttributeError):  # not started yet: `_listen` kills it after the start
            self._process.kill()

    def _send(self, task: Any) -> None:
        try:
            self._connection.send(task)
        except OSError:  # it has died, which the listener reports
            pass
        except Exception as error:  # too large for this computer's memory
            self._workers.post(self, ("failed", words_of(error)))

    def _listen(self) -> None:
        try:
            self._process.start()  # fails if the fork server dies at this moment
            self._theirs.close()
            if self._is_killed:
                self._process.kill()
            while True:
                self._workers.post(self, self._connection.recv())
        except (EOFError, OSError):
            pass
        except Exception as error:  # a message that cannot be read, for example for lack of memory
            words_of(error)
            self.kill()
        self._workers.post(self, None)
        with suppress(AssertionError):
            self._process.join()


def _nothing(_: Report) -> None:
    """Do nothing: a preparation has no function that a worker calls."""
