"""Writes a BVH file again with some of its movement changed: all else stays as it stands in the file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import accumulate

import numpy as np

from motionmind._typing import Bools, Floats, Indices
from motionmind.body.motion import Motion
from motionmind.files import FilePath, name_of, write_atomically
from motionmind.formats._bvh_file import BvhFile, assemble, read_file
from motionmind.formats._bvh_hierarchy import BvhJoint
from motionmind.formats._bvh_rig import Placed, normalise, resolve_places
from motionmind.formats._clock import even_step
from motionmind.formats.bvh import INSERTED_LINE_END, length_digits
from motionmind.formats.bvh_rig_file import nearest_angles, rotation_order
from motionmind.formats.units import guess_unit, metres_per_unit
from motionmind.geometry import rotations as rot

# Smaller changes are rounding.
_SAME_RAD, _SAME_M = 1e-9, 1e-10
_CONTINUED_RAD = np.radians(60.0)  # angles changed by less stay near those in the file; others near the frame before


def write_changed_bvh(
    path: FilePath, source: FilePath, before: Motion, after: Motion, unit: str | float | None = None
) -> Motion:
    """Write a BVH file with changed movement, on the skeleton and in the channels of its source.

    The hierarchy stays word for word, and so do the values of channels and frames that did not change.

    Args:
        path: the file to write.
        source: the BVH file to change.
        before: its movement, as `read_bvh` returns it with the same unit.
        after: the changed movement, on the same skeleton and in the same frames.
        unit: as for `read_bvh`.

    Returns:
        The movement as the file holds it. It differs from `after` where joints have less than three rotation channels,
        or the root no positions.

    Raises:
        MotionMindError: the file cannot be written.
    """
    file = read_file(source)
    placed, adds = resolve_places(assemble(file.joints, file.values, name_of(source)))
    scale = metres_per_unit(unit) if unit is not None else guess_unit(normalise(placed).skeleton)[1]
    values = _changed_values(file, placed, before, after, scale, adds=adds)
    write_atomically(path, ("\n".join(_lines(file, values, after, 1.0 / scale)) + "\n").encode())
    return _as_written(file, values, after, scale, adds=adds)


def _as_written(file: BvhFile, values: Floats, motion: Motion, scale: float, *, adds: bool) -> Motion:
    """Return a motion as the channels hold it; arguments as of `_changed_values`."""
    placed = assemble(file.joints, values, motion.name)
    own = [placed.skeleton.names.index(name) for name in motion.skeleton.names]
    turned, base = _above(placed, own[0])
    rotations = placed.rotations[:, own]
    rotations[:, 0] = rot.mul(turned, rotations[:, 0])
    place = placed.place(own[0]) + (placed.skeleton.offsets[own[0]] if adds and own[0] else 0.0)
    return replace(motion, rotations=rotations, root=scale * (base + rot.mul_vec(turned, place)))


def _changed_values(
    file: BvhFile, placed: Placed, before: Motion, after: Motion, scale: float, *, adds: bool
) -> Floats:
    """Return the values of all channels [T, C] with the changes from one movement to another.

    Args:
        file: the file.
        placed: its movement, in its own unit, with places resolved.
        before: the movement as it is in the file.
        after: the changed movement.
        scale: metres in one unit of the file.
        adds: whether the file adds position channels to OFFSETs.
    """
    values, names = file.values.copy(), placed.skeleton.names
    starts = [0, *accumulate(len(joint.channels) for joint in file.joints)]
    turns = rot.angle(before.rotations, after.rotations)
    for number, name in enumerate(after.skeleton.names):
        joint = names.index(name)
        columns = _columns(file.joints[joint], starts[joint], "ROTATION")
        changed = np.flatnonzero(turns[:, number] > _SAME_RAD)
        if not len(columns) or not len(changed):
            continue
        local = after.rotations[changed, number]
        if number == 0:
            local = rot.inv_mul(_above(placed, joint)[0][changed], local)
        small = turns[changed, number] < _CONTINUED_RAD
        values[:, columns] = _angles(rotation_order(file.joints[joint]), values[:, columns], changed, local, small)
    joint = names.index(after.skeleton.names[0])
    one = file.joints[joint]
    moved = np.flatnonzero(rot.norm(after.root - before.root) > _SAME_M)
    turned, base = _above(placed, joint)
    place = rot.mul_vec(rot.inv(turned[moved]), after.root[moved] / scale - base[moved])
    if adds and joint:
        place = place - np.array(one.offset)
    for column in _columns(one, starts[joint], "POSITION"):
        values[moved, column] = np.round(place[:, "XYZ".index(one.channels[column - starts[joint]][0])], _digits(scale))
    return values


def _digits(scale: float) -> int:
    """Return the decimals of lengths in a file with a unit of `scale` metres."""
    return length_digits(1.0 / scale)


def _columns(joint: BvhJoint, start: int, kind: str) -> list[int]:
    """Return the columns of a joint's channels of a kind, given its first column."""
    return [column for column, channel in enumerate(joint.channels, start) if channel.endswith(kind)]


