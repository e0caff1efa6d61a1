"""Jobs handed to workers: the same results whoever they are, and none lost with a worker."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from itertools import count
from pathlib import Path

import psutil
import pytest
from executor_jobs import die, die_once, doze, square

from motionmind.errors import MotionMindError
from motionmind.executors import cluster as clusters
from motionmind.executors.here import this_process
from motionmind.executors.opening import open_team
from motionmind.executors.team import Team, UnfinishedError

distributed = pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    """The address of a local cluster of two workers."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as local:
        yield local.scheduler_address


@pytest.fixture(scope="module", params=["this process", "threads", "processes", "cluster"])
def team(request: pytest.FixtureRequest) -> Iterator[Team]:
    with ExitStack() as stack:
        match request.param:
            case "this process":
                yield this_process()
            case "threads":
                yield Team(partial(ThreadPoolExecutor, 3), lambda: 9)
            case "processes":
                yield stack.enter_context(open_team(2))
            case _:
                yield stack.enter_context(clusters.cluster(request.getfixturevalue("scheduler")))


def test_results_come_in_the_order_of_the_jobs(team: Team) -> None:
    assert list(team.map(square, range(50))) == [number * number for number in range(50)]
    assert list(team.map(square, [])) == []


def test_an_error_of_a_job_is_raised_in_its_place(team: Team) -> None:
    results = team.map(square, [3, 2, -1, 0])
    assert [next(results), next(results)] == [9, 4]
    with pytest.raises(ValueError, match="no root of -1"):
        next(results)


def test_jobs_are_taken_as_they_are_needed(team: Team) -> None:
    """An endless iterable of them fills no memory."""
    jobs = count()
    results = team.map(square, jobs)
    assert [next(results) for _ in range(5)] == [0, 1, 4, 9, 16]
    assert next(jobs) < 30


def test_jobs_of_workers_that_die_are_done_by_others(tmp_path: Path) -> None:
    with open_team(2) as team:
        assert list(team.map(partial(die_once, tmp_path), range(8))) == list(range(8))


def test_a_job_that_always_ends_its_worker_is_named() -> None:
    with open_team(2) as team:
        results = team.map(die, range(5))
        assert [next(results), next(results)] == [0, 1]
        with pytest.raises(UnfinishedError, match=r"^2: a worker running this job alone died 3 times"):
            next(results)


def test_workers_end_with_the_process_that_started_them(tmp_path: Path) -> None:
    """Even if it is killed, can say nothing, and they are at work."""
    script = tmp_path / "client.py"
    script.write_text(
        "import multiprocessing, time\nfrom motionmind.executors.opening import open_team\n"
        "if __name__ == '__main__':\n    with open_team(2) as team:\n"
        "        results = team.map(time.sleep, [0.3, 1000, 1000])\n        next(results)\n"  # the pool ends with jobs
        "        print(*(worker.pid for worker in multiprocessing.active_children()), flush=True)\n"
        "        time.sleep(1000)\n"
    )
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE) as client:
        assert client.stdout is not None
        workers = [psutil.Process(int(number)) for number in client.stdout.readline().split()]
        assert len(workers) == 2
        client.send_signal(signal.SIGKILL)
    assert psutil.wait_procs(workers, timeout=60)[1] == []


def test_a_cluster_that_goes_away_is_told() -> None:
    local = distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, dashboard_address=":0", processes=False, protocol="tcp"
    )
    with local, clusters.cluster(local.scheduler_address) as team:
        results = team.map(doze, range(100))
        assert next(results) == 0
        local.close()
        with pytest.raises(UnfinishedError, match="finished work is kept: run the same command again to resume"):
            list(results)


def test_a_cluster_without_workers_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clusters, "_WORKERS_TIMEOUT_S", 0.3)
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0", processes=False, protocol="tcp") as local,
        pytest.raises(MotionMindError, match=r"tcp://\S+ the cluster has had no workers for 0\.3 s"),
        clusters.cluster(local.scheduler_address),
    ):
        pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tcp://127.0.0.1:port"])
def test_an_address_of_no_scheduler_is_told(address: str) -> None:
    with pytest.raises(MotionMindError, match=f"^{address}: no scheduler answers"), clusters.cluster(address):
        pass


def test_no_workers_are_too_few() -> None:
    with pytest.raises(MotionMindError, match="workers must be at least 1, not 0"), open_team(0):
        pass


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MotionMindError, match=r'pip install "motionmind\[scale\]"'), clusters.cluster("tcp://a:1"):
        pass
