"""The page of an ensemble: every dancer where Python puts it, its name and colour, and a button to hide it."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from bundled_clips import ballet_clip
from pages import FINE, SCREENS, Opened, near, reachable_controls, readable_words

from motionmind._typing import Int16s
from motionmind.body.motion import Insertion
from motionmind.ensemble.dancers import Dancer, Ensemble, Way
from motionmind.geometry import rotations as rot
from motionmind.render.body_shape import shape_of
from motionmind.render.group_page import write_group_page
from motionmind.render.palette import BRIDGED, INSERTED, dancer_ink

PIECE, OTHER = ballet_clip("temps-lie"), ballet_clip("jump")
TILTED = rot.from_axis_angle([1.0, 0.0, 0.0], 0.5)


def trio(inserted: bool = False) -> Ensemble:
    insertion = Insertion(OTHER.times[[0, -1]], (("left_elbow", 0),))
    last = replace(OTHER, insertions=(insertion,)) if inserted else OTHER
    rotations = PIECE.rotations.copy()
    rotations[:, 0] = rot.mul(TILTED, rotations[:, 0])
    tilted = replace(PIECE, rotations=rotations)
    ways = (Way(0.2, 0.3, (0.1, 0.2)), Way(1.0, 2.0, (1.0, -2.0)))
    return Ensemble(
        "trio",
        (
            Dancer("Anna", PIECE, (-1.5, 0.5)),
            Dancer("Ben", tilted, (0.5, -1.0), np.radians(130.0), 2.3, True),
            Dancer("Chloe", last, (1.5, 0.3), np.radians(-70.0), 0.4, ways=ways),
        ),
        60.0,
    )


def amount(picture: Int16s, colour: tuple[int, ...]) -> int:
    return int(near(picture, colour).sum())


def test_dancers_are_where_python_puts_them_at_every_time(show: Callable[..., Opened]) -> None:
    ensemble = trio()
    tab = show(ensemble)
    frames = tab.get("motionmind.motion.length")
    assert frames == len(ensemble.times())
    motions = ensemble.motions()
    for number, motion in enumerate(motions):
        cones, balls = shape_of(motion.skeleton).solids(motion.rotations, motion.root)
        for frame in (0, 9, 38, 55, frames // 2, frames - 1):  # some while a piece waits
            found = tab.get(f"motionmind.solids({frame}, {number})")
            ends = np.reshape(found["cones"], (-1, 2, 4))[..., :3]
            np.testing.assert_allclose(ends, np.stack([cones.a[frame], cones.b[frame]], axis=1), atol=2e-4)
            np.testing.assert_allclose(np.reshape(found["balls"], (-1, 4, 3))[:, 0], balls.centre[frame], atol=2e-4)


def test_a_piece_is_on_the_page_once_however_many_dance_it(tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("page") / "page.html"
    dancers = [Dancer(f"d{i}", PIECE, (1.5 * i, 0.0), 0.1 * i, float(i), i % 3 == 2) for i in range(12)]
    write_group_page(path, Ensemble("canon", tuple(dancers)))
    text = re.search(r'id="data">(.*?)</script>', path.read_text("utf-8"), re.S)
    assert text
    data = json.loads(text[1])
    assert len(data["pieces"]) == 2, "as it is, and in the mirror"
    assert [one["piece"] for one in data["dancers"]] == [0, 0, 1] * 4


@pytest.mark.long
def test_every_dancer_has_a_colour_a_name_and_a_button_that_hides_it(show: Callable[..., Opened]) -> None:
    tab = show(trio(), **FINE)
    tab.click("front")
    tab.get("document.getElementById('below').style.visibility = 'hidden'")
    names = tab.page.locator(".name")
    assert [one.inner_text() for one in names.all()] == ["Anna", "Ben", "Chloe"]
    inks = [dancer_ink(number) for number in range(2)]  # grey, the third, has no hue
    everybody = tab.picture()
    amounts = [amount(everybody, ink) for ink in inks]
    assert min(amounts) > 200
    tab.get("document.getElementById('below').style.visibility = ''")
    tab.page.get_by_role("button", name="Ben").click()
    tab.wait("document.querySelectorAll('.name')[1].hidden")
    tab.get("document.getElementById('below').style.visibility = 'hidden'")
    left = tab.picture()
    assert amount(left, inks[1]) < 0.2 * amounts[1]  # knees of the others have nearly its hue
    assert amount(left, inks[0]) > 0.8 * amounts[0]
    tab.get("document.getElementById('below').style.visibility = ''")
    tab.page.get_by_role("button", name="Ben").focus()
    tab.press("Enter")
    tab.get("document.getElementById('below').style.visibility = 'hidden'")
    assert np.array_equal(tab.picture(), everybody)


@pytest.mark.long
def test_inserted_movement_of_one_dancer_is_violet_and_bridges_are_marked(show: Callable[..., Opened]) -> None:
    tab = show(trio(inserted=True), **FINE, viewport={"width": 1280, "height": 900})
    tab.get("motionmind.player.seek(1.5)")
    violet = amount(tab.picture(), INSERTED["middle"])
    assert violet > 200
    assert "bridged" in tab.get("document.getElementById('legend').textContent")
    marked = amount(tab.picture(), BRIDGED)
    assert tab.page.is_visible("#inserted")
    tab.page.get_by_role("button", name="Chloe").click()
    assert amount(tab.picture(), INSERTED["middle"]) < 0.1 * violet
    assert amount(tab.picture(), BRIDGED) < marked - 20


@pytest.mark.long
@pytest.mark.parametrize("screen", SCREENS)
def test_it_fits_every_screen_and_has_no_ghosts(show: Callable[..., Opened], screen: str) -> None:
    tab = show(trio(), **SCREENS[screen])
    controls = reachable_controls(tab.page, 44 if SCREENS[screen].get("has_touch") else 32)
    assert {"Anna", "Ben", "Chloe", "play", "timeline"} <= controls
    assert not controls & {"onion", "apart", "ends", "plan"}
    assert "name" in readable_words(tab.page)
    tab.press("o")
    assert tab.get("document.getElementById('onion').getAttribute('aria-pressed')") == "false"


@pytest.mark.long
def test_it_has_no_floor_plan_by_button_or_key(show: Callable[..., Opened]) -> None:
    tab = show(trio())
    assert not tab.page.is_visible("#plan")
    tab.press("f")
    assert tab.get("document.getElementById('plan').getAttribute('aria-pressed')") == "false"
    assert "floor plan" not in tab.get("document.getElementById('sheet').textContent")