def _above(placed: Placed, joint: int) -> tuple[Floats, Floats]:
    """Return the orientation [T, 4] and the place [T, 3] of the frame in which a joint moves, in the file's unit."""
    chain: list[int] = []
    while (joint := placed.skeleton.parents[joint]) >= 0:
        chain.insert(0, joint)
    count = len(placed.rotations)
    turned, place = np.tile(rot.IDENTITY, (count, 1)), np.zeros((count, 3))
    for one in chain:
        place = place + rot.mul_vec(turned, placed.place(one))
        turned = rot.mul(turned, placed.rotations[:, one])
    return turned, place


def _angles(order: str, values: Floats, changed: Indices, local: Floats, small: Bools) -> Floats:
    """Return the values of a joint's rotation channels [T, channels], degrees, with some rotations changed.

    Args:
        order: the axes of the channels.
        values: their values in the file [T, channels].
        changed: the changed frames [M].
        local: the rotations there [M, 4].
        small: whether each differs little from the file's [M].
    """
    out, width = values.copy(), len(order)
    whole = order + "".join(axis for axis in "XYZ" if axis not in order)
    angles, near = rot.to_euler(whole, local), np.zeros((len(changed), 3))
    near[:, :width] = np.radians(values[changed])
    found = np.round(np.degrees(nearest_angles(angles, near, whole)), 6)
    out[changed] = found[:, :width]
    for at in np.flatnonzero(~small):
        near_before = np.zeros(3)
        near_before[:width] = np.radians(out[max(changed[at] - 1, 0)])
        out[changed[at]] = np.round(np.degrees(nearest_angles(angles[at], near_before, whole)), 6)[:width]
    return out


def _lines(file: BvhFile, values: Floats, motion: Motion, scale: float) -> Iterator[str]:
    """Yield the lines of the file, with `scale` units per metre."""
    is_angle = [channel.endswith("ROTATION") for joint in file.joints for channel in joint.channels]
    formats = ["%.6f" if angle else f"%.{length_digits(scale)}f" for angle in is_angle]
    yield from [*file.hierarchy, "MOTION", f"Frames: {len(values)}", f"Frame Time: {even_step(motion, 'BVH'):.12g}"]
    is_regular = len(file.rows) == len(values)  # else frames wrap over lines
    for frame, (row, inserted) in enumerate(zip(values, motion.inserted(), strict=True)):
        words = file.rows[frame][1].split() if is_regular else [f"{value:.12g}" for value in file.values[frame]]
        for column in np.flatnonzero(row != file.values[frame]):
            words[column] = formats[column] % (row[column] + 0.0)
        yield " ".join(words) + (INSERTED_LINE_END if inserted else "")
