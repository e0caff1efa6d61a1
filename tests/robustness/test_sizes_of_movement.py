"""No file under 1 MB takes more than 1 GB or 10 s: what it asks for is refused before memory is taken."""

from __future__ import annotations

import io
import re
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from bounded_runs import run_bounded

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.body.rates import MAX_POSITIONS
from motionmind.errors import FormatError, MotionMindError
from motionmind.files import parse_toml
from motionmind.formats import read_motion, write_motion
from motionmind.geometry import rotations as rot
from motionmind.render.pictures import draw_picture
from motionmind.render.timing import MIN_FPS, film_rate, frame_times

pytestmark = pytest.mark.long

BODY = human23()
MOST_FRAMES = MAX_POSITIONS // len(BODY)


def bvh(folder: Path, joints: int, frames: int, step: float) -> Path:
    """Write a BVH whose joints have no channels, except for the root's one."""
    lines = ["HIERARCHY", "ROOT r", "{", "OFFSET 0 0 0", "CHANNELS 1 Xrotation"]
    lines += [f"JOINT j{i} {{ OFFSET 0 1 0 End Site {{ OFFSET 0 1 0 }} }}" for i in range(1, joints)]
    lines += ["}", "MOTION", f"Frames: {frames}", f"Frame Time: {step}", *["0"] * frames]
    path = folder / "hostile.bvh"
    path.write_text("\n".join(lines) + "\n")
    assert path.stat().st_size < 10**6
    return path


def slow_bvh(folder: Path, seconds: float = 1e6) -> Path:
    """Write a BVH of 300 bytes whose two frames are 11 days apart, or so many seconds."""
    path = folder / "slow.bvh"
    joints = "JOINT a { OFFSET 0 1 0 CHANNELS 3 Xrotation Yrotation Zrotation End Site { OFFSET 0 1 0 } }"
    path.write_text(
        f"HIERARCHY\nROOT r {{ OFFSET 0 0 0 CHANNELS 3 Xrotation Yrotation Zrotation\n{joints}\n}}\n"
        f"MOTION\nFrames: 2\nFrame Time: {seconds}\n0 0 0 0 0 0\n1 2 3 4 5 6\n"
    )
    return path


def npz(folder: Path, arrays: dict[str, np.ndarray]) -> Path:
    path = folder / "hostile.npz"
    np.savez_compressed(path, **arrays)  # type: ignore[arg-type]
    assert path.stat().st_size < 10**6
    return path


def zeros(frames: int, kind: type) -> dict[str, np.ndarray]:
    sizes = {"poses": 156, "trans": 3}
    return {name: np.zeros((frames, size), kind) for name, size in sizes.items()} | {"mocap_framerate": np.array(60)}


@pytest.mark.parametrize("command", ["convert", "render", "corpus"])
def test_a_small_file_of_slow_frames_is_refused(command: str, tmp_path: Path) -> None:
    path = slow_bvh(tmp_path)
    arguments = {
        "convert": ["convert", path, "out.json", "--fps", 30],
        "render": ["render", path, "-o", "out.gif"],
        "corpus": ["corpus", "build", "mine", path, "--rate", 30],
    }
    done = run_bounded(*arguments[command], folder=tmp_path)
    assert done.code == 2, done
    assert re.search("more than (can be made at once|a film of it may have)", done.error), done
    assert done.within_bounds, done


@pytest.mark.parametrize(("source", "suffix"), [("many frames", ".gif"), ("slow frames", ".gif")])
def test_a_film_of_a_small_file_takes_no_longer_than_others(source: str, suffix: str, tmp_path: Path) -> None:
    path = bvh(tmp_path, 2, 70_000, 0.04) if source == "many frames" else slow_bvh(tmp_path, 2800.0)
    done = run_bounded("render", path, "-o", f"out{suffix}", folder=tmp_path)
    assert done.code == 0, done
    assert re.search(r"note: .*: [\d.]+ frames a second, 1000 in all \(--fps, or fps=, for others\)\n", done.error)
    assert done.within_bounds, done


@pytest.mark.parametrize("suffix", [".gif", ".mp4", ".svg"])
def test_nobody_may_ask_for_a_film_of_many_times_as_many_frames(suffix: str, tmp_path: Path) -> None:
    motion = read_motion(slow_bvh(tmp_path, 2800.0))
    with pytest.raises(MotionMindError, match=r"^slow: 70001 frames are more than a film of it may have, 4000 \("):
        draw_picture(tmp_path / f"out{suffix}", motion, fps=25.0)
    assert [path.name for path in tmp_path.iterdir()] == ["slow.bvh"]


