"""File formats, one module each. Readers and writers choose the format by the file name's suffix.

| suffix | read | written |
|---|---|---|
| `.json` | posture or motion | posture or motion |
| `.bvh` | motion | motion, posture as one frame |
| `.amc` | motion, with the `.asf` beside it | |
| `.npz` | motion on SMPL's joints (AMASS), or SOMA's (Kimodo) | motion of people, posture as one frame |
| `.pkl` | motion on SMPL's joints (AIST++) | |
| `.npy` | motion on SMPL's joints (FineDance), or their places (HumanML3D, MDM) | |
| `.pt` | motion on SMPL's joints (GVHMR) | |
| `.txt` | the notation of the papers | the notation of the papers |
| `.glb` | motion, or posture without animation | the same |
| `.gltf`, `.vrm` | as `.glb` | |
| `.vrma` | as `.glb` | motion of people |

Installed packages may add others, each named after its suffix (`MotionReader`, `MotionWriter`). `lossy_fields` names
what a format cannot hold.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from numbers import Real
from pathlib import Path

from motionmind.arguments import check_integer, check_path, check_real, check_type
from motionmind.body.human import SHORTEST_PERSON_M, TALLEST_PERSON_M
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.clip_names import CLIP_SUFFIXES, GLTF_SUFFIXES, split_clip
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.files import FilePath
from motionmind.formats.added import MotionReader, MotionWriter, added_suffixes, read_added, write_added
from motionmind.formats.lossy import WRITABLE, lossy_fields
from motionmind.formats.refused import way_out
from motionmind.retarget.vertical import check_up, to_y_up

__all__ = ["MotionReader", "MotionWriter", "lossy_fields"]

_READABLE = (".json", ".bvh", ".amc", ".txt", ".npz", ".pkl", ".npy", ".pt", *GLTF_SUFFIXES)


def read_motion(
    path: FilePath,
    *,
    unit: str | float | None = None,
    asf: FilePath | None = None,
    fps: float | None = None,
    skeleton: Skeleton | None = None,
    up: str | None = None,
) -> Motion:
    """Read a motion from a file of any readable format; a posture becomes a motion of one frame at time 0.

    Args:
        path: the file; its suffix determines the format. Of a glTF file with several clips, "hero.glb#Walk" is the one
            named so; without a name it is the first that moves, with a warning. "duo.bvh#Hips" is the body with this
            ROOT in a BVH file with several, "results.npy#2" MDM's second sample.
        unit: BVH's unit of length (`read_bvh`); None guesses it from the skeleton. Also glTF's, and that of the body's
            place in `.npz`, if it is not the metre.
            Other formats define their own.
        asf: AMC's skeleton (`read_amc`); None finds it beside the file.
        fps: frames per second: of AMC (default 120), which does not record them, of AIST++, FineDance, GVHMR and
            HumanML3D (default 60, 30, 30 and 20), and of BVH, `.npz` and the papers' notation in place of the file's.
            Frames of JSON and glTF have times of their own.
        skeleton: the body of the papers' notation, which names joints only; None infers it from their names.
        up: "y" or "z", the vertical in the file: with "z" the movement is turned, so that y is up. None leaves it as it
            is, for `to_human23` to find; but of `.npz`, where it takes z, unless people stand along y.

    Returns:
        The motion, in metres and seconds, on the file's own skeleton.

    Raises:
        FormatError: the suffix is unknown, the file does not exist, or its content does not match its suffix.

    Warns:
        MotionMindWarning: something was repaired, or a person is shorter than 0.5 m or taller than 2.6 m.

    >>> import numpy as np
    >>> from motionmind import Motion, Posture, human23, read_motion, write_motion
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> write_motion("rest.bvh", posture.as_motion())
    >>> len(read_motion("rest.bvh"))
    1
    """
    check_path("path", path)
    check_path("asf", asf, or_none=True)
    check_type("unit", unit, str, Real, wanted="the name of a unit, or its metres", or_none=True)
    check_real("fps", fps, or_none=True)
    check_type("skeleton", skeleton, Skeleton, or_none=True)
    check_up(up)
    named, (path, clip) = path, split_clip(path)
    # Formats are imported here, so a program loads only those it uses.
    match _suffix(path, _READABLE, "read"):
        case ".bvh":
            from motionmind.formats.bvh import read_bvh

            motion = read_bvh(path, clip=clip, unit=unit, fps=fps)
        case ".amc":
            from motionmind.formats.asf_amc import read_amc

            motion = read_amc(path, asf) if fps is None else read_amc(path, asf, fps=fps)
        case ".txt":
            from motionmind.formats.papers import read_papers

            motion = read_papers(path, skeleton=skeleton, rate=fps)
        case ".npz" | ".pkl" | ".npy" | ".pt" as suffix:
            motion = _read_smpl(path, suffix, clip, fps, up, unit)
        case ".json":
            motion = _read_json(path)
        case ".glb" | ".gltf" | ".vrm" | ".vrma":
            from motionmind.formats.gltf import read_gltf

            motion = read_gltf(path, clip=clip, unit=unit)
        case _:
            motion = read_added(path, fps)
    _question_height(named, motion.skeleton)
    return to_y_up(motion) if up == "z" and Path(path).suffix.lower() != ".npz" else motion


def read_clips(
    path: FilePath,
    *,
    unit: str | float | None = None,
    asf: FilePath | None = None,
    fps: float | None = None,
    up: str | None = None,
) -> Iterator[Motion]:
    """Read all clips of a glTF file, bodies of BVH or samples of MDM, or the only motion of any other file.

    If there are several, each has a name of the form "stem#clip"; poses are motions of one frame. Arguments as for
    `read_motion`.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in CLIP_SUFFIXES or split_clip(path)[1] is not None:
        yield read_motion(path, unit=unit, asf=asf, fps=fps, up=up)
        return
    if suffix == ".bvh":
        from motionmind.formats.bvh import read_bvh_clips

        motions = read_bvh_clips(path, unit=unit, fps=fps)
    elif suffix == ".npy":
        from motionmind.formats.smpl_data import read_npy_clips

        motions = read_npy_clips(path, fps=fps)
    else:
        from motionmind.formats.gltf import read_gltf_clips

        motions = iter(read_gltf_clips(path, unit=unit))
    for number, motion in enumerate(motions):
        if number == 0 or suffix == ".bvh":  # the others are of one body
            _question_height(path, motion.skeleton)
        yield to_y_up(motion) if up == "z" else motion


