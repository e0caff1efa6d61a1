"""A variation on its attractor as a page: the attractor in three dimensions beside the body that dances along it."""

from __future__ import annotations

from typing import Any

import numpy as np

from motionmind._typing import Floats
from motionmind.plots.portrait import Portrait
from motionmind.render.markup import base64_of
from motionmind.render.page import page_beside
from motionmind.render.palette import PLOT


def attractor_page(portrait: Portrait) -> str:
    """Build the HTML page of a portrait; player/README.md documents its data."""
    arranged = portrait.variation.arrange()
    sheets = portrait.sheets[::50]  # enough to show the attractor
    points = portrait.in_space(sheets)
    low, high = points.min(axis=0), points.max(axis=0)
    radius = 0.5 * float(np.linalg.norm(high - low))

    def encode(points: Floats) -> str:
        return base64_of(((portrait.in_space(points) - 0.5 * (low + high)) / radius).astype("<f4").tobytes())

    data: dict[str, Any] = {
        "flow": portrait.flow.label,
        "every": portrait.every,
        "order": portrait.order.tolist(),
        "frames": arranged.frames.tolist(),
        "jumps": sorted(portrait.jumps),
        "sites": encode(portrait.sites),
        "piece": encode(portrait.piece),
        "other": encode(portrait.other),
        "sheets": encode(sheets),
        "cells": base64_of(portrait.postures_at(sheets).astype("<u2").tobytes()),
        "colours": {"piece": PLOT.piece, "other": PLOT.variation},
    }
    return page_beside(arranged.motion, "attractor", data)
