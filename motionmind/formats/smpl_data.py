"""Reads movement on SMPL's joints from data sets and models: AIST++'s `.pkl`, GVHMR's `.pt`, and three kinds of `.npy`.

R. Li, S. Yang, D. Ross and A. Kanazawa, "AI Choreographer: Music Conditioned 3D Dance Generation with AIST++", ICCV
(2021): a pickle (`_unpickle`) of `smpl_poses` [T, 72], rotation vectors of SMPL's 24 joints, `smpl_trans` [T, 3] and
`smpl_scaling` [1], the length of a metre; 60 frames a second.

R. Li et al., "FineDance: A Fine-grained Choreography Dataset for 3D Full Body Dance Generation", ICCV (2023).
An array of frames, 30 a second: a place, then the rotations of SMPL+H's 52 joints, by the first two rows of their
matrices [T, 3 + 312]. Its code also writes four marks of contact in front [T, 319], the body's 22 joints [T, 135], and
rotation vectors of 52 joints [T, 159] or of SMPL-X's 55 [T, 168].

Guo et al., "Generating Diverse and Natural 3D Human Motions from Text", CVPR (2022): HumanML3D. The places of joints
[T, 22, 3], metres, 20 frames a second; rotations are fitted to them (`_joint_places`).

Tevet et al., "Human Motion Diffusion Model", ICLR (2023): MDM's `results.npy`, a pickle of samples in HumanML3D's form:
`motion` [N, 22, 3, T] and their `lengths` [N].

Shen et al., "World-Grounded Human Motion Recovery via Gravity-View Coordinates", SIGGRAPH Asia (2024): GVHMR's
`hmr4d_results.pt`, a file of PyTorch (`_torch`) with `smpl_params_global` on SMPL-X's 22 joints: `global_orient`
[T, 3], `body_pose` [T, 63] and `transl` [T, 3], of a film that it takes at 30 frames a second.

All worlds are y up. As in `npz`, joints have human44's places in files without lengths of bones. The place in files
with rotations is that of the body model's origin, about 0.24 m above the pelvis in SMPL and 0.35 m in SMPL-X.
"""

from __future__ import annotations

import io
import logging
import re
import warnings
from collections.abc import Iterator

import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.body.noticeable import NOTICEABLE_SPAN_SHARE
from motionmind.body.rates import MAX_FPS
from motionmind.body.skeleton import Skeleton
from motionmind.display import displayed_path
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning, quoted
from motionmind.files import FilePath, name_of, read_bytes
from motionmind.formats._joint_places import fit_joints
from motionmind.formats._npy import checked_numbers, read_array
from motionmind.formats._smpl import smpl_bodies
from motionmind.formats._smpl_parts import gather_poses
from motionmind.formats._torch import read_torch
from motionmind.formats._unpickle import Recorded, to_array, unpickle
from motionmind.formats.npz import in_one_line, max_array_bytes
from motionmind.formats.units import bone_span
from motionmind.geometry import rotations as rot

# {columns: (columns before the place, numbers of a rotation, body)}.
_FINEDANCE_LAYOUTS = {
    315: (0, 6, "SMPL+H"),
    319: (4, 6, "SMPL+H"),
    135: (0, 6, "SMPL body"),
    159: (0, 3, "SMPL+H"),
    168: (0, 3, "SMPL-X"),
}

_GVHMR_PARAMS = "smpl_params_global"
_NOT_GVHMR = (
    "of PyTorch's files only GVHMR's results are read: load it there, and save its poses in AMASS's form (.npz)"
)
_PLACES = ((22, 3), (24, 3))  # joints of SMPL's bodies, by 3
_OBJECT = re.compile(rb"\x93NUMPY[\1-\3]\0.{2,4}\{'descr': '\|O', [^}]*'shape': \(\)", re.DOTALL)

_log = logging.getLogger(__name__)