def _question_height(path: FilePath, skeleton: Skeleton) -> None:
    """Warn if joints that are known as a person's make a body that no person has the height of."""
    from motionmind.formats.units import person_height
    from motionmind.retarget.joint_mapping import joint_mapping

    mapping = joint_mapping(skeleton)
    height = person_height(skeleton, mapping) if mapping else 0.0
    if height > 0.0 and not SHORTEST_PERSON_M <= height <= TALLEST_PERSON_M:
        remedy = "its ASF file states it" if Path(path).suffix.lower() == ".amc" else "--unit gives another"
        message = f"{path}: a person {height:.3g} m tall; the unit seems wrong ({remedy})"
        warnings.warn(message, MotionMindWarning, stacklevel=3)


def _read_smpl(
    path: FilePath, suffix: str, clip: str | None, fps: float | None, up: str | None, unit: str | float | None
) -> Motion:
    """Read a motion on SMPL's joints, by the format of the suffix."""
    from motionmind.formats.npz import read_npz
    from motionmind.formats.smpl_data import read_aist, read_gvhmr, read_npy

    if suffix == ".npz":
        return read_npz(path, fps=fps, up=up, unit=unit)
    if suffix == ".npy":
        return read_npy(path, fps=fps, clip=clip)
    return {".pkl": read_aist, ".pt": read_gvhmr}[suffix](path, fps=fps)


def _read_json(path: FilePath) -> Motion:
    """Read a motion, or a posture as one, from JSON."""
    from motionmind.files import read_bytes
    from motionmind.formats import _json

    data = read_bytes(path)
    if _json.kind_of(data, path) == _json.POSTURE:
        from motionmind.formats.posture_json import posture_from_json

        return posture_from_json(data, path).as_motion()
    from motionmind.formats.motion_json import motion_from_json

    return motion_from_json(data, path)


def read_posture(
    path: FilePath,
    *,
    frame: int | None = None,
    unit: str | float | None = None,
    asf: FilePath | None = None,
    skeleton: Skeleton | None = None,
) -> Posture:
    """Read one posture from a file of any readable format.

    Args:
        path: the file; its suffix determines the format.
        frame: which frame, counted from 0, or from the end if negative; None if the file has only one.
        unit: as for `read_motion`.
        asf: as for `read_motion`.
        skeleton: as for `read_motion`.

    Returns:
        The posture, in metres, on the file's own skeleton.

    Raises:
        FormatError: as `read_motion`; or the file has several frames and `frame` is None.
        MotionMindError: there is no such frame.

    >>> import numpy as np
    >>> from motionmind import Posture, human23, read_posture, write_posture
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> write_posture("rest.json", posture)
    >>> read_posture("rest.json").skeleton.name
    'human23'
    """
    check_integer("frame", frame, or_none=True)
    motion = read_motion(path, unit=unit, asf=asf, skeleton=skeleton)
    if frame is None and len(motion) > 1:
        raise FormatError(
            f"{len(motion)} frames, where one posture was expected; say which frame (motionmind posture extracts one)",
            path=path,
        )
    return motion.posture(frame or 0)


