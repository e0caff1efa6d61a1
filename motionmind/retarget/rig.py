"""A rig: how a family of skeletons calls its joints, and what is left of their names without what varies."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from motionmind._typing import Floats

_MOST = 0.8  # share of a file's joints whose names end in numbers, if these tell its nodes apart


@dataclass(frozen=True, eq=False)
class Rig:
    """A family of skeletons that share their joints' names.

    Attributes:
        name: the rig's name.
        joints: by plain name of a file's joint, the joint of human23 that it maps to; without the spine. Of names for
            one joint that do not descend from each other, the first that a skeleton has counts.
        spine: plain names of all joints from the pelvis upwards to the one that carries the arms. Those that a
            skeleton has are divided between lumbar and thorax.
        marks: plain names that every skeleton of this rig has.
        frames: for rigs whose zero pose does not stand, by joint of human23, the orientation of its axes in the file's
            joint's own frame, quaternions [4]. Empty if the zero pose stands.
        neck_leans: whether the slope of the neck in the zero pose is posture, not anatomy: a neck and head at rest are
            then turned upright from it.
        twists: by joint of human23, radians by which its axes are turned about +x in the file's, once the bones'
            directions agree; a bone's direction does not determine its twist.
    """

    name: str
    joints: Mapping[str, str]
    spine: Sequence[str]
    marks: frozenset[str] = frozenset()
    frames: Mapping[str, Floats] = field(default_factory=dict)
    neck_leans: bool = False
    twists_rad: Mapping[str, float] = field(default_factory=dict)


def plain_names(names: Sequence[str]) -> list[str]:
    """Strip from names what varies from file to file: namespaces, a common prefix, case, punctuation."""
    bare = [re.split(r"[:|]", name)[-1] or name for name in names]
    # "Character1_Hips", "Character1_Spine": the common prefix, if it ends at a word's end.
    first = re.match(r".*[^A-Za-z0-9]", bare[0])
    prefix = first[0] if first and all(name.startswith(first[0]) for name in bare) else ""
    if not prefix and len(bare) > 1 and all(re.match(re.escape(bare[0]) + "[^A-Za-z0-9]", name) for name in bare[1:]):
        prefix = bare[1][: len(bare[0]) + 1]  # "Bip01", "Bip01 Pelvis", "Bip01 Spine"
    return [re.sub(r"[^a-z0-9]", "", name.removeprefix(prefix).lower()) for name in bare]


def without_endings(names: Sequence[str]) -> list[str] | None:
    """Return names without an ending that all have ("Hips_jnt"), or a number that most end in ("Hips_01, Head_05").

    Exporters add these, so that names are unique in a scene. None if there is none, or names are then alike.

    >>> without_endings(["Hips_01", "Spine_02", "Head_03"])
    ['Hips', 'Spine', 'Head']
    """
    last = re.search(r"[^A-Za-z0-9][A-Za-z0-9]*$", names[0])
    if last and all(name.endswith(last[0]) for name in names):
        bare = [name.removesuffix(last[0]) for name in names]
    else:
        bare = [re.sub(r"[^A-Za-z0-9]\d+$", "", name) for name in names]
        if sum(map(str.__ne__, bare, names)) <= _MOST * len(names):
            return None
    return bare if len({*bare}) == len(bare) else None


def spine_shares(chain: Sequence[str]) -> dict[str, str]:
    """Divide a spine's joints, listed upwards, between human23's lumbar and thorax: {name: "lumbar" or "thorax"}.

    The last joint, which carries the arms, is always the thorax's. Of an odd number the lumbar gets one more: in CMU's
    spines of three the thorax is then as high as human23's (0.24 m and 0.23 m above the pelvis).
    """
    upper = max(1, len(chain) // 2)
    return {name: "lumbar" if i < len(chain) - upper else "thorax" for i, name in enumerate(chain)}
