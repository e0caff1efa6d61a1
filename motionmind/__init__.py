"""MotionMind: movement between two postures in the style of a corpus, with a proof of how good it is.

    from motionmind import Engine, own_skeleton, read_motion

    engine = Engine.fit([own_skeleton(read_motion("clip.bvh"))], rate=5)
    tween = engine.tween(a, b)

The public names are listed once, in `__init__.pyi`; each is imported when it is first used, so that `import motionmind`
is quick.
"""

from __future__ import annotations

import lazy_loader

__version__ = "0.2.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
