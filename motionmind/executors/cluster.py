"""Teams of the workers of a cluster, by Dask's distributed scheduler (an extra)."""

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
from motionmind.executors.team import AHEAD, Team

_PORT = 8786  # of a Dask scheduler, if it is told no other
_ANSWERS = 10.0  # seconds within which a scheduler answers
_PATIENCE = 60.0  # seconds for which a cluster may have no workers, before it is taken to be gone


@contextmanager
def cluster(address: str) -> Iterator[Team]:
    """Open a team of the workers of a cluster.

    Args:
        address: its scheduler's, such as "tcp://192.168.0.7:8786".

    Raises:
        MotionMindError: the extra is not installed, nobody answers there, or no worker comes.
    """
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise MotionMindError(f'a cluster needs an extra: pip install "motionmind[scale]" ({error})') from None
    for name in ("distributed", "distributed.client"):  # what goes wrong is said once, by us
        logging.getLogger(name).setLevel(logging.CRITICAL)
    connect: Any = Client  # which has no types
    try:
        place = urlsplit(address)
        # Asked first: a client that reaches nobody complains long after its error.
        socket.create_connection((place.hostname or "", place.port or _PORT), _ANSWERS).close()
        client = connect(address, timeout=_ANSWERS, set_as_default=False)
    except (OSError, ValueError) as error:  # a time that is up is an OSError
        raise MotionMindError(f"{address}: no scheduler answers there (tcp://HOST:{_PORT} is usual): {error}") from None
    try:
        watch = _Watch(client, address)
        while not watch.threads:
            if reason := watch.missing():
                raise MotionMindError(reason)
            time.sleep(0.1)
        yield Team(
            # Results are ours to keep, so no name is derived from a job; Dask tries a job again on another worker.
            lambda: client.get_executor(pure=False),
            lambda: AHEAD * max(watch.threads, 1),
            (KilledWorker, BrokenExecutor),
            watch.missing,
        )
    finally:
        client.close(timeout=_ANSWERS)


class _Watch:
    """Whether a cluster is there.

    Attributes:
        threads: how many jobs its workers do at once, when that was last asked.
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client, self._address = client, address
        self._seen = time.monotonic()
        self.threads = 0
        self.missing()

    def missing(self) -> str:
        """Ask for the workers; return why they are out of reach, or "" while there is hope."""
        if self._client.status == "running":
            try:
                self.threads = sum(self._client.nthreads().values())
            except (OSError, TimeoutError):
                self.threads = 0
            if self.threads:
                self._seen = time.monotonic()
        elif self._client.status != "connecting":
            return f"{self._address}: the scheduler is gone"
        if time.monotonic() - self._seen > _PATIENCE:
            return f"{self._address}: the cluster has had no workers for {_PATIENCE:g} s"
        return ""
