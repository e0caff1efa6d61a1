"""Run jobs on workers, and run them again when a worker dies.

A `Team` hides the kind of workers: it makes an executor, and replaces a broken one. A pool of processes breaks as a
whole if one of them dies, and does not tell which job was the cause. The team therefore repeats the unfinished jobs one
at a time: this finds a job that always kills its worker, and saves memory if a lack of it was the reason.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from concurrent.futures import CancelledError as Cancelled
from dataclasses import dataclass
from typing import Any, TypeVar

from motionmind.errors import MotionMindError

_Job = TypeVar("_Job")
_Result = TypeVar("_Result")

MAX_ATTEMPTS = 3  # to run, alone, a job that kills its worker
N_JOBS_PER_WORKER = 3  # submitted ahead, which keeps all workers busy


class UnfinishedError(MotionMindError):
    """Work was interrupted through no fault of its input; finished parts are kept, and the same command resumes it."""


@dataclass(frozen=True, eq=False)
class Team:
    """Workers behind an executor.

    Attributes:
        make: makes an executor; called again when one breaks.
        ahead: returns the number of jobs to keep submitted: enough to keep all workers busy, but no more.
        lost: errors that mean that a job's worker died.
        missing: returns why the workers are unreachable; "" if they are reachable.
    """

    make: Callable[[], Executor]
    ahead: Callable[[], int]
    lost: tuple[type[BaseException], ...] = (BrokenExecutor,)
    missing: Callable[[], str] = str

    def map(self, function: Callable[[_Job], _Result], jobs: Iterable[_Job]) -> Iterator[_Result]:
        """Yield the results of `function` for all jobs, in order.

        Args:
            function: a picklable function; repeating a call must give the same result.
            jobs: the jobs, consumed as workers become free; may be endless.

        Raises:
            UnfinishedError: a job kills its workers repeatedly, or the workers are unreachable.
            Exception: any error of `function`.
        """
        waiting = iter(jobs)
        under_way: deque[tuple[_Job, Future[_Result]]] = deque()
        executor = self.make()
        try:
            while True:
                while len(under_way) < self.ahead() and (job := next(waiting, _NONE)) is not _NONE:
                    under_way.append((job, _submit(executor, function, job)))
                if not under_way:
                    return
                try:
                    result = self._wait(under_way[0][1])
                except self.lost:
                    executor.shutdown(wait=False)
                    executor = self.make()
                    # Jobs that finished before the failure are not repeated.
                    for job, future in list(under_way):
                        done = future
                        if not self._is_done(future):
                            executor, done = self._alone(executor, function, job)
                        yield self._wait(done)
                        under_way.popleft()
                    continue
                under_way.popleft()
                yield result
        finally:
            for _, future in under_way:
                future.cancel()
            executor.shutdown(wait=False)

    def _alone(
        self, executor: Executor, function: Callable[[_Job], _Result], job: _Job
    ) -> tuple[Executor, Future[_Result]]:
        """Run a job alone; return the executor, a new one if it broke, and the finished future."""
        for _ in range(MAX_ATTEMPTS):
            future = _submit(executor, function, job)
            try:
                self._wait(future)
            except self.lost:
                executor.shutdown(wait=False)
                executor = self.make()
                continue
            except Exception:  # the job's own error: raised when its result is read
                pass
            return executor, future
        raise UnfinishedError(
            f"{job}: a worker running this job alone died {MAX_ATTEMPTS} times: out of memory, or a library crashed"
        )

    def _wait(self, future: Future[_Result]) -> _Result:
        """Wait for a result; raise UnfinishedError if the workers are unreachable."""
        while not wait([future], 1.0).done:  # check the workers every second
            if reason := self.missing():
                raise _gone(reason)
        try:
            return future.result()
        except Cancelled:  # cancelled by the workers' side: this side never cancels
            raise _gone(self.missing() or "the cluster cancelled the jobs") from None

    def _is_done(self, future: Future[Any]) -> bool:
        """Return whether a job has finished, with a result or an error of its own."""
        return future.done() and not future.cancelled() and not isinstance(future.exception(), self.lost)


_NONE: Any = object()


def _submit(executor: Executor, function: Callable[[_Job], _Result], job: _Job) -> Future[_Result]:
    """Submit a job; if the executor is broken, return a failed future."""
    try:
        return executor.submit(function, job)
    except BrokenExecutor as error:
        failed: Future[_Result] = Future()
        failed.set_exception(error)
        return failed


def _gone(reason: str) -> UnfinishedError:
    return UnfinishedError(f"{reason}; finished work is kept: run the same command again to resume")
