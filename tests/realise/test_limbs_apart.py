"""Limbs kept apart: legs that change places pass each other, smoothly, and nothing else moves."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import insect

from motionmind._typing import Floats
from motionmind.body.capsules import capsules_of, legs_depth, pair_depths, penetration
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.motion import Posture
from motionmind.geometry import rotations as rot
from motionmind.realise.limb_turns import LEAST, Placed, is_any_deeper, least_turns
from motionmind.realise.limbs_apart import _give_way, _limbs_of, keep_limbs_apart
from motionmind.tween.engine import Engine

BODY = human23()
FRAMES = 31
TIMES = np.arange(FRAMES) / 30.0
ENDS = np.array([0.0, FRAMES - 1.0])
FREE = np.zeros(len(BODY), dtype=np.bool_)
UNUSUAL = np.zeros(len(capsules_of(BODY).pairs()))
LEGS = [BODY.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("hip", "ankle")]


def posture(**turned: tuple[float, float, float]) -> Floats:
    """Local rotations [J, 4] at rest, but for the rotation vectors of some joints."""
    out = np.tile(rot.IDENTITY, (len(BODY), 1))
    for joint, vector in turned.items():
        out[BODY.index(joint)] = rot.exp(np.array(vector))
    return out


def crossed(forward: float, inward: float = 0.2) -> Floats:
    """A posture with shanks crossed, the left leg swung so far forward and the right one backward, radians."""
    return posture(left_hip=(-forward, 0.0, -inward), right_hip=(forward, 0.0, inward))


def between(a: Floats, b: Floats) -> Floats:
    """The shortest way from one posture to another [FRAMES, J, 4], eased in and out."""
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, FRAMES))
    return rot.slerp(a[None], b[None], share[:, None])


def apart(rotations: Floats, root: Floats | None = None, **options: Floats) -> Floats:
    """The movement with limbs kept apart, on a body in the air unless its root's places are given."""
    frame = np.arange(FRAMES)
    flying = np.stack([np.zeros(FRAMES), 0.1 * frame * (FRAMES - 1 - frame), frame], axis=1)
    given = {"given": ENDS, "fixed": FREE, "usual": UNUSUAL} | options
    return keep_limbs_apart(BODY, rotations, flying if root is None else root, TIMES, **given)


THROUGH = between(crossed(0.2), crossed(-0.2))
IN_PASSING = between(
    posture(left_hip=(-0.5, 0.0, -0.18), right_hip=(0.5, 0.0, 0.0)), posture(left_hip=(0.5, 0.0, -0.18))
)


@pytest.mark.parametrize("movement", [THROUGH, IN_PASSING], ids=["to the other side", "in passing"])
def test_legs_do_not_pass_through_each_other(movement: Floats) -> None:
    assert legs_depth(BODY, movement[[0, -1]]).max() == 0.0
    assert legs_depth(BODY, movement).max() > 0.035
    assert legs_depth(BODY, apart(movement)).max() < 0.01


@pytest.mark.parametrize("movement", [THROUGH, IN_PASSING], ids=["to the other side", "in passing"])
def test_ends_and_other_joints_stay_to_the_bit(movement: Floats) -> None:
    out = apart(movement)
    np.testing.assert_array_equal(out[[0, 1, -2, -1]], movement[[0, 1, -2, -1]])
    others = np.delete(np.arange(len(BODY)), LEGS)
    np.testing.assert_array_equal(out[:, others], movement[:, others])


