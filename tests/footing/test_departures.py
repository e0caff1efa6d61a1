"""Departures: a foot that swings goes past its hip, and stays where it stands."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.footing.departures import NEAREST, clear_of_hip
from motionmind.footing.footfalls import Stance

FRAMES, FPS, LENGTH = 61, 30.0, 0.9
STANDS = [Stance(0, 15, np.zeros(2), np.zeros(2)), Stance(45, FRAMES - 1, np.zeros(2), np.zeros(2))]


def kick() -> Floats:
    """A leg, from hip to foot, that kicks forward, straight."""
    raised = 1.4 * np.sin(np.linspace(0.0, np.pi, FRAMES)) ** 2
    return LENGTH * np.stack([np.zeros(FRAMES), -np.cos(raised), np.sin(raised)], axis=1)


def drawn_back(by: float, aside: float = 0.0) -> Floats:
    """Displacements of its foot, back and `aside`, between two places where it stands."""
    back = by * np.sin(np.linspace(0.0, np.pi, 30)) ** 2
    out = np.zeros((FRAMES, 3))
    out[15:45, 2], out[15:45, 0] = -back, aside * back
    return out


@pytest.mark.parametrize("aside", [0.0, 0.1, -0.2])
def test_a_foot_that_would_swing_through_its_hip_goes_past_it(aside: float) -> None:
    leg, off = kick(), drawn_back(LENGTH, aside)
    through = np.linalg.norm(leg + off, axis=1)
    assert through.min() < 0.9 * NEAREST * LENGTH
    cleared = clear_of_hip(off, leg, LENGTH, STANDS, FPS)
    there = leg + cleared
    assert np.linalg.norm(there, axis=1).min() > NEAREST * LENGTH - 1e-9
    np.testing.assert_array_equal(cleared[:16], off[:16])
    np.testing.assert_array_equal(cleared[45:], off[45:])
    # Nowhere does it go faster than it would have by more than what keeps it away.
    moved, would = (np.linalg.norm(np.diff(leg + one, axis=0), axis=1) * FPS for one in (cleared, off))
    assert moved.max() < would.max() + 4.0


def test_a_foot_that_stays_away_from_its_hip_or_was_as_near_is_left_alone() -> None:
    leg, off = kick(), drawn_back(0.3)
    assert clear_of_hip(off, leg, LENGTH, STANDS, FPS) is off
    crouched = 0.3 * leg
    assert clear_of_hip(0.0 * off, crouched, LENGTH, STANDS, FPS).max() == 0.0


def test_a_foot_that_stands_near_its_hip_stays_where_it_stands() -> None:
    leg, off = kick(), drawn_back(LENGTH)
    stands = [Stance(0, FRAMES - 1, np.zeros(2), np.zeros(2))]
    assert clear_of_hip(off, leg, LENGTH, stands, FPS) is off
