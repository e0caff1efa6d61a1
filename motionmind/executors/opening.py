"""Open a team of workers on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from motionmind.errors import MotionMindError
from motionmind.executors.here import processes, this_process
from motionmind.executors.team import Team


@contextmanager
def open_team(workers: int = 1) -> Iterator[Team]:
    """Open a team of processes, 1 for this one alone; results do not depend on their number.

    Raises:
        MotionMindError: the number is below 1.
    """
    if workers < 1:
        raise MotionMindError(f"workers must be at least 1, not {workers}")
    if workers == 1:
        yield this_process()
    else:
        with processes(workers) as team:
            yield team
