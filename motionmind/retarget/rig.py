"""Rigs: how a family of skeletons names its joints, and how to reduce names to their plain form."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from motionmind._typing import Floats


@dataclass(frozen=True, eq=False)
class Rig:
    """A family of skeletons that share their joints' names.

    Attributes:
        name: the rig's name.
        joints: {plain name of a file's joint: human23's joint}, without the spine. If several names for one joint
            occur in different branches of a skeleton, the first counts.
        spine: plain names of all joints from the pelvis up to the joint that carries the arms; divided between lumbar
            and thorax, as far as a skeleton has them.
        marks: plain names that every skeleton of this rig has.
        frames: for rigs whose zero pose does not stand: {joint of human23: orientation of its axes in the frame of the
            file's joint, quaternion [4]}. Empty if the zero pose stands.
        neck_leans: whether the slope of the neck in the zero pose is posture, not anatomy; neck and head at rest are
            then turned upright.
        twists_rad: {joint of human23: rotation of its axes about +x in the file's, radians}, applied once the bones'
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
    """Return names in plain form: without namespace, common prefix, case and punctuation, which vary among files."""
    bare = [re.split(r"[:|]", name)[-1] or name for name in names]
    # "Character1_Hips", "Character1_Spine": the common prefix, if it ends at a word's end.
    first = re.match(r".*[^A-Za-z0-9]", bare[0])
    prefix = first[0] if first and all(name.startswith(first[0]) for name in bare) else ""
    if not prefix and len(bare) > 1 and all(re.match(re.escape(bare[0]) + "[^A-Za-z0-9]", name) for name in bare[1:]):
        prefix = bare[1][: len(bare[0]) + 1]  # "Bip01", "Bip01 Pelvis", "Bip01 Spine"
    return [re.sub(r"[^a-z0-9]", "", name.removeprefix(prefix).lower()) for name in bare]


def without_endings(names: Sequence[str]) -> list[str] | None:
    """Strip an ending that all names have ("Hips_jnt"), or the number that most end in ("Hips_01", "Head_05").

    Exporters add these to make names unique in a scene. None if there is no ending, or stripping makes names equal.

    >>> without_endings(["Hips_01", "Spine_02", "Head_03"])
    ['Hips', 'Spine', 'Head']
    """
    last = re.search(r"[^A-Za-z0-9][A-Za-z0-9]*$", names[0])
    if last and all(name.endswith(last[0]) for name in names):
        bare = [name.removesuffix(last[0]) for name in names]
    else:
        bare = [re.sub(r"[^A-Za-z0-9]\d+$", "", name) for name in names]
        if sum(map(str.__ne__, bare, names)) <= 0.8 * len(names):
            return None
    return bare if len({*bare}) == len(bare) else None


def spine_shares(chain: Sequence[str]) -> dict[str, str]:
    """Divide a spine's joints, listed upwards, between human23's lumbar and thorax: {name: "lumbar" or "thorax"}.

    The last joint, which carries the arms, always belongs to the thorax. With an odd number the lumbar gets one more:
    in CMU's spines of three the thorax is then as high as human23's (0.24 m and 0.23 m above the pelvis).
    """
    upper = max(1, len(chain) // 2)
    return {name: "lumbar" if i < len(chain) - upper else "thorax" for i, name in enumerate(chain)}
