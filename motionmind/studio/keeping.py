"""Named versions of the piece for the page: how long each is, and what has changed since."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.studio import api
from motionmind.studio.answers import VersionView
from motionmind.studio.piece import State
from motionmind.studio.versions import Version, differences
from motionmind.studio.view import layout_of

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio


def versions_of(studio: Studio, state: State) -> list[VersionView]:
    """Return the versions in a state of the project, the latest first, compared with its piece."""
    project = studio.project
    now = Version(state.blocks, state.verdicts, state.notes, state.about, state.cast)

    def seconds(version: Version) -> float:
        whole = replace(state, **version._asdict())
        return layout_of(whole, project.finding, project.marks).seconds

    length, found = seconds(now), []
    for name, version in [*state.versions.items()][::-1]:
        own = seconds(version)
        found.append(VersionView(name, own, differences(version, now, (own, length))))
    return found


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the route for versions."""

    async def versions(_: Request) -> Response:
        return api.json(await run_in_threadpool(versions_of, studio, studio.project.state))

    return [Route("/api/versions", versions)]