def read_aist(path: FilePath, *, fps: float | None = None) -> Motion:
    """Read a motion from AIST++'s `.pkl`, on SMPL's joints, without running any code in the file.

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames per second; None takes 60.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, or its content is invalid; the message says how.
    """
    data = read_bytes(path)
    try:
        held = unpickle(data)
    except Exception as error:  # of the machine's, two dozen classes
        raise FormatError(f"not AIST++'s pickle of arrays: {in_one_line(error)}", path=path) from error
    if not isinstance(held, dict) or not {"smpl_poses", "smpl_trans"} <= held.keys():
        raise FormatError("no 'smpl_poses' and 'smpl_trans': not movement in AIST++'s form", path=path)
    poses, trans, scaling = (
        _array(held.get(name, 1.0), name, path) for name in ("smpl_poses", "smpl_trans", "smpl_scaling")
    )
    body = smpl_bodies()["SMPL"]
    if poses.ndim < 2 or not len(poses) or poses.size != len(poses) * 3 * len(body):
        raise FormatError(f"'smpl_poses' has the shape {list(poses.shape)}, not frames by {3 * len(body)}", path=path)
    if trans.shape != (len(poses), 3):
        raise FormatError(f"'smpl_trans' has the shape {list(trans.shape)}, not [{len(poses)}, 3]", path=path)
    if scaling.size != 1 or not 1e-6 < scaling.item() < 1e6:
        raise FormatError("'smpl_scaling' must be one number above 0", path=path)
    turns = rot.exp(poses.reshape(len(poses), -1, 3))
    return _motion(path, body, turns, trans / scaling.item(), 60.0 if fps is None else fps, pelvis_m=-0.24)


def read_gvhmr(path: FilePath, *, fps: float | None = None) -> Motion:
    """Read a motion from GVHMR's `.pt`, on SMPL's 22 joints, without PyTorch and without running any code in the file.

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames per second; None takes 30.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, is not GVHMR's, or its content is invalid; the message says how.
    """
    data = read_bytes(path)
    try:
        file = read_torch(data)
    except Exception as error:  # of zipfile and the machine, two dozen classes
        raise FormatError(f"{_NOT_GVHMR} ({in_one_line(error)})", path=path) from error
    params = file.held.get(_GVHMR_PARAMS) if isinstance(file.held, dict) else None
    if not isinstance(params, dict):
        raise FormatError(f"{_NOT_GVHMR} (no {_GVHMR_PARAMS!r})", path=path)
    arrays: dict[str, Floats] = {}
    for name in ("global_orient", "body_pose", "transl"):
        try:
            arrays[name] = checked_numbers(file.tensor(params.get(name), max_array_bytes(len(data))), repr(name), path)
        except Exception as error:  # of zipfile too
            if isinstance(error, FormatError):
                raise
            raise FormatError(f"{name!r} cannot be read: {in_one_line(error)}", path=path) from error
    poses, trans = gather_poses(arrays, path)
    body = next(one for one in smpl_bodies().values() if poses.shape[1:] == (3 * len(one),))
    turns = rot.exp(poses.reshape(len(poses), -1, 3))
    return _motion(path, body, turns, trans, 30.0 if fps is None else fps, pelvis_m=-0.35)


