"""Read files that describe bodies: their joints, the joints' angles and ranges, and masses.

The files are TOML; `bodies/human23.toml` is a commented example.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from motionmind.body.anatomy import SIDES, Anatomy, Joint, Leg
from motionmind.body.human import BODIES
from motionmind.body.skeleton import Skeleton, remembered
from motionmind.errors import FormatError, did_you_mean
from motionmind.files import FilePath, parse_toml, read_bytes

FORMAT, VERSION = "motionmind-body", 1
# The headings of a score besides its layers.
HEADINGS = ("title", "body", "include", "tempo", "facings", "phrase", "clip", "posture")
_BODIES = Path(__file__).parent / "bodies"


class _Segment(msgspec.Struct, forbid_unknown_fields=True):
    name: str
    parent: str = ""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tip: tuple[float, float, float] = (0.0, 0.0, 0.0)


class _File(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    format: str
    version: int
    name: str
    layers: dict[str, list[str]]
    joints: dict[str, Joint]
    groups: dict[str, dict[str, float | dict[str, float]]] = {}
    leg: Leg | None = None
    skeleton: list[_Segment] = []


@cache
def anatomy_named(name: str) -> Anatomy:
    """Return a body that comes with MotionMind, such as "human23".

    Raises:
        FormatError: there is no such body; the message names the bodies there are.
    """
    return read_body(_bundled(name))


@remembered
def anatomy_of(skeleton: Skeleton) -> Anatomy | None:
    """Return the anatomy of a body with the joints of human23 or human44, in any proportions; None for other bodies."""
    return next((anatomy_named(name) for name, make in BODIES.items() if make().names == skeleton.names), None)


def _bundled(name: object, path: FilePath | None = None) -> Path:
    known = sorted(file.stem for file in _BODIES.glob("*.toml"))
    if name not in known:
        hint = did_you_mean(str(name), known) or f"; there are {', '.join(known)}, or a .toml file"
        raise FormatError(f"no body {name!r}{hint}", path=path)
    return _BODIES / f"{name}.toml"


def read_body(path: FilePath) -> Anatomy:
    """Read a body from a TOML file.

    Args:
        path: the file, as `bodies/human23.toml` shows.

    Raises:
        FormatError: the file is missing, malformed or contradicts itself; the message names the table or joint.
    """
    try:
        read = msgspec.convert(_with_angles(_read_table(path)), _File)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"cannot be read as a body: {error}", path=path) from None
    if (read.format, read.version) != (FORMAT, VERSION):
        raise FormatError(
            f"is {read.format!r} version {read.version}; {FORMAT!r} version {VERSION} can be read", path=path
        )
    skeleton = _skeleton(read, path)
    out = Anatomy(
        skeleton,
        {layer: tuple(joints) for layer, joints in read.layers.items()},
        read.joints,
        {group: _shares(read, group, path) for group in read.groups},
        read.leg,
        str(path),
    )
    _check(out, path)
    return out


def _read_table(path: FilePath) -> dict[str, Any]:
    """Return the tables of a file, merged over those of the body that it `extends`, if any."""
    data = parse_toml(read_bytes(path).decode("utf-8-sig"))
    extended = data.pop("extends", None)
    return data if extended is None else _on_top(data, _read_table(_bundled(extended, path)))


def _on_top(upper: dict[str, Any], lower: dict[str, Any]) -> dict[str, Any]:
    """Merge tables entry by entry; the upper table's entries override the lower's."""
    tables = [key for key in upper if isinstance(upper[key], dict) and isinstance(lower.get(key), dict)]
    return lower | upper | {key: _on_top(upper[key], lower[key]) for key in tables}


def _shares(read: _File, group: str, path: FilePath) -> dict[str, dict[str, float]]:
    """Return each joint's share of each angle of a group; a single number in the file is its share of all angles."""
    out = {}
    for name, share in read.groups[group].items():
        if name not in read.joints:
            raise FormatError(f"[groups] {group}: no joint {name!r}{did_you_mean(name, read.joints)}", path=path)
        angles = read.joints[name].angles
        out[name] = share if isinstance(share, dict) else dict.fromkeys(angles, share)
        if set(out[name]) != set(angles):
            raise FormatError(f"[groups] {group}: {name} needs a share of {', '.join(angles)} each", path=path)
    return out


