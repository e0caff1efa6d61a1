"""Laws of the vectors: outlines are exact before they are smooth, and what a browser shows is the picture."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from bundled_clips import ballet_clip
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image, ImageDraw

from motionmind._typing import Floats, Int16s
from motionmind.body.human import human23, human44
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot
from motionmind.render.bspline import path
from motionmind.render.solids import EMPTY_CODE
from motionmind.render.stage import Stage
from motionmind.render.svg import svg, write_svg
from motionmind.render.timing import frame_times
from motionmind.render.trace import Lines, outlines, ridges, smooth
from motionmind.render.view import VIEWS

SVG = "{http://www.w3.org/2000/svg}"
seeds = st.integers(0, 2**32 - 1)


def blots(seed: int, labels: int = 3, size: int = 40) -> Int16s:
    """Regions of some labels on nothing: discs one over another, and specks."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:size, :size]
    picture = np.full((size, size), EMPTY_CODE, dtype=np.int16)
    for _ in range(8):
        middle, radius = rng.uniform(0, size, 2), rng.uniform(1, size / 3)
        picture[np.hypot(x - middle[0], y - middle[1]) < radius] = rng.integers(EMPTY_CODE, labels)
    specks = rng.random((size, size)) < 0.05
    picture[specks] = rng.integers(EMPTY_CODE, labels, (size, size))[specks]
    return picture


def disc(radius: float, size: int = 100) -> Int16s:
    """A disc about the middle of a picture."""
    y, x = np.mgrid[:size, :size] + 0.5
    return np.where(np.hypot(x - size / 2, y - size / 2) < radius, 0, EMPTY_CODE).astype(np.int16)


def split(lines: Lines) -> list[Floats]:
    """The points of each line."""
    return np.split(lines.points, lines.starts[1:-1]) if len(lines.labels) else []


def sides(lines: Lines) -> set[tuple[float, ...]]:
    """The edges of samples, from corner to corner, along which lines run."""
    found = []
    for points, closed in zip(split(lines), lines.closed, strict=True):
        ahead = np.roll(points, -1, axis=0)
        found += [(*a, *b) for a, b in (zip(points, ahead, strict=True) if closed else pairwise(points))]
    assert len(found) == len(set(found))
    return set(found)


def curve(text: str, scale: float) -> list[Floats]:
    """The points of a path's splines [..., 2] in samples, by the rules of SVG for m, q and t."""
    pen, control, lines = np.zeros(2), np.zeros(2), []
    for command, numbers in re.findall("([mqt])([^mqt]*)", text):
        pairs = np.array([float(number) for number in re.findall(r"[+-]\d+", numbers)]).reshape(-1, 2)
        if command == "m":
            pen = pen + pairs[0]
            lines.append([pen])
            continue
        for pair in pairs[1:] if command == "q" else pairs:
            control = pen + pairs[0] if command == "q" else 2.0 * pen - control
            for t in np.linspace(0.0, 1.0, 9)[1:]:
                lines[-1].append((1 - t) ** 2 * pen + 2 * t * (1 - t) * control + t * t * (pen + pair))
            pen = pen + pair
    return [np.array(line) / scale for line in lines]


def distance(points: Floats, line: Floats) -> Floats:
    """How far points [N, 2] are from a closed line [M, 2]."""
    ahead = np.roll(line, -1, axis=0) - line
    share = ((points[:, None] - line) * ahead).sum(axis=-1) / np.maximum((ahead**2).sum(axis=-1), 1e-12)
    return np.linalg.norm(points[:, None] - line - share.clip(0.0, 1.0)[..., None] * ahead, axis=-1).min(axis=1)


# --- tracing --------------------------------------------------------------------------------------------------------


@given(seeds)
@settings(max_examples=30)
def test_the_area_in_outlines_is_that_of_their_samples(seed: int) -> None:
    picture = blots(seed)
    lines = outlines(picture)
    for label in range(3):
        assert lines.areas()[lines.labels == label].sum() == (picture == label).sum()
    assert set(np.unique(lines.labels)) == set(np.unique(picture)) - {EMPTY_CODE}


