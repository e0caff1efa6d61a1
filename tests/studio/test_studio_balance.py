"""Balance while posing: the centre of mass over the feet, how it is shown, and the handles of feet and heels."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip
from piece_page import until
from scipy.spatial import ConvexHull
from studio_server import LARGE, SMALL, Served

from motionmind.body.motion import Posture
from motionmind.studio.balance import balance_of, corners


@pytest.mark.parametrize("seed", range(20))
def test_corners_are_those_of_the_convex_hull(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(rng.integers(3, 40), 2)).round(1 + seed % 2)
    points = np.concatenate([points, points[:2]])
    found = corners(points)
    hull = points[ConvexHull(points).vertices]
    assert {*found} == {(float(x), float(y)) for x, y in hull}
    x, y = np.array(found).T
    area = 0.5 * (x @ np.roll(y, -1) - y @ np.roll(x, -1))
    assert area == pytest.approx(ConvexHull(points).volume)  # in order


def test_fewer_than_three_points_or_a_line_have_no_area() -> None:
    assert corners(np.zeros((0, 2))) == []
    assert corners(np.array([[1.0, 2.0]] * 3)) == [(1.0, 2.0)]
    assert corners(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])) == [(0.0, 0.0), (2.0, 2.0)]


def test_a_body_leans_out_of_balance_and_flies_without_support() -> None:
    posture = ballet_clip("plies").posture(0)
    standing = balance_of(posture)
    assert standing
    assert standing.outside == 0.0
    assert 0.7 < standing.mass[1] < 1.3
    assert len(standing.support) > 3
    up = balance_of(Posture(posture.skeleton, posture.rotations, posture.root + np.array([0.0, 0.5, 0.0])))
    assert up
    assert (up.support, up.outside) == ([], None)
    aside = np.array([0.3, 0.0, -0.2])
    moved = balance_of(Posture(posture.skeleton, posture.rotations, posture.root + aside))
    assert moved
    assert np.allclose(np.array(moved.mass) - standing.mass, aside)
    assert np.allclose(np.array(moved.support) - standing.support, aside[::2])
    leant = posture.rotations.copy()
    names = posture.skeleton.names
    for spine in ("lumbar", "thorax"):  # the trunk forwards, over feet that stay
        leant[names.index(spine)] = [np.sin(0.6), 0.0, 0.0, np.cos(0.6)]
    lean = balance_of(Posture(posture.skeleton, leant, posture.root))
    assert lean
    assert lean.support == standing.support
    assert lean.outside is not None
    assert lean.outside > 0.0


def _open(page: Any, posture: str) -> None:
    page.get_by_test_id("open-pose").click()
    page.get_by_test_id("handle-pelvis").wait_for()
    page.get_by_test_id("pose-from").select_option(posture)
    until(page, "(title) => document.querySelector('.caption .name')?.textContent.startsWith(title)", posture[7:])
    page.wait_for_timeout(500)


def _middle(page: Any, testid: str) -> tuple[float, float]:
    box = page.get_by_test_id(testid).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


MET = "([x, y]) => document.elementFromPoint(x, y)?.closest('[data-testid^=handle]')?.dataset.testid ?? ''"


@pytest.mark.long
@pytest.mark.parametrize("studio_page", [LARGE, SMALL], ids=["large", "small"], indirect=True)
@pytest.mark.parametrize("posture", ["ballet/arabesque", "ballet/second", "ballet/plie"])
@pytest.mark.parametrize("view", ["Front", "Quarter", "Side"])
def test_a_foots_handle_is_over_its_heels_and_both_are_met(studio_page: Any, posture: str, view: str) -> None:
    page = studio_page
    _open(page, posture)
    page.get_by_role("button", name=view, exact=True).click()
    page.wait_for_timeout(200)
    for side in ("left", "right"):
        foot, heel = (page.get_by_test_id(f"handle-{side}_{part}").bounding_box() for part in ("ankle", "heel"))
        assert foot["width"] > page.get_by_test_id("handle-left_knee").bounding_box()["width"] > heel["width"] >= 24
        index = "(one) => Number(one.style.zIndex)"
        layers = [page.get_by_test_id(f"handle-{side}_{part}").evaluate(index) for part in ("ankle", "heel")]
        assert layers[0] > layers[1]
        # Neither covers the other, though other handles may.
        middles = [np.add(box["x"], box["width"] / 2) + 1j * (box["y"] + box["height"] / 2) for box in (foot, heel)]
        assert abs(middles[1] - middles[0]) >= (foot["width"] + heel["width"]) / 2 - 0.5
        for part in ("ankle", "heel"):
            assert page.evaluate(MET, [*_middle(page, f"handle-{side}_{part}")]) != ""


@pytest.mark.long
def test_dragging_a_foot_lifts_it_and_is_no_releve_by_mouse_and_by_keys(studio_page: Any) -> None:
    page = studio_page
    _open(page, "ballet/second")
    words = page.get_by_test_id("balance")
    assert words.inner_text() == "In balance over the feet."
    area = "document.querySelector('[data-testid=balance-mark] polygon').getAttribute('points')"
    before = page.evaluate(area)
    assert len(before.split()) > 3
    other = _middle(page, "handle-right_heel")
    x, y = _middle(page, "handle-left_ankle")
    assert page.evaluate(MET, [x, y]) == "handle-left_ankle"
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 9):
        page.mouse.move(x + 3 * step, y - 12 * step)
        page.wait_for_timeout(20)
    page.mouse.up()
    until(page, "document.querySelector('[data-testid=pose-undo]').title.includes('left foot')")
    page.wait_for_timeout(500)
    assert y - _middle(page, "handle-left_ankle")[1] > 60
    assert np.allclose(_middle(page, "handle-right_heel"), other, atol=4)  # the other stands, and does not rise
    assert page.evaluate(area) != before  # one foot supports less
    page.get_by_test_id("pose-undo").click()
    until(page, f"{area} === {before!r}")
    # The whole body aside by keys: the feet stay, so that it is out of balance in the end.
    page.get_by_test_id("handle-thorax").focus()
    for _ in range(14):
        page.keyboard.press("Shift+ArrowRight")
        page.wait_for_timeout(60)
    until(page, "document.querySelector('[data-testid=balance]').textContent.startsWith('Out of balance')")
    mark = page.get_by_test_id("balance-mark")
    assert "off" in mark.get_attribute("class")
    assert "cm beyond the feet" in words.inner_text()


@pytest.mark.long
def test_headings_of_every_panel_are_in_order(studio_server: Served, studio_page: Any) -> None:
    studio_server.insert("b", "ballet/adagio", 0, 20)
    for panel in ("between", "vary", "pose", "movement", "take"):
        studio_page.get_by_test_id(f"open-{panel}").click()
        studio_page.wait_for_timeout(700)
        script = "[...document.querySelectorAll('h1, h2, h3, h4')].map((one) => Number(one.tagName[1]))"
        levels = studio_page.evaluate(script)
        assert levels[0] == 1
        skipped = [(a, b) for a, b in pairwise(levels) if b > a + 1]
        assert skipped == [], (panel, levels)
