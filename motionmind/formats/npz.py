"""Reads and writes AMASS's `.npz`: movement on SMPL's joints, the usual form in human movement data sets and models.

Kimodo's `.npz` is read, too (`motionmind.formats._kimodo`).

Mahmood, Ghorbani, Troje, Pons-Moll and Black, "AMASS: Archive of Motion Capture as Surface Shapes", ICCV (2019). A file
holds numpy arrays; those of movement are

    poses            [T, 3 J]  rotation vectors (axis times angle) in radians, joint after joint, each against its
                               parent. J is 22 (the body), 24 (SMPL), 52 (SMPL+H, AMASS's own) or 55 (SMPL-X)
    trans            [T, 3]    the body's place, metres
    mocap_framerate  []        frames per second; mocap_frame_rate in SMPL-X files

Files in which poses are in parts (`motionmind.formats._smpl_parts`), or the rate is `fps`, are read too.

The world is z up, or y up in some programs' files, whose people stand along y. At rest SMPL stands in a T-pose, y up,
facing +z, and all its joints' axes are the world's, like human23's. So rotations are copied unchanged, and only the
root's is turned upright.

SMPL's joint positions are not in the file: they follow from `betas` and `gender` by the body model, whose licence
forbids bundling it. Files are read onto joints placed as in human44, so soles may be some centimetres off the floor.
`betas` and `gender` are not read; written files have those of SMPL's mean body. `trans` is the pelvis's place up to a
constant of the body model (about 3 cm in height), which both reading and writing ignore.
"""

from __future__ import annotations

import io
import logging
import warnings
import zipfile
from typing import Any

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS, MAX_POSITIONS
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed_path
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.files import FilePath, name_of, read_bytes, write_atomically
from motionmind.formats._clock import even_step
from motionmind.formats._kimodo import KIMODO_ARRAYS, KIMODO_FPS, from_kimodo
from motionmind.formats._npy import read_array
from motionmind.formats._smpl import smpl_bodies, to_smpl
from motionmind.formats._smpl_parts import ARRAY_NAMES, gather_poses
from motionmind.formats.text import MAX_NUMBER
from motionmind.formats.units import metres_per_unit
from motionmind.geometry import rotations as rot
from motionmind.retarget.vertical import Z_UP_TO_Y_UP, find_vertical

_RATE_NAMES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate")

# Two hours at 120 frames per second. Compressed arrays that claim more are meant to exhaust memory.
_MAX_ARRAY_BYTES = 2**30

_log = logging.getLogger(__name__)


def read_npz(
    path: FilePath, *, fps: float | None = None, up: str | None = None, unit: str | float | None = None
) -> Motion:
    """Read a motion from an AMASS file, on SMPL's joints, placed as in human44; or from Kimodo's, on its own joints.

    `to_human23` maps these joints; `write_npz` restores the same orientations and places. A log entry warns that the
    body's shape is not read (logger "motionmind.formats.npz", level INFO).

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames per second in place of the file's, or of 30 for Kimodo's.
        up: "y" or "z", the vertical in the file; None takes z, unless the movement stands along y, and y for Kimodo's.
        unit: of the body's place, and all lengths of Kimodo's: a name in `UNITS`, or metres in one unit; None takes
            metres.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, or is neither an AMASS file nor Kimodo's; the message names the array.

    Warns:
        MotionMindWarning: it is doubtful which axis is up, the body is far above or below 0, or joints stray.
    """
    arrays = _read_arrays(path)
    if KIMODO_ARRAYS[0] in arrays:
        return _read_kimodo(arrays, path, fps, up, unit)
    poses, trans = gather_poses(arrays, path)
    skeleton = next(body for body in smpl_bodies().values() if poses.shape[1:] == (3 * len(body),))
    trans = trans * (1.0 if unit is None else metres_per_unit(unit))
    rate = _rate(arrays, fps, path)
    _log.info("%s: joints stand where human44's do; the file's body shape (betas) is not read", displayed_path(path))
    vectors = poses.reshape(len(poses), -1, 3)
    if (longest := float(np.median(rot.norm(vectors).max(axis=1)))) > 20.0:  # radians
        raise FormatError(f"'poses' turns by {longest:.3g} radians: are these degrees?", path=path)
    rotations = rot.exp(vectors)
    if (up or _vertical(skeleton, rotations, trans, path)) == "z":
        rotations[:, 0] = rot.mul(Z_UP_TO_Y_UP, rotations[:, 0])
        trans = rot.mul_vec(Z_UP_TO_Y_UP, trans)
    if (height := float(np.median(np.abs(trans[:, 1])))) > 20.0:  # metres
        message = f"{path}: the body is {height:.0f} m off 0; is its place in centimetres (--unit cm)?"
        warnings.warn(message, MotionMindWarning, stacklevel=2)
    times = np.arange(len(poses), dtype=np.float64) / rate
    return Motion(skeleton, rot.normalise(rotations), trans, times, name=name_of(path), rate=rate)


def _read_kimodo(
    arrays: dict[str, Floats], path: FilePath, fps: float | None, up: str | None, unit: str | float | None
) -> Motion:
    """Build the motion from Kimodo's arrays; arguments are those of `read_npz`."""
    scale = 1.0 if unit is None else metres_per_unit(unit)
    skeleton, rotations, root = from_kimodo({**arrays, "posed_joints": scale * arrays["posed_joints"]}, path)
    rate = _rate({_RATE_NAMES[-1]: np.array(KIMODO_FPS), **arrays}, fps, path)
    if up == "z":
        rotations[:, 0], root = rot.mul(Z_UP_TO_Y_UP, rotations[:, 0]), rot.mul_vec(Z_UP_TO_Y_UP, root)
    times = np.arange(len(root), dtype=np.float64) / rate
    return Motion(skeleton, rot.normalise(rotations), root, times, name=name_of(path), rate=rate)