@pytest.mark.parametrize(("frames", "rate"), [(2, 25.0), (1000, 25.0), (1001, 25.0), (1999, 12.5), (10**9, MIN_FPS)])
def test_a_film_has_so_many_frames_at_a_rate_that_nobody_chose(frames: int, rate: float) -> None:
    still = Motion(BODY, np.tile(rot.IDENTITY, (2, 23, 1)), np.zeros((2, 3)), np.array([0.0, (frames - 1) / 25.0]))
    if rate == MIN_FPS:
        with pytest.raises(MotionMindError, match="more than a film of it may have, 4000 "):
            film_rate(still, 25.0, None)
        return
    assert film_rate(still, 25.0, None) == pytest.approx(rate)
    assert len(frame_times(still, film_rate(still, 25.0, None))) == {2: 2, 1000: 1000, 1001: 1001, 1999: 1000}[frames]
    assert film_rate(still, 25.0, 50.0) == 50.0
    assert film_rate(still, 25.0, None, 10**9) == 25.0


def test_joints_without_channels_are_bounded(tmp_path: Path) -> None:
    done = run_bounded("convert", bvh(tmp_path, 4000, 300_000, 0.1), "out.json", folder=tmp_path)
    assert done.code == 2, done
    assert "300000 frames of 3999 joints are more than can be made at once" in done.error, done
    assert done.within_bounds, done


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int8], ids=str)
def test_a_compressed_array_is_refused_before_it_is_unpacked(kind: type, tmp_path: Path) -> None:
    path = npz(tmp_path, zeros(700_000 if kind is np.int8 else 200_000 if kind is np.float32 else 100_000, kind))
    done = run_bounded("convert", path, "out.bvh", folder=tmp_path)
    assert done.code == 2, done
    assert "'poses' is too large to be movement" in done.error
    assert done.within_bounds, done


def test_a_member_is_judged_by_what_is_read_of_it(tmp_path: Path) -> None:
    """Two members whose names differ in their suffix alone: the harmless one must not vouch for the other."""
    path = npz(tmp_path, zeros(100_000, np.float64))
    harmless = io.BytesIO()
    np.save(harmless, np.zeros((2, 156)))
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("poses.txt", harmless.getvalue())
    with pytest.raises(FormatError, match="too large to be movement"):
        read_motion(path)


def test_movement_of_an_hour_is_made_within_bounds(tmp_path: Path) -> None:
    """The largest motion that may be made stays within the limits, in each format that is written."""
    rotations = np.tile(rot.IDENTITY, (2, len(BODY), 1))
    rotations[1, 5] = rot.about_vertical(np.array(1.0))
    times = np.array([0.0, (MOST_FRAMES - 1) / 30.0])
    write_motion(tmp_path / "in.json", Motion(BODY, rotations, np.zeros((2, 3)), times))
    for name in ("out.json", "out.bvh"):
        done = run_bounded("convert", "in.json", name, "--fps", 30, folder=tmp_path)
        assert done.code == 0, done
        assert f"{MOST_FRAMES} frames" in done.out.replace(",", "")
        assert done.memory < 10**9, done
    one_more = Motion(BODY, rotations, np.zeros((2, 3)), np.array([0.0, MOST_FRAMES / 30.0]))
    with pytest.raises(MotionMindError, match=f"more than can be made at once, {MOST_FRAMES} "):
        one_more.resample(30.0)


LONG_KEYS = [
    ".".join(["a"] * 40_000) + " = 1",
    "[" + ".".join(["a"] * 40_000) + "]",
    " . ".join(['"a"'] * 40_000) + " = 1",
    "\t.\t".join(["'a'"] * 40_000) + " = 1",
    ".".join(['"\\"a"'] * 40_000) + " = 1",
    "x = { " + ".".join(["a"] * 40_000) + " = 1 }",
]


@pytest.mark.parametrize("text", LONG_KEYS, ids=range(len(LONG_KEYS)))
def test_a_key_of_many_parts_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "joints.toml").write_text(f"b = 1\n{text}\n")
    slow_bvh(tmp_path)
    done = run_bounded("convert", "slow.bvh", "out.json", "--joints", "joints.toml", folder=tmp_path)
    assert done.code == 2, done
    assert "joints.toml: not a joint mapping: a key of more than 20 parts (at line 2)" in done.error
    assert done.within_bounds


def test_keys_and_text_of_usual_length_are_parsed() -> None:
    assert parse_toml('a.b.c = "one. two. three."\n[x."y.z"]\n') == {
        "a": {"b": {"c": "one. two. three."}},
        "x": {"y.z": {}},
    }
    began = time.process_time()
    parse_toml('a = "' + "word" * 200_000 + '"')
    parse_toml("a" * 900_000 + " = 1")
    assert time.process_time() - began < 2.0


PAPERS = {
    "a joint over many lines": "{" + "pelvis\n" * 120_000 + ", 0, 0, 0, 1}",
    "blanks between lines": "{pelvis" + "\n" * 900_000 + ", 0, 0, 0, 1}",
    "words": "pelvis " * 120_000,
    "numbers": "pelvis" + " 0" * 400_000,
}


@pytest.mark.parametrize("text", PAPERS.values(), ids=list(PAPERS))
def test_the_papers_are_read_in_linear_time(text: str, tmp_path: Path) -> None:
    (tmp_path / "hostile.txt").write_text(text)
    done = run_bounded("convert", "hostile.txt", "out.json", folder=tmp_path)
    assert done.code == (0 if text.startswith("{pelvis\n\n") else 2), done
    assert done.within_bounds
    assert done.seconds < 5.0
