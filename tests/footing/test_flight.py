"""Flights: when they begin and end, and a mass that falls freely in them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from motionmind._typing import Bools, Floats
from motionmind.body.contact import pose
from motionmind.body.human import human23
from motionmind.body.plausibility import GRAVITY_MPS2
from motionmind.footing.flight import SHORTEST_PUSH_OFF_S, Flight, find_falls, find_flights, flying_frames
from motionmind.footing.root import stand
from motionmind.geometry import rotations as rot

BODY, FPS = human23(), 30.0


def test_rounding_errors_do_not_decide_in_which_frame_a_flight_begins() -> None:
    aloft, heights = np.zeros(41), 0.25 * (1.0 + 1e-15 * np.arange(-40, 40))
    aloft[2:14] = 1.0  # sooner than the body can push off, which takes seven frames and a half
    begins = {
        flight.start
        for height in heights
        for flight in find_flights(
            aloft, np.full(41, height), np.ones(41), np.ones(2), (False, False), (None, None), GRAVITY_MPS2, 30.0
        )
    }
    assert begins == {8}


def test_flights_that_do_not_fit_are_shorter_or_none() -> None:
    still, leaps = np.full(31, 1.0), np.full(31, 0.3)
    on_floor = (np.array([1.0, 1.0]), (False, False), (None, None), GRAVITY_MPS2, 30.0)
    middle = np.zeros(31)
    middle[9:22] = 1.0
    (flight,) = find_flights(middle, leaps, still, *on_floor)
    assert (flight.start, flight.end) == pytest.approx((8, 22), abs=1)
    short = find_flights(middle[10:21], leaps[10:21], still[10:21], *on_floor)
    assert all(one.end - one.start < 6 for one in short)
    # Between two postures in the air, so near that there is no time to land, all of it is flight.
    (whole,) = find_flights(
        np.ones(13), leaps[:13], still[:13], np.array([1.2, 1.2]), (True, True), (None, None), GRAVITY_MPS2, 30.0
    )
    assert (whole.start, whole.end) == (0, 12)
    first, last = find_flights(
        np.ones(61), np.zeros(61), np.ones(61), np.array([1.2, 1.2]), (True, True), (None, None), GRAVITY_MPS2, 30.0
    )
    assert (first.start, last.end) == (0, 60)
    assert first.end / 30.0 == pytest.approx(np.sqrt(0.4 / GRAVITY_MPS2), abs=0.5 / 30.0)
    # It comes down to the floor in a whole frame, and is as near the top of its flight as that allows.
    seconds, (rate, _) = first.end / 30.0, first.rates
    assert rate is not None
    assert 1.2 + rate * seconds - 0.5 * GRAVITY_MPS2 * seconds**2 == pytest.approx(1.0)
    assert abs(rate) < 0.5 * GRAVITY_MPS2 / 30.0
    assert last.rates[1] == pytest.approx(-rate)


def test_a_body_that_rises_in_a_or_falls_in_b_is_longer_in_the_air() -> None:
    """Half a metre above where it stands: as long as it takes to fall from there at that velocity."""
    calm, masses = np.zeros(61), np.array([1.5, 1.5])
    for rate in (-2.0, 0.5, 2.0):
        for hovering, rates, falls in (((True, False), (rate, None), rate), ((False, True), (None, rate), -rate)):
            (flight,) = find_flights(calm, calm, np.ones(61), masses, hovering, rates, GRAVITY_MPS2, 30.0)
            seconds = (falls + np.sqrt(falls**2 + 2.0 * GRAVITY_MPS2 * 0.5)) / GRAVITY_MPS2
            assert (flight.end - flight.start) / 30.0 == pytest.approx(seconds, abs=1.0 / 30.0)
            assert flight.rates == rates


def test_jumps_one_after_another_leave_time_to_land_and_push() -> None:
    flights = find_flights(
        np.ones(121), np.full(121, 0.05), np.ones(121), np.ones(2), (False, False), (None, None), GRAVITY_MPS2, 30.0
    )
    assert len(flights) > 3
    assert all(after.start - before.end >= SHORTEST_PUSH_OFF_S * 30.0 - 1.0 for before, after in pairwise(flights))


def test_between_the_last_frame_on_the_floor_and_the_first_nothing_bears_the_body() -> None:
    flights = [Flight(3, 6, (None, None)), Flight(8, 10, (None, 0.0))]
    assert np.flatnonzero(flying_frames(flights, (False, True), 11)).tolist() == [4, 5, 9, 10]
    assert np.flatnonzero(flying_frames(flights, (False, False), 11)).tolist() == [4, 5, 9]


# --- a mass that falls ------------------------------------------------------------------------------------------------


def leap(floats: float = 0.0, frames: int = 31, takes_off: int = 8, lands: int = 20) -> tuple[Floats, Floats, Bools]:
    """A body that bends its knees in the air as well, with its root on a parabola but for so many metres: rotations,
    root, and the frames that must not change."""
    bends = np.clip(np.sin(np.linspace(0.0, 3.0 * np.pi, frames)), 0.0, None)
    rotations = np.tile(rot.IDENTITY, (frames, len(BODY), 1))
    for side in ("left", "right"):
        for joint, share in (("hip", -0.3), ("knee", 0.6)):
            rotations[:, BODY.index(f"{side}_{joint}")] = rot.from_axis_angle([1.0, 0.0, 0.0], share * bends)
    root = stand(BODY, rotations, np.zeros((frames, 3)), np.zeros(frames))
    here, seconds = slice(takes_off, lands + 1), np.arange(lands - takes_off + 1) / FPS
    rise = 0.5 * GRAVITY_MPS2 * seconds * (seconds[-1] - seconds)
    root[here, 1] = np.linspace(root[takes_off, 1], root[lands, 1], len(seconds)) + rise
    root[here, 1] += floats * np.sin(np.linspace(0.0, np.pi, len(seconds)))
    given = np.zeros(frames, dtype=np.bool_)
    given[[0, -1]] = True
    return rotations, root, given


def falls(rotations: Floats, root: Floats, given: Bools, fps: float = FPS) -> list[tuple[int, int]]:
    return find_falls(BODY, pose(BODY, rotations, root), given, fps)[1]


def test_a_leap_is_one_fall_from_the_first_frame_in_the_air_to_the_last() -> None:
    ((first, after),) = falls(*leap())
    assert (first, after) == (9, 20)


def test_a_posture_that_is_passed_in_the_air_parts_a_fall() -> None:
    rotations, root, given = leap()
    given[13] = True
    assert falls(rotations, root, given) == [(9, 13), (14, 20)]


def test_a_fall_goes_on_where_legs_are_drawn_up_and_ends_where_something_pushes() -> None:
    rotations, root, given = leap()
    for dip, goes_on in ((0.006, True), (0.012, False)):
        bumpy = root.copy()
        bumpy[14, 1] -= dip
        assert (falls(rotations, bumpy, given) == [(9, 20)]) == goes_on


@pytest.mark.parametrize("end", [0, -1])
def test_a_fall_reaches_to_an_end_in_the_air(end: int) -> None:
    """Legs that hurry into a posture in the air take the last frame before it off the parabola; not so on the floor."""
    rotations, root, _ = leap()
    for kept, in_air in ((slice(0, 15), True), (slice(0, 28), False)):
        poses, way = (one[kept] if end else one[kept][::-1] for one in (rotations, root.copy()))
        beside = len(way) - 2 if end else 1
        way[beside, 1] -= 0.006
        given = np.zeros(len(way), dtype=np.bool_)
        given[[0, -1]] = True
        assert any(first <= beside < after for first, after in falls(poses, way, given)) == in_air


def test_a_body_that_trembles_off_the_floor_does_not_fall() -> None:
    """Somebody holds it up for a second, and it is shaken by millimetres: accelerations of gravity and more."""
    rng = np.random.default_rng(0)
    for fps, shakes in ((30.0, 2e-3), (60.0, 5e-4), (120.0, 1e-4)):
        frames = int(2.0 * fps)
        rotations = np.tile(rot.IDENTITY, (frames, len(BODY), 1))
        root = stand(BODY, rotations, np.zeros((frames, 3)), np.zeros(frames))
        up = np.clip(np.minimum(np.arange(frames), np.arange(frames)[::-1]) / (0.5 * fps), 0.0, 1.0)
        root[:, 1] += 0.3 * up + shakes * rng.normal(size=frames) * (up > 0.5)
        given = np.zeros(frames, dtype=np.bool_)
        given[[0, -1]] = True
        assert max((after - first for first, after in falls(rotations, root, given, fps)), default=0) < 0.2 * fps


def test_a_body_that_is_up_for_another_reason_does_not_fall() -> None:
    """It hangs, or its floor is lower than it was said to be: nothing falls there."""
    rotations, root, given = leap()
    hangs = root.copy()
    hangs[9:20, 1] = root[9, 1]
    assert not falls(rotations, hangs, given)
    assert not falls(rotations, stand(BODY, rotations, root, np.zeros(len(root))), given)
