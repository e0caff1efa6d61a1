"""The share of steps by which a variation leaves its piece, and the nudge that is sought for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind._typing import Ints
from motionmind.chaos.flows import FLOWS, find_flow
from motionmind.errors import MotionMindError
from motionmind.formats import write_motion
from motionmind.tween.engine import Engine
from motionmind.variation.departure import DEPARTURE_TOLERANCE, departure, find_nudge
from motionmind.variation.variation import vary
from motionmind.variation.variation_json import write_variation


@pytest.mark.parametrize(
    ("order", "share"),
    [([0, 1, 2, 3], 0.0), ([0, 0, 1, 1], 0.0), ([0, 2, 3, 4, 5], 0.25), ([3, 2, 1], 1.0), ([5], 0.0)],
)
def test_steps_that_go_on_or_stay_do_not_depart(order: list[int], share: float) -> None:
    assert departure(np.array(order)) == share


def stepping(share: Callable[[float], float]) -> Callable[[float], Ints]:
    """Orders of 101 postures that depart in a share of their steps, given the nudge."""

    def order(nudge: float) -> Ints:
        leaves = np.arange(100) < round(100 * share(nudge))
        return np.concatenate([[0], np.cumsum(np.where(leaves, 2, 1))])

    return order


def test_the_smallest_nudge_that_comes_near_is_taken() -> None:
    rising = stepping(lambda nudge: min(nudge, 1.0))
    for share in (0.1, 0.25, 0.6, 1.0):
        nudge = find_nudge(rising, share)
        assert abs(departure(rising(nudge)) - share) <= DEPARTURE_TOLERANCE
        assert abs(departure(rising(nudge / 10**0.1)) - share) > DEPARTURE_TOLERANCE
    assert find_nudge(rising, 0.0) == pytest.approx(1e-12)
    assert find_nudge(stepping(lambda nudge: 0.5 if nudge > 2.0 else 0.1), 0.9) == pytest.approx(10**0.4)


def test_nudges_that_lead_nowhere_end_the_search() -> None:
    def diverging(nudge: float) -> Ints:
        if nudge > 1.0:
            raise MotionMindError("the trajectory diverges")
        return stepping(lambda nudge: 0.3)(nudge)

    assert find_nudge(diverging, 1.0) == pytest.approx(1e-12)

    def nowhere(nudge: float) -> Ints:
        raise MotionMindError("the trajectory diverges")

    with pytest.raises(MotionMindError, match="diverges"):
        find_nudge(nowhere, 0.3)
    with pytest.raises(MotionMindError, match="give nudge or depart, not both"):
        vary(ballet_clip("jump"), nudge=0.1, depart=0.25)
    for share in (-0.1, 1.1, float("nan")):
        with pytest.raises(MotionMindError, match="must be from 0 to 1"):
            find_nudge(diverging, share)


@pytest.mark.parametrize("clip", ["promenade", "adagio"])  # of 44 and 68 postures
@pytest.mark.parametrize("flow", ["lorenz", "rossler"])
def test_a_variation_departs_as_asked_however_long_its_piece_is(clip: str, flow: str) -> None:
    piece = ballet_clip(clip)
    found = vary(piece, flow=find_flow(flow), depart=0.25)
    assert abs(departure(found.order) - 0.25) <= DEPARTURE_TOLERANCE
    again = vary(piece, flow=find_flow(flow), nudge=found.course.nudge[0])
    np.testing.assert_array_equal(again.order, found.order)
    np.testing.assert_array_equal(vary(piece, flow=find_flow(flow)).order, found.order)  # a quarter is the default


@pytest.mark.parametrize("flow", sorted(FLOWS))
@pytest.mark.parametrize("count", [48, 200])
def test_by_default_a_fifth_at_least_leaves_the_order_of_pieces_long_and_short(flow: str, count: int) -> None:
    clip = ballet_clip("adagio")
    frames = np.arange(count) % len(clip)
    step = clip.times[1] - clip.times[0]
    piece = replace(clip, rotations=clip.rotations[frames], root=clip.root[frames], times=step * np.arange(count))
    assert departure(vary(piece, flow=find_flow(flow)).order) >= 0.2


# As runs of the piece's postures, (the first, how many): what a nudge of 0.1 has always given.
OF_OLD = {
    "lorenz": [(0, 45), (20, 2), (47, 8), (49, 1), (26, 1), (60, 1), (52, 2), (36, 1), (18, 2), (14, 1), (46, 1)],
    "rossler": [(0, 11), (43, 5), (16, 1), (49, 1), (18, 15), (22, 3), (36, 2), (27, 1), (39, 3), (64, 4), (25, 4)],
    "duffing": [(0, 13), (60, 4), (65, 2), (0, 6), (44, 23), (58, 3), (22, 1), (4, 3), (45, 3), (49, 1), (49, 8)],
}


@pytest.mark.parametrize("flow", sorted(OF_OLD))
def test_a_trajectory_that_is_given_gives_the_same_piece_as_ever_byte_for_byte(flow: str, tmp_path: Path) -> None:
    piece = ballet_clip("adagio")
    engine = Engine.load("ballet")
    order = np.concatenate([np.arange(first, first + count) for first, count in OF_OLD[flow]])
    nudged = vary(piece, flow=find_flow(flow), nudge=0.1)
    np.testing.assert_array_equal(nudged.order[: len(order)], order)
    started = vary(piece, flow=find_flow(flow), start=find_flow(flow).start, nudge=0.1)
    judged = vary(piece, engine, flow=find_flow(flow), watch=lambda _: True, nudge=0.1)
    np.testing.assert_array_equal(judged.postures, nudged.order)
    for name, one in (("nudged", nudged), ("started", started)):
        write_variation(tmp_path / f"{name}.json", one)
    assert (tmp_path / "nudged.json").read_bytes() == (tmp_path / "started.json").read_bytes()


def test_the_command_line_says_what_was_reached(run: Run) -> None:
    write_motion("piece.json", ballet_clip("promenade"))
    ran = run("vary", "piece.json", "--depart", 0.25, "-o", "v.json")
    assert ran.code == 0
    assert any(f" seams ({share}% of steps): " in ran.out for share in range(20, 31))
    assert "no nudge found" not in ran.err
    ran = run("vary", "piece.json", "--depart", 1, "-o", "v.json")
    assert "note: no nudge found for --depart 100%; the nearest share is " in ran.err
    ran = run("vary", "piece.json", "--depart", 0.3, "--nudge", 1, "-o", "w.json")
    assert ran.code == 2
    assert "--depart chooses a nudge, and --nudge sets one; give one of them" in ran.err
