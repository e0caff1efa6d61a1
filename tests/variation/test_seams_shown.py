"""Seams as a reviewer sees them: postures by name, a sheet of thumbnails, one seam played with another insertion."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from command_line import Run
from PIL import Image

from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.names.finding import open_collection
from motionmind.names.postures import find_posture
from motionmind.names.spelling import parse_posture, parse_source
from motionmind.render.seam_sheet import seam_sheet
from motionmind.tween.engine import Engine
from motionmind.variation.piece import Piece
from motionmind.variation.posture_names import name_postures
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import write_variation

BALLET = open_collection(parse_source("ballet"))


@pytest.fixture(scope="module")
def adagio() -> Motion:
    return BALLET.motions(["adagio"])[0]


@pytest.fixture(scope="module")
def variation(adagio: Motion) -> Variation:
    return vary(Piece.of(adagio), Engine.load("ballet"), nudge=1.0, inserted=0.4)


@pytest.fixture
def file(tmp_path: Path, variation: Variation) -> Path:
    write_variation(tmp_path / "v.json", variation)
    return tmp_path / "v.json"


# --- names ------------------------------------------------------------------------------------------------------------


def test_a_name_leads_to_the_posture_that_it_names(adagio: Motion) -> None:
    names = name_postures(Piece.of(adagio), BALLET)
    assert len(set(names)) > 40
    assert any("@" not in name for name in names)
    for number, name in enumerate(names):
        found = find_posture(f"ballet/{name}").posture
        np.testing.assert_array_less(rot.angle(found.rotations[1:], adagio.rotations[number, 1:]), np.radians(1.0))
        if "@" in name:
            assert name == f"adagio@{number}"


def test_frames_are_counted_in_the_whole_clip_and_turned_bodies_keep_their_names(adagio: Motion) -> None:
    names = name_postures(Piece.of(adagio), BALLET)
    part = adagio.slice(7, 40)
    assert name_postures(Piece.of(part), BALLET) == names[7:40]
    even = adagio.resample(30.0)
    of_part = name_postures(Piece.of(even.slice(31, 200)))
    assert of_part == tuple(f"adagio@{frame}" for frame in range(31, 200))
    assert name_postures(Piece.of(even.slice(1, 200), rate=5.0))[:3] == ("adagio@1", "adagio@7", "adagio@13")
    # A corpus has fewer frames of a clip than the recording that the clip is made of.
    named = set(BALLET.postures)
    of_recording = name_postures(Piece.of(even.slice(1, 200)), BALLET)
    assert [name for name in of_recording[:60:20] if name not in named] == ["adagio@1", "adagio@21", "adagio@41"]
    turned = part.rotations.copy()
    turned[:, 0] = rot.mul(rot.about_vertical(1.0), turned[:, 0])
    assert name_postures(Piece.of(replace(part, rotations=turned)), BALLET) == names[7:40]


def test_the_table_names_postures_and_does_without_the_corpus(run: Run, file: Path, variation: Variation) -> None:
    names = name_postures(variation.piece, BALLET)
    first = variation.seams[0]
    listed = run("review", file, "--list").out
    (line,) = [line for line in listed.splitlines() if line.startswith("   1  ")]
    assert f" {names[first.end]}" in line
    for clip, start, end in re.findall(r"(\S+)@(\d+)\.\.(\d+)", listed):
        for frame in (start, end):
            parse_posture(f"ballet/{clip}@{frame}")  # a name that commands take
    assert re.search(r"[a-z] to [a-z]", listed)  # from a posture of one name to one of another
    gone = tuple(msgspec.structs.replace(one, corpus="gone") for one in variation.transitions)
    write_variation(file, replace(variation, transitions=gone))
    assert f" adagio@{first.end}" in run("review", file).out


def test_a_seam_tells_the_cut_as_it_was_apart_from_the_insertion_as_it_is(run: Run, file: Path) -> None:
    seams = [seam for seam in run("review", file, "--json").json["seams"] if seam["candidates"]]
    run("review", file, "--discard", seams[0]["number"])
    rows = {
        int(line[:4]): line for line in run("review", file, "--list").out.splitlines() if line[:4].strip().isdigit()
    }
    for seam in seams:
        worst = max(seam["breaks"], key=lambda one: one["degrees"])
        first, then = ("abrupt", "discarded") if seam is seams[0] else ("was", "now")
        cut, insertion = rows[seam["number"]].split(f"{first}: ")[1].split(f"; {then}: ")
        assert cut.startswith(f"{worst['joint']} jumps {worst['degrees']:.0f} degrees, ")
        assert ("unattested" in cut, "too fast" in cut) == (not worst["attested"], worst["fast"])
        best = seam["candidates"][0]
        assert insertion.startswith(f"{best['moves']} moves in {best['seconds']:.2f} s, {best['status']}, ")
        assert ("every transition attested" in insertion) == (best["attested"] == 1.0)
        assert insertion.endswith(f", 1 of {len(seam['candidates'])}")


# --- the sheet --------------------------------------------------------------------------------------------------------


def test_the_sheet_has_a_row_for_each_seam_and_violet_where_something_is_inserted(
    run: Run, file: Path, tmp_path: Path, variation: Variation
) -> None:
    drawn = run("review", file, "--sheet", tmp_path / "sheet.png", "--approve", 1)
    assert (drawn.code, drawn.out.splitlines()[-1]) == (0, f"written   {file}, {tmp_path / 'sheet.png'}")
    picture = Image.open(tmp_path / "sheet.png")
    names = name_postures(variation.piece, BALLET)
    assert picture.size == seam_sheet(variation, names).size
    bare = seam_sheet(variation.discard(*(seam.number for seam in variation.seams if seam.insertion)), names)
    few = seam_sheet(replace(variation, edits=()).cut(0, 0, 1), names)
    assert few.size == picture.size

    def violet(image: Image.Image) -> int:
        r, g, b = np.moveaxis(np.asarray(image.convert("RGB"), dtype=int), -1, 0)
        return int(((r - g > 25) & (b - g > 60)).sum())

    assert violet(picture) > 10 * violet(bare)
    with pytest.raises(MotionMindError, match="there is no seam to draw"):
        seam_sheet(vary(variation.piece, nudge=0.0), names)


# --- a seam played ----------------------------------------------------------------------------------------------------


def test_a_seam_is_played_with_another_insertion_and_nothing_is_edited(
    run: Run, file: Path, tmp_path: Path, variation: Variation
) -> None:
    seam = next(one for one in variation.seams if one.transition and len(one.transition.candidates) == 3)
    before = file.read_bytes()
    for alternative in (None, 2, 3):
        shown = variation.around(seam.number, alternative)
        assert seam.transition is not None
        candidate = seam.transition.candidates[(alternative or 1) - 1]
        (mark,) = [one for one in shown.insertions if one.times[0] >= shown.times[0]]
        assert mark.times[-1] - mark.times[0] == pytest.approx(candidate.motion.times[-1])
        assert 0.0 < mark.times[0] - shown.times[0] <= 1.0 + 1e-6
        assert 0.0 < shown.times[-1] - mark.times[-1] <= 1.0 + 1e-6
        words = ("--alternative", alternative) if alternative else ()
        played = run("review", file, "--play", seam.number, *words, "-o", tmp_path / "seam.html")
        assert played.code == 0
        assert f"seam {seam.number}, {len(shown)} frames" in played.out
    assert file.read_bytes() == before
    for words, message in (
        (("--play", 1), "--play needs a file, such as -o seam-1.gif"),
        (("--play", 999, "-o", "x.gif"), "no seam 999"),
        (("--play", seam.number, "--alternative", 9, "-o", "x.gif"), "has alternatives 1 to 3, no alternative 9"),
        (("--play", 1, "-o", "x.json"), "the name must end in one of .png, .gif, .mp4, .svg, .html"),
        (("--play", 1, "--undo", "-o", "x.gif"), "--play draws one seam; leave out"),
        (("--alternative", 2), "--replace and --alternative need each other"),
        (("--sheet", "x.gif"), "the name must end in one of .png"),
    ):
        done = run("review", file, *words)
        assert (done.code, message in done.err) == (2, True), done.err
        assert file.read_bytes() == before
