"""Maps a file's joints onto human23's, by the names of well-known rigs or by the user's table."""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from pathlib import Path

from motionmind.arguments import check_path
from motionmind.body.anatomy import SIDES
from motionmind.body.human import BODIES, human23
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, SkeletonError, enumerated
from motionmind.files import parse_toml, read_bytes
from motionmind.retarget.limb_names import ESSENTIAL_LIMB_JOINTS, find_unclear, map_by_limbs
from motionmind.retarget.rig import Rig, plain_names, spine_shares, without_endings
from motionmind.retarget.rigs import RIGS

# A skeleton must have one joint of each tuple; any other joint of human23 moves with its parent.
_ESSENTIAL = (
    ("pelvis",),
    *((f"{side}_{joint}",) for side in SIDES for joint in ESSENTIAL_LIMB_JOINTS),
    ("lumbar", "thorax"),
    ("cervical", "atlantal"),
)
_LIMB_NAMES = Rig("names of limbs", {}, ())  # any rig that `limb_names` recognises


def joint_mapping(skeleton: Skeleton, joints: Mapping[str, str] | None = None) -> dict[str, str] | None:
    """Map a skeleton's joints onto human23's: {file's joint: human23's joint}.

    Several joints in a row may map to one of human23's, which takes its place from the first and its rotation from
    the last. A mapping must cover pelvis, hips, knees, ankles, shoulders, elbows and wrists, one joint of the spine
    (lumbar or thorax) and one of neck and head (cervical or atlantal).

    Args:
        skeleton: a file's own skeleton.
        joints: the user's mapping, as `read_joint_mapping` returns it. Names of the file's joints may lack their
            namespace and differ in case. None recognises the rig by its names: one of `RIGS`, or names of limbs.

    Returns:
        The mapping in the skeleton's order; None if `joints` is None and no rig has these names.

    Raises:
        SkeletonError: `joints` names an unknown joint, or lacks an essential one.
    """
    if joints is not None:
        return _resolve(skeleton, joints)
    known = known_rig(skeleton)
    return None if known is None else known[1]


def is_human44(skeleton: Skeleton) -> bool:
    """Return whether the skeleton has human44's joints, by name; human23 would lose some of them."""
    known = known_rig(skeleton)
    return known is not None and known[0].name == "human44"


def filled_joints(mapping: Mapping[str, str]) -> list[str]:
    """Return the joints of human23 that nothing maps to; they move with their parents."""
    return [name for name in human23().names if name not in set(mapping.values())]


def read_joint_mapping(path: str | Path) -> dict[str, str]:
    """Read a user's mapping from a file: JSON if its suffix is `.json`, TOML otherwise.

    TOML has lines such as `Hips = "pelvis"`, alone or under `[joints]`; names with characters other than letters,
    digits, - and _ need quotes. JSON has one object, alone or under "joints".

    Returns:
        {file's joint: human23's joint}.

    Raises:
        FormatError: the file cannot be read, or names a joint that human23 does not have.

    >>> from pathlib import Path
    >>> from motionmind.retarget import read_joint_mapping
    >>> _ = Path("rig.toml").write_text('Hips = "pelvis"')
    >>> read_joint_mapping("rig.toml")
    {'Hips': 'pelvis'}
    """
    check_path("path", path)
    path = Path(path)
    try:
        text = read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")
        table = json.loads(text) if path.suffix.lower() == ".json" else parse_toml(text)
    except (ValueError, RecursionError) as error:  # of either parser, and of UTF-8
        raise FormatError(f"not a joint mapping: {error}", path=path) from None
    if isinstance(table, dict) and isinstance(table.get("joints"), dict):
        table = table["joints"]
    if not isinstance(table, dict) or not table:
        raise FormatError('not a joint mapping: it must hold lines such as Hips = "pelvis"', path=path)
    for source, target in table.items():
        if not isinstance(target, str):
            raise FormatError(
                f"{source!r} must map to the name of a joint of human23, as text (a name with a dot needs quotes)",
                path=path,
            )
        if target not in human23().names:
            raise FormatError(f"{source!r}: {_describe_unknown(target, human23().names, 'human23')}", path=path)
    return table


def known_rig(skeleton: Skeleton) -> tuple[Rig, dict[str, str]] | None:
    """Recognise a rig by its joints' names.

    Returns:
        The first of `RIGS` whose essential joints the skeleton has, and its mapping {file's joint: human23's joint} in
        the skeleton's order; None if there is none.
    """
    known = _known_tree(skeleton.names, skeleton.parents)
    return known and (known[0], dict(known[1]))


@lru_cache(64)  # the files of a collection share a few trees
def _known_tree(names: tuple[str, ...], parents: tuple[int, ...]) -> tuple[Rig, dict[str, str]] | None:
    """Recognise a rig as `known_rig`, by its joints' names and parents."""
    for variant in (names, without_endings(names)):
        plain = plain_names(variant) if variant else []
        for rig in (one for one in RIGS if variant is names or (variant and one.name not in BODIES)):
            mapping = _map_by_names(rig, plain, parents)
            if rig.marks <= set(plain) and not _missing(mapping.values()):
                return rig, {names[i]: mapping[i] for i in sorted(mapping)}
    limbs = map_by_limbs(names, parents)
    return (_LIMB_NAMES, {names[i]: limbs[i] for i in sorted(limbs)}) if limbs else None