def write_npz(path: FilePath, motion: Motion) -> None:
    """Write `motion` as an uncompressed AMASS file: on its own joints if they are one of SMPL's bodies, else on SMPL+H.

    When human44 becomes SMPL+H, each row of spine joints becomes one or two, and the four fingers move as one. Any
    other body is retargeted to human23 first. Joints that nothing maps to stay at rest. Read back, orientations agree
    to 1e-6 rad and the pelvis's places to 1e-9 m. The same motion gives the same bytes.

    Args:
        path: the file to write.
        motion: the movement, evenly spaced in time.

    Raises:
        MotionMindError: the skeleton does not map to human23, the times are not even (`motion.resample` makes them
            so), or the file cannot be written.
    """
    step = even_step(motion, "AMASS")
    if 1.0 / step > MAX_FPS:
        raise MotionMindError(f"{path}: {1.0 / step:g} frames a second are more than {MAX_FPS:g}")
    body, rotations, root = to_smpl(motion)
    rotations[:, 0] = rot.inv_mul(Z_UP_TO_Y_UP, rotations[:, 0])
    arrays: dict[str, Any] = {
        "trans": rot.mul_vec(rot.inv(Z_UP_TO_Y_UP), root),
        "gender": np.array("neutral"),
        _RATE_NAMES[body.name == "SMPL-X"]: np.array(round(1.0 / step, 9)),
        "betas": np.zeros(16),
        "dmpls": np.zeros((len(motion), 8)),  # soft tissue's dynamics, which AMASS's files have too
        "poses": rot.log(rotations).reshape(len(motion), -1),
    }
    file = io.BytesIO()
    np.savez(file, **arrays)  # dates its members 1980, so bytes do not depend on the clock
    write_atomically(path, file.getvalue())


# --- reading --------------------------------------------------------------------------------------------------------


def _read_arrays(path: FilePath) -> dict[str, Floats]:
    """Read only the file's arrays of movement, checked to be finite numbers."""
    found: dict[str, Floats] = {}
    data = read_bytes(path)
    if not data.startswith(b"PK"):
        raise FormatError("not an .npz file, which is a zip of numpy arrays", path=path)
    name, left = "", max_array_bytes(len(data))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as file:
            members = {member.filename.removesuffix(".npy"): member for member in file.infolist()}
            wholes = (("poses", "trans"), KIMODO_ARRAYS)  # AMASS's SMPL-X has its parts, too
            names = next((whole for whole in wholes if whole[0] in members), ARRAY_NAMES)
            for name in (*names, *_RATE_NAMES):
                if name in members:
                    found[name] = _read_member(file, members[name], left, path)
                    left -= found[name].nbytes
    except FormatError:
        raise
    except Exception as error:  # zipfile's and zlib's errors, a dozen classes
        what = f"{name!r} cannot be read" if name else "cannot be read"
        raise FormatError(f"{what}: {in_one_line(error)}", path=path) from error
    return found


def _read_member(archive: zipfile.ZipFile, member: zipfile.ZipInfo, max_bytes: int, path: FilePath) -> Floats:
    """Read an array from an archive; no more is unpacked than the array may take."""
    name = repr(member.filename.removesuffix(".npy"))
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # others may claim gigabytes to unpack
        raise FormatError(f"{name} cannot be read: compressed otherwise than numpy does", path=path)
    with archive.open(member) as stream:
        return read_array(stream, max_bytes, name, path)


def max_array_bytes(size: int) -> int:
    """Return the bytes allowed for all arrays: twice the file's `size` or the largest motion's, up to a limit."""
    return min(max(24 * MAX_POSITIONS, 2 * size), _MAX_ARRAY_BYTES)


def _vertical(skeleton: Skeleton, rotations: Floats, root: Floats, path: FilePath) -> str:
    """Return the vertical axis, "y" or "z", by rotations [T, J, 4] and places of the root [T, 3], metres."""
    trunk = rot.mul_vec(rotations[:, 0], np.array([0.0, 1.0, 0.0]))
    axis, doubt = find_vertical(
        lambda some: skeleton.positions_and_tips(rotations[some], root[some]),
        trunk,
        usual="z",
        height=skeleton.height,
        is_stated=True,
    )
    if doubt:
        message = f"{path}: taken with {axis} up, which is doubtful: {doubt}"
        warnings.warn(message, MotionMindWarning, stacklevel=4)
    return axis


def _rate(arrays: dict[str, Floats], fps: float | None, path: FilePath) -> float:
    """Return `fps`, or the file's frames per second if it is None."""
    name = "fps" if fps is not None else next((name for name in _RATE_NAMES if name in arrays), None)
    if name is None:
        raise FormatError(f"no array {_RATE_NAMES[0]!r}: give the frames per second (--source-fps, or fps=)", path=path)
    rate = arrays[name] if fps is None else np.array(fps, dtype=np.float64)
    if rate.size != 1 or not 1.0 / MAX_NUMBER <= rate.item() <= MAX_FPS:
        raise FormatError(f"{name!r} must be one number of frames per second, not {in_one_line(rate)}", path=path)
    return float(rate.item())


def in_one_line(what: object) -> str:
    """Return an error's text, or an array's numbers, in one line of at most 200 characters."""
    return " ".join(str(what).split())[:200] or type(what).__name__