def walking(rotations: Floats) -> Floats:
    """Places of a root [FRAMES, 3] on which the left foot stays for ten frames, then the right one, and so on."""
    places = BODY.positions(rotations, np.zeros((FRAMES, 3)))
    feet = ["right_toes" if (frame // 10) % 2 else "left_toes" for frame in range(1, FRAMES)]
    moved = [places[k + 1, BODY.index(foot)] - places[k, BODY.index(foot)] for k, foot in enumerate(feet)]
    return np.concatenate([np.zeros((1, 3)), -np.cumsum(moved, axis=0)])


@pytest.mark.parametrize(("frames", "forward"), [(8, 0.3), (12, 0.3), (12, 0.4)])
def test_legs_that_stand_in_turn_come_apart(frames: int, forward: float) -> None:
    since = np.clip((np.arange(FRAMES) - 15) / frames + 0.5, 0.0, 1.0)
    share = 0.5 - 0.5 * np.cos(np.pi * since)
    movement = rot.slerp(crossed(forward, 0.3)[None], crossed(-forward, 0.3)[None], share[:, None])
    assert legs_depth(BODY, movement).max() > 0.09
    assert legs_depth(BODY, apart(movement, walking(movement))).max() < 0.01


def test_feet_keep_their_orientations() -> None:
    ankles = [BODY.index("left_ankle"), BODY.index("right_ankle")]
    before, after = (BODY.global_rotations(each)[:, ankles] for each in (THROUGH, apart(THROUGH)))
    assert rot.angle(before, after).max() < 1e-6


def test_the_movement_stays_smooth() -> None:
    """No joint turns from frame to frame by much more than before, nor changes how fast it turns."""
    before, after = (rot.log(rot.inv_mul(each[:-1], each[1:]))[:, LEGS] for each in (THROUGH, apart(THROUGH)))
    assert np.abs(np.diff(after, axis=0)).max() < np.abs(np.diff(before, axis=0)).max() + np.radians(3.0)


def test_what_the_ends_have_in_each_other_stays() -> None:
    deep = crossed(0.05)
    assert legs_depth(BODY, deep) > 0.03
    still = np.tile(deep, (FRAMES, 1, 1))
    np.testing.assert_array_equal(apart(still), still)


def test_what_the_corpus_has_in_each_other_stays() -> None:
    np.testing.assert_array_equal(apart(THROUGH, usual=np.full(len(UNUSUAL), 0.2)), THROUGH)


def test_postures_on_the_way_stay() -> None:
    out = apart(THROUGH, given=np.array([0.0, 9.5, FRAMES - 1.0]))
    np.testing.assert_array_equal(out[8:12], THROUGH[8:12])
    assert legs_depth(BODY, out).max() < legs_depth(BODY, THROUGH).max()


def test_a_fixed_leg_stays_and_the_other_gives_way() -> None:
    fixed = FREE.copy()
    fixed[BODY.index("left_hip")] = True
    out = apart(THROUGH, fixed=fixed)
    np.testing.assert_array_equal(out[:, LEGS[:2]], THROUGH[:, LEGS[:2]])
    assert legs_depth(BODY, out).max() < 0.02


def test_a_standing_foot_stays_where_it_stands() -> None:
    """The left leg stands straight; the right one swings through it, and does not sink into the floor."""
    swing = between(posture(right_hip=(-0.6, 0.0, 0.28)), posture(right_hip=(0.6, 0.0, 0.28)))
    root = np.zeros((FRAMES, 3))
    assert legs_depth(BODY, swing).max() > 0.05
    out = apart(swing, root)
    assert legs_depth(BODY, out).max() < 0.01
    left, right = BODY.index("left_ankle"), BODY.index("right_ankle")
    moved = np.linalg.norm(BODY.positions(out, root) - BODY.positions(swing, root), axis=-1)
    assert moved[:, left].max() < 0.005
    assert moved[:, right].max() > 0.05
    assert lowest_height(BODY, out, root).min() > lowest_height(BODY, swing, root).min() - 0.002


def test_of_two_standing_feet_the_one_that_steps_sooner_gives_way() -> None:
    """The right foot stands from the first frame on, the left one until the last; for a while their legs cross."""
    still = np.zeros((FRAMES, 4))
    still[:20, 1] = still[12:, 0] = 1.0
    crosses = np.zeros(FRAMES, dtype=np.bool_)
    crosses[13:16] = True
    held, stands = _give_way(still, still, crosses)
    expected = still.copy()
    expected[12:16, 0] = 0.0  # it comes down a frame before they cross
    np.testing.assert_array_equal(held, expected)
    np.testing.assert_array_equal(stands, expected)
    for unchanged in _give_way(still, still, ~still[:, :2].all(axis=1)):
        np.testing.assert_array_equal(unchanged, still)


def test_legs_that_are_apart_are_not_driven_farther() -> None:
    """Each side of a plane asked of them throughout, these turned by 17 degrees; by 11 they have passed each other."""
    movement = between(crossed(0.2, 0.25), crossed(-0.2, 0.25))
    out = apart(movement)
    assert legs_depth(BODY, movement).max() > 0.09
    assert legs_depth(BODY, out).max() < 0.015
    assert rot.angle(out, movement)[:, LEGS].max() < np.radians(13.0)


def test_a_hand_goes_round_the_thigh() -> None:
    """An arm that hangs down, a little inwards, swings from in front of the thigh to behind it."""

    def hanging(forward: float) -> Floats:
        out = posture()
        swung = rot.mul(rot.exp(np.array([-forward, 0.0, 0.0])), rot.exp(np.array([0.0, 0.0, -1.7])))
        out[BODY.index("left_shoulder")] = swung
        return out

    swing = between(hanging(0.5), hanging(-0.5))
    depths = penetration(BODY, swing)
    assert max(depth[[0, -1]].max() for depth in depths.values()) == 0.0
    assert depths["left_hand", "left_thigh"].max() > 0.03
    out = apart(swing)
    assert max(depth.max() for depth in penetration(BODY, out).values()) < 0.01
    assert np.all(out[:, BODY.index("left_hip")] == swing[:, BODY.index("left_hip")])


def test_a_limb_is_as_deep_as_in_the_deepest_of_its_pairs() -> None:
    rng, capsules = np.random.default_rng(0), capsules_of(BODY)
    pairs, limbs = capsules.pairs(), _limbs_of(BODY)
    places = BODY.positions_and_tips(rot.exp(rng.normal(0.0, 0.6, (60, len(BODY), 3))), np.zeros(3))
    ends = capsules.place(places)
    placed = Placed(ends, places[:, limbs.first], places[:, limbs.last], np.zeros((60, 4)))
    allowed = rng.uniform(0.0, 0.05, (60, len(pairs)))
    deep, steps = least_turns(placed, limbs, capsules.radii, pairs, allowed, np.zeros((60, len(pairs), 3)))
    beyond = pair_depths(ends, capsules.radii, pairs)[0] - allowed
    expected = np.zeros_like(deep)
    for (limb, other), depth in zip(limbs.owner[pairs], beyond.T, strict=True):
        for mine, against in ((limb, other), (other, limb)):
            if mine > 1 or (mine >= 0 and against < 2):
                expected[:, mine] = np.maximum(expected[:, mine], np.where(depth > LEAST, depth, 0.0))
    assert (expected > 0.0).any(axis=0).all()
    np.testing.assert_allclose(deep, expected, rtol=0.0, atol=1e-12)
    assert not steps[deep == 0.0].any()


def test_limbs_that_are_apart_do_not_change() -> None:
    wide = between(posture(left_hip=(0.5, 0.0, 0.3)), posture(left_hip=(-0.5, 0.0, 0.3)))
    assert apart(wide) is wide


def test_a_body_without_capsules_does_not_change() -> None:
    body, rng = insect(), np.random.default_rng(0)
    rotations = rot.normalise(rng.normal(size=(FRAMES, len(body), 4)))
    fixed = np.zeros(len(body), dtype=np.bool_)
    out = keep_limbs_apart(body, rotations, np.zeros((FRAMES, 3)), TIMES, ENDS, fixed, np.zeros(0))
    assert out is rotations


def test_tweens_keep_their_legs_apart_unless_told_otherwise() -> None:
    """Random pairs of ballet postures; without the correction some legs pass through each other."""
    engine = Engine.load("ballet")
    corpus, body = engine.corpus, engine.corpus.skeleton
    kept, left = [], []
    for ends in np.random.default_rng(3).integers(len(corpus), size=(8, 2)):
        a, b = (Posture(body, corpus.rotations[end], corpus.root[end]) for end in ends)
        own = legs_depth(body, np.stack([a.rotations, b.rotations])).max()
        kept.append(legs_depth(body, engine.tween(a, b).motion.rotations).max() - own)
        left.append(legs_depth(body, engine.tween(a, b, without=["limbs"]).motion.rotations).max() - own)
    assert max(left) > 0.03
    assert max(kept) < 0.03


def test_arms_that_meet_beside_a_given_posture_part_without_a_jerk() -> None:
    """Forearms that were crossed come into each other in the second frame; driven apart at once, they flew apart."""
    found, fps = Engine.load("macarena"), 30.0
    a, b = (Posture(found.corpus.skeleton, found.corpus.rotations[k], found.corpus.root[k]) for k in (76, 36))
    plain, apart_ = (found.tween(a, b, fps=fps, without=left).motion for left in ({"limbs"}, set()))
    arms = [BODY.index(f"{side}_shoulder") for side in ("left", "right")]
    fastest = [fps * rot.angle(one.rotations[:-1, arms], one.rotations[1:, arms])[:10].max() for one in (plain, apart_)]
    assert fastest[0] < 6.0
    assert fastest[1] < 11.5


def test_any_pair_that_is_deeper_than_allowed_is_seen() -> None:
    capsules = capsules_of(BODY)
    pairs = capsules.pairs()
    rng = np.random.default_rng(0)
    rotations = rot.exp(0.7 * rng.normal(size=(40, len(BODY), 3)))
    ends = np.ascontiguousarray(capsules.place(BODY.positions_and_tips(rotations, np.zeros(3))))
    depths, _ = pair_depths(ends, capsules.radii, pairs)
    deepest = np.sort(depths.max(axis=0))
    assert deepest[-1] > 0.02
    assert deepest[0] < 0.0
    for off in (-1e-9, 1e-9):
        for frame, pair in np.argwhere(depths > LEAST)[::7]:
            allowed = np.full(depths.shape, 1.0)
            allowed[frame, pair] = depths[frame, pair] - LEAST + off
            assert is_any_deeper(ends, capsules.radii, pairs, allowed) == (off < 0.0)
