"""AMASS's `.npz`, in and out: movement on the joints of SMPL, as data sets and models of human movement keep it.

Mahmood, Ghorbani, Troje, Pons-Moll and Black, "AMASS: Archive of Motion Capture as Surface Shapes", ICCV (2019). A file
holds numpy's arrays; those of movement are

    poses            [T, 3 J]  rotation vectors (axis times angle) in radians, joint after joint, each against its
                               parent. J is 22 (the body), 24 (SMPL), 52 (SMPL+H, AMASS's own) or 55 (SMPL-X)
    trans            [T, 3]    where the body is, metres
    mocap_framerate  []        frames a second; mocap_frame_rate in the files of SMPL-X

The world has z up. At rest SMPL stands in a T-pose, y up, facing +z, and all its joints' axes are the world's, as
human23's are. So orientations are taken over as they are, and the root's alone is turned upright.

Where SMPL's joints stand in the body is not in the file: it follows from `betas` and `gender` by the body model, whose
licence does not let us bring it along. Files are read onto joints that stand where those of human44 do, so soles may
be some centimetres off the floor; `betas` and `gender` are not read, and what is written has those of SMPL's mean
body. `trans` is where the pelvis is, but for a constant of the body model (about 3 cm in height), which is left out
both ways.
"""

from __future__ import annotations

import io
import logging
import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats
from motionmind.body.human import human44
from motionmind.body.motion import FASTEST, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, read_bytes, write_atomically
from motionmind.formats._clock import even_step
from motionmind.formats.text import LARGEST
from motionmind.geometry import rotations as rot
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23

_RATES = ("mocap_framerate", "mocap_frame_rate")

# An hour at 120 frames a second is half of it; what says that it is more, packed, is made to fill the memory.
_LARGEST_ARRAY = 2**30  # bytes

# From a world with z up to ours, and the axes in which a body that faces -y there faces +z here.
_UPRIGHT = rot.from_axis_angle([1.0, 0.0, 0.0], -np.pi / 2)

_log = logging.getLogger(__name__)


def read_npz(path: FilePath, *, fps: float | None = None) -> Motion:
    """Movement from an AMASS file, on SMPL's own joints by SMPL's names, at human44's places.

    `to_human23` knows these joints; written again (`write_npz`), they give the same orientations and places. That the
    body's shape is not read is logged (logger "motionmind.formats.npz", level INFO).

    Args:
        path: the file; its stem becomes the motion's name.
        fps: frames a second where the file does not say.

    Raises:
        FormatError: the file is not there, or is no AMASS file; the message names the array.
    """
    arrays = _read_arrays(path)
    for needed in ("poses", "trans"):
        if needed not in arrays:
            raise FormatError(f"no array {needed!r}: it is no movement as AMASS writes it", path=path)
    poses, trans = arrays["poses"], arrays["trans"]
    skeleton = next((body for body in smpl_bodies().values() if poses.shape[1:] == (3 * len(body),)), None)
    if skeleton is None or not len(poses):
        sizes = ", ".join(str(3 * len(body)) for body in smpl_bodies().values())
        raise FormatError(f"'poses' has the shape {list(poses.shape)}, not frames by one of {sizes}", path=path)
    if trans.shape != (len(poses), 3):
        raise FormatError(f"'trans' has the shape {list(trans.shape)}, not [{len(poses)}, 3] as 'poses' has", path=path)
    rate = _rate(arrays, fps, path)
    _log.info("%s: joints stand where human44's do; the file's body shape (betas) is not read", path)
    rotations = rot.exp(poses.reshape(len(poses), -1, 3))
    rotations[:, 0] = rot.mul(_UPRIGHT, rotations[:, 0])
    times = np.arange(len(poses), dtype=np.float64) / rate
    return Motion(skeleton, rot.normalise(rotations), rot.mul_vec(_UPRIGHT, trans), times, name=Path(path).stem)


def write_npz(path: FilePath, motion: Motion) -> None:
    """Write `motion` as an AMASS file, uncompressed: on the joints of SMPL that it is on already, else of SMPL+H.

    From human44 SMPL+H takes rows of the spine as one joint or two, and its four fingers move as one; any other body
    is brought onto human23 first. Joints that nothing maps to stay at rest. Read back, orientations agree to 1e-6 rad
    and the pelvis's places to 1e-9 m. The same motion gives the same bytes.

    Raises:
        MotionMindError: the skeleton does not map to human23, the times are not even (`motion.resample` makes them
            so), or the file cannot be written.
    """
    step = even_step(motion, "AMASS")
    if 1.0 / step > FASTEST:
        raise MotionMindError(f"{path}: {1.0 / step:g} frames a second are more than {FASTEST:g}")
    body, rotations, root = _on_smpl(motion)
    rotations[:, 0] = rot.inv_mul(_UPRIGHT, rotations[:, 0])
    arrays: dict[str, Any] = {
        "trans": rot.mul_vec(rot.inv(_UPRIGHT), root),
        "gender": np.array("neutral"),
        _RATES[body.name == "SMPL-X"]: np.array(round(1.0 / step, 9)),
        "betas": np.zeros(16),
        "dmpls": np.zeros((len(motion), 8)),  # how soft tissue swings, which AMASS's files have beside the poses
        "poses": rot.log(rotations).reshape(len(motion), -1),
    }
    file = io.BytesIO()
    np.savez(file, **arrays)  # dates its members 1980, whenever it is called
    write_atomically(path, file.getvalue())


