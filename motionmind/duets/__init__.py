"""Duets: where two dancers are to each other, learned from duets, and tweens that keep a couple together."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
