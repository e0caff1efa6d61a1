"""Teams of workers on a cluster, with Dask's distributed scheduler (an extra)."""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

from motionmind.errors import MotionMindError
from motionmind.executors.team import N_JOBS_PER_WORKER, Team

_PORT = 8786  # default port of a Dask scheduler
_ANSWER_TIMEOUT_S = 10.0  # for a scheduler
_WORKERS_TIMEOUT_S = 60.0  # without workers, until a cluster counts as lost


@contextmanager
def cluster(address: str) -> Iterator[Team]:
    """Open a team of the workers of a cluster.

    Args:
        address: address of its scheduler, such as "tcp://192.168.0.7:8786".

    Raises:
        MotionMindError: the extra is not installed, no scheduler answers there, or no worker appears.
    """
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise MotionMindError(f'a cluster needs an extra: pip install "motionmind[scale]" ({error})') from None
    for name in ("distributed", "distributed.client"):  # we report each error once, ourselves
        logging.getLogger(name).setLevel(logging.CRITICAL)
    connect: Any = Client  # untyped
    try:
        place = urlsplit(address)
        # Try to connect first: a client without a scheduler logs errors long after it fails.
        socket.create_connection((place.hostname or "", place.port or _PORT), _ANSWER_TIMEOUT_S).close()
        client = connect(address, timeout=_ANSWER_TIMEOUT_S, set_as_default=False)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise MotionMindError(f"{address}: no scheduler answers (usual form: tcp://HOST:{_PORT}): {error}") from None
    try:
        watch = _Watch(client, address)
        while not watch.threads:
            if reason := watch.missing():
                raise MotionMindError(reason)
            time.sleep(0.1)
        yield Team(
            # Not pure: Dask needs no names derived from jobs. It retries a job on another worker by itself.
            lambda: client.get_executor(pure=False),
            lambda: N_JOBS_PER_WORKER * max(watch.threads, 1),
            (KilledWorker, BrokenExecutor),
            watch.missing,
        )
    finally:
        client.close(timeout=_ANSWER_TIMEOUT_S)


class _Watch:
    """Watches whether a cluster is available.

    Attributes:
        threads: number of jobs that its workers run at once, when last queried.
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client, self._address = client, address
        self._seen = time.monotonic()
        self.threads = 0
        self.missing()

    def missing(self) -> str:
        """Query the workers; return why they are unavailable, or "" if they may still be available."""
        if self._client.status == "running":
            try:
                self.threads = sum(self._client.nthreads().values())
            except (OSError, TimeoutError):
                self.threads = 0
            if self.threads:
                self._seen = time.monotonic()
        elif self._client.status != "connecting":
            return f"{self._address}: lost the connection to the scheduler"
        if time.monotonic() - self._seen > _WORKERS_TIMEOUT_S:
            return f"{self._address}: the cluster has had no workers for {_WORKERS_TIMEOUT_S:g} s"
        return ""