def joints_without_place(motion: Motion) -> list[str]:
    """The joints that turn in `motion` and that none of SMPL's stands for or turns with."""
    skeleton = motion.skeleton
    if _own_body(skeleton):
        return []
    if human44().difference(skeleton) is None:
        kept = {*_STANDS.values(), *_TURNS.values(), *smpl_bodies()["SMPL+H"].names}
    else:
        kept = set(joint_mapping(skeleton) or skeleton.names)
    turned = rot.angle(motion.rotations, rot.IDENTITY).max(axis=0) > 1e-6
    return [name for name, turns in zip(skeleton.names, turned, strict=True) if turns and name not in kept]


# --- in -------------------------------------------------------------------------------------------------------------


def _read_arrays(path: FilePath) -> dict[str, Floats]:
    """The arrays of movement that the file has, all finite numbers; nothing else of it is unpacked."""
    found: dict[str, Floats] = {}
    data = read_bytes(path)
    if not data.startswith(b"PK"):
        raise FormatError("no .npz file, which is a zip of numpy's arrays", path=path)
    name = ""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            members = file.zip.infolist()
            for name in ("poses", "trans", *_RATES):
                # What a member says of its size is all that is unpacked of it.
                if any(member.file_size > _LARGEST_ARRAY for member in members if Path(member.filename).stem == name):
                    raise FormatError(f"{name!r} is larger than movement is", path=path)
                if name in file:
                    found[name] = _numbers(file[name], name, path)
    except FormatError:
        raise
    except Exception as error:  # zipfile's, zlib's, lzma's, numpy's and its parser's errors, two dozen classes
        what = f"{name!r} cannot be read" if name else "cannot be read"
        raise FormatError(f"{what}: {_line(error)}", path=path) from error
    return found


def _numbers(array: NDArray[np.generic], name: str, path: FilePath) -> Floats:
    """The array as floats; FormatError says which element is no number."""
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "fiu":
        raise FormatError(f"{name!r} holds no numbers", path=path)
    if array.size * 8 > _LARGEST_ARRAY:
        raise FormatError(f"{name!r} is larger than movement is", path=path)
    numbers = array.astype(np.float64)
    bad = np.argwhere(~(np.abs(numbers) <= LARGEST))  # NaN too
    if len(bad):
        raise FormatError(f"{name!r}{bad[0].tolist()} is {numbers[tuple(bad[0])]:g}, no place or angle", path=path)
    return numbers


def _rate(arrays: dict[str, Floats], fps: float | None, path: FilePath) -> float:
    """Frames a second that the file says, or else `fps`."""
    name = next((name for name in _RATES if name in arrays), "fps")
    said = arrays.get(name, np.array(math.nan if fps is None else fps))
    if name == "fps" and fps is None:
        raise FormatError(f"no array {_RATES[0]!r}: say how many frames a second there are", path=path)
    if said.size != 1 or not 0.0 < said.item() <= FASTEST:
        raise FormatError(f"{name!r} must be one number of frames a second, not {_line(said)}", path=path)
    return float(said.item())


def _line(what: object) -> str:
    """An error's words, or an array's numbers, in one line that is not too long."""
    return " ".join(str(what).split())[:200] or type(what).__name__


# --- the bodies -----------------------------------------------------------------------------------------------------

# SMPL's tree: Loper, Mahmood, Romero, Pons-Moll and Black, "SMPL: A Skinned Multi-Person Linear Model", ACM Trans.
# Graph. 34:6 (2015); SMPL+H: Romero, Tzionas and Black, "Embodied Hands", ACM Trans. Graph. 36:6 (2017); SMPL-X:
# Pavlakos et al., "Expressive Body Capture", CVPR (2019). The names are those of the models' published code.
_Rows = tuple[tuple[str, str], ...]  # a joint, and the joint that it hangs from

_SIDES = ("left", "right")
_FINGERS = ("index", "middle", "pinky", "ring", "thumb")

_BODY: _Rows = (
    ("pelvis", ""),
    *((f"{side}_hip", "pelvis") for side in _SIDES),
    ("spine1", "pelvis"),
    *((f"{side}_knee", f"{side}_hip") for side in _SIDES),
    ("spine2", "spine1"),
    *((f"{side}_ankle", f"{side}_knee") for side in _SIDES),
    ("spine3", "spine2"),
    *((f"{side}_foot", f"{side}_ankle") for side in _SIDES),
    ("neck", "spine3"),
    *((f"{side}_collar", "spine3") for side in _SIDES),
    ("head", "neck"),
    *((f"{side}_shoulder", f"{side}_collar") for side in _SIDES),
    *((f"{side}_elbow", f"{side}_shoulder") for side in _SIDES),
    *((f"{side}_wrist", f"{side}_elbow") for side in _SIDES),
)
_MITTENS: _Rows = tuple((f"{side}_hand", f"{side}_wrist") for side in _SIDES)
_FACE: _Rows = tuple((joint, "head") for joint in ("jaw", "left_eye_smplhf", "right_eye_smplhf"))
_HANDS: _Rows = tuple(
    (f"{side}_{finger}{row}", f"{side}_{finger}{row - 1}" if row > 1 else f"{side}_wrist")
    for side in _SIDES
    for finger in _FINGERS
    for row in (1, 2, 3)
)

