"""A variation on its attractor as a page: the attractor in three dimensions, and the body that dances along it."""

from __future__ import annotations

from typing import Any

import numpy as np

from motionmind._typing import Floats
from motionmind.chaos.reorder import reorder
from motionmind.plots.portrait import Portrait
from motionmind.plots.symbols import OTHER, PIECE
from motionmind.render.page import base64_of, page_beside

_THINNED = 50  # one of so many points of the sheets is enough to see where the attractor is


def attractor_page(portrait: Portrait) -> str:
    """The page; player/README.md says what it holds."""
    arranged = portrait.variation.arrange()
    sheets = portrait.sheets[::_THINNED]
    there = portrait.in_space(sheets)
    low, high = there.min(axis=0), there.max(axis=0)
    radius = 0.5 * float(np.linalg.norm(high - low))

    def places(points: Floats) -> str:
        return base64_of(((portrait.in_space(points) - 0.5 * (low + high)) / radius).astype("<f4").tobytes())

    data: dict[str, Any] = {
        "flow": portrait.flow.label,
        "every": portrait.every,
        "order": portrait.order.tolist(),
        "frames": arranged.frames.tolist(),
        "jumps": sorted(portrait.jumps),
        "sites": places(portrait.sites),
        "piece": places(portrait.piece),
        "other": places(portrait.other),
        "sheets": places(sheets),
        "cells": base64_of(reorder(portrait.sites, sheets).astype("<u2").tobytes()),
        "colours": {"piece": PIECE, "other": OTHER},
    }
    return page_beside(arranged.motion, "attractor", data)
