"""The map of an attractor: points all over it, and trajectories thinned out for drawing."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from motionmind._typing import Floats
from motionmind.chaos.flows import Flow
from motionmind.chaos.trajectories import trajectory
from motionmind.studio.varying import STEPS_PER_PLACE, find_flow


def axes_of(flow: Flow) -> tuple[int, int, int]:
    """Return the coordinates that point right, up and towards the viewer on a map of a flow."""
    return (0, 2, 1) if flow.name == "lorenz" else (0, 1, 2)


@lru_cache(maxsize=4)
def map_of(name: str) -> dict[str, Any]:
    """Return the part of a map that does not depend on the piece: points all over the attractor [M][3], and its axes.

    Raises:
        MotionMindError: no flow in three dimensions has this name.
    """
    flow = find_flow(name)
    points = trajectory(flow, count=12_000, every=3)
    return {"flow": name, "axes": axes_of(flow), "points": points.round(4).tolist(), "about": flow.about}


def drawn(points: Floats) -> list[list[float]]:
    """Thin out a trajectory of more than 6000 points for a map [M][3]; its sites stay."""
    every = STEPS_PER_PLACE if len(points) > 6_000 else 1
    thinned: list[list[float]] = points[::every].round(4).tolist()
    return thinned
