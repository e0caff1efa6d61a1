"""Places for hands and feet, set in the viewer's scene by mouse and keys, or by fields; pins and postures, drawn."""

from __future__ import annotations

from typing import Any

import pytest
from piece_page import from_a_to_b, until, wait_for
from studio_server import LARGE, SMALL

from motionmind.studio.placement import _turned

pytestmark = pytest.mark.long

PHONE = (390, 844)
DESK = "studio.desk.state === 'found' && studio.desk.looking && studio.desk.found[0].motion === studio.viewer.motion"
OFF = """(joint) => {
  const { motion } = studio.viewer, [{ at, place }] = studio.desk.reaches;
  const [rotations, root] = [new Float64Array(motion.joints.length * 4), new Float64Array(3)];
  motion.sample(at, rotations, root);
  motion.body.pose(rotations, root);
  const k = 3 * motion.joints.indexOf(joint);
  return Math.hypot(...place.map((x, i) => x - motion.body.joints[k + i]));
}"""


def _middle(page: Any, name: str) -> tuple[float, float]:
    box = page.get_by_test_id(name).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def _set_places(page: Any) -> None:
    """Go from A to B, and set places in the viewer."""
    from_a_to_b(page)
    page.get_by_role("button", name="Back to the viewer").click()
    page.get_by_test_id("places").locator("summary").click()
    page.get_by_test_id("look").click()
    until(page, DESK)


@pytest.mark.parametrize("studio_page", [LARGE, PHONE], ids=["large", "phone"], indirect=True)
def test_a_hand_is_brought_to_a_place_by_mouse_and_a_reload_keeps_it(studio_page: Any, axe_faults: Any) -> None:
    page = studio_page
    _set_places(page)
    page.get_by_test_id("reach-joint").select_option("right_wrist")
    page.get_by_test_id("reach-add").click()
    until(page, f"{DESK} && studio.desk.reaches.length === 1")
    assert page.evaluate(OFF, "right_wrist") < 0.01  # it is where the hand was
    assert axe_faults(page) == []
    x, y = _middle(page, "place-1")
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 7):
        page.mouse.move(x - 2 * step, y + 3 * step)
    page.mouse.up()
    until(page, "studio.desk.state === 'searching'")
    until(page, DESK)
    page.wait_for_timeout(300)
    found = _middle(page, "place-1")
    assert abs(found[0] - x + 12) < 3
    assert abs(found[1] - y - 18) < 3
    assert page.evaluate(OFF, "right_wrist") < 0.01
    assert "reaches the place to 0." in page.get_by_test_id("reached").inner_text()
    kept = page.evaluate("studio.desk.reaches")
    page.reload()
    until(page, "window.studio?.desk?.state === 'found'")
    assert page.evaluate("studio.desk.reaches") == kept
    page.get_by_role("button", name="Show the alternatives").click()
    page.get_by_test_id("accept").click()
    wait_for(page, "piece.seams.length === 1 && piece.seams[0].state === 'inserted'")
    assert page.evaluate("studio.store.state.piece.seams[0].ask.reaches") == kept
    assert page.evaluate("studio.desk.reaches") == []
    page.get_by_test_id("place-1").wait_for()  # on the time line, too


@pytest.mark.parametrize("studio_page", [SMALL], ids=["small"], indirect=True)
def test_a_place_is_made_moved_timed_and_removed_by_keyboard(studio_page: Any) -> None:
    page = studio_page
    _set_places(page)
    page.get_by_test_id("reach-joint").focus()
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    until(page, f"{DESK} && studio.desk.reaches.length === 1")
    before = page.evaluate("studio.desk.reaches[0]")
    assert before["joint"] == page.get_by_test_id("reach-joint").input_value()
    page.get_by_test_id("place-1").focus()
    page.keyboard.press("Shift+ArrowDown")
    page.keyboard.press("Shift+ArrowDown")
    page.keyboard.press("Alt+ArrowLeft")
    until(page, "studio.desk.state === 'searching'")  # once for all of them
    until(page, DESK)
    after = page.evaluate("studio.desk.reaches[0]")
    assert after["at"] == pytest.approx(before["at"] - 0.1)
    moved = [a - b for a, b in zip(after["place"], before["place"], strict=True)]
    assert sum(step**2 for step in moved) ** 0.5 == pytest.approx(0.1, abs=0.002)
    assert page.evaluate("document.activeElement.dataset.testid") == "place-1"
    assert page.evaluate("studio.viewer.player.time") == pytest.approx(after["at"])
    up = page.get_by_test_id("reach-1-up")
    up.fill("120")
    up.press("Enter")
    until(page, f"{DESK} && studio.desk.reaches[0].place[1] === 1.2")
    assert page.evaluate("studio.desk.reaches[0].place[0]") == after["place"][0]
    at = page.get_by_test_id("reach-1-at")
    at.fill("99")  # beyond the movement
    at.press("Enter")
    assert at.input_value() == str(after["at"])
    page.get_by_test_id("place-1").focus()
    page.keyboard.press("Delete")
    until(page, f"{DESK} && studio.desk.reaches.length === 0")
    assert page.get_by_test_id("place-1").count() == 0


