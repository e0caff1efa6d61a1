"""Movement as pictures, films and pages: by suffix, from Python and from the command line, for every body."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from PIL import Image

from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.formats import write_motion, write_posture
from motionmind.geometry import rotations as rot
from motionmind.notation.compose import compose
from motionmind.render import PICTURES
from motionmind.render.page import page
from motionmind.render.pictures import draw_picture
from motionmind.render.stage import Stage

CORPORA = Path(__file__).parents[2] / "corpora"
ARABESQUE, FIFTH = (CORPORA / "ballet" / "postures" / f"{name}.json" for name in ("arabesque", "fifth"))
BEGINS = {".png": b"\x89PNG", ".gif": b"GIF89a", ".mp4": b"", ".svg": b"<svg", ".html": b"<!doctype html>"}
FILMS = [".gif", ".mp4", ".svg"]


@cache
def bodies() -> dict[str, Motion]:
    """A few frames on bodies of all kinds, and the numbers of frames that are odd."""
    ballet = ballet_clip("jump").slice(0, 6)
    insertions = (Insertion(ballet.times[[1, 2, 4]], (("left_hip", 1),)),)
    line = Skeleton("line", ("top",), (-1,), np.zeros((1, 3)))
    return {
        "a person": ballet,
        "a person, some of it inserted": replace(ballet, insertions=insertions),
        "44 joints": compose(CORPORA / "hands" / "hands.score", "wave").slice(0, 5),
        "six legs": compose(CORPORA / "walk-hexapod" / "insect.score", "tripod").slice(0, 5),
        "one posture": ballet.slice(3, 4),
        "no moves": replace(ballet.slice(3, 4), insertions=(Insertion(ballet.times[3:4]),)),
        "no extent": Motion(line, np.tile(rot.IDENTITY, (2, 1, 1)), np.zeros((2, 3)), np.array([0.0, 0.5])),
        "a long wait": replace(ballet, times=ballet.times + np.array([0, 0, 0, 0, 0, 3.0])),
    }


@pytest.mark.long
@pytest.mark.parametrize("suffix", PICTURES)
@pytest.mark.parametrize("kind", bodies())
def test_every_body_goes_into_every_picture(kind: str, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a{suffix}"
    small = {"size": 200} if suffix in FILMS else {}  # as films of any size are made, in less time
    draw_picture(path, bodies()[kind], **small)
    data = path.read_bytes()
    assert data.lstrip().lower().startswith(BEGINS[suffix].lower())
    assert len(data) > 500
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.long
@pytest.mark.parametrize("suffix", PICTURES)
def test_what_is_written_again_is_the_same_bytes(suffix: str, tmp_path: Path) -> None:
    path, motion = tmp_path / f"a{suffix}", bodies()["a person, some of it inserted"]
    small = {"size": 200} if suffix in FILMS else {}
    draw_picture(path, motion, **small)
    data = path.read_bytes()
    draw_picture(path, motion, **small)
    assert path.read_bytes() == data


@pytest.mark.long
@pytest.mark.parametrize("suffix", PICTURES)
def test_where_nothing_can_be_written_nothing_is_left(suffix: str, tmp_path: Path) -> None:
    (tmp_path / f"a{suffix}").mkdir()
    for path in (tmp_path / "none" / f"a{suffix}", tmp_path / f"a{suffix}"):
        with pytest.raises(MotionMindError, match=rf"^{re.escape(str(path))}: cannot be written: ") as refusal:
            draw_picture(path, ballet_clip("jump").slice(0, 2))
        assert "\n" not in str(refusal.value)
    assert [file.name for file in tmp_path.iterdir()] == [f"a{suffix}"]


@pytest.mark.long
@pytest.mark.parametrize("view", ["quarter", "front", "side", "left", "top"])
@pytest.mark.parametrize("suffix", [".png", ".gif"])
def test_the_size_is_the_pictures_height_where_it_is_not_flat(view: str, suffix: str, tmp_path: Path) -> None:
    motion = ballet_clip("jump").slice(0, 1 if suffix == ".png" else 3)
    heights = []
    for size in (160, 320):
        draw_picture(tmp_path / f"a{suffix}", motion, view=view, size=size)
        with Image.open(tmp_path / f"a{suffix}") as picture:
            heights.append(picture.height)
            assert 0.4 * size < picture.height <= size
    assert heights[1] == pytest.approx(2 * heights[0], rel=0.15)


@pytest.mark.parametrize(
    ("name", "frames", "options", "message"),
    [
        ("a.jpg", 3, {}, r"a\.jpg: suffix '\.jpg' is unknown; pictures end in \.png, \.gif, \.mp4, \.svg, \.html$"),
        ("a.png", 3, {"fps": 5}, r"a\.png: fps is for films \(\.gif, \.mp4, \.svg\), not for a sheet of postures$"),
        ("a.png", 3, {"view": "top"}, r"a\.png: view is for films and single postures, not for a sheet of postures$"),
        ("a.png", 1, {"fps": 5}, r"a\.png: fps is for films \(\.gif, \.mp4, \.svg\), not for one posture$"),
        ("a.html", 3, {"size": 100}, r"a\.html: size is for films and single postures, not for a page$"),
        ("a.gif", 3, {"view": "below"}, r"no view 'below'; there are quarter, front, side, left, top"),
        ("a.gif", 3, {"fps": 0}, "frames a second, not 0"),
        ("a.svg", 3, {"fps": float("nan")}, "frames a second, not nan"),
        ("a.mp4", 3, {"size": 0}, "from 120 to 2160, not 0"),
        ("a.gif", 3, {"size": 10**6}, "from 120 to 2160, not 1000000"),
    ],
)
def test_what_a_picture_has_not_is_refused(
    name: str, frames: int, options: dict[str, object], message: str, tmp_path: Path
) -> None:
    with pytest.raises(MotionMindError, match=message):
        draw_picture(tmp_path / name, ballet_clip("jump").slice(0, frames), **options)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


# --- the command ------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_a_tween_becomes_any_picture_at_once_or_later(run: Run, tmp_path: Path) -> None:
    files = [word for suffix in (*PICTURES, ".json") for word in ("-o", f"tween{suffix}")]
    assert run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "--moves", 4, *files).code == 0
    for suffix in PICTURES:
        drawn = run("render", "tween.json", "-o", f"again{suffix}")
        assert (drawn.code, drawn.err) == (0, "")
        assert drawn.out.startswith(f"again{suffix}: ")
        check_alike(tmp_path / f"tween{suffix}", tmp_path / f"again{suffix}")


def check_alike(one: Path, other: Path) -> None:
    """Check that two pictures are the same but for rounding.

    JSON rounds numbers, so that the last digit of one may differ where they are written, and a pixel on an edge.
    """
    at_once, later = one.read_bytes(), other.read_bytes()
    if one.suffix in (".html", ".mp4"):
        assert len(at_once) == pytest.approx(len(later), rel=1e-3)
    elif one.suffix == ".svg":
        number = rb"[+-]?(?:\d+\.?\d*|\.\d+)"
        assert re.sub(number, b"#", at_once) == re.sub(number, b"#", later)
        ours, theirs = (np.array(re.findall(number, text), dtype=np.float64) for text in (at_once, later))
        np.testing.assert_allclose(ours, theirs, atol=5.0)  # of the fine units that paths are drawn in
    else:
        with Image.open(one) as before, Image.open(other) as after:
            counts = [getattr(picture, "n_frames", 1) for picture in (before, after)]
            assert counts[0] == counts[1]
            for frame in range(counts[0]):
                before.seek(frame)
                after.seek(frame)
                assert before.info.get("duration") == after.info.get("duration")
                pixels = np.array([picture.convert("RGB") for picture in (before, after)], dtype=float)
                if one.suffix == ".gif":
                    assert np.abs(np.subtract(*pixels)).mean() < 0.01
                else:
                    assert np.any(pixels[0] != pixels[1], axis=-1).mean() < 1e-4


@pytest.mark.long
def test_postures_and_scores_become_pictures(run: Run, tmp_path: Path) -> None:
    commands = (
        ("render", ARABESQUE, "-o", "posture.png"),
        ("render", CORPORA / "ballet" / "allegro.score", "--clip", "jump", "-o", "score.svg"),
        ("render", "walk-hexapod", "--clip", "tripod", "--from", 2, "--to", 6, "-o", "corpus.gif", "--fps", 10),
        ("compose", CORPORA / "ballet" / "allegro.score", "--clip", "jump", "-o", "clip.html"),
        ("compose", CORPORA / "ballet" / "vocabulary.score", "--posture", "fifth", "-o", "named.png"),
        ("posture", ARABESQUE, "--frame", 0, "-o", "taken.png"),
    )
    for command in commands:
        ran = run(*command)
        assert (ran.code, ran.err) == (0, ""), command
    assert (tmp_path / "posture.png").read_bytes() == (tmp_path / "taken.png").read_bytes()


@pytest.mark.long
def test_a_sheet_of_a_part_keeps_the_numbers_of_the_whole(run: Run, tmp_path: Path) -> None:
    write_motion("clip.bvh", ballet_clip("adagio").resample(10.0))
    drawn = run("render", "clip.bvh", "-o", "few.png", "--from", 100, "--to", -1)
    assert drawn.code == 0
    assert run("sheet", "clip.bvh", "-o", "same.png", "--from", 100, "--postures", 48).code == 0
    assert (tmp_path / "few.png").read_bytes() == (tmp_path / "same.png").read_bytes()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("render a.json -o a.bvh", r"a\.bvh: cannot be written: the name must end in one of \.png, \.gif, "),
        ("render a.json -o a.json", r"a\.json: cannot be written: the name must end in one of"),
        ("render a.json -o none/a.gif", r"none/a\.gif: cannot be written: there is no folder"),
        ("render none.json -o a.gif", r"none\.json: cannot be read: there is no such file"),
        ("render nan.json -o a.gif", r"nan\.json:"),
        ("render a.json -o a.gif --clip b", r"a\.json: --clip is only for a score, a corpus or a glTF file"),
        ("render walk-hexapod -o a.gif", r"walk-hexapod: holds 4 clips; name one, such as walk-hexapod/tripod"),
        ("render walk-hexapod --clip tripd -o a.gif", r"no clip 'tripd'; did you mean tripod\?"),
        ("render a.json -o a.html --fps 5", r"a\.html: fps is for films"),
        ("render a.json -o a.gif --from 99", r"a\.json: frames are 0 to 5, there is no frame 99"),
        ("render a.json -o a.gif --view below", "'below' is not one of"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(line: str, message: str, run: Run, tmp_path: Path) -> None:
    write_motion("a.json", ballet_clip("jump").slice(0, 6))
    content = json.loads((tmp_path / "a.json").read_text())
    content["root"][2][1] = float("nan")
    (tmp_path / "nan.json").write_text(json.dumps(content))
    before = sorted(tmp_path.iterdir())
    ran = run(*line.split())
    assert ran.code == 2
    assert re.search(message, ran.err), ran.err
    assert ran.err.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.long
def test_what_a_file_has_no_place_for_is_said_by_all_who_write_it(run: Run) -> None:
    joined = run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "-o", "tween.bvh")
    lacks = r"(?m)^note: tween\.bvh: no place for the marks of frames that the engine made \(\d+\)"
    assert re.search(lacks, joined.err)
    write_posture("here.json", ballet_clip("jump").posture(0))
    assert run("posture", "here.json", "--frame", 0, "-o", "there.json").err == ""


def test_frames_of_a_part_are_numbered_as_in_the_whole() -> None:
    motion = ballet_clip("jump")
    stage = Stage(motion.slice(2, 6), first=2)
    assert [stage.words(number)[1][0] for number in range(4)] == [f"frame {number}" for number in (2, 3, 4, 5)]
    assert '"first":2' in page(motion.slice(2, 6), 2)


def test_odd_names_and_places_are_no_tracebacks(run: Run, tmp_path: Path) -> None:
    odd = Path(os.fsdecode(b"b\xffd.json"))
    write_motion("a.json", replace(ballet_clip("jump").slice(0, 3), name="b\udcffd"))
    Path("a.json").rename(odd)
    assert run("render", odd, "-o", "a.html").code == 0
    assert run("convert", odd, "b.bvh").code == 0
    Path("loop.gif").symlink_to("loop.gif")
    for line in (("render", "b.bvh", "-o", "loop.gif"), ("render", "b.bvh", "-o", f"{'a' * 252}.gif")):
        ran = run(*line)
        assert (ran.code, ran.err.count("\n")) == (2, 1), ran.err
        assert line[-1] in ran.err


def test_a_picture_goes_through_a_pipe(tmp_path: Path) -> None:
    program = "import sys; from motionmind.files import write_atomically; write_atomically('/dev/stdout', b'all of it')"
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True)
    assert ran.stdout == b"all of it"
