"""Drawings: one mark for each sign, shapes that tell directions and levels apart, pages."""

from __future__ import annotations

import re
from io import BytesIO
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from staves import random_staff, staff_of

from motionmind import MotionMindError, read_motion, read_score
from motionmind.laban.columns import notate
from motionmind.laban.drawing import Drawing, draw_staff
from motionmind.laban.shapes import Box, draw_sign, outline, stripes
from motionmind.laban.signs import AROUND, PLACE, Direction, Hold, Sign, Staff, Turn
from motionmind.plots.marks import Dot, Line, Polygon
from motionmind.render.palette import INK
from motionmind.transcription import transcribe

BOX = Box(0.0, 0.0, 20.0, 60.0)


def drawn(staff: Staff) -> str:
    return draw_staff(staff).encode(".svg").decode()


def titles(svg: str, css: str) -> list[str]:
    """The words of all groups of a class."""
    root = ElementTree.fromstring(svg)
    name = "{http://www.w3.org/2000/svg}"
    groups = [group for group in root.iter(f"{name}g") if group.get("class") == css]
    return [group.findtext(f"{name}title") or "" for group in groups]


def assert_one_mark_for_each_sign(staff: Staff) -> None:
    svg = drawn(staff)
    wanted = [
        f"{sign.column}, counts {sign.begin:g} to {sign.end:g}: {sign.value}"
        for sign in staff.signs
        if not isinstance(sign.value, Hold)
    ]
    assert sorted(titles(svg, "sign")) == sorted(wanted)
    assert sorted(titles(svg, "start")) == sorted(f"{column}, start: {value}" for column, value in staff.start.items())
    assert set(titles(svg, "continued")) <= set(wanted)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_a_random_staff_has_one_mark_for_each_sign(seed: int) -> None:
    assert_one_mark_for_each_sign(random_staff(seed))


def test_a_long_staff_has_one_mark_for_each_sign_on_its_pages() -> None:
    staff = random_staff(5, n_signs=120)
    drawing = draw_staff(staff)
    assert len(drawing.pages) > 1
    assert len({(page.width, page.height) for page in drawing.pages}) == 1
    assert_one_mark_for_each_sign(staff)
    picture = Image.open(BytesIO(drawing.encode(".png")))
    assert picture.height == 2 * sum(page.height for page in drawing.pages)
    assert len(re.findall(rb"/Type\s*/Page\b", drawing.encode(".pdf"))) == len(drawing.pages)


@pytest.mark.parametrize("take", ["cmu-05/05_02.bvh", "cmu-05/05_11.bvh", "cmu-29/29_01.amc"])
def test_transcribed_recordings_are_drawn(shared_data: Path, tmp_path: Path, take: str) -> None:
    path = tmp_path / "a.score"
    motion = read_motion(shared_data / take)
    path.write_text(transcribe(motion.slice(1, min(len(motion), 600)), 12.0).text, encoding="utf-8")
    score = read_score(path)
    staff = notate(score, score.clips[0], 4).staff
    assert len(staff.signs) > 20
    assert_one_mark_for_each_sign(staff)


def test_the_outlines_of_all_directions_differ() -> None:
    for on_left in (True, False):
        shapes = [outline(around, BOX, on_left=on_left) for around in (PLACE, *AROUND)]
        for a, b in combinations(shapes, 2):
            assert a.shape != b.shape or not np.allclose(a, b)


@pytest.mark.parametrize("around", [PLACE, *AROUND])
def test_left_and_right_are_drawn_as_mirror_images(around: str) -> None:
    words = {"left": "right", "right": "left"}
    other = "-".join(words.get(word, word) for word in around.split("-"))
    mirrored = outline(other, BOX, on_left=True) * [-1.0, 1.0] + [BOX.right, 0.0]
    mine = outline(around, BOX, on_left=False)
    assert {tuple(corner) for corner in mirrored.round(6)} == {tuple(corner) for corner in mine.round(6)}


@pytest.mark.parametrize("around", [PLACE, *AROUND])
def test_forward_is_backward_upside_down(around: str) -> None:
    words = {"forward": "back", "back": "forward"}
    other = "-".join(words.get(word, word) for word in around.split("-"))
    turned = outline(other, BOX, on_left=True) * [1.0, -1.0] + [0.0, BOX.bottom]
    mine = outline(around, BOX, on_left=True)
    assert {tuple(corner) for corner in turned.round(6)} == {tuple(corner) for corner in mine.round(6)}


@pytest.mark.parametrize("around", [PLACE, *AROUND])
def test_levels_are_stripes_a_dot_and_black(around: str) -> None:
    marks = {level: [*draw_sign(Direction(around, level), BOX, on_left=True)] for level in ("low", "middle", "high")}
    shapes = {level: next(mark for mark in own if isinstance(mark, Polygon)) for level, own in marks.items()}
    assert [level for level, shape in shapes.items() if shape.fill == INK] == ["low"]
    assert [level for level, own in marks.items() if any(isinstance(mark, Dot) for mark in own)] == ["middle"]
    assert [level for level, own in marks.items() if any(isinstance(mark, Line) for mark in own)] == ["high"]


