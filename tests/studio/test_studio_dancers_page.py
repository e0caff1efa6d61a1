"""Several dancers on the page: added, dragged, moved by keys, hidden, and played as the ensemble has them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pages import RESTING, Tabs
from piece_page import until
from studio_server import LARGE, SMALL, Served
from test_studio_dancers import TRIO, ensemble_in, opened, put
from test_studio_timeline import box_at_rest, wait_for_states

pytestmark = pytest.mark.long

# Each dancer's root, and the rotations of all joints, at a time.
_POSED = """(time) => studio.viewer.motion.dancers.map((dancer) => {
  const [rotations, root] = [new Float64Array(4 * dancer.piece.joints.length), new Float64Array(3)];
  dancer.sample(time, rotations, root);
  return [[...root], [...rotations]];
})"""

_DRAWN = """new Promise((drawn) => {
  studio.viewer.addEventListener('draw', drawn, { once: true });
  studio.viewer.stale();
})"""


@pytest.fixture
def page(studio_server: Served, studio_page: Any) -> Any:
    """A page with a piece of one stretch, in which nothing is sought; the panel of dancers is open."""
    studio_server.send("DELETE", "/api/seams")
    studio_server.insert("b1", "ballet/adagio", 0, 30)
    until(studio_page, "window.studio?.viewer.piece !== undefined")
    studio_page.evaluate("studio.viewer.back()")
    studio_page.get_by_test_id("open-dancers").click()
    studio_page.get_by_test_id("add-dancer").wait_for()
    return studio_page


def wait_for_dancers(page: Any, count: int) -> None:
    """Wait until the viewer shows so many dancers, and the lanes, too."""
    until(page, "(count) => (studio.viewer.motion?.dancers ?? []).length === count", count)
    until(page, "(count) => document.querySelectorAll('.lanes .danced').length === count", count)


def cast(page: Any) -> list[Any]:
    found: list[Any] = page.evaluate("studio.store.state.cast.dancers")
    return found


def entry(page: Any, name: str) -> float:
    return next(float(one["entry"]) for one in cast(page) if one["id"] == name)


def wait_for_entry(page: Any, name: str, count: float) -> None:
    until(
        page,
        "([id, count]) => studio.store.state.cast.dancers.find((one) => one.id === id)?.entry === count",
        [name, count],
    )
    # What is played follows.
    until(
        page,
        "([id, entry]) => studio.viewer.motion?.dancers?.find((one) => one.id === id).entry === entry",
        [name, (count - 1.0) / 2.0],
    )


@pytest.mark.parametrize("studio_page", [LARGE, SMALL], ids=["large", "small"], indirect=True)
def test_dancers_are_added_dragged_hidden_and_removed_by_mouse(page: Any) -> None:
    page.get_by_test_id("add-canon").fill("4")
    page.get_by_test_id("add-mirrored").check()
    page.get_by_test_id("add-dancer").click()
    wait_for_dancers(page, 2)
    one, other = cast(page)
    first, second = one["id"], other["id"]
    assert (one["entry"], other["entry"], other["mirrored"], other["place"]) == (1.0, 5.0, True, [1.5, 0.0])
    assert page.evaluate("studio.viewer.player.motion.end") == pytest.approx(
        page.evaluate("studio.store.state.piece.seconds") + 2.0, abs=0.05
    )
    # Drag the second one's lane by three counts.
    lane = page.get_by_test_id(f"lane-{second}").bounding_box()
    width = lane["x"] - page.get_by_test_id(f"lane-{first}").bounding_box()["x"]
    count = width / 4.0  # pixels
    x, y = lane["x"] + 0.8 * lane["width"], lane["y"] + 0.5 * lane["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 1.5 * count, y, steps=4)
    page.mouse.move(x + 3.1 * count, y, steps=4)
    page.mouse.up()
    wait_for_entry(page, second, 8.0)
    # A click without a drag shows the moment.
    box = page.get_by_test_id(f"lane-{first}").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    until(page, "studio.viewer.player.time > 1")
    page.get_by_test_id(f"show-{first}").click()
    assert page.evaluate("studio.viewer.motion.dancers.map(({ shown }) => shown)") == [False, True]
    page.get_by_test_id(f"shown-{first}").click()
    assert page.evaluate("studio.viewer.motion.dancers.map(({ shown }) => shown)") == [True, True]
    page.get_by_test_id(f"remove-{second}").click()
    wait_for_dancers(page, 1)
    page.get_by_test_id("undo").click()
    wait_for_dancers(page, 2)
    assert entry(page, second) == 8.0
    # A new dancer is another one, and shown.
    page.get_by_test_id(f"shown-{second}").click()
    page.get_by_test_id(f"remove-{second}").click()
    wait_for_dancers(page, 1)
    page.get_by_test_id("add-dancer").click()
    wait_for_dancers(page, 2)
    assert cast(page)[1]["id"] != second
    assert page.evaluate("studio.viewer.motion.dancers.map(({ shown }) => shown)") == [True, True]


def test_lanes_are_reached_and_moved_by_keys_alone(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna")
    put(studio_server, "ben", place=[1.5, 0.0], entry=5.5)
    studio_server.edit(edit="formations", changes=[{"at": 9, "counts": 2, "formation": "line"}])
    wait_for_dancers(page, 2)
    press = page.keyboard.press
    page.get_by_test_id("ruler").focus()
    for _ in range(12):
        press("Tab")
        if page.evaluate("document.activeElement.dataset.lane") == "anna":
            break
    press("Tab")
    assert page.evaluate("document.activeElement.dataset.lane") == "ben"
    press("ArrowRight")
    wait_for_entry(page, "ben", 6.0)
    press("PageUp")
    press("ArrowLeft")
    wait_for_entry(page, "ben", 13.0)
    press("Home")
    wait_for_entry(page, "ben", 1.0)
    press("ArrowUp")
    wait_for_entry(page, "ben", 2.0)
    press("ArrowDown")
    wait_for_entry(page, "ben", 1.0)
    assert page.evaluate("document.activeElement.dataset.lane") == "ben"
    press("Enter")
    assert page.evaluate("studio.viewer.motion.dancers[1].shown") is False
    press("Shift+Tab")
    press("Shift+Tab")
    press("ArrowRight")
    until(page, "studio.store.state.cast.changes[0].at === 10")
    press("Control+z")
    until(page, "studio.store.state.cast.changes[0].at === 9")


def test_fields_place_turn_rename_and_change_formations(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna")
    put(studio_server, "ben", place=[1.5, 0.0])
    wait_for_dancers(page, 2)

    def fill(name: str, value: str) -> None:
        page.get_by_test_id(name).fill(value)
        page.get_by_test_id(name).press("Tab")

    fill("place-ben-x", "-2.5")
    fill("place-ben-z", "1")
    fill("facing-ben", "90")
    fill("entry-ben", "3.5")
    fill("name-ben", "Benjamin")
    until(page, "studio.viewer.motion?.dancers?.[1].name === 'Benjamin'")
    ben = cast(page)[1]
    assert (ben["name"], ben["place"], ben["facing"], ben["entry"]) == ("Benjamin", [-2.5, 1.0], 90.0, 3.5)
    page.get_by_test_id("add-formation").click()
    page.get_by_test_id("change-0-formation").select_option("circle")
    fill("change-0-spacing", "3")
    fill("change-0-at", "5")
    until(page, "studio.viewer.motion?.dancers?.[0].ways.length === 1 && studio.store.state.cast.changes[0].at === 5")
    assert page.evaluate("studio.store.state.cast.changes[0].spacing") == 3.0
    page.get_by_test_id("change-0-formation").select_option("places")
    fill("change-0-anna-x", "4")
    until(page, "studio.store.state.cast.changes[0].places.anna?.[0] === 4")
    page.get_by_test_id("change-0-remove").click()
    until(page, "studio.store.state.cast.changes.length === 0")


def test_places_are_dragged_on_the_floor_and_moved_by_keys(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna")
    put(studio_server, "ben", place=[1.5, 0.0])
    wait_for_dancers(page, 2)
    page.get_by_role("button", name="Top", exact=True).click()
    until(page, "document.querySelectorAll('.stage .spot:not([hidden])').length === 2")
    anna, ben = (box_at_rest(page, f"spot-{name}") for name in ("anna", "ben"))
    bx, by = ben["x"] + 0.5 * ben["width"], ben["y"] + 0.5 * ben["height"]
    metre = (ben["x"] - anna["x"]) / 1.5  # seen from above
    page.mouse.move(bx, by)
    page.mouse.down()
    page.mouse.move(bx + 0.4 * metre, by - 0.3 * metre, steps=5)
    until(page, "studio.viewer.motion.dancers[1].place[0] > 1.8")  # the body goes along
    page.mouse.move(bx + 0.5 * metre, by - metre, steps=5)
    page.mouse.up()
    until(page, "studio.store.state.cast.dancers[1].place[0] !== 1.5")
    assert cast(page)[1]["place"] == pytest.approx([2.0, -1.0], abs=0.15)
    page.get_by_test_id("spot-anna").focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowDown"):
        page.keyboard.press(key)
    until(page, "JSON.stringify(studio.store.state.cast.dancers[0].place) === '[0.2,0.1]'")
    page.get_by_test_id("open-take").click()
    until(page, "document.querySelectorAll('.stage .spot').length === 0")


def test_the_viewer_plays_what_the_ensemble_is(page: Any, studio_server: Served) -> None:
    assert opened(studio_server, TRIO).status == 200
    wait_for_dancers(page, 3)
    page.reload()
    page.get_by_test_id("open-dancers").click()
    wait_for_dancers(page, 3)
    ensemble = ensemble_in(studio_server)
    until(page, "(end) => Math.abs(studio.viewer.motion.end - end) < 0.05", ensemble.seconds)
    loaded = "!piece.parts || piece.parts.every(({ key }) => piece.movements.at(key))"
    until(page, f"studio.viewer.motion.dancers.every(({{ piece }}) => {loaded})")
    for time in (0.0, 3.3, 9.0, 10.1, 17.7, ensemble.seconds):
        times = np.array([time])
        for (root, rotations), motion in zip(page.evaluate(_POSED, time), ensemble.motions(times), strict=True):
            assert np.allclose(root, motion.root[0], atol=2e-3), (time, motion.name)
            same = np.abs((np.array(rotations).reshape(-1, 4) * motion.rotations[0]).sum(axis=1))
            assert same.min() > 1.0 - 1e-4, (time, motion.name)


def test_the_mirrored_piece_mirrors_it_wherever_its_parts_are(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna")
    wait_for_dancers(page, 1)
    until(page, "studio.viewer.motion.piece.times.length > 0")
    found = page.evaluate(
        """async () => {
          const { piece } = studio.viewer.motion;
          const [part] = piece.parts;
          const moved = Object.assign(Object.create(Object.getPrototypeOf(piece)), piece, {
            parts: [{ ...part, place: [2, 3], turn: 0.7 }, { ...part, at: part.seconds + 1, place: [-1, 4], turn: -2 }],
          });
          const own = await moved.copy(piece.movements);
          const mirrored = await own.mirrored();
          const pose = (one, time) => {
            const [rotations, root] = [new Float64Array(4 * one.joints.length), new Float64Array(3)];
            one.sample(time, rotations, root);
            return [[...root], [...rotations.slice(0, 4)]];
          };
          return [0.5, 4, part.seconds + 0.5, part.seconds + 6].map((time) => [pose(own, time), pose(mirrored, time)]);
        }"""
    )
    for ((x, y, z), (qx, qy, qz, qw)), (root, rotation) in found:
        assert root == pytest.approx([-x, y, z], abs=1e-4)
        assert abs(np.dot(rotation, [qx, -qy, -qz, qw])) == pytest.approx(1.0, abs=1e-6)


def test_the_time_line_follows_the_first_dancer_who_waits(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna", entry=3.0)
    studio_server.edit(edit="formations", changes=[{"at": 5, "counts": 4, "places": {"anna": [2, 0]}}])
    wait_for_dancers(page, 1)
    until(page, "studio.viewer.motion.dancers[0].ways.length === 1")
    assert page.evaluate("[0, 1, 2, 3, 4, 5].map((time) => studio.viewer.motion.own(time))") == pytest.approx(
        [0.0, 0.0, 1.0, 1.0, 1.0, 2.0]
    )
    # A click on the ruler shows this moment of the piece, when she dances it.
    ruler, scale = (
        page.get_by_test_id("ruler").bounding_box(),
        page.evaluate("document.querySelector('[data-testid=lane-anna]').getBoundingClientRect().left"),
    )
    per_second = scale - ruler["x"]  # she enters after one second
    page.mouse.click(ruler["x"] + 2.0 * per_second, ruler["y"] + 8)
    until(page, "Math.abs(studio.viewer.player.time - 5) < 0.1")


def test_the_edge_of_the_stage_is_the_same_with_and_without_dancers(page: Any, studio_server: Served) -> None:
    def wait_for_edge(stands: bool) -> None:
        until(page, f"Boolean(studio.viewer.stage?.edge?.parent) === {str(stands).lower()}")

    put(studio_server, "anna")
    wait_for_dancers(page, 1)
    studio_server.edit(edit="stage", size=[8.0, 6.0])
    wait_for_edge(True)
    studio_server.edit(edit="dismiss", dancer="anna")
    until(page, "studio.viewer.motion && !studio.viewer.motion.dancers")
    wait_for_edge(True)
    studio_server.edit(edit="stage", size=None)
    wait_for_edge(False)
    put(studio_server, "ben")
    wait_for_dancers(page, 1)
    wait_for_edge(False)


def test_edits_with_dancers_leave_nothing_with_the_gpu(page: Any, studio_server: Served) -> None:
    held = "studio.viewer.stage.renderer.info.memory.geometries"
    put(studio_server, "anna")
    wait_for_dancers(page, 1)
    found = []
    for turn in (10.0, 20.0, 30.0):
        put(studio_server, "anna", facing=turn)
        until(page, "(turn) => Math.abs(studio.viewer.motion.data.dancers[0].facing - turn) < 1e-6", np.radians(turn))
        page.evaluate(_DRAWN)
        found.append(page.evaluate(held))
    assert found[0] > 0
    assert found == found[:1] * 3


def test_music_is_among_the_lanes_whose_clock_it_follows(
    page: Any, studio_server: Served, tmp_path: Path, axe_faults: Callable[[Any], list[str]]
) -> None:
    path = tmp_path / "beats.txt"
    path.write_text("\n".join(str(0.5 * number) for number in range(40)))
    job = studio_server.post("/api/music", {"window": "w1", "path": str(path)})["job"]
    assert studio_server.wait_for(job)["state"] == "done"
    page.get_by_test_id("music-lane").wait_for()
    put(studio_server, "anna", entry=41.0)
    wait_for_dancers(page, 1)
    until(page, "document.querySelector('.lanes [data-testid=music-lane]')")
    assert page.get_by_test_id("music-lane").count() == 1
    assert axe_faults(page) == []
    # While she waits, the time line follows the clock of all.
    for _ in range(14):
        page.get_by_test_id("zoom-in").click()
    until(page, "document.querySelector('.timeline .tracks').scrollLeft === 0")
    page.evaluate("studio.viewer.player.play()")
    until(page, "document.querySelector('.timeline .tracks').scrollLeft > 0 && studio.viewer.player.time < 20")
    page.evaluate("studio.viewer.player.pause()")
    studio_server.edit(edit="dismiss", dancer="anna")
    until(page, "document.querySelector('[data-testid=music-lane]') && !document.querySelector('.lanes')")


def test_an_emptied_piece_has_no_lanes(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna")
    wait_for_dancers(page, 1)
    studio_server.edit(edit="delete", block="b1")
    until(page, "studio.store.state.piece.blocks.length === 0 && !document.querySelector('.lanes')")
    studio_server.insert("b2", "ballet/adagio", 0, 10)
    wait_for_dancers(page, 1)


def test_an_insertion_of_several_dancers_is_selected_and_flipped(page: Any, studio_server: Served) -> None:
    studio_server.send("POST", "/api/seams")
    studio_server.insert("b2", "ballet/plies", 0, 20)
    wait_for_states(page, ["inserted"])
    put(studio_server, "anna")
    pin = {"joint": "left_wrist", "hold": "place"}
    studio_server.edit(edit="ask", left="b1", right="b2", pins=[pin])
    wait_for_states(page, ["inserted"])
    wait_for_dancers(page, 1)
    page.get_by_test_id("insertion-1").click()
    page.get_by_test_id("selected").wait_for()
    at = page.evaluate("studio.store.state.piece.seams[0].at")
    page.evaluate("(time) => studio.viewer.player.seek(time)", at + 0.2)
    until(page, "studio.viewer.motion.insertedAt(studio.viewer.player.time)")
    assert page.locator(".overlay .pin").count() == 0


def test_who_comes_too_near_is_shown_at_that_moment(page: Any, studio_server: Served) -> None:
    put(studio_server, "anna")
    put(studio_server, "ben", place=[0.3, 0.0], entry=3.0)
    wait_for_dancers(page, 2)
    button = page.get_by_test_id("near").get_by_role("button").first
    button.wait_for()
    (near,) = studio_server.get("/api/ensemble/near")
    assert button.inner_text() == f"anna and ben: {near['metres']:.2f} m at count {near['count']:.1f}"
    button.click()
    until(page, "(time) => Math.abs(studio.viewer.player.time - time) < 1e-6", near["seconds"])
    page.get_by_test_id("place-ben-x").fill("9")
    page.get_by_test_id("place-ben-x").press("Tab")
    page.get_by_test_id("near-none").wait_for()


def test_a_file_is_opened_and_exported_by_the_panels(page: Any, tmp_path: Path) -> None:
    path = tmp_path / "trio.toml"
    path.write_text(TRIO, encoding="utf-8")
    page.get_by_test_id("choose-ensemble").set_input_files(path)
    wait_for_dancers(page, 3)
    page.get_by_test_id("open-take").click()
    for form, name in (("toml", "piece.toml.zip"), ("html", "piece.html"), ("bvh", "piece.bvh.zip")):
        with page.expect_download() as saving:
            page.get_by_test_id(f"export-{form}").click()
        assert saving.value.suggested_filename == name


def test_what_cannot_be_is_refused_in_words(studio_server: Served, tabs: Tabs, tmp_path: Path) -> None:
    studio_server.send("DELETE", "/api/seams")
    studio_server.insert("b1", "ballet/adagio", 0, 30)
    put(studio_server, "anna")
    put(studio_server, "ben", place=[1.5, 0.0])
    with tabs.tab({}, viewport={"width": LARGE[0], "height": LARGE[1]}, **RESTING) as page:
        page.goto(studio_server.entry)
        page.get_by_test_id("open-dancers").click()
        field = page.get_by_test_id("name-ben")
        field.fill("anna")
        field.press("Tab")
        page.get_by_text("two dancers are named anna").wait_for()
        until(page, "document.querySelector('[data-testid=name-ben]').value === 'ben'")
        path = tmp_path / "trio.toml"
        path.write_text('piece = "solo.bvh"\n[[dancer]]\n', encoding="utf-8")
        page.get_by_test_id("choose-ensemble").set_input_files(path)
        page.get_by_text("upload this movement first").wait_for()
        assert [one["name"] for one in cast(page)] == ["anna", "ben"]


def test_panel_and_lanes_shut_nobody_out(
    page: Any, studio_server: Served, axe_faults: Callable[[Any], list[str]]
) -> None:
    assert opened(studio_server, TRIO).status == 200
    wait_for_dancers(page, 3)
    page.get_by_test_id("change-0-formation").select_option("places")
    page.get_by_test_id("change-0-d1-x").wait_for()
    page.get_by_test_id("show-d2").click()
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for width in (1440, 390):
            page.set_viewport_size({"width": width, "height": 900})
            assert axe_faults(page) == [], (scheme, width)