def write_motion(
    path: FilePath,
    motion: Motion,
    *,
    unit: str | float = "cm",
    rig: FilePath | None = None,
    ends: tuple[int, int] | None = None,
) -> None:
    """Write `motion` in the format of the suffix.

    For BVH, a log entry says what to set in Blender's import (logger "motionmind.formats.programs", level INFO).

    Args:
        path: the file: `.json`, `.bvh`, `.txt` (the papers' notation), `.glb` (glTF, a skinned body), `.vrma` (VRM
            animation) or `.npz` (AMASS).
        motion: the movement to write.
        unit: BVH's unit of length (`write_bvh`), unless `rig` has one; other formats define their own.
        rig: a BVH or glTF file on whose rig a motion of human23 is written as `.bvh` or `.glb`: with the skeleton and
            channels of BVH, or the nodes and skins of glTF; None for the motion's own skeleton.
        ends: the frames of `rig` that are the motion's first and last posture, so that every bone meets them; None if
            the motion begins and ends elsewhere.

    Raises:
        MotionMindError: the suffix is unknown, the format cannot hold this motion, or the file cannot be written.
        SkeletonError: the joints of `rig` do not map to human23.

    >>> import numpy as np
    >>> from motionmind import Posture, human23, write_motion
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> write_motion("rest.bvh", posture.as_motion(), unit="m")
    """
    check_path("path", path)
    check_type("motion", motion, Motion)
    check_type("unit", unit, str, Real, wanted="the name of a unit, or its metres")
    check_path("rig", rig, or_none=True)
    check_type("ends", ends, tuple, or_none=True)
    suffix = _suffix(path, WRITABLE, "written")
    if rig is not None:
        from motionmind.formats.rig_files import read_rig, write_on_rig

        write_on_rig(path, motion, read_rig(rig, ends))
    elif suffix == ".bvh":
        from motionmind.formats.bvh import write_bvh
        from motionmind.formats.programs import note_settings

        write_bvh(path, motion, unit)
        note_settings(path, motion, unit, " (or write it with --for blender)")
    elif suffix == ".txt":
        from motionmind.formats.papers import write_papers

        write_papers(path, motion)
    elif suffix == ".glb":
        from motionmind.formats.glb import write_glb

        write_glb(path, motion)
    elif suffix == ".vrma":
        from motionmind.formats.vrma import write_vrma

        write_vrma(path, motion)
    elif suffix == ".npz":
        from motionmind.formats.npz import write_npz

        write_npz(path, motion)
    elif suffix == ".json":
        from motionmind.formats.motion_json import write_motion_json

        write_motion_json(path, motion)
    else:
        write_added(path, motion)


def write_posture(path: FilePath, posture: Posture) -> None:
    """Write `posture` in the format of the suffix; as a motion of one frame if the format has no postures.

    Raises:
        MotionMindError: as `write_motion`.

    >>> import numpy as np
    >>> from motionmind import Posture, human23, write_posture
    >>> at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (23, 1))
    >>> posture = Posture(human23(), at_rest, np.zeros(3))
    >>> write_posture("rest.json", posture)
    """
    check_path("path", path)
    check_type("posture", posture, Posture)
    if _suffix(path, WRITABLE, "written") == ".json":
        from motionmind.formats.posture_json import write_posture_json

        write_posture_json(path, posture)
    else:
        write_motion(path, posture.as_motion())


def _suffix(path: FilePath, known: tuple[str, ...], verb: str) -> str:
    """Return the lower-case suffix; an error if it is neither `known` nor added, of files to be "read" or "written"."""
    suffix = Path(path).suffix.lower()
    if suffix not in known and suffix not in (others := added_suffixes()):
        message = f"suffix {suffix!r} is unknown; files that can be {verb} end in {', '.join((*known, *others))}"
        message = (way_out(suffix) if verb == "read" else None) or message
        raise FormatError(message, path=path) if verb == "read" else MotionMindError(f"{path}: {message}")
    return suffix
