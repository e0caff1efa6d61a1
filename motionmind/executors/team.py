"""Jobs handed to workers, and handed out again when a worker dies with them.

Whoever has jobs sees one thing, a `Team`, whatever works them: it makes an executor, and makes a new one when that
breaks. A pool of processes breaks as a whole if one of them dies, and does not say by which job. So the jobs that were
under way are then done one at a time: that finds a job that always ends its worker, and spares memory if its lack was
the reason.
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

MOST_TIMES = 3  # that a job may end the worker that it is alone on
AHEAD = 3  # jobs under way for each worker
_LOOK = 1.0  # seconds after which a team asks whether its workers are still there


class UnfinishedError(MotionMindError):
    """Work that was broken off by no fault of its input: what is done is kept, for the same command to go on from."""


@dataclass(frozen=True, eq=False)
class Team:
    """Workers, by the executor that hands them jobs.

    Attributes:
        make: makes an executor; called again when one breaks.
        ahead: returns how many jobs to keep under way: enough that no worker idles, few enough that none is held long.
        lost: errors of a job by which its worker died.
        missing: returns why the workers cannot be reached any more; "" while they can.
    """

    make: Callable[[], Executor]
    ahead: Callable[[], int]
    lost: tuple[type[BaseException], ...] = (BrokenExecutor,)
    missing: Callable[[], str] = str

    def map(self, function: Callable[[_Job], _Result], jobs: Iterable[_Job]) -> Iterator[_Result]:
        """Yield the results of `function` for all jobs, in their order.

        Args:
            function: what to do; a function of a module, as pickle requires. Done again, it must do the same.
            jobs: taken as workers become free: a long or endless iterable fills no memory.

        Raises:
            UnfinishedError: workers die of a job again and again, or are out of reach; and what `function` raises.
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
                    # Those that were done before it broke are not done again.
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
        """Do a job while no other is under way; return the executor, made anew if it broke, and what was done."""
        for _ in range(MOST_TIMES):
            future = _submit(executor, function, job)
            try:
                self._wait(future)
            except self.lost:
                executor.shutdown(wait=False)
                executor = self.make()
                continue
            except Exception:  # of the job itself: raised where its result is taken
                pass
            return executor, future
        raise UnfinishedError(
            f"{job}: a worker died of it {MOST_TIMES} times, alone; memory may lack, or a library has crashed"
        )

    def _wait(self, future: Future[_Result]) -> _Result:
        """Return a result when it is there; MotionMindError if its worker is out of reach."""
        while not wait([future], _LOOK).done:
            if reason := self.missing():
                raise _gone(reason)
        try:
            return future.result()
        except Cancelled:  # nobody here cancels: the workers' side did
            raise _gone(self.missing() or "the workers have dropped what they were given") from None

    def _is_done(self, future: Future[Any]) -> bool:
        """Return whether a job was done, be it with an error of its own."""
        return future.done() and not future.cancelled() and not isinstance(future.exception(), self.lost)


_NONE: Any = object()


def _submit(executor: Executor, function: Callable[[_Job], _Result], job: _Job) -> Future[_Result]:
    """Submit a job; to an executor that has broken since, as a job that broke it."""
    try:
        return executor.submit(function, job)
    except BrokenExecutor as error:
        failed: Future[_Result] = Future()
        failed.set_exception(error)
        return failed


def _gone(reason: str) -> UnfinishedError:
    return UnfinishedError(f"{reason}; what is done is kept: the same command goes on from there")