@pytest.mark.parametrize("studio_page", [LARGE], ids=["large"], indirect=True)
def test_wishes_of_the_time_line_are_drawn(studio_server: Any, studio_page: Any, axe_faults: Any) -> None:
    page = studio_page
    studio_server.insert("b1", "ballet/adagio", 0, 20)
    studio_server.insert("b2", "ballet/fifth")
    stay = {"joint": "left_wrist", "hold": "place", "begins": 0.2, "ends": 0.6}
    wishes = {"seconds": 3.0, "passing": [{"posture": "ballet/plie"}], "pins": [stay]}
    studio_server.edit(edit="ask", left="b1", right="b2", **wishes)
    wait_for(page, "piece.seams[0]?.state === 'inserted'")
    page.get_by_test_id("insertion-1").click()
    page.locator(".asked-mark.waypoint .words").wait_for()
    assert sorted(page.locator(".asked-mark").all_inner_texts()) == ["left hand stays here", "passes plie"]
    assert page.evaluate("studio.viewer.ghosts.waypoints.length") == 1
    page.get_by_test_id("wishes").click()
    page.evaluate("studio.viewer.player.seek(studio.store.state.piece.seams[0].at + 2.5)")
    page.get_by_test_id("reach-joint").select_option("right_ankle")
    page.get_by_test_id("reach-add").click()
    wait_for(page, "piece.seams[0].ask.reaches.length === 1 && piece.seams[0].state === 'inserted'")
    assert axe_faults(page) == []
    # The handle is where the foot is: the insertion is turned and moved to where the piece has come.
    x, y = _middle(page, "place-1")
    foot = page.evaluate(
        """async () => {
          const { viewer } = studio, [seam] = studio.store.state.piece.seams;
          const { motion, stage } = viewer, [{ joint, at }] = seam.ask.reaches;
          const [rotations, root] = [new Float64Array(motion.joints.length * 4), new Float64Array(3)];
          motion.sample(seam.at + at, rotations, root);
          motion.body.pose(rotations, root);
          const k = 3 * motion.joints.indexOf(joint), point = viewer.stage.middle.clone();
          point.fromArray(motion.body.joints, k).project(stage.camera);
          const { left, top, width, height } = viewer.overlay.getBoundingClientRect();
          return [left + 0.5 * (point.x + 1) * width, top + 0.5 * (1 - point.y) * height];
        }"""
    )
    assert abs(foot[0] - x) < 4
    assert abs(foot[1] - y) < 4
    page.get_by_test_id("reach-1-remove").click()
    wait_for(page, "piece.seams[0].ask.reaches.length === 0")
    page.get_by_test_id("wishes-close").click()
    page.locator(".stretches [role=option]").first.click()
    until(page, "studio.viewer.ghosts.waypoints.length === 0")
    assert not page.locator(".asked").is_visible()


def test_places_are_turned_and_moved_as_the_insertion_is(studio_page: Any) -> None:
    until(studio_page, "window.studio?.store.state")
    place, asked = [0.3, 1.4, -0.5], {"place": [2.0, -1.0], "turn": 2.2}
    there, back = studio_page.evaluate(
        """async ([asked, place]) => {
          const { toScene, fromScene } = await import(document.querySelector('link[href$="asks/asked.js"]').href);
          return [toScene(asked, place), fromScene(asked, toScene(asked, place))];
        }""",
        [asked, place],
    )
    x, z = _turned(place[0], place[2], asked["turn"])  # as the server places parts
    assert there == pytest.approx([x + 2.0, 1.4, z - 1.0])
    assert back == pytest.approx(place)