@given(seeds)
@settings(max_examples=30)
def test_outlines_filled_are_the_picture_they_were_traced_from(seed: int) -> None:
    picture = blots(seed)
    lines = outlines(picture)
    again = np.full(picture.shape, EMPTY_CODE)
    for label in range(3):
        image = Image.new("1", (4 * picture.shape[1], 4 * picture.shape[0]))
        own = lines.only(lines.labels == label)
        areas = own.areas()
        for number in np.argsort(-np.abs(areas), kind="stable"):  # holes after what they are in
            corners = [tuple(point) for point in 4.0 * split(own)[number]]
            ImageDraw.Draw(image).polygon(corners, fill=int(areas[number] > 0.0))
        again[np.asarray(image)[2::4, 2::4]] = label
    assert (again == picture).all()


@given(seeds)
@settings(max_examples=20)
def test_smooth_lines_pass_each_edge_within_half_a_sample(seed: int) -> None:
    lines = outlines(blots(seed))
    for raw, drawn in zip(split(lines), split(smooth(lines)), strict=True):
        assert np.abs(drawn - 0.5 * (raw + np.roll(raw, -1, axis=0))).max() <= 0.5 + 1e-9


@pytest.mark.parametrize("radius", [6.0, 11.0, 40.2])
def test_a_disc_becomes_rounder(radius: float) -> None:
    lines = outlines(disc(radius))
    text = path(smooth(lines), 10.0)
    off = [np.abs(np.hypot(*(points - 50.0).T) - radius).max() for points in (lines.points, curve(text, 10.0)[0])]
    assert off[1] < 0.75 * off[0]
    assert len(text) < 8 * radius + 80  # a byte or so a sample of its outline


@pytest.mark.parametrize("slope", [0.02, 0.11, 0.37, 0.5, 0.93])
def test_a_slanted_edge_becomes_straight(slope: float) -> None:
    y, x = np.mgrid[:120, :300] + 0.5
    lines = outlines(np.where(y > 60.3 + slope * (x - 150.0), 0, EMPTY_CODE).astype(np.int16))
    points = curve(path(smooth(lines), 10.0), 10.0)[0]
    points = points[(np.abs(points[:, 0] - 150.0) < 50.0) & (np.abs(points[:, 1] - 60.0) < 50.0)]
    off = (points[:, 1] - 60.3 - slope * (points[:, 0] - 150.0)) / np.hypot(1.0, slope)
    assert len(points) > 8
    assert np.abs(off).max() < 0.45


@given(seeds)
@settings(max_examples=20)
def test_a_path_follows_its_lines_and_closes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:120, :120] - 59.7
    leaves, turn = rng.integers(1, 5), rng.uniform(0.0, 2.0 * np.pi)
    blob = np.hypot(x, y) < rng.uniform(20.0, 40.0) * (1.0 + 0.3 * np.cos(leaves * np.arctan2(y, x) + turn))
    lines = smooth(outlines(np.where(blob, 0, EMPTY_CODE).astype(np.int16)))
    (drawn,) = curve(path(lines, 10.0), 10.0)
    assert (drawn[0] == drawn[-1]).all()
    off = np.concatenate([distance(drawn, lines.points), distance(lines.points, drawn)])
    assert off.mean() < 0.7
    assert off.max() < 2.5  # where a dent is sharp


def test_a_path_starts_where_it_is_told_to() -> None:
    lines = smooth(outlines(disc(20.0)))
    here, there = (curve(path(lines, 10.0, start), 10.0)[0] for start in ((0, 0), (70, -30)))
    assert there == pytest.approx(here + np.array([7.0, -3.0]))


@given(seeds)
@settings(max_examples=30)
def test_ridges_are_where_a_part_stands_before_another(seed: int) -> None:
    parts = blots(seed)
    depth = np.where(parts == EMPTY_CODE, -np.inf, np.random.default_rng(seed).uniform(0.0, 1.0, parts.shape))
    parts, depth = np.pad(parts, 1, constant_values=EMPTY_CODE), np.pad(depth, 1, constant_values=-np.inf)
    least, most = set(), set()
    for y, x in np.argwhere(parts != EMPTY_CODE).tolist():
        around = [(y - 1, x, (x, y, x + 1, y)), (y, x + 1, (x + 1, y, x + 1, y + 1))]
        around += [(y + 1, x, (x + 1, y + 1, x, y + 1)), (y, x - 1, (x, y + 1, x, y))]
        for other_y, other_x, side in around:
            rise = depth[y, x] - depth[other_y, other_x]
            if parts[y, x] != parts[other_y, other_x] and rise > 0.2:
                most.add(side)
                if rise > 0.4:
                    least.add(side)
    assert least <= sides(ridges(parts, depth.astype(np.float32), 0.4)) <= most