# Which joint of human44 stands for one of SMPL's, where the names differ. SMPL's spine2 is about as high above the
# pelvis as human44's thorax, its spine3 as thorax_middle.
_STANDS = {
    "spine1": "lumbar",
    "spine2": "thorax",
    "spine3": "thorax_middle",
    "neck": "cervical",
    "head": "atlantal",
    **{f"{side}_collar": f"{side}_clavicle" for side in _SIDES},
    **{f"{side}_foot": f"{side}_toes" for side in _SIDES},
    **{f"{side}_hand": f"{side}_fingers" for side in _SIDES},
    **{
        f"{side}_{finger}{row}": f"{side}_{'thumb' if finger == 'thumb' else 'fingers'}{joint}"
        for side in _SIDES
        for finger in _FINGERS
        for row, joint in enumerate(("", "_middle", "_end"), start=1)
    },
}
# With which it turns, where that is another: the end of a row.
_TURNS = {"spine1": "lumbar_upper", "spine3": "thorax_upper", "neck": "cervical_upper"}

# Metres from human44's fingers, which stand for four, to each of them: a hand is about 84 mm broad (Buryanov and
# Kotiuk, as for human44). Where jaw and eyes are in the head is a guess.
_ASIDE = {
    "jaw": (0.0, 0.02, 0.02),
    "left_eye_smplhf": (0.03, 0.08, 0.08),
    "right_eye_smplhf": (-0.03, 0.08, 0.08),
    **{
        f"{side}_{finger}{row}": (0.0, 0.0, ahead)
        for side in _SIDES
        for finger, ahead in (("index", 0.021), ("ring", -0.021), ("pinky", -0.042))
        for row in (1, 2, 3)
    },
}


@cache
def smpl_bodies() -> dict[str, Skeleton]:
    """SMPL's trees by their names, from the smallest to the largest."""
    trees = {
        "SMPL body": _BODY,
        "SMPL": _BODY + _MITTENS,
        "SMPL+H": _BODY + _HANDS,
        "SMPL-X": _BODY + _FACE + _HANDS,
    }
    return {name: _body(name, rows) for name, rows in trees.items()}


def _body(name: str, rows: _Rows) -> Skeleton:
    model = human44()
    places = model.positions(np.tile(rot.IDENTITY, (len(model), 1)), np.zeros(3))
    joints, parents = [joint for joint, _ in rows], [parent for _, parent in rows]
    stands = [model.index(_STANDS.get(joint, "atlantal" if parent == "head" else joint)) for joint, parent in rows]
    rest = places[stands] + [_ASIDE.get(joint, (0.0, 0.0, 0.0)) for joint in joints]
    tips = np.zeros((len(rows), 3))
    for i, joint in enumerate(joints):
        if joint == "head" or not (joint in parents or parents[i] == "head"):
            end = stands[i]
            while below := model.children(end):  # of a wrist's, the fingers come before the thumb
                end = below[0]
            tips[i] = places[end] + model.tips[end] - places[stands[i]]
    above = [joints.index(parent) if parent else -1 for parent in parents]
    offsets = rest - rest[above]
    offsets[0] = 0.0
    return Skeleton(name, tuple(joints), tuple(above), offsets, tips)


def _on_smpl(motion: Motion) -> tuple[Skeleton, Floats, Floats]:
    """One of SMPL's bodies, its joints' rotations [T, J, 4], and the pelvis's places [T, 3], in our world."""
    own = _own_body(motion.skeleton)
    if own:
        return own, motion.rotations.copy(), motion.root
    if human44().difference(motion.skeleton) is not None:
        motion = to_human23(motion)
    body = smpl_bodies()["SMPL+H"]
    given = motion.skeleton.global_rotations(motion.rotations)
    turned = np.empty((len(motion), len(body), 4))
    for i, (joint, parent) in enumerate(zip(body.names, body.parents, strict=True)):
        source = _source(joint, motion.skeleton)
        turned[:, i] = turned[:, parent] if source is None else given[:, motion.skeleton.index(source)]
    return body, body.local_rotations(turned), motion.root


def _own_body(skeleton: Skeleton) -> Skeleton | None:
    return next((body for body in smpl_bodies().values() if body.difference(skeleton) is None), None)


def _source(joint: str, skeleton: Skeleton) -> str | None:
    """The joint of human23 or human44 with which one of SMPL's turns; None for none, as for a jaw."""
    choices = (_TURNS.get(joint), _STANDS.get(joint, joint))
    return next((name for name in choices if name in skeleton.names), None)
