"""Plots as SVG and PNG: joint graphs, joint angles over time, variations on their attractors, floor plans, and gaps."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
