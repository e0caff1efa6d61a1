"""Movements in which hands and feet are at given places at given times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest
from bodies import ant
from moved import FPS, HUMAN

from motionmind._typing import Floats
from motionmind.body.capsules import capsules_of
from motionmind.body.contact import lowest_height, pose
from motionmind.body.legs import find_hinge
from motionmind.body.limbs import limbs_of
from motionmind.body.mirror import find_sides
from motionmind.body.skeleton import Skeleton
from motionmind.footing.ground import Given, Stance
from motionmind.geometry import rotations as rot
from motionmind.solver.motion import Bounds, Synthesis, solve_motion
from motionmind.solver.reaches import Reach

MOVES, N = 8, 46
MIDDLE_S = 0.5 * (N - 1) / FPS
SIDES = find_sides(HUMAN)
MIRROR = np.array([-1.0, 1.0, 1.0])


class Ends(NamedTuple):
    """A movement on a level floor from a crouch to another, on any body."""

    skeleton: Skeleton
    rotations: Floats

    def solve(self, reaches: Sequence[Reach] = (), fixed: Sequence[int] = ()) -> Synthesis:
        """Return the movement with some reaches, and some joints that must not turn."""
        high = -lowest_height(self.skeleton, self.rotations[[0, -1]], np.zeros((2, 3)))
        count, none = 2 * MOVES + 1, np.zeros(len(self.skeleton), dtype=np.bool_)
        stance = Stance(
            np.linspace(0.0, (N - 1) / FPS, count),
            np.zeros(count),
            np.ones(count),
            np.ones((count, len(limbs_of(self.skeleton)) + 1)),
            np.zeros(count),
            np.zeros(count),
            np.zeros((2 * MOVES, 3)),
            0.02,
        )
        ends = np.array([0.0, high[0], 0.0]), np.array([0.0, high[1], 0.0])
        allowed = np.zeros(len(capsules_of(self.skeleton).pairs()))
        bounds = Bounds(none.copy(), none, none, allowed, None, np.inf, np.inf, np.inf, np.inf)
        bounds.fixed[list(fixed)] = True
        given = Given({0: 0.0, MOVES: 0.0}, ends, (None, None))
        times = np.arange(N) / FPS
        return solve_motion(self.skeleton, self.rotations, times, stance, given, bounds, reaches=reaches)

    def place(self, made: Synthesis, joint: int, seconds: float) -> Floats:
        """Return where a joint is at a time [3], metres."""
        at = self.skeleton.positions(made.rotations, made.root)[:, joint]
        return np.array([np.interp(seconds, np.arange(N) / FPS, one) for one in at.T])


def crouch(seed: int) -> Ends:
    """A body that bends its legs, and arms and trunk at random, and comes back to where it almost began."""
    rng, q = np.random.default_rng(seed), np.tile(rot.IDENTITY, (N, len(HUMAN), 1))
    bend = np.sin(np.linspace(0.0, 0.95 * np.pi, N))[:, None]
    turns = {"lumbar": 0.2 * rng.normal(size=3), "thorax": 0.2 * rng.normal(size=3)}
    for side in ("left", "right"):
        turns[f"{side}_shoulder"] = 0.4 * rng.normal(size=3)
        q[:, HUMAN.index(f"{side}_elbow")] = rot.exp(np.array([0.0, -1.2 if side == "left" else 1.2, 0.0]))
        for joint, turn in (("hip", -0.3), ("knee", 0.6), ("ankle", -0.3)):
            turns[f"{side}_{joint}"] = np.array([turn, 0.0, 0.0])
    for name, turn in turns.items():
        q[:, HUMAN.index(name)] = rot.exp(bend * turn)
    return Ends(HUMAN, q)


def most(made: Synthesis, term: str) -> float:
    return max((one.most for one in made.residuals if one.term == term), default=0.0)


def near(ends: Ends, made: Synthesis, name: str, seconds: float, off: Floats) -> Reach:
    """A reach away from where a joint would be."""
    joint = ends.skeleton.index(name)
    return Reach(joint, ends.place(made, joint, seconds) + off, seconds)


def turned_arm(ends: Ends, made: Synthesis, side: str, frame: int, rng: np.random.Generator) -> Reach:
    """A reach to where the hand would be if shoulder and elbow turned somewhat."""
    q = made.rotations[frame].copy()
    shoulder, elbow, wrist = (HUMAN.index(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist"))
    hinge = find_hinge(HUMAN, elbow)
    assert hinge is not None
    q[shoulder] = rot.mul(q[shoulder], rot.exp(rng.uniform(-0.4, 0.4, 3)))
    q[elbow] = rot.mul(q[elbow], rot.exp(rng.uniform(-0.3, 0.3) * hinge))
    return Reach(wrist, HUMAN.positions(q, made.root[frame])[wrist], frame / FPS)


@pytest.mark.parametrize("seed", range(6))
def test_hands_are_at_places_within_their_workspace_and_nothing_else_gives(seed: int) -> None:
    ends, rng = crouch(seed), np.random.default_rng(100 + seed)
    free = ends.solve()
    reaches = [turned_arm(ends, free, side, int(rng.integers(12, N - 12)), rng) for side in ("left", "right")]
    reaches[1] = reaches[1]._replace(seconds=reaches[1].seconds + 0.4 / FPS)  # between frames
    made = ends.solve(reaches)
    for reach in reaches:
        assert np.linalg.norm(ends.place(made, reach.joint, reach.seconds) - reach.place) < 0.005
    np.testing.assert_array_equal(made.rotations[[0, -1]], free.rotations[[0, -1]])
    for term, slack in (("Floor", 0.2), ("Limits", 4.0), ("Contacts", 0.5), ("Balance", 2.0)):
        assert most(made, term) <= most(free, term) + slack, term


def test_a_mirrored_problem_has_the_mirrored_solution() -> None:
    ends = crouch(1)
    reach = near(ends, ends.solve(), "left_wrist", 0.7, np.array([0.1, 0.2, 0.1]))
    foot = near(ends, ends.solve(), "right_ankle", 0.9, np.array([0.0, 0.15, 0.1]))
    other = Ends(HUMAN, rot.mirror(ends.rotations[:, SIDES.partners], SIDES.axis))
    made, image = (
        ends.solve([reach, foot]),
        other.solve([Reach(int(SIDES.partners[one.joint]), MIRROR * one.place, one.seconds) for one in (reach, foot)]),
    )
    np.testing.assert_allclose(image.root, made.root * MIRROR, atol=2e-3)
    back = rot.mirror(image.rotations[:, SIDES.partners], SIDES.axis)
    assert np.degrees(rot.angle(back, made.rotations)).max() < 1.0


def test_out_of_reach_the_rest_of_the_movement_stays_sound() -> None:
    ends = crouch(2)
    free = ends.solve()
    for far in ([3.0, 0.0, 0.0], [0.0, -3.0, 1.0], [0.0, 9.0, 0.0]):
        reach = near(ends, free, "left_wrist", MIDDLE_S, np.array(far))
        made = ends.solve([reach])
        before, after = (np.linalg.norm(ends.place(one, reach.joint, MIDDLE_S) - reach.place) for one in (free, made))
        assert after < before - 0.1  # it stretches towards the place
        assert most(made, "Floor") < 1.0
        assert most(made, "Contacts") < 4.0
        assert most(made, "Limits") < 12.0


def test_a_fixed_arm_does_not_reach() -> None:
    ends = crouch(3)
    arm = [HUMAN.index(f"left_{joint}") for joint in ("clavicle", "shoulder", "elbow")]
    reach = near(ends, ends.solve(), "left_wrist", MIDDLE_S, np.array([0.0, 0.2, 0.0]))
    made = ends.solve([reach], arm)
    np.testing.assert_allclose(made.rotations[:, arm], ends.rotations[:, arm], atol=1e-12)


@pytest.mark.parametrize("off", [[0.0, 0.2, 0.1], [0.05, 0.0, 0.15]])
def test_a_standing_foot_leaves_the_floor_to_reach_and_stands_again(off: list[float]) -> None:
    ends = crouch(0)
    free = ends.solve()
    reach = near(ends, free, "left_ankle", MIDDLE_S, np.array(off))
    made = ends.solve([reach])
    assert np.linalg.norm(ends.place(made, reach.joint, MIDDLE_S) - reach.place) < 0.01
    ankle, toes = HUMAN.index("right_ankle"), HUMAN.index("left_toes")
    other = HUMAN.positions(made.rotations, made.root)
    assert np.ptp(other[10:-10, ankle], axis=0).max() < 0.03  # the other foot stands
    np.testing.assert_allclose(other[[2, -3], toes], other[[0, -1], toes], atol=0.02)


def test_a_foot_that_is_in_its_place_anyway_stays_on_the_floor() -> None:
    ends = crouch(0)
    free = ends.solve()
    made = ends.solve([near(ends, free, "left_ankle", MIDDLE_S, np.zeros(3))])
    np.testing.assert_allclose(made.root, free.root, atol=5e-3)
    low = [pose(HUMAN, one.rotations).places[:, HUMAN.index("left_toes"), 1] + one.root[:, 1] for one in (free, made)]
    np.testing.assert_allclose(low[1], low[0], atol=0.01)


def test_places_scale_with_the_body() -> None:
    skeleton = ant()
    q = rot.exp(0.3 * np.sin(np.linspace(0.0, np.pi, N))[:, None, None] * np.ones((len(skeleton), 3)))
    ends = Ends(skeleton, q)
    free = ends.solve()
    leg = limbs_of(skeleton)[0]
    at, size = ends.place(free, leg[-1], MIDDLE_S), float(np.ptp(skeleton.rest[:, 0]))
    reach = Reach(leg[-1], at + np.array([0.0, 0.03 * size, 0.0]), MIDDLE_S)
    made = ends.solve([reach])
    assert np.linalg.norm(ends.place(made, leg[-1], MIDDLE_S) - reach.place) < 0.01 * size