def read_npy(path: FilePath, *, fps: float | None = None, clip: str | None = None) -> Motion:
    """Read a motion from a `.npy` of FineDance, HumanML3D or MDM, on SMPL's joints, without running any code in it.

    A log entry says what the fit of rotations to places leaves open (logger "motionmind.formats.smpl_data", level
    INFO), and which of several samples is read.

    Args:
        path: the file; its stem becomes the motion's name, and "stem#clip" with a clip.
        fps: frames per second; None takes 30 for FineDance, and 20 for places of joints.
        clip: the number of one of MDM's samples, from 1; None for the first.

    Returns:
        The motion, in metres and seconds, y up.

    Raises:
        FormatError: the file does not exist, or its content is invalid; the message says how.

    Warns:
        MotionMindWarning: lengths of bones vary, so that joints are noticeably off their places.
    """
    data = read_bytes(path)
    if _OBJECT.match(data):
        samples = _mdm_samples(data, path)
        number = 1 if clip is None else int(clip) if re.fullmatch(r"[1-9][0-9]{0,8}", clip) else 0
        if not 1 <= number <= len(samples):
            raise FormatError(f"no sample {quoted(clip or '')}; it has {len(samples)}, from 1", path=path)
        if clip is None and len(samples) > 1:
            _log.info("%s: the first of %d samples is read", displayed_path(path), len(samples))
        return _from_places(samples[number - 1], path, fps, "" if clip is None else f"#{number}")
    if clip is not None:
        raise FormatError(f"no sample {quoted(clip)}; it holds one movement", path=path)
    frames = read_array(io.BytesIO(data), max_array_bytes(len(data)), "the array", path)
    if frames.ndim == 3 and frames.shape[1:] in _PLACES and len(frames):
        return _from_places(frames, path, fps)
    return _from_finedance(frames, path, fps)


def read_npy_clips(path: FilePath, *, fps: float | None = None) -> Iterator[Motion]:
    """Read all samples of a `.npy`, as `read_npy` reads one.

    If there are several, each has a name of the form "stem#clip".
    """
    data = read_bytes(path)
    samples = _mdm_samples(data, path) if _OBJECT.match(data) else []
    if len(samples) < 2:
        yield read_npy(path, fps=fps)
        return
    for number, places in enumerate(samples, 1):
        yield _from_places(places, path, fps, f"#{number}")


def _mdm_samples(data: bytes, path: FilePath) -> list[Floats]:
    """Return the samples in MDM's results, places [T, 22, 3] each."""
    start = 10 if data[6] == 1 else 12
    try:
        held = unpickle(data[start + int.from_bytes(data[8:start], "little") :])
        results = held.state[4][0] if isinstance(held, Recorded) else None
    except Exception as error:  # of the machine's, two dozen classes
        raise FormatError(f"not MDM's pickle of arrays: {in_one_line(error)}", path=path) from error
    if not isinstance(results, dict) or "motion" not in results:
        raise FormatError("no 'motion': not MDM's results", path=path)
    motion = _array(results["motion"], "motion", path)
    if motion.ndim != 4 or motion.shape[1:3] not in _PLACES or not motion.size:
        raise FormatError(f"'motion' has the shape {list(motion.shape)}, not samples by 22 by 3 by frames", path=path)
    count, most = len(motion), motion.shape[3]
    lengths = _array(results["lengths"], "lengths", path) if "lengths" in results else np.full(count, float(most))
    if lengths.shape != (count,) or not np.all((lengths >= 1.0) & (lengths <= most) & (lengths % 1.0 == 0.0)):
        raise FormatError(f"'lengths' must be {count} numbers of frames, from 1 to {most}", path=path)
    return [sample[..., : int(length)].transpose(2, 0, 1) for sample, length in zip(motion, lengths, strict=True)]


def _from_places(places: Floats, path: FilePath, fps: float | None, clip: str = "") -> Motion:
    """Build the motion from places of joints [T, J, 3], with rotations fitted to them."""
    rate = _checked_rate(20.0 if fps is None else fps)
    try:
        body, rotations, reached = fit_joints(places, rate)
    except ValueError as error:
        raise FormatError(f"places of joints that are no body: {error}", path=path) from error
    off = rot.norm(reached - places)
    text = "%s: rotations are fitted to places (joints within %.1f mm), which do not show how head and hands turn"
    _log.info(text, displayed_path(f"{path}{clip}"), 1000.0 * off.max())
    if off.max() > NOTICEABLE_SPAN_SHARE * bone_span(np.array(body.parents), body.offsets, body.tips):
        frame, joint = np.unravel_index(int(off.argmax()), off.shape)
        message = (
            f"{path}{clip}: lengths of bones vary: {body.names[joint]} is {1000.0 * off.max():.0f} mm off its place in "
            f"frame {frame}"
        )
        warnings.warn(message, MotionMindWarning, stacklevel=3)
    times = np.arange(len(places), dtype=np.float64) / rate
    return Motion(body, rot.normalise(rotations), places[:, 0], times, name=f"{name_of(path)}{clip}", rate=rate)