def _map_by_names(rig: Rig, plain: Sequence[str], parents: Sequence[int]) -> dict[int, str]:
    """Map joints with these plain names and parents by a rig's table: {joint's index: human23's joint}."""
    table = dict(rig.joints) | spine_shares([name for name in rig.spine if name in plain])
    order = list(table)
    found = sorted((order.index(name), i) for i, name in enumerate(plain) if name in table)
    mapping: dict[int, str] = {}
    for _, i in found:  # in the table's order: of two joints in different branches the first counts
        target = table[plain[i]]
        if all(on_one_chain(parents, i, other) for other, taken in mapping.items() if taken == target):
            mapping[i] = target
    return mapping


def describe_unknown_rig(skeleton: Skeleton) -> str:
    """Say why joints do not map to human23: which joints of the most similar rig they lack."""
    plain = plain_names(skeleton.names)
    lacking = []
    for rig in RIGS:
        missing = _missing(_map_by_names(rig, plain, skeleton.parents).values())
        lacking.append((missing + [f"a joint called {mark}" for mark in sorted(rig.marks - set(plain))], rig.name))
    missing, name = min(lacking, key=lambda one: len(one[0]))
    unclear = find_unclear(skeleton.names, skeleton.parents)
    if len(unclear) < len(missing) and len(unclear) <= 2:
        fault = f"the joints' names do not show {enumerated([f'the {part}' for part in unclear])}"
    elif len(missing) > len(_ESSENTIAL) // 2:
        fault = "they have the names of no known rig"
    else:
        fault = f"named as in {name}, they lack {enumerated(missing)}"
    return f"the joints of {skeleton.name} do not map to human23: {fault}"


def describe_limbs(skeleton: Skeleton) -> str:
    """Describe which joints names of limbs make pelvis, left leg and left arm; return "" for any other rig."""
    known = known_rig(skeleton)
    if known is None or known[0] is not _LIMB_NAMES:
        return ""
    source = {joint: name for name, joint in reversed(known[1].items())}
    leg, arm = (
        ", ".join(source[f"left_{joint}"] for joint in limb)
        for limb in (ESSENTIAL_LIMB_JOINTS[:3], ESSENTIAL_LIMB_JOINTS[3:])
    )
    return f"joints recognised by names of limbs: {source['pelvis']} is the pelvis, {leg} a leg, {arm} an arm"


def _resolve(skeleton: Skeleton, joints: Mapping[str, str]) -> dict[str, str]:
    """Resolve and check the user's mapping; return it by the skeleton's own names, in their order."""
    plain = plain_names(skeleton.names)
    mapping: dict[int, str] = {}
    for source, target in joints.items():
        if target not in human23().names:
            raise SkeletonError(f"mapping of {source!r}: {_describe_unknown(target, human23().names, 'human23')}")
        matches = [i for i, name in enumerate(skeleton.names) if name == source]
        matches = matches or [i for i, name in enumerate(plain) if [name] == plain_names([source])]
        if len(matches) != 1:
            raise SkeletonError(f"mapping to {target}: {_describe_unknown(source, skeleton.names, skeleton.name)}")
        if mapping.get(matches[0], target) != target:
            raise SkeletonError(f"mapping of {source!r}: both {mapping[matches[0]]} and {target}; give one")
        mapping[matches[0]] = target
    for i, target in mapping.items():
        for other, taken in mapping.items():
            if taken == target and not on_one_chain(skeleton.parents, i, other):
                names = f"{skeleton.names[i]!r} and {skeleton.names[other]!r}"
                raise SkeletonError(f"{names} both map to {target}, but neither descends from the other")
    missing = _missing(mapping.values())
    if missing:
        raise SkeletonError(f"the mapping onto human23 lacks {', '.join(missing)}")
    return {skeleton.names[i]: mapping[i] for i in sorted(mapping)}


def _missing(targets: Iterable[str]) -> list[str]:
    """Name the essential joints of human23 that `targets` lacks."""
    present = set(targets)
    return [" or ".join(choice) for choice in _ESSENTIAL if not present & set(choice)]


def on_one_chain(parents: Sequence[int], a: int, b: int) -> bool:
    """Return whether one of the joints `a` and `b` (indices) is the other or descends from it."""
    low, high = max(a, b), min(a, b)
    while low > high:
        low = parents[low]
    return low == high


def _describe_unknown(name: str, names: Iterable[str], where: str) -> str:
    """Say that there is no joint `name`, with the closest known name or all of them."""
    close = {known.lower(): known for known in names}
    match = difflib.get_close_matches(name.lower(), close, n=1)
    hint = f"did you mean {close[match[0]]!r}?" if match else f"its joints are {', '.join(names)}"
    return f"no joint {name!r} in {where}; {hint}"