def test_the_ridge_of_a_disc_is_its_outline() -> None:
    parts = disc(20.0)
    lines = ridges(parts, np.where(parts == EMPTY_CODE, -np.inf, 0.0).astype(np.float32), 0.1)
    assert lines.closed.tolist() == [True]
    assert sides(lines) == sides(outlines(parts))


def test_a_ridge_goes_on_across_a_joint_and_ends_at_what_hides_it() -> None:
    """A bar of two parts before nothing, and a second bar half behind it."""
    parts, depth = np.full((40, 60), EMPTY_CODE, dtype=np.int16), np.full((40, 60), -np.inf, dtype=np.float32)
    parts[2:38, 25:35], depth[2:38, 25:35] = 2, 0.0
    parts[15:25, 5:30], depth[15:25, 5:30] = 0, 1.0
    parts[15:25, 30:55], depth[15:25, 30:55] = 1, 1.0
    lines = ridges(parts, depth, 0.1)
    assert sorted(lines.closed) == [False, False, True]
    assert np.abs(lines.areas()).max() == 10 * 50
    ends = {
        tuple(point)
        for line, closed in zip(split(lines), lines.closed, strict=True)
        if not closed
        for point in line[[0, -1]]
    }
    assert ends == {(25, 15), (35, 15), (25, 25), (35, 25)}


# --- files ----------------------------------------------------------------------------------------------------------


@cache
def tween() -> Motion:
    """A second of ballet, of which the engine made the middle, with bridges."""
    motion = ballet_clip("adagio").slice(0, 4)
    times = np.linspace(0.0, 1.0, 4)
    one = Insertion(times, (("left_elbow", 0), ("right_knee", 1), ("right_knee", 2)))
    return replace(motion, times=times, insertions=(one,), name="tween")


def at_rest(skeleton: Skeleton, frames: int = 1) -> Motion:
    rotations = np.tile(rot.IDENTITY, (frames, len(skeleton), 1))
    root = np.tile([0.0, skeleton.height or 1.0, 0.0], (frames, 1))
    return Motion(skeleton, rotations, root, np.arange(frames) / 10.0)


def insect() -> Skeleton:
    """Six legs, 2 cm across."""
    names, parents, offsets, tips = ["body"], [-1], [[0.0, 0.0, 0.0]], [[0.0, 0.0, -0.008]]
    for side, out in (("left", 1.0), ("right", -1.0)):
        for row, z in (("front", 0.003), ("mid", 0.0), ("hind", -0.003)):
            names.append(f"{side}_{row}")
            parents.append(0)
            offsets.append([0.002 * out, 0.0, z])
            tips.append([0.008 * out, -0.006, z])
    return Skeleton("ant", tuple(names), tuple(parents), np.array(offsets), np.array(tips))


def test_frames_are_shown_when_they_are_to_be() -> None:
    motion = tween()
    root = ElementTree.fromstring(svg(motion, fps=8))
    (film,) = root.iter(f"{SVG}animate")
    total = float(film.attrib["dur"].removesuffix("s"))
    assert total == pytest.approx(motion.times[-1] - motion.times[0] + 0.8)
    shown = [float(key) * total for key in film.attrib["keyTimes"].split(";")]
    assert shown == pytest.approx(frame_times(motion, 8.0) - motion.times[0], abs=1e-4)
    frames = film.attrib["values"].split(";")
    assert len(set(frames)) == len(frames) == len(shown) == 9
    assert film.attrib["calcMode"] == "discrete"
    assert film.attrib["repeatCount"] == "indefinite"


def test_all_that_is_referred_to_is_there_once() -> None:
    text = svg(tween(), fps=8)
    ids = [one.attrib["id"] for one in ElementTree.fromstring(text).iter() if "id" in one.attrib]
    referred = re.findall(r'href="#([\w-]+)"', text) + re.findall(r"url\(#([\w-]+)\)", text)
    referred += re.findall(r"#(f\d+)", text)
    assert len(ids) == len(set(ids))
    assert set(referred) == set(ids)


@pytest.mark.long
def test_what_is_written_is_text() -> None:
    text = "".join(ElementTree.fromstring(svg(tween(), fps=8)).itertext())
    for words in ("0.00 s", "1.00 s", "frame 3", "inserted", "bridged: left_elbow", "bridged: right_knee"):
        assert words in text


