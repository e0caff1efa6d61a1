"""A variation on its attractor: what is drawn is what the file holds, and where the flow has it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import cache
from io import BytesIO
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from numpy.typing import ArrayLike
from pages import FINE, SCREENS, Tabs, reachable_controls, readable_words
from PIL import Image
from scipy.spatial import cKDTree

from motionmind._typing import Floats, Ints
from motionmind.body.motion import Motion
from motionmind.chaos.flows import FLOWS, Flow
from motionmind.errors import MotionMindError
from motionmind.notation.compose import motions
from motionmind.notation.read import read_score
from motionmind.plots import portrait as portraits
from motionmind.plots.attractor import ATTRACTORS, attractor, draw_attractor
from motionmind.plots.canvas import Plate, png, svg
from motionmind.plots.marks import Dot, Inset, Line, Region, Words
from motionmind.plots.portrait import Portrait, portrait_of
from motionmind.plots.scene import Room
from motionmind.plots.symbols import round_numbers
from motionmind.render.palette import PLOT
from motionmind.render.solids import EMPTY_CODE
from motionmind.variation.piece import Piece
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import write_variation

pytestmark = pytest.mark.long

MACARENA = Path(__file__).parents[2] / "corpora" / "macarena" / "macarena.score"
SVG = "{http://www.w3.org/2000/svg}"


def varied(flow: str, count: int = 131, **options: Any) -> Variation:
    """The first postures of the macarena, varied, nothing smoothed."""
    return vary(macarena().slice(0, count), flow=FLOWS[flow], **options)


@cache
def macarena() -> Motion:
    """The dance, which no test changes."""
    return motions(score := read_score(MACARENA), score.clips)[0]


@pytest.fixture(scope="module", params=["lorenz", "rossler"])
def portrait(request: pytest.FixtureRequest) -> Portrait:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(portraits, "N_SHEET_STEPS", 500_000)  # which fill the attractor, too
        found = portrait_of(varied(request.param, length=180))
        assert len(found.sheets) == 500_000
    return found


@pytest.fixture(scope="module")
def plate(portrait: Portrait) -> Plate:
    return attractor(portrait)


@pytest.fixture
def sketchy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Attractors of few strands, which are drawn quickly."""
    monkeypatch.setattr(portraits, "N_SHEET_STEPS", 20_000)


def lines(plate: Plate, ink: tuple[int, int, int]) -> list[Line]:
    """Lines of this colour, the longest first: trajectories have the most points."""
    found = [mark for mark in plate.marks if isinstance(mark, Line) and mark.ink == ink]
    return sorted(found, key=lambda line: -len(line.points))


def dots(plate: Plate, title: str) -> dict[int, Dot]:
    """Dots whose title begins so, by the number that follows; of several in one place the last."""
    found = ((mark, re.match(rf"{title} (\d+)", mark.title)) for mark in plate.marks if isinstance(mark, Dot))
    return {int(match[1]): mark for mark, match in found if match}


def boxes(plate: Plate, kind: type[Inset | Words]) -> Iterator[Floats]:
    """What insets or words take of the picture: left, top, right, bottom."""
    for mark in plate.marks:
        if isinstance(mark, Inset) and kind is Inset:
            yield np.array([*mark.at, *np.add(mark.at, mark.size)])
        elif isinstance(mark, Words) and kind is Words:
            long = 0.5 * mark.size * len(mark.text)
            left = mark.at[0] - {"start": 0.0, "middle": 0.5, "end": 1.0}[mark.anchor] * long
            yield np.array([left, mark.at[1] - 0.4 * mark.size, left + long, mark.at[1] + 0.4 * mark.size])


def disjoint(one: Floats, other: Floats) -> bool:
    return bool(np.any(one[:2] >= other[2:]) or np.any(other[:2] >= one[2:]))


# --- what is found again ----------------------------------------------------------------------------------------------


def test_trajectories_pass_the_sites_and_what_is_nearest_is_the_files_order(portrait: Portrait) -> None:
    order = portrait.variation.order
    assert (len(portrait.sites), len(portrait.points)) == (131, 180)
    assert np.array_equal(cKDTree(portrait.sites).query(portrait.points)[1], order)
    assert np.array_equal(portrait.points[0], portrait.sites[0] + portrait.variation.course.nudge)
    assert portrait.parting is not None
    assert np.array_equal(order[: portrait.parting], np.arange(portrait.parting))
    assert order[portrait.parting] != portrait.parting
    steps = np.diff(order)
    assert sorted(portrait.jumps) == (np.flatnonzero((steps != 1) & (steps != 0)) + 1).tolist()


