"""The projects opened last, and a studio of its own for one of them."""

from __future__ import annotations

import asyncio
import hashlib
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.corpus import store
from motionmind.display import displayed, displayed_path, printable
from motionmind.errors import MotionMindError
from motionmind.studio.api import body_of, json
from motionmind.studio.renewal import recent

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

_MAX_RECENT = 4
_STUDIO_START_S = 30.0
_ADDRESS = re.compile(r"http://\S+#token=\S+")


class RecentProject(msgspec.Struct, forbid_unknown_fields=True):
    """One of the projects opened last, and when (seconds since 1970)."""

    id: str
    name: str
    folder: str
    opened: float


class RecentOpening(msgspec.Struct, forbid_unknown_fields=True):
    """A request to open one of the latest projects."""

    id: Annotated[str, msgspec.Meta(max_length=64)]


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes; other computers see no projects beside the open one."""

    def listed() -> dict[str, tuple[Path, float]]:
        if studio.is_shared:
            return {}
        own = os.path.realpath(studio.project.path)
        others = [one for one in recent(store.home(studio.home)) if str(one[0]) != own]
        return {hashlib.sha256(os.fsencode(path)).hexdigest(): (path, at) for path, at in others[:_MAX_RECENT]}

    async def latest(_: Request) -> Response:
        shown = [
            RecentProject(key, displayed(path.stem), displayed_path(path.parent), at)
            for key, (path, at) in listed().items()
        ]
        return json(shown)

    async def open_one(request: Request) -> Response:
        asked = await body_of(request, RecentOpening)
        if asked.id not in (found := listed()):
            raise MotionMindError("this project was moved or deleted")
        await _open(found[asked.id][0], studio.home)
        return json({})

    return [Route("/api/recent", latest), Route("/api/recent", open_one, methods=["POST"])]


async def _open(project: Path, home: Path | None) -> None:
    """Start a studio, which opens its page in the browser; raise MotionMindError if it does not start.

    The page of this one could not go there: a studio answers to no page of another address.
    """
    command = [sys.executable, "-m", "motionmind", "studio", str(project), "--until-closed"]
    command += ["--home", str(home)] if home else []
    with tempfile.TemporaryDirectory() as folder:
        out, err = Path(folder, "out"), Path(folder, "err")
        with out.open("wb") as outward, err.open("wb") as errors:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=outward,
                stderr=errors,
                start_new_session=os.name == "posix",  # it outlives this one's terminal
            )
        end = time.monotonic() + _STUDIO_START_S
        while time.monotonic() < end:
            is_over = process.poll() is not None  # before the last look at what it said
            if _ADDRESS.search(_said(out)):
                return
            if is_over:
                raise MotionMindError(_reason(_said(err)))
            await asyncio.sleep(0.05)
        process.kill()
    raise MotionMindError(f"{displayed_path(project)}: the studio did not start within {_STUDIO_START_S:g} s")


def _reason(said: str) -> str:
    """Return the error in what a command said."""
    last = printable(said.strip().rpartition("\n")[2])
    return last.removeprefix("error: ") or "the studio did not start"


def _said(file: Path) -> str:
    return file.read_text("utf-8", "replace")