@pytest.mark.parametrize("around", [PLACE, *AROUND])
def test_stripes_stay_within_their_sign(around: str) -> None:
    corners = outline(around, BOX, on_left=True)
    lines = [*stripes(corners)]
    assert len(lines) > 5
    for start, end in lines:
        assert inside(corners, 0.5 * (start + end))
        assert np.isclose(start.sum(), end.sum())


def inside(corners: np.ndarray, point: np.ndarray) -> bool:
    """Whether a point is within a polygon, by the edges that a ray to the right crosses."""
    crossed = False
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if (y1 > point[1]) != (y2 > point[1]) and point[0] < x1 + (x2 - x1) * (point[1] - y1) / (y2 - y1):
            crossed = not crossed
    return crossed


def test_time_runs_upward_and_signs_are_as_long_as_they_last() -> None:
    signs = [Sign("left arm", 0.0, 1.0, Direction(PLACE, "low")), Sign("left arm", 1.0, 3.0, Direction(PLACE, "high"))]
    page = draw_staff(staff_of(signs)).pages[0]
    shapes = [group.marks[1] for group in page.marks if getattr(group, "attributes", "") == 'class="sign"']
    first, second = (shape.corners[:, 1] for shape in shapes)
    assert second.max() <= first.min() + 1.0
    assert 2.6 < (second.max() - second.min()) / (first.max() - first.min()) < 3.4


def test_columns_are_in_the_order_of_the_books() -> None:
    values = {column: Direction(PLACE, "low") for column in ("left arm", "torso", "left leg", "left support")}
    values |= {column: Direction(PLACE, "low") for column in ("right support", "right leg", "right arm", "head")}
    page = draw_staff(staff_of([Sign(column, 0.0, 1.0, value) for column, value in values.items()], {})).pages[0]
    shapes = [group.marks for group in page.marks if getattr(group, "attributes", "") == 'class="sign"']
    left = {marks[0].text.partition(",")[0]: float(marks[1].corners[:, 0].min()) for marks in shapes}
    assert sorted(left, key=left.__getitem__) == list(values)


def test_a_turn_stands_across_the_supports_but_beside_a_step() -> None:
    def places(*signs: Sign) -> tuple[float, float]:
        page = draw_staff(staff_of([Sign("turn", 0.0, 1.0, Turn(90)), *signs], {})).pages[0]
        group = next(
            mark
            for mark in page.marks
            if getattr(mark, "attributes", "") == 'class="sign"' and "turn," in mark.marks[0].text
        )
        centre = page.marks[1].points[0, 0]
        return float(group.marks[1].corners[:, 0].min() - centre), float(group.marks[1].corners[:, 0].max() - centre)

    both = places()
    left = places(Sign("left support", 0.0, 1.0, Hold()))
    step = places(Sign("left support", 0.0, 1.0, Direction("forward", "low")))
    assert both[0] < -15.0 < 15.0 < both[1]
    assert left[0] < -15.0 < left[1] < 0.0
    assert step[0] > 100.0


def test_the_documents_show_the_drawing_of_their_score(tmp_path: Path) -> None:
    docs = Path(__file__).parents[2] / "docs"
    path = tmp_path / "tendu.score"
    path.write_text((docs / "notation.md").read_text("utf-8").split("```text\n")[1].partition("```")[0], "utf-8")
    score = read_score(path)
    assert (docs / "gallery" / "tendu.svg").read_text("utf-8") == drawn(notate(score, score.clips[0], 4).staff)


def test_a_score_that_is_too_long_is_refused() -> None:
    staff = Staff("Long", "human23", 60.0, 4, 100_000.0, {}, (Sign("turn", 0.0, 1.0, Turn(90)),))
    with pytest.raises(MotionMindError, match="pages, and at most 100 are drawn"):
        draw_staff(staff)


@pytest.mark.parametrize(("suffix", "most", "others"), [(".png", 10, ".svg or .pdf"), (".pdf", 20, ".svg")])
def test_pixels_of_many_pages_are_refused(suffix: str, most: int, others: str) -> None:
    def drawing(counts: float) -> Drawing:
        return draw_staff(Staff("Long", "human23", 60.0, 4, counts, {}, (Sign("turn", 0.0, 1.0, Turn(90)),)))

    a_page = next(counts for counts in range(4, 999, 4) if len(drawing(float(counts)).pages) == 2) - 4
    with pytest.raises(
        MotionMindError, match=rf"^{most + 1} pages, and at most {most} are drawn as {suffix}; write {others}$"
    ):
        drawing(float(most * a_page + 4)).encode(suffix)
    assert drawing(float(most * a_page + 4)).encode(".svg")