def test_cells_are_those_of_the_map_where_the_attractor_is_seen(portrait: Portrait) -> None:
    seen, scale, near = portrait.seen(portrait.sheets), 10.0, 5
    corner = np.array([seen[:, 0].min() - 1.0, seen[:, 1].max() + 1.0])
    width, height = np.ceil((np.ptp(seen, axis=0) + 2.0) * scale).astype(int)
    cells = portrait.cells(corner, scale, int(width), int(height))
    assert set(np.unique(cells)) <= {EMPTY_CODE, *range(131)}

    sheets = cKDTree((seen - corner) * [scale, -scale])
    (left_out,) = portrait.axes[2]
    sign = 1.0 if portrait.flow.name == "rossler" else -1.0  # x and y are seen from above, x and z from before -y
    shown = 0
    for point, posture in zip(portrait.points, portrait.order, strict=True):
        column, row = (portrait.seen(point) - corner) * [scale, -scale]
        around = cells[int(row) - near : int(row) + near + 1, int(column) - near : int(column) + near + 1]
        if posture in around:
            shown += 1
        else:  # then something else is before it
            beside = portrait.sheets[sheets.query_ball_point((column, row), 4.0)]
            assert (sign * beside[:, left_out]).max() > sign * point[left_out] + 0.5
    assert shown > 0.6 * len(portrait.points)


def test_edits_hold_until_postures_are_moved() -> None:
    variation = varied("rossler", 40, length=60)
    number = variation.seams[0].number
    edited = variation.approve(number).cut(10, 14, 30).approve(variation.seams[1].number)
    found = portrait_of(edited)
    assert np.array_equal(found.variation.postures, variation.order)
    assert [seam.decision for seam in found.variation.seams][:2] == ["approved", "open"]


# --- what is drawn ----------------------------------------------------------------------------------------------------


def test_sites_and_points_are_drawn_where_the_axes_say(portrait: Portrait, plate: Plate) -> None:
    # As a reader does: numbers beside ticks tell where coordinates are.
    words = [mark for mark in plate.marks if isinstance(mark, Words) and re.fullmatch(r"-?[\d.]+", mark.text)]
    across, up, _ = portrait.axes
    names = [portrait.flow.dimensions[i] for i in (across, up)]
    x_name, y_name = (next(w for w in plate.marks if isinstance(w, Words) and w.text == name) for name in names)
    on_x = [w for w in words if w.anchor == "middle" and abs(w.at[1] - x_name.at[1]) < 15.0]
    on_y = [w for w in words if w.anchor == "end" and abs(w.at[0] - y_name.at[0]) < 15.0]
    for axis, ticks, coordinate in ((0, on_x, across), (1, on_y, up)):
        slope, start = np.polyfit([float(w.text) for w in ticks], [w.at[axis] for w in ticks], 1)
        for points, title in ((portrait.sites, "posture"), (portrait.points, "at")):
            found = dots(plate, title)
            assert sorted(found) == list(range(len(points)))
            drawn = np.array([found[n].at[axis] for n in range(len(points))])
            np.testing.assert_allclose(drawn, start + slope * points[:, coordinate], atol=1e-6)
        if axis == 0:
            across_slope = slope
    assert slope == pytest.approx(-across_slope)  # a cell has the shape that it has


def test_every_step_of_both_trajectories_is_drawn_and_passes_its_sites(portrait: Portrait, plate: Plate) -> None:
    for ink, title, count in ((PLOT.piece, "posture", 131), (PLOT.variation, "at", 180)):
        points = lines(plate, ink)[0].points
        assert len(points) == (count - 1) * portrait.every + 1
        places = np.array([dots(plate, title)[n].at for n in range(count)])
        np.testing.assert_allclose(points[:: portrait.every], places, atol=1e-9)
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() < 80.0


