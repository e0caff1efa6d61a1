"""A worker that is killed takes its job with it, and nothing else."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from studio_server import Served


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """One studio for all tests of this module."""
    from studio_server import serving

    from motionmind.studio.project import Project

    project = Project.create(tmp_path_factory.mktemp("losses") / "piece.motionmind", "ballet")
    with serving(project) as one:
        yield one


def _until(found: Callable[[], Any], seconds: float = 600.0) -> Any:
    end = time.monotonic() + seconds
    while not (value := found()):
        assert time.monotonic() < end
        time.sleep(0.01)
    return value


def _kill_worker(served: Served, kind: str) -> str:
    """Kill the worker that does a job of some kind, once there is one; return the job's id."""
    workers = served.studio.workers
    busy = _until(lambda: [one for one in workers._workers if one.job is not None and one.job.kind == kind])[0]
    job: str = busy.job.id
    os.kill(busy._process.pid, signal.SIGKILL)
    _until(lambda: served.get(f"/api/jobs/{job}")["state"] == "failed")
    return job


def _seam(served: Served) -> Any:
    return served.project()["piece"]["seams"][-1]


def test_a_seam_whose_worker_was_killed_is_smoothed_by_the_next(served: Served) -> None:
    served.edit(edit="arrange", blocks=[], about={"words": "begin"})
    served.insert("a", "ballet/arabesque")
    served.insert("b", "ballet/passe")
    _kill_worker(served, "seam")
    assert len(served.project()["piece"]["blocks"]) == 2
    assert _until(lambda: (seam := _seam(served))["state"] == "inserted" and seam)["alternatives"]


def test_what_ends_workers_again_and_again_is_given_up_in_a_line(served: Served) -> None:
    served.edit(edit="arrange", blocks=[], about={"words": "begin anew"})
    served.insert("c", "ballet/second")
    served.insert("d", "ballet/passe")
    for _ in range(2):
        _kill_worker(served, "seam")
    seam = _until(lambda: (seam := _seam(served))["state"] == "none found" and seam)
    assert seam["words"] == "stopped: this computer ran out of memory"


def test_a_search_whose_worker_was_killed_fails_in_a_line_and_the_next_finds(served: Served) -> None:
    asked = {"a": {"key": "ballet/arabesque"}, "b": {"key": "ballet/fifth"}}
    served.post("/api/between", asked)
    job = _kill_worker(served, "between")
    assert served.get(f"/api/jobs/{job}")["words"] == "stopped: this computer ran out of memory"
    again = served.wait_for(served.post("/api/between", asked)["job"])
    assert again["state"] == "done"
    assert len(again["partial"]) == 4