def _with_angles(data: dict[str, Any]) -> dict[str, Any]:
    """Gather each joint's angles, which a file writes beside its other keys: every subtable is one."""
    joints = data.get("joints")
    if not isinstance(joints, dict):
        return data
    return data | {
        "joints": {
            name: {key: value for key, value in table.items() if not isinstance(value, dict)}
            | {"angles": {key: value for key, value in table.items() if isinstance(value, dict)}}
            if isinstance(table, dict)
            else table
            for name, table in joints.items()
        }
    }


def _skeleton(read: _File, path: FilePath) -> Skeleton:
    if not read.skeleton:
        if read.name not in BODIES:
            raise FormatError(
                f"{read.name!r} has no skeleton: give [[skeleton]] tables of name, parent, offset", path=path
            )
        return BODIES[read.name]()
    names = [segment.name for segment in read.skeleton]
    for segment in read.skeleton[1:]:
        if segment.parent not in names:
            raise FormatError(f"the parent of {segment.name}, {segment.parent!r}, is no joint", path=path)
    parents = tuple(names.index(segment.parent) if segment.parent else -1 for segment in read.skeleton)
    offsets = np.array([segment.offset for segment in read.skeleton])
    return Skeleton(read.name, tuple(names), parents, offsets, np.array([segment.tip for segment in read.skeleton]))


def _check(body: Anatomy, path: FilePath) -> None:
    """Check that all names are known, and that every joint is described and in one layer, pairs apart from singles."""
    for joint, anatomy in body.joints.items():
        _check_joint(body, joint, anatomy, path)
    missing = sorted(_stems(body.skeleton) - set(body.joints))
    if missing:
        raise FormatError(f"there is no [joints.{missing[0]}]", path=path)
    for layer, joints in body.layers.items():
        if layer in HEADINGS:
            raise FormatError(f"{layer!r} cannot be a layer: it is a heading of scores", path=path)
        strangers = [joint for joint in joints if joint not in body.joints]
        if strangers or not joints:
            what = f"{strangers[0]!r}{did_you_mean(strangers[0], body.joints)}" if strangers else "nothing"
            raise FormatError(f"[layers] {layer}: {what} is no joint", path=path)
        if len({body.paired(joint) for joint in joints}) > 1:
            raise FormatError(f"[layers] {layer}: pairs and single joints move in layers of their own", path=path)
    for joint in sorted(_stems(body.skeleton)):
        holders = [layer for layer, joints in body.layers.items() if joint in joints]
        if len(holders) != 1:
            raise FormatError(f"{joint} must be in one layer, not {' and '.join(holders) or 'none'}", path=path)
    if body.leg is not None:
        for joint in (body.leg.hip, body.leg.knee, body.leg.ankle, body.leg.toes):
            if joint not in body.joints or not body.paired(joint):
                raise FormatError(f"[leg]: {joint!r} is no pair of joints{did_you_mean(joint, body.joints)}", path=path)
        if not any(anatomy.mass for anatomy in body.joints.values()):
            raise FormatError("[leg]: a body that stands needs the mass of its joints' segments", path=path)


def _check_joint(body: Anatomy, joint: str, anatomy: Joint, path: FilePath) -> None:
    stems, where = _stems(body.skeleton), f"[joints.{joint}]"
    if joint not in stems:
        raise FormatError(f"{where}: no such joint{did_you_mean(joint, stems)}", path=path)
    if anatomy.long not in ("x", "y", "z"):
        raise FormatError(f"{where}: long must be x, y or z, not {anatomy.long!r}", path=path)
    for name, angle in anatomy.angles.items():
        if angle.about.removeprefix("-") not in ("x", "y", "z"):
            raise FormatError(f"{where} {name}: about must be an axis such as -x, not {angle.about!r}", path=path)
        if not angle.range[0] <= 0.0 <= angle.range[1]:
            raise FormatError(f"{where} {name}: the range must have 0 in it, not be {angle.range}", path=path)
    if len({angle.axis for angle in anatomy.angles.values()}) < len(anatomy.angles):
        raise FormatError(f"{where}: two angles about one axis", path=path)
    if anatomy.against:
        names, above = body.skeleton.names, body.named(joint, "left")
        while above > 0 and names[above] != anatomy.against:
            above = body.skeleton.parents[above]
        if names[above] != anatomy.against or body.named(joint, "left") == above:
            raise FormatError(f"{where}: against must name a joint above it, not {anatomy.against!r}", path=path)


def _stems(skeleton: Skeleton) -> set[str]:
    """Return the joints' names without their sides."""
    return {name.partition("_")[2] if name.partition("_")[0] in SIDES else name for name in skeleton.names}
