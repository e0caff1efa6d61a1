"""MotionMind: movement between two postures in the style of a corpus, with a proof of how good it is.

    from motionmind import Engine, own_skeleton, read_motion

    engine = Engine.fit([own_skeleton(read_motion("clip.bvh"))], rate=5)
    tween = engine.tween(a, b)

What is listed here is the public interface. It is imported when it is first used, so that `import motionmind` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from motionmind.body.human import human23, human44
    from motionmind.body.motion import Insertion, Motion, Posture
    from motionmind.body.skeleton import Skeleton
    from motionmind.chaos.flows import Flow, flow_of
    from motionmind.discretize import make as make_discretization
    from motionmind.errors import (
        CorpusError,
        FormatError,
        MotionMindError,
        MotionMindWarning,
        NoPathError,
        SkeletonError,
    )
    from motionmind.formats import read_motion, read_posture, write_motion, write_posture
    from motionmind.notation.compose import compose
    from motionmind.render.pictures import write_picture
    from motionmind.render.sheet import contact_sheet
    from motionmind.retarget.retarget import own_skeleton, to_human23
    from motionmind.tween.certificate import Bridge, Source, Wait
    from motionmind.tween.engine import Engine
    from motionmind.tween.result import Tween
    from motionmind.variation.piece import Piece
    from motionmind.variation.review import Seam
    from motionmind.variation.variation import Variation, vary
    from motionmind.variation.variation_json import read_variation, write_variation

__version__ = "0.1.0"

__all__ = [
    "Bridge",
    "CorpusError",
    "Engine",
    "Flow",
    "FormatError",
    "Insertion",
    "Motion",
    "MotionMindError",
    "MotionMindWarning",
    "NoPathError",
    "Piece",
    "Posture",
    "Seam",
    "Skeleton",
    "SkeletonError",
    "Source",
    "Tween",
    "Variation",
    "Wait",
    "compose",
    "contact_sheet",
    "flow_of",
    "human23",
    "human44",
    "make_discretization",
    "own_skeleton",
    "read_motion",
    "read_posture",
    "read_variation",
    "to_human23",
    "vary",
    "write_motion",
    "write_picture",
    "write_posture",
    "write_variation",
]

_HOMES = {
    "chaos.flows": ("Flow", "flow_of"),
    "discretize": ("make_discretization",),
    "engine": ("Engine",),
    "errors": (
        "CorpusError",
        "FormatError",
        "MotionMindError",
        "MotionMindWarning",
        "NoPathError",
        "SkeletonError",
    ),
    "formats": ("read_motion", "read_posture", "write_motion", "write_posture"),
    "_learned": ("own_skeleton",),
    "motion": ("Insertion", "Motion", "Posture"),
    "notation.compose": ("compose",),
    "render.pictures": ("write_picture",),
    "render.sheet": ("contact_sheet",),
    "_retarget": ("to_human23",),
    "skeleton": ("Skeleton", "human23", "human44"),
    "_tween": ("Bridge", "Source", "Tween", "Wait"),
    "variation.piece": ("Piece",),
    "variation.review": ("Seam",),
    "variation.variation": ("Variation", "vary"),
    "variation.variation_json": ("read_variation", "write_variation"),
}
_RENAMED = {"make_discretization": "make"}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"motionmind.{module}"), _RENAMED.get(name, name))
    raise AttributeError(f"module 'motionmind' has no attribute {name!r}")
