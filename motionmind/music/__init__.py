"""Music: the times of its beats, and its sound. Reading sound and MIDI needs the extra `music`."""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