def test_both_itineraries_are_drawn_and_every_jump(portrait: Portrait, plate: Plate) -> None:
    seams = portrait.variation.seams
    told = re.compile(r"jump from posture (\d+) to (\d+), seam (\d+)$")
    found = [told.search(mark.title) for mark in plate.marks if isinstance(mark, Dot)]
    jumps = sorted(tuple(map(int, match.groups())) for match in found if match)
    assert jumps == sorted(2 * [(seam.start, seam.end, seam.number) for seam in seams])

    top = max(mark.at[1] for mark in dots(plate, "at").values())
    below = [
        m for m in plate.marks if isinstance(m, Dot) and m.at[1] > top + 50.0 and PLOT.variation in (m.fill, m.rim)
    ]
    places = {round(mark.at[0], 6): mark.at[1] for mark in below}  # a parting lies on a jump
    heights = [places[x] for x in sorted(places)]
    assert len(heights) == len(portrait.order)
    slope, start = np.polyfit(portrait.order, heights, 1)
    np.testing.assert_allclose(heights, start + slope * portrait.order, atol=1e-6)
    piece = next(line for line in lines(plate, PLOT.piece) if len(line.points) == 2 and line.points[:, 1].min() > top)
    np.testing.assert_allclose(piece.points[:, 1], [start, start + slope * 130], atol=1e-6)


def test_what_is_written_and_the_figures_can_be_read(plate: Plate) -> None:
    figures, words = list(boxes(plate, Inset)), list(boxes(plate, Words))
    assert len(figures) >= 8
    page = np.array([0.0, 0.0, plate.width, plate.height])
    for box in figures + words:
        assert not disjoint(box, page)
        assert np.all(box[:2] >= 0.0)
        assert np.all(box[2:] <= page[2:])
    for one, other in combinations(figures, 2):
        assert disjoint(one, other)
    for one in figures:
        assert all(disjoint(one, box) for box in words)
    numbers = [box for box in words if box[1] > 140.0]
    for one, other in combinations(numbers, 2):
        assert disjoint(one, other)
    named = {mark.text for mark in plate.marks if isinstance(mark, Words) and mark.text.isdecimal()}
    assert {"0", "100"} <= named


def test_a_leader_leads_from_a_figure_to_its_own_site(portrait: Portrait, plate: Plate) -> None:
    sites = dots(plate, "posture")
    marks = list(plate.marks)
    for n, mark in enumerate(marks):
        if isinstance(mark, Inset):
            line, dot, foot = marks[n - 2], marks[n - 1], marks[n + 1]
            assert isinstance(line, Line)
            assert isinstance(dot, Dot)
            assert isinstance(foot, Words)
            np.testing.assert_allclose(line.points[1], sites[int(foot.text)].at)
            assert dot.title == mark.title
            assert mark.title.startswith(f"posture {foot.text} of")
            box = np.array([*np.subtract(mark.at, 6.0), *np.add(np.add(mark.at, mark.size), 6.0)])
            assert np.all(box[:2] <= line.points[0])
            assert np.all(line.points[0] <= box[2:])


def test_a_figure_is_solid_within_and_nothing_around() -> None:
    piece = Piece(ballet_clip("jump"), np.arange(len(ballet_clip("jump"))))
    plate = attractor(portrait_of(vary(piece, flow=FLOWS["rossler"])))
    figures = [mark for mark in plate.marks if isinstance(mark, Inset)]
    assert len(figures) == 7  # each in a cell as large
    for figure in figures:
        opacity = figure.pixels[..., 3]
        assert opacity[[0, -1]].max() == opacity[:, [0, -1]].max() == 0
        assert 0.1 < (opacity == 255).mean() < 0.8
        assert figure.size[1] == pytest.approx(104.0, rel=0.3)


# --- laws of what draws it --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("flow", "count", "length"), [("rossler", 1, 1), *((flow, 4, 12) for flow in sorted(FLOWS))])
@pytest.mark.usefixtures("sketchy")
def test_every_flow_can_be_drawn(flow: str, count: int, length: int) -> None:
    plate = attractor(portrait_of(varied(flow, count, length=length)))
    assert sorted(dots(plate, "posture")) == list(range(count))
    assert sorted(dots(plate, "at")) == list(range(length))
    root = ElementTree.fromstring(svg(plate))
    assert len(root.findall(f"{SVG}circle")) == sum(isinstance(mark, Dot) for mark in plate.marks)
    assert len(root.findall(f"{SVG}polyline")) == sum(isinstance(mark, Line) for mark in plate.marks)
    assert len(root.findall(f"{SVG}path")) == sum(isinstance(mark, Region) for mark in plate.marks)


def test_png_shows_what_svg_does(plate: Plate) -> None:
    image = Image.open(BytesIO(png(plate))).convert("RGB")
    assert image.size == (plate.width, plate.height)
    found, places = 0, np.array([mark.at for mark in plate.marks if isinstance(mark, Dot)])
    for title, ink in (("posture", PLOT.piece), ("at", PLOT.variation)):
        for dot in dots(plate, title).values():
            around = np.hypot(*(places - dot.at).T) < 8.0
            if around.sum() == 1 and dot.fill == ink:
                pixel = image.getpixel((int(dot.at[0]), int(dot.at[1])))
                found += bool(np.abs(np.subtract(pixel, ink)).max() < 90)
    assert found > 20


