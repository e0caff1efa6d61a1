"""Transcription: from a recording back to a score that a person can read, change and compose."""

from __future__ import annotations

import lazy_loader

TOLERANCE_RANGE_DEG = (1.0, 90.0)
LONGEST_MOVE_S = 3.0  # between two postures; a longer hold takes several lines

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
