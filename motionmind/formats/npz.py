"""Reads and writes AMASS's `.npz`: movement on SMPL's joints, the usual form in human movement data sets and models.

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
import math
import warnings
import zipfile
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_FPS, MAX_POSITIONS
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.files import FilePath, name_of, read_bytes, write_atomically
from motionmind.formats._clock import even_step
from motionmind.formats._smpl import smpl_bodies, to_smpl
from motionmind.formats._smpl_parts import ARRAY_NAMES, gather_poses
from motionmind.formats.text import MAX_NUMBER
from motionmind.formats.units import metres_per_unit
from motionmind.geometry import rotations as rot
from motionmind.retarget.vertical import Z_UP_TO_Y_UP, find_vertical

_RATE_NAMES = ("mocap_framerate", "mocap_frame_rate", "fps", "frame_rate", "framerate")

# Two hours at 120 frames per second. A compressed array that claims more is meant to exhaust memory.
_MAX_ARRAY_BYTES = 2**30

_log = logging.getLogger(__name__)


def read_npz(
    path: FilePath, *, fps: float | None = None, up: str | None = None, unit: str | float | None = None
) -> Motion:
    """Read a motion from an AMASS file, on SMPL's joints, placed as in human44.

    `to_human23` maps these joints; `write_npz` restores the same orientations and places. A log entry warns that the
    body's shape is not read (logger "motionmind.formats.npz", level INFO).

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames per second in place of the file's.
        up: "y" or "z", the vertical in the file; None takes z, unless the movement stands along y.
        unit: of the body's place, a name in `UNITS`, or metres in one unit; None takes metres.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, or is not an AMASS file; the message names the array.

    Warns:
        MotionMindWarning: it is doubtful which axis is up, or the body is far above or below 0.
    """
    arrays = _read_arrays(path)
    poses, trans = gather_poses(arrays, path)
    skeleton = next(body for body in smpl_bodies().values() if poses.shape[1:] == (3 * len(body),))
    trans = trans * (1.0 if unit is None else metres_per_unit(unit))
    rate = _rate(arrays, fps, path)
    _log.info("%s: joints stand where human44's do; the file's body shape (betas) is not read", path)
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
    return Motion(skeleton, rot.normalise(rotations), trans, times, name=name_of(path))


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
    name = ""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            members = file.zip.NameToInfo
            whole = "poses" in file  # AMASS's SMPL-X has its parts, too
            for name in (*(("poses", "trans") if whole else ARRAY_NAMES), *_RATE_NAMES):
                if name in file:
                    _check_claim(file.zip, members.get(name) or members[f"{name}.npy"], name, len(data), path)
                    found[name] = checked_numbers(file[name], repr(name), path)
    except FormatError:
        raise
    except Exception as error:  # zipfile's, zlib's, lzma's, numpy's and its parser's errors, two dozen classes
        what = f"{name!r} cannot be read" if name else "cannot be read"
        raise FormatError(f"{what}: {in_one_line(error)}", path=path) from error
    return found


def _check_claim(archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str, size: int, path: FilePath) -> None:
    """Raise FormatError before unpacking if an array claims too much for a file of `size` bytes.

    Unpacking never exceeds the claim: zipfile ends a member at its size, numpy an array at its shape.
    """
    with archive.open(member) as stream:
        check_array(stream, size, repr(name), path)
    if member.file_size > 2 * _max_array_bytes(size):
        raise FormatError(f"{name!r} is too large to be movement", path=path)


def check_array(stream: IO[bytes], size: int, what: str, path: FilePath) -> None:
    """Raise FormatError if an array's header claims too much for a file of `size` bytes."""
    version = np.lib.format.read_magic(stream)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, _ = read_header(stream)
    if 8 * math.prod(shape) > _max_array_bytes(size):
        raise FormatError(f"{what} is too large to be movement: {list(shape)}", path=path)


def _max_array_bytes(size: int) -> int:
    """Return the bytes allowed for an array: twice the file's `size` or the largest motion's, up to a limit."""
    return min(max(24 * MAX_POSITIONS, 2 * size), _MAX_ARRAY_BYTES)


def checked_numbers(array: NDArray[np.generic], what: str, path: FilePath) -> Floats:
    """Return the array as floats; FormatError names an element that is not a number in range."""
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise FormatError(f"{what} holds no numbers", path=path)
    numbers = array.astype(np.float64, copy=False)
    bad = np.argwhere(~(np.abs(numbers) <= MAX_NUMBER))  # NaN too
    if len(bad):
        value = numbers[tuple(bad[0])]
        raise FormatError(f"{what}{bad[0].tolist()} is {value:g}, not a place or an angle", path=path)
    return numbers


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
    rate = arrays.get(name, np.array(fps, dtype=np.float64))
    if rate.size != 1 or not 1.0 / MAX_NUMBER <= rate.item() <= MAX_FPS:
        raise FormatError(f"{name!r} must be one number of frames per second, not {in_one_line(rate)}", path=path)
    return float(rate.item())


def in_one_line(what: object) -> str:
    """Return an error's text, or an array's numbers, in one line of at most 200 characters."""
    return " ".join(str(what).split())[:200] or type(what).__name__
