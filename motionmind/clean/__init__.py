"""Cleaning of recordings: gaps, flips and spikes, jitter, feet that slide, and the floor."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
