"""Files in and out. `read_motion` and `read_posture` know the format by the name's suffix, as do the writers.

| suffix | read | written |
|---|---|---|
| `.json` | posture or motion | posture or motion |
| `.bvh` | motion | motion, posture as one frame |
| `.amc` | motion, with the `.asf` beside it | |
| `.npz` | motion on SMPL's joints, as AMASS keeps it | motion of people, posture as one frame |
| `.txt` | the notation of the papers | the notation of the papers |
| `.glb` | | motion, posture without animation |

What a format has no place for, `lossy_fields` says.
"""

from __future__ import annotations

from pathlib import Path

from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import FilePath, write_atomically
from motionmind.formats.lossy import lossy_fields

__all__ = ["lossy_fields", "read_motion", "read_posture", "write_atomically", "write_motion", "write_posture"]

_READ = (".json", ".bvh", ".amc", ".txt", ".npz")
_WRITTEN = (".json", ".bvh", ".txt", ".glb", ".npz")


def read_motion(
    path: FilePath,
    *,
    unit: str | float | None = None,
    asf: FilePath | None = None,
    fps: float | None = None,
    skeleton: Skeleton | None = None,
) -> Motion:
    """Movement from a file of any format that is known; a posture is a motion of one frame at time 0.

    Args:
        path: the file; its suffix tells the format.
        unit: BVH's unit of length (`read_bvh`); None tells it from the skeleton. Other formats know their own.
        asf: AMC's skeleton (`read_amc`); None finds it beside the file.
        fps: frames a second of formats that do not say: AMC (default 120), the papers' notation (default 1), `.npz`
            that lacks them (no default).
        skeleton: the body of the papers' notation, which names joints only; None tells it from their names.

    Raises:
        FormatError: the suffix is unknown, or the file is not there, or is not what its suffix says.
    """
    suffix = _suffix(path, _READ, "read")
    # The formats are imported here, so that a program pays for those that it meets.
    if suffix == ".bvh":
        from motionmind.formats.bvh import read_bvh

        return read_bvh(path, unit=unit)
    if suffix == ".amc":
        from motionmind.formats.asf_amc import read_amc

        return read_amc(path, asf) if fps is None else read_amc(path, asf, fps=fps)
    if suffix == ".txt":
        from motionmind.formats.papers import read_papers

        return read_papers(path, skeleton=skeleton) if fps is None else read_papers(path, skeleton=skeleton, rate=fps)
    if suffix == ".npz":
        from motionmind.formats.npz import read_npz

        return read_npz(path, fps=fps)
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
    """One posture from a file of any format that is known; arguments as for `read_motion`.

    A file with several frames needs `frame`, counted from 0, or from the end if negative.

    Raises:
        FormatError: as `read_motion`; or there are several frames and none is chosen.
        MotionMindError: there is no such frame.
    """
    motion = read_motion(path, unit=unit, asf=asf, skeleton=skeleton)
    if frame is None and len(motion) > 1:
        raise FormatError(
            f"{len(motion)} frames, where one posture was expected; say which frame (motionmind posture takes one out)",
            path=path,
        )
    return motion.posture(frame or 0)


def write_motion(path: FilePath, motion: Motion, *, unit: str | float = "cm") -> None:
    """Write `motion` in the format of the suffix.

    That is `.json`, `.bvh`, `.txt` (the papers' notation), `.glb` (glTF, a skinned body), or `.npz` (AMASS). `unit` is
    BVH's unit of length (`write_bvh`); other formats have their own.
    """
    suffix = _suffix(path, _WRITTEN, "written")
    if suffix == ".bvh":
        from motionmind.formats.bvh import write_bvh

        write_bvh(path, motion, unit)
    elif suffix == ".txt":
        from motionmind.formats.papers import write_papers

        write_papers(path, motion)
    elif suffix == ".glb":
        from motionmind.formats.glb import write_glb

        write_glb(path, motion)
    elif suffix == ".npz":
        from motionmind.formats.npz import write_npz

        write_npz(path, motion)
    else:
        from motionmind.formats.motion_json import write_motion_json

        write_motion_json(path, motion)


def write_posture(path: FilePath, posture: Posture) -> None:
    """Write `posture` in the format of the suffix; as a motion of one frame where the format has no postures."""
    if _suffix(path, _WRITTEN, "written") == ".json":
        from motionmind.formats.posture_json import write_posture_json

        write_posture_json(path, posture)
    else:
        write_motion(path, posture.as_motion())


def _suffix(path: FilePath, known: tuple[str, ...], done: str) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in known:
        message = f"suffix {suffix!r} is unknown; files that can be {done} end in {', '.join(known)}"
        raise FormatError(message, path=path) if done == "read" else MotionMindError(f"{path}: {message}")
    return suffix