def test_a_figure_has_room_of_its_own() -> None:
    rng = np.random.default_rng(3)
    room, taken = Room(600, 400), list[Floats]()
    cells = np.where(np.hypot(*np.mgrid[-100:100, -150:150]) < 90.0, 5, EMPTY_CODE).astype(np.int16)
    room.cover((150.0, 100.0), cells)
    for posture in range(12):
        site = np.array([300.0, 200.0]) + rng.uniform(-70.0, 70.0, 2)
        corner = room.near(posture, site, 60.0, 90.0)
        if corner is None:
            continue
        box = np.array([*corner, corner[0] + 60.0, corner[1] + 90.0])
        inside = cells[int(box[1]) - 100 : int(box[3]) - 100, max(int(box[0]) - 150, 0) : max(int(box[2]) - 150, 0)]
        assert set(np.unique(inside)) <= {EMPTY_CODE, posture}
        assert all(disjoint(box, other) for other in taken)
        taken.append(box)
        room.join(corner, 60.0, 90.0, np.stack([0.5 * (box[:2] + box[2:]), site]))
    assert len(taken) > 3


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-30.2, 30.7), (0.0, 999.0), (-2e-3, 1e-3), (5.0, 76.8)])
def test_ticks_are_round_and_about_six(low: float, high: float) -> None:
    ticks = round_numbers(low, high)
    assert low <= ticks[0]
    assert ticks[-1] <= high
    assert 2 <= len(ticks) <= 7
    step = ticks[1] - ticks[0]
    assert f"{step:.6e}"[0] in "125"
    np.testing.assert_allclose(np.round(ticks / step), ticks / step, atol=1e-9)


# --- files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ATTRACTORS)
@pytest.mark.usefixtures("sketchy")
def test_the_command_writes_the_same_bytes_again(suffix: str, run: Run) -> None:
    write_variation("variation.json", varied("rossler", 6))
    for name in ("one", "two"):
        ran = run("attractor", "--of", "variation.json", "-o", f"{name}{suffix}")
        assert (ran.code, ran.out, ran.err) == (0, f"{name}{suffix}: rossler, 6 sites, 6 points\n", "")
    assert Path(f"one{suffix}").read_bytes() == Path(f"two{suffix}").read_bytes()


def test_what_cannot_be_drawn_is_refused_in_a_line(run: Run) -> None:
    variation = varied("rossler", 30)
    write_variation("variation.json", variation)
    write_variation("changed.json", replace(variation, order=variation.order[::-1]))
    for name, course in (("flat", {"nudge": (0.1, 0.0)}), ("still", {"skip": -1})):
        write_variation(f"{name}.json", replace(variation, course=replace(variation.course, **course)))
    strange = Flow("strange", FLOWS["rossler"].field, (1.0, 1.0, 0.0), 0.05, parameters={"a": 0.2, "b": 0.2, "c": 5.7})
    write_variation("strange.json", vary(variation.piece, flow=strange))
    Path("notes.json").write_text("[]")
    for source, output, fault in (
        ("variation.json", "a.pdf", "must end in one of .png, .svg, .html"),
        ("variation.json", "gone/a.png", "there is no folder"),
        ("gone.json", "a.png", "there is no such file"),
        ("notes.json", "a.png", "notes.json"),
        ("changed.json", "a.png", "give another order here"),
        ("flat.json", "a.png", "not 2 numbers and 10"),
        ("still.json", "a.png", "not 3 numbers and -1"),
        ("strange.json", "a.png", "no flow 'strange'"),
    ):
        ran = run("attractor", "--of", source, "-o", output)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert fault in ran.err
        assert not Path(output).exists()
    run("convert", "variation.json", "plain.bvh")
    run("convert", "plain.bvh", "plain.json")
    assert "movement alone" in run("attractor", "--of", "plain.json", "-o", "a.png").err
    with pytest.raises(MotionMindError, match=r"an attractor is written as one of \.png"):
        draw_attractor("a.pdf", variation)
    long = Variation(variation.piece, variation.course, np.zeros(10_001, dtype=np.int64))
    with pytest.raises(MotionMindError, match="10000 postures at most, not 10001"):
        portrait_of(long)


