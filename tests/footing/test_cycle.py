"""Laws of cycles: what repeats is found exactly, and rounds follow one another without a seam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from motionmind.body.contact import foot_slides
from motionmind.body.human import human23
from motionmind.body.legs import find_hinge
from motionmind.body.mirror import mirrored
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.footing.cycle import Cycle, Ground, bend_leg, close_between, close_cycle
from motionmind.geometry import rotations as rot

BODY = human23()
FPS = 60.0


def swinging(frames: int, period: float, turn: float = 0.0, drift: float = 0.0, seed: int = 0) -> Motion:
    """Every joint swings in harmonics of a period, and the root goes on, turning by `turn` radians a round.

    Swings grow by `drift` of themselves in each round.
    """
    random = np.random.default_rng(seed)
    phase = np.arange(frames)[:, None, None] / period
    swings = sum(
        random.normal(scale=0.2 / n, size=(23, 3)) * np.sin(2.0 * np.pi * (n * phase + random.random((23, 3))))
        for n in (1, 2, 3)
    ) * (1.0 + drift * phase)
    heading = turn * phase[:, 0, 0]
    rotations = rot.exp(swings)
    rotations[:, 0] = rot.mul(rot.about_vertical(heading), rotations[:, 0])
    steps = rot.mul_vec(rot.about_vertical(heading), np.array([0.0, 0.0, 1.2 / period]))
    root = np.cumsum(steps, axis=0) + np.array([0.0, 0.95, 0.0])
    root[:, 1] += 0.02 * np.sin(2.0 * np.pi * phase[:, 0, 0])
    return Motion(BODY, rotations, root, np.arange(frames) / FPS, name="swings")


def walk(rounds: float, uneven: float = 0.0) -> Motion:
    """Legs with knees walk on the spot of their stance feet, which the root follows; `uneven` lengthens steps."""
    frames = round(rounds * 72)
    phase = 2.0 * np.pi * np.arange(frames) / 72.0
    size = 1.0 + uneven * phase / (2.0 * np.pi)
    rotations = np.tile(rot.IDENTITY, (frames, 23, 1))
    for side, shift in (("left", 0.0), ("right", np.pi)):
        swing = 0.35 * size * np.sin(phase + shift)
        lift = 0.9 * np.maximum(np.cos(phase + shift + 0.2), 0.0) ** 2
        for joint, angle in (("hip", -swing - 0.5 * lift), ("knee", lift), ("ankle", swing - 0.5 * lift)):
            rotations[:, BODY.index(f"{side}_{joint}")] = rot.from_axis_angle([1.0, 0.0, 0.0], angle)
    places = BODY.positions(rotations, np.zeros((frames, 3)))
    ankles = np.stack([places[:, BODY.index(f"{side}_ankle")] for side in ("left", "right")], axis=1)
    standing = (np.cos(phase) > 0.0).astype(int)  # the right one while the left one swings
    steps = np.diff(ankles, axis=0)[np.arange(frames - 1), standing[1:]]
    root = np.concatenate([[[0.0, 0.0, 0.0]], np.cumsum(-steps, axis=0)])
    root[:, 1] = 0.1 - ankles[np.arange(frames), standing, 1]
    return Motion(BODY, rotations, root, np.arange(frames) / FPS, name="walk")


def rounds_of(cycle: Cycle, count: int) -> Motion:
    """Several rounds, one after another."""
    rounds = [cycle.ground.moved(cycle.motion, float(number)) for number in range(count)]
    rotations = np.concatenate([one.rotations[number > 0 :] for number, one in enumerate(rounds)])
    root = np.concatenate([one.root[number > 0 :] for number, one in enumerate(rounds)])
    return replace(cycle.motion, rotations=rotations, root=root, times=np.arange(len(root)) / FPS)


@pytest.mark.parametrize("period", [31, 48, 90])
@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
def test_what_repeats_is_found_exactly(period: int, turn: float) -> None:
    motion = swinging(4 * period, period, turn)
    cycle = close_cycle(motion)
    assert cycle.frames[1] - cycle.frames[0] == period
    assert cycle.ground.turn == pytest.approx(turn, abs=1e-6)
    assert max(cycle.gap.max(), cycle.root_gap) < 1e-6
    part = motion.slice(cycle.frames[0], cycle.frames[1] + 1)
    assert rot.angle(cycle.motion.rotations, part.rotations).max() < 0.01
    assert cycle.motion.root == pytest.approx(part.root, abs=1e-6)


@pytest.mark.parametrize(
    "motion",
    [
        swinging(300, 50.5, turn, drift, seed)
        for seed in range(3)
        for turn, drift in ((0.0, 0.05), (0.9, 0.1), (0.03, 0.2))
    ]
    + [walk(4, uneven) for uneven in (0.0, 0.05, 0.1)],
    ids=str,
)
def test_rounds_follow_without_a_seam(motion: Motion) -> None:
    """Steps, and changes of steps, are at the seam no larger than elsewhere in the recording."""
    cycle = close_cycle(motion)
    three, count = rounds_of(cycle, 3).positions(), len(cycle.motion)
    own = motion.positions()
    for order, slack in ((1, 1.2), (2, 1.5)):
        moved = np.linalg.norm(np.diff(three, order, axis=0), axis=-1)
        usual = np.linalg.norm(np.diff(own, order, axis=0), axis=-1).max(axis=0)
        assert np.all(moved[count - 3 : count + 2] <= slack * usual.max())


@pytest.mark.parametrize("uneven", [0.0, 0.05, 0.1, 0.2, 0.4])
def test_feet_that_stand_stay(uneven: float) -> None:
    motion = walk(4, uneven)
    cycle = close_cycle(motion)
    three = rounds_of(cycle, 3)
    own = foot_slides(BODY, motion.rotations, motion.root)
    slides = foot_slides(BODY, three.rotations, three.root)
    assert cycle.ground.travel[2] > 0.5
    assert slides.max() <= own.max() + 0.001  # metres a frame
    assert slides.mean() <= 1.02 * own.mean()


@pytest.mark.parametrize("turn", [0.0, 0.9])
def test_mirrored_and_reversed(turn: float) -> None:
    """Mirrored movement has the mirrored cycle; the cycle of reversed movement has the same length and gap."""
    motion = swinging(200, 50.0, turn, 0.1)
    cycle, image = close_cycle(motion), close_cycle(mirrored(motion))
    assert image.frames == cycle.frames
    assert mirrored(cycle.motion).root == pytest.approx(image.motion.root, abs=1e-9)
    assert rot.angle(mirrored(cycle.motion).rotations, image.motion.rotations).max() < 1e-5
    back = close_cycle(replace(motion, rotations=motion.rotations[::-1], root=motion.root[::-1]))
    assert back.frames[1] - back.frames[0] == cycle.frames[1] - cycle.frames[0]


@pytest.mark.parametrize("turn", [0.0, 0.9, -0.4])
def test_in_place(turn: float) -> None:
    still = close_cycle(swinging(200, 50.0, turn, 0.1)).in_place()
    assert still.root[-1] == pytest.approx(still.root[0], abs=1e-9)
    assert rot.angle(still.rotations[-1], still.rotations[0]).max() < 1e-6


@pytest.mark.parametrize("turn", [0.0, 0.5, -2.5])
def test_shares_of_the_ground_add_up(turn: float) -> None:
    ground = Ground(turn, np.array([1.0, 0.0, -2.0]))
    assert ground.at(1.0)[1] == pytest.approx(ground.travel)
    (first, a), (second, b), (both, c) = map(ground.at, (0.3, 0.5, 0.8))
    assert rot.mul_vec(second, a) + b == pytest.approx(c)
    assert rot.angle(rot.mul(second, first), both) < 1e-7


def test_what_has_no_cycle() -> None:
    still = swinging(200, 50.0)
    still = replace(still, rotations=still.rotations[[0] * 200], root=still.root[[0] * 200])
    with pytest.raises(MotionMindError, match="swings: nothing moves far enough to repeat"):
        close_cycle(still)
    with pytest.raises(MotionMindError, match=r"swings: lasts 0.32 s, too short for a cycle of 0.5 s"):
        close_cycle(swinging(20, 50.0))


@pytest.mark.parametrize("bend", [0.0, 1e-9, 0.02, 0.5])
def test_legs_reach_and_knees_bend_forwards(bend: float) -> None:
    """Straight knees, too, bend about their hinge."""
    motion = walk(1).slice(0, 2)
    rotations = np.tile(rot.IDENTITY, (2, 23, 1))
    leg = tuple(BODY.index(f"left_{name}") for name in ("hip", "knee", "ankle"))
    rotations[:, leg[1]] = rot.from_axis_angle([1.0, 0.0, 0.0], bend)
    standing = replace(motion, rotations=rotations)
    target = standing.positions()[:, leg[2]] + np.array([0.02, 0.05, 0.01])
    found = bend_leg(
        standing, (leg[0], leg[1], leg[2]), find_hinge(BODY, leg[1]), target, np.tile(rot.IDENTITY, (2, 1))
    )
    assert found.positions()[:, leg[2]] == pytest.approx(target, abs=1e-6)
    assert rot.angle(BODY.global_rotations(found.rotations)[:, leg[2]], rot.IDENTITY).max() < 1e-7
    turned = rot.log(found.rotations[:, leg[1]])
    assert turned[:, 0].min() > bend + 0.1
    assert np.abs(turned[:, 1:]).max() < 1e-6


def test_a_swing_is_not_closed_on_its_way_back() -> None:
    """A pendulum has each posture twice in a round, with opposite velocities."""
    motion = swinging(200, 60.0)
    phase = 2.0 * np.pi * np.arange(200)[:, None, None] / 60.0
    rotations = rot.exp(0.5 * np.sin(phase) * np.random.default_rng(1).normal(size=(23, 3)))
    cycle = close_cycle(replace(motion, rotations=rotations, root=motion.root * [0.0, 0.0, 1.0]))
    assert cycle.frames[1] - cycle.frames[0] == 60


@pytest.mark.parametrize("turn", [0.0, 1.0])
@pytest.mark.parametrize("rounds", [0.9, 1.03, 1.1])
def test_velocities_meet_at_any_seam(turn: float, rounds: float) -> None:
    """A round leaves its first frame as it arrives at its last, whatever these are."""
    fine = 1000.0  # frames a second: differences of frames are velocities
    motion = swinging(2000, 800.0, turn)
    cycle = close_between(replace(motion, times=np.arange(2000) / fine), 300, 300 + round(800 * rounds))
    two, seam = rounds_of(cycle, 2), len(cycle.motion) - 1
    before, after = (two.slice(frame, frame + 2) for frame in (seam - 1, seam))
    turned = [rot.log(rot.inv_mul(*one.rotations)) * fine for one in (before, after)]
    moved = [np.diff(one.root, axis=0)[0] * fine for one in (before, after)]
    assert cycle.speed_gap.max() > 0.2
    assert rot.norm(turned[1] - turned[0]).max() < 0.3 * cycle.speed_gap.max()
    assert rot.norm(moved[1] - moved[0]) < 0.01  # metres a second
