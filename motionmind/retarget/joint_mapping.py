"""Which joint of a file stands for which of human23: by the names of well-known rigs, or as the user says."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path

from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, SkeletonError
from motionmind.retarget.rigs import RIGS, Rig, plain_names, spine_shares

# What a skeleton must have, one joint of each line; all else goes along with the joint it hangs from.
_ESSENTIAL = (
    ("pelvis",),
    *(
        (f"{side}_{joint}",)
        for side in ("left", "right")
        for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    ),
    ("lumbar", "thorax"),
    ("cervical", "atlantal"),
)


def joint_mapping(skeleton: Skeleton, joints: Mapping[str, str] | None = None) -> dict[str, str] | None:
    """Which joints of `skeleton` stand for which of human23: {file's joint: human23's joint}.

    Several joints in a row may stand for one of human23's: it stands where the first does and turns as the last
    does. Of human23 there must be pelvis, hips, knees, ankles, shoulders, elbows and wrists, one joint of the spine
    (lumbar or thorax) and one of neck and head (cervical or atlantal).

    Args:
        skeleton: a file's own skeleton.
        joints: the user's mapping, from `read_joint_mapping`. Names of the file's joints may lack their namespace and
            differ in case. None to know the rig by its names: CMU (BVH and ASF), Mixamo, Biovision, Bandai-Namco, SMPL,
            or human44.

    Returns:
        The mapping in the skeleton's order; None where `joints` is None and no rig has these names.

    Raises:
        SkeletonError: `joints` names what is not there, or lacks an essential joint.
    """
    if joints is not None:
        return _own_mapping(skeleton, joints)
    known = known_rig(skeleton)
    return None if known is None else known[1]


def is_human44(skeleton: Skeleton) -> bool:
    """Whether the skeleton has human44's joints, by names as known rigs are; on human23 it would lose some of them."""
    known = known_rig(skeleton)
    return known is not None and known[0].name == "human44"


def filled_joints(mapping: Mapping[str, str]) -> list[str]:
    """The joints of human23 for which a mapping has no source: they go along with the joint they hang from."""
    return [name for name in human23().names if name not in set(mapping.values())]


def read_joint_mapping(path: str | Path) -> dict[str, str]:
    """A user's mapping {file's joint: human23's joint} from a TOML or JSON file (by suffix; TOML is taken else).

    TOML: `Hips = "pelvis"`, one a line; names with other characters than letters, digits, - and _ in quotes. The
    lines may stand under `[joints]`. JSON: one object, or one under "joints".

    Raises:
        FormatError: the file cannot be read, or names a joint that human23 does not have.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
        table = json.loads(text) if path.suffix.lower() == ".json" else tomllib.loads(text)
    except OSError as error:
        raise FormatError(f"cannot be read: {error.strerror or error}", path=path) from None
    except (ValueError, RecursionError) as error:  # of either parser, and of UTF-8
        raise FormatError(f"no mapping of joints: {error}", path=path) from None
    if isinstance(table, dict) and isinstance(table.get("joints"), dict):
        table = table["joints"]
    if not isinstance(table, dict) or not table:
        raise FormatError('no mapping of joints: it must hold lines such as Hips = "pelvis"', path=path)
    for source, target in table.items():
        if not isinstance(target, str):
            raise FormatError(
                f"{source!r} must be given the name of a joint of human23, as text (a name with a dot in it needs "
                "quotes)",
                path=path,
            )
        if target not in human23().names:
            raise FormatError(f"{source!r}: {_unknown(target, human23().names, 'human23')}", path=path)
    return table


def known_rig(skeleton: Skeleton) -> tuple[Rig, dict[str, str]] | None:
    """The first rig whose names the skeleton has, all essential ones at least, and its mapping."""
    plain = plain_names(skeleton.names)
    for rig in RIGS:
        spine = spine_shares([name for name in rig.spine if name in plain])
        table = dict(rig.joints) | spine
        order = list(table)
        found = sorted((order.index(name), i) for i, name in enumerate(plain) if name in table)
        mapping: dict[int, str] = {}
        for _, i in found:  # in the table's order, so that the first of two that are not in a row counts
            target = table[plain[i]]
            if all(in_a_row(skeleton, i, other) for other, taken in mapping.items() if taken == target):
                mapping[i] = target
        if rig.marks <= set(plain) and not _missing(mapping.values()):
            return rig, {skeleton.names[i]: mapping[i] for i in sorted(mapping)}
    return None


def _own_mapping(skeleton: Skeleton, joints: Mapping[str, str]) -> dict[str, str]:
    plain = plain_names(skeleton.names)
    mapping: dict[int, str] = {}
    for source, target in joints.items():
        if target not in human23().names:
            raise SkeletonError(f"mapping of {source!r}: {_unknown(target, human23().names, 'human23')}")
        same = [i for i, name in enumerate(skeleton.names) if name == source]
        same = same or [i for i, name in enumerate(plain) if [name] == plain_names([source])]
        if len(same) != 1:
            raise SkeletonError(f"mapping to {target}: {_unknown(source, skeleton.names, skeleton.name)}")
        if mapping.get(same[0], target) != target:
            raise SkeletonError(f"mapping of {source!r}: it is given both {mapping[same[0]]} and {target}")
        mapping[same[0]] = target
    for i, target in mapping.items():
        for other, taken in mapping.items():
            if taken == target and not in_a_row(skeleton, i, other):
                names = f"{skeleton.names[i]!r} and {skeleton.names[other]!r}"
                raise SkeletonError(f"{names} both stand for {target}, but neither hangs from the other")
    missing = _missing(mapping.values())
    if missing:
        raise SkeletonError(f"the mapping onto human23 lacks {', '.join(missing)}")
    return {skeleton.names[i]: mapping[i] for i in sorted(mapping)}


def _missing(targets: Iterable[str]) -> list[str]:
    there = set(targets)
    return [" or ".join(choice) for choice in _ESSENTIAL if not there & set(choice)]


def in_a_row(skeleton: Skeleton, a: int, b: int) -> bool:
    """Whether of the joints `a` and `b` (indices) one hangs from the other, or both are the same."""
    low, high = max(a, b), min(a, b)
    while low > high:
        low = skeleton.parents[low]
    return low == high


def _unknown(name: str, names: Iterable[str], where: str) -> str:
    close = {known.lower(): known for known in names}
    match = difflib.get_close_matches(name.lower(), close, n=1)
    hint = f"did you mean {close[match[0]]!r}?" if match else f"its joints are {', '.join(names)}"
    return f"no joint {name!r} in {where}; {hint}"