def _from_finedance(frames: Floats, path: FilePath, fps: float | None) -> Motion:
    """Build the motion from FineDance's array."""
    frames = frames[0] if frames.ndim == 3 and len(frames) == 1 else frames
    if frames.ndim != 2 or frames.shape[1] not in _FINEDANCE_LAYOUTS or not len(frames):
        sizes = ", ".join(str(size) for size in _FINEDANCE_LAYOUTS)
        fault = f"an array of the shape {list(frames.shape)}, not frames by one of {sizes}, or by 22 joints by 3"
        if frames.ndim == 2 and frames.shape[1] == 263:
            fault += "; 263 are HumanML3D's features: give its joints instead (new_joints, not new_joint_vecs)"
        raise FormatError(fault, path=path)
    before, width, name = _FINEDANCE_LAYOUTS[frames.shape[1]]
    body = smpl_bodies()[name]
    trans, values = frames[:, before : before + 3], frames[:, before + 3 :].reshape(len(frames), -1, width)
    try:
        turns = rot.exp(values) if width == 3 else _from_rows(values)
    except ValueError as error:
        raise FormatError(f"the rows of a rotation's matrix are zero or parallel: {error}", path=path) from error
    return _motion(path, body, turns, trans, 30.0 if fps is None else fps, pelvis_m=-0.35)


def _array(value: object, name: str, path: FilePath) -> Floats:
    """Return a pickle's array of numbers; FormatError if the value is not one."""
    try:
        return checked_numbers(to_array(value), f"'{name}'", path)
    except (ValueError, TypeError, OverflowError) as error:
        raise FormatError(f"{name!r}: {in_one_line(error)}", path=path) from error


def _from_rows(rows: Floats) -> Floats:
    """Return rotations [..., 4] from the first two rows of their matrices [..., 6], made orthonormal in order.

    Source: Zhou et al., "On the continuity of rotation representations in neural networks", CVPR (2019).
    """
    first, second = rows[..., :3], rows[..., 3:]
    with np.errstate(invalid="ignore", divide="ignore"):
        one = first / np.linalg.norm(first, axis=-1, keepdims=True)
        two = second - np.sum(one * second, axis=-1, keepdims=True) * one
        two /= np.linalg.norm(two, axis=-1, keepdims=True)
    if not np.isfinite(two).all():
        raise ValueError("not a rotation")
    return rot.from_matrix(np.stack([one, two, np.cross(one, two)], axis=-2))


def _motion(path: FilePath, body: Skeleton, turns: Floats, trans: Floats, rate: float, *, pelvis_m: float) -> Motion:
    """Build the motion from rotations [T, J, 4], places of the model's origin [T, 3] and the pelvis's height there."""
    _log.info("%s: the file has no lengths of bones; joints have human44's places", displayed_path(path))
    times = np.arange(len(turns), dtype=np.float64) / _checked_rate(rate)
    return Motion(
        body, rot.normalise(turns), trans + np.array([0.0, pelvis_m, 0.0]), times, name=name_of(path), rate=rate
    )


def _checked_rate(rate: float) -> float:
    """Return the frames per second; MotionMindError if there are too many or none."""
    if not 0.0 < rate <= MAX_FPS:
        raise MotionMindError(f"fps must be a positive number of frames a second, {MAX_FPS:g} at most, not {rate}")
    return rate