def test_one_posture_stands_still() -> None:
    text = svg(tween().posture(1).as_motion())
    root = ElementTree.fromstring(text)
    assert not list(root.iter(f"{SVG}animate"))
    assert len(list(root.iter(f"{SVG}use"))) == 1


@pytest.mark.parametrize("skeleton", [human44(), insect()], ids=["44 joints", "six legs"])
@pytest.mark.parametrize("view", VIEWS)
def test_any_body_from_anywhere(skeleton: Skeleton, view: str) -> None:
    root = ElementTree.fromstring(svg(at_rest(skeleton, 2), view=view))
    assert len([one for one in root.iter(f"{SVG}g") if re.fullmatch(r"f\d+", one.attrib.get("id", ""))]) >= 2


def test_names_are_escaped() -> None:
    name = '</title><script>"&\x00\u2028'
    root = ElementTree.fromstring(svg(replace(at_rest(human23()), name=name)))
    assert root.findtext(f"{SVG}title") == name.replace("\x00", r"\u0000").replace("\u2028", r"\u2028")
    assert not list(root.iter(f"{SVG}script"))


@pytest.mark.long
def test_the_same_bytes_again(tmp_path: Path) -> None:
    for name in "ab":
        write_svg(tmp_path / f"{name}.svg", tween(), fps=4)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


@pytest.mark.long
def test_a_file_is_small() -> None:
    """Four seconds, with ghosts all the while."""
    motion = tween()
    one = replace(motion.insertions[0], times=4.0 * motion.times)
    assert len(svg(replace(motion, times=4.0 * motion.times, insertions=(one,)))) < 500_000


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match="frames a second, not 0"):
        svg(tween(), fps=0)
    with pytest.raises(MotionMindError, match="no view 'back'"):
        svg(tween(), view="back")
    with pytest.raises(MotionMindError, match="no such file or folder"):
        write_svg(tmp_path / "none" / "a.svg", at_rest(human23()))
    assert list(tmp_path.iterdir()) == []


# --- in a browser ---------------------------------------------------------------------------------------------------


def shots(browser: Any, file: Path, size: tuple[int, int], times: list[float], **media: str) -> list[Floats]:
    """What a browser shows of an SVG at some times, in seconds."""
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.emulate_media(**media)
    page.goto(file.as_uri())
    pictures = []
    for time in times:
        page.evaluate(f"document.documentElement.pauseAnimations(); document.documentElement.setCurrentTime({time})")
        page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        pictures.append(np.asarray(Image.open(BytesIO(page.screenshot())).convert("RGB"), dtype=np.float64))
    page.close()
    return pictures


def unlike(one: Floats, other: Floats) -> float:
    """The share of blocks of 4 by 4 pixels, but for the words underneath, whose colours plainly differ."""
    height, width = int(0.9 * len(one)) // 4, one.shape[1] // 4
    off = (one - other)[: 4 * height, : 4 * width].reshape(height, 4, width, 4, 3).mean(axis=(1, 3))
    return float((np.abs(off).max(axis=-1) > 30.0).mean())


@pytest.mark.long
def test_a_browser_shows_the_picture(browser: Any, tmp_path: Path) -> None:
    motion = tween()
    write_svg(tmp_path / "tween.svg", motion, fps=4)
    stage = Stage(motion, frame_times(motion, 4.0))
    pictures = [picture.astype(np.float64) for picture in stage.frames()]
    size = stage.camera.width, stage.camera.height
    times = [*(stage.motion.times + 0.01), 1.79, 1.81]
    shown = shots(browser, tmp_path / "tween.svg", size, times)
    for picture, shot in zip([*pictures, pictures[-1], pictures[0]], shown, strict=True):
        assert unlike(picture, shot) < 0.015
    assert unlike(pictures[0], shown[1]) > 0.05  # another posture is unlike


@pytest.mark.long
def test_who_wants_no_motion_sees_one_posture(browser: Any, tmp_path: Path) -> None:
    motion = tween()
    write_svg(tmp_path / "tween.svg", motion, fps=4)
    stage = Stage(motion, frame_times(motion, 4.0))
    size = stage.camera.width, stage.camera.height
    first, last = shots(browser, tmp_path / "tween.svg", size, [0.01, 1.01], reduced_motion="reduce")
    assert (first == last).all()
    assert unlike(stage.picture(2).astype(np.float64), first) < 0.015
