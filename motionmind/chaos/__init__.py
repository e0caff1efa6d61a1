"""Chaotic reordering: wrap a piece around a strange attractor, and read it along another trajectory."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
