"""Movements put on their ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.capsules import capsules_of
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.limbs import limbs_of
from motionmind.body.skeleton import Skeleton
from motionmind.footing.ground import Given, Stance
from motionmind.solver.motion import Bounds, solve_motion

TIGHT = np.zeros(23, dtype=np.bool_)  # no joint is loose


def grounded(
    q: Floats,
    root: Floats,
    fps: float = 30.0,
    skeleton: Skeleton | None = None,
    fixed: Bools = TIGHT,
    given: Sequence[float] = (),
    aloft: Floats | None = None,
    leap: float = 0.0,
    rates: tuple[Floats | None, Floats | None] = (None, None),
    fastest: Floats | None = None,
    travels: float = np.inf,
    pushes: float = np.inf,
    usual: Floats | None = None,
    **options: Any,
) -> tuple[Floats, Floats]:
    """The movement on the floor, between the root's ends; walks stand on all limbs, but where they are `aloft`."""
    skeleton = skeleton or human23()
    half_steps = np.interp(np.arange(2 * len(given) + 3), np.arange(len(given) + 2) * 2, [0.0, *given, len(q) - 1.0])
    half_steps = half_steps / fps if given else np.linspace(0.0, len(q) - 1.0, 2 * 8 + 1) / fps
    moves, none = len(half_steps) // 2, np.zeros(len(half_steps))
    flies = none if aloft is None else aloft
    places = np.interp(half_steps * fps, np.arange(len(q)), lowest_height(skeleton, q, root))
    low = {move: float(places[2 * move]) for move in (range(moves + 1) if given else (0, moves))}
    stands = np.ones((len(half_steps), len(limbs_of(skeleton)) + 1))
    clearance, leaps = flies * leap, np.where(flies > 0.0, leap, 0.0)
    stance = Stance(half_steps, clearance, none + 1.0, stands, flies, leaps, np.zeros((2 * moves, 3)), 0.08)
    none_of_joints = np.zeros(len(skeleton), dtype=np.bool_)
    touches = np.zeros(len(capsules_of(skeleton).pairs())) if usual is None else usual
    bounds = Bounds(fixed, none_of_joints, none_of_joints, touches, fastest, np.inf, travels, np.inf, pushes)
    made = solve_motion(
        skeleton, q, np.arange(len(q)) / fps, stance, Given(low, (root[0], root[-1]), rates), bounds, **options
    )
    return made.rotations, made.root
