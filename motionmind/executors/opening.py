"""Open a team of workers: by their number, or by the address of a cluster."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from motionmind.errors import MotionMindError
from motionmind.executors.here import processes, this_process
from motionmind.executors.team import Team


@contextmanager
def open_team(workers: int = 1, scheduler: str | None = None) -> Iterator[Team]:
    """Open a team of workers; results do not depend on the kind of team.

    Args:
        workers: the number of processes; 1 for this one alone.
        scheduler: address of a Dask scheduler, whose workers to use instead: "tcp://192.168.0.7:8786".

    Raises:
        MotionMindError: the number is below 1, no scheduler answers at the address, or the extra is not installed.
    """
    if workers < 1:
        raise MotionMindError(f"there must be 1 worker at least, not {workers}")
    if scheduler is not None:
        from motionmind.executors.cluster import cluster

        with cluster(scheduler) as team:
            yield team
    elif workers == 1:
        yield this_process()
    else:
        with processes(workers) as team:
            yield team