def test_names_that_xml_cannot_hold_are_written_as_it_can() -> None:
    words = Words((0.0, 0.0), 'a<b & "c"\x01', 10.0, (0, 0, 0))
    dot = Dot((0.0, 0.0), 1.0, (0, 0, 0), (0, 0, 0), title="<>\x02")
    ElementTree.fromstring(svg(Plate(10, 10, "&\x03", (words, dot))))


# --- the page ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def danced() -> Variation:
    return varied("rossler", 40, length=60)


@pytest.fixture(scope="module")
def page(danced: Variation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    draw_attractor(path := tmp_path_factory.mktemp("page") / "page.html", danced)
    return path


@pytest.fixture
def said() -> list[str]:
    """What pages complained of."""
    return []


@pytest.fixture
def show(tabs: Tabs, page: Path, said: list[str]) -> Iterator[Callable[..., Any]]:
    """A function that opens the page; afterwards, that it neither complained nor asked for anything."""
    asked: list[str] = []
    hearing = {
        "console": lambda message: said.append(message.text),
        "pageerror": lambda error: said.append(str(error)),
        "request": lambda request: asked.append(request.url),
    }

    def show(ready: str = "window.motionmind?.attractor", script: str = "", **options: Any) -> Any:
        usual = {"viewport": {"width": 900, "height": 500}, "reduced_motion": "reduce", "device_scale_factor": 0.5}
        tab = using.enter_context(tabs.tab(hearing, script=script, **(usual | options)))
        tab.goto(page.as_uri())
        for _ in range(500):
            if tab.evaluate(f"!!({ready})"):
                break
            tab.wait_for_timeout(20)
        return tab

    with ExitStack() as using:
        yield show
    assert [line for line in said if not re.search("GPU stall|WebGL context could not", line)] == []
    assert [url for url in asked if not url.startswith(("data:", "file:"))] == []


def test_the_page_follows_the_variation_on_its_attractor(show: Callable[..., Any], danced: Variation) -> None:
    variation, tab = danced, show(**FINE)
    times = variation.motion().times[variation.arrange().frames]
    found = tab.evaluate(
        "motionmind.attractor.times.map(time => (motionmind.player.seek(time), motionmind.attractor.posture))"
    )
    assert found == variation.order.tolist()
    np.testing.assert_allclose(tab.evaluate("motionmind.attractor.times"), times)

    portrait = portrait_of(variation)
    for n in (0, 17, 41):
        at = 0.75 * times[n] + 0.25 * times[n + 1]
        tab.evaluate(f"motionmind.player.seek({at})")
        place = tab.evaluate("motionmind.attractor.place")
        np.testing.assert_allclose(place, [n, 0.25], atol=1e-6)
        # Places in the page are those of the flow but for where the origin is, and a scale.
        here = np.array(tab.evaluate("[...motionmind.attractor.head.geometry.attributes.position.array]"))
        sites = np.array(tab.evaluate("[...motionmind.attractor.sites]")).reshape(-1, 3)
        scale = np.ptp(sites[:, 0]) / np.ptp(portrait.sites[:, 0])
        np.testing.assert_allclose(sites - sites[0], scale * (portrait.sites - portrait.sites[0]), atol=1e-5)
        step = (n + 0.25) * portrait.every
        before, share = portrait.other[int(step)], step - int(step)
        wanted = before + share * (portrait.other[int(step) + 1] - before)
        np.testing.assert_allclose(here - sites[0], scale * (wanted - portrait.sites[0]), atol=1e-5)
        cell = tab.evaluate(
            "(({ cell: { geometry: { index, attributes } } }) => [...index.array].map(i => "
            "[0, 1, 2].map(k => attributes.position.array[3 * i + k])))(motionmind.attractor)"
        )
        assert len(cell) > 20
        assert (cKDTree(sites).query(cell)[1] == variation.order[n]).mean() > 0.99  # floats of half the length
        assert tab.inner_text("#site") == str(variation.order[n])
        assert f"posture {variation.order[n]}, at {n} of 59" in tab.inner_text("#reading")
    shot = np.array(Image.open(BytesIO(tab.locator("#space").screenshot())).convert("RGB")).astype(int)
    for ink in (PLOT.piece, PLOT.variation):
        assert (np.abs(shot - ink).max(axis=-1) < 40).sum() > 50


@pytest.mark.parametrize("screen", SCREENS)
def test_the_page_fits_every_screen_and_can_be_read(show: Callable[..., Any], danced: Variation, screen: str) -> None:
    jump = max(portrait_of(danced).jumps)
    tab = show(color_scheme="dark", **SCREENS[screen])
    check_page(tab, screen, jump)
    dark = paper_of(tab)
    tab.emulate_media(color_scheme="light", reduced_motion="reduce")
    check_page(tab, screen, jump)
    assert luminance(paper_of(tab)) > luminance(dark) + 0.5


def check_page(tab: Any, screen: str, jump: int) -> None:
    """Check that a page fits its screen and can be read, before and after the variation jumps to a posture."""
    controls = reachable_controls(tab, 44 if SCREENS[screen].get("has_touch") else 32)
    assert {"space", "canvas", "timeline", "play", "front", "dark", "help"} <= controls
    # Numbers as long as they become, and an attractor that has to be as large at all times.
    tab.evaluate("motionmind.player.seek(motionmind.attractor.times[0])")
    room = tab.locator("#space").bounding_box()
    tab.evaluate(f"motionmind.player.seek(motionmind.attractor.times[{jump}])")
    assert tab.locator("#space").bounding_box() == room
    assert min(room["width"], room["height"]) > 100
    assert "jumped from" in tab.inner_text("#reading")
    assert tab.evaluate("(({ scrollWidth, clientWidth }) => scrollWidth <= clientWidth)(reading)")
    assert {"flow", "reading", "piece", "other", "cell", "site", "h1"} <= readable_words(tab)
    # Lines and dots need a contrast of 3: WCAG 2.2, 1.4.11.
    paper = paper_of(tab)
    for name in ("piece", "other"):
        line = f"document.querySelector('#attractor .{name}')"
        ink = tab.evaluate(f"getComputedStyle({line}, '::before').backgroundColor")
        light, dark = sorted([luminance(paper), luminance([int(v) for v in re.findall(r"\d+", ink)])], reverse=True)
        assert (light + 0.05) / (dark + 0.05) > 3.0


def paper_of(tab: Any) -> Ints:
    """The colour of the paper that the attractor is drawn on [3]."""
    return np.array(Image.open(BytesIO(tab.locator("#space").screenshot())).convert("RGB"))[2, 2].astype(np.int64)


def luminance(colour: ArrayLike) -> float:
    """Relative luminance of an sRGB colour, 0 to 255 (WCAG 2.2)."""
    share = np.asarray(colour) / 255.0
    linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("screen", SCREENS)
def test_without_webgl_the_page_only_says_so(show: Callable[..., Any], said: list[str], screen: str) -> None:
    script = "HTMLCanvasElement.prototype.getContext = () => null"
    tab = show("document.getElementById('attractor').hidden", script, **SCREENS[screen])
    size = SCREENS[screen]["viewport"]
    box, main = tab.locator("#message").bounding_box(), tab.locator("main").bounding_box()
    assert (main["width"], main["height"]) == (size["width"], size["height"])
    assert box["x"] + box["width"] / 2 == pytest.approx(size["width"] / 2, abs=1)
    assert "WebGL" in tab.inner_text("#message")
    said.clear()  # three.js says it too


def test_keys_turn_the_picture_that_has_the_focus(show: Callable[..., Any]) -> None:
    tab = show()
    places = "[motionmind.attractor, motionmind.stage].map(one => one.camera.position.toArray())"
    before = tab.evaluate(places)
    tab.focus("#space")
    tab.keyboard.press("Shift+ArrowLeft")
    turned = tab.evaluate(places)
    assert turned[0] != before[0]
    assert turned[1] == before[1]
    tab.focus("#canvas")
    tab.keyboard.press("Shift+ArrowLeft")
    again = tab.evaluate(places)
    assert again[0] == turned[0]
    assert again[1] != turned[1]


def test_a_variation_that_is_longer_than_its_piece_stays_with_it_to_its_end(sketchy: None) -> None:
    found = portrait_of(vary(Piece.of(ballet_clip("jump")), nudge=0.0, length=20))
    assert found.parting is None
    words = [mark.text for mark in attractor(found).marks if isinstance(mark, Words)]
    assert any("stays with it to its end" in text for text in words)
    assert not any("they part at" in text for text in words)


def test_more_steps_than_a_picture_has_lines_for_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(portraits, "MAX_STEPS", 100)
    with pytest.raises(MotionMindError, match="shows 100 steps at most, not 220: 20 postures, 11 steps each"):
        portrait_of(vary(Piece.of(ballet_clip("jump")), length=20))
