"""Limbs kept apart: legs that change places pass each other, smoothly, and nothing else moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from bodies import insect
from grounds import grounded

from motionmind._typing import Floats
from motionmind.body.capsules import capsules_of, legs_depth, penetration
from motionmind.body.contact import lowest_height
from motionmind.body.human import human23
from motionmind.body.motion import Posture
from motionmind.footing.root import stand
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine

BODY = human23()
FRAMES = 31
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


def apart(rotations: Floats, root: Floats | None = None, **options: Any) -> Floats:
    """The movement with limbs kept apart, of a body that leaps for half a second unless its root is given."""
    options = {"usual": UNUSUAL} | options
    if root is None:
        flies = {"aloft": np.ones(2 * len(options.get("given", ())) + 3 if options.get("given") else 17), "leap": 1.0}
        root, options = stand(BODY, rotations, np.zeros((FRAMES, 3)), np.ones(FRAMES)), flies | {"fps": 60.0} | options
    return grounded(rotations, root, **options)[0]


THROUGH = between(crossed(0.2), crossed(-0.2))
IN_PASSING = between(
    posture(left_hip=(-0.5, 0.0, -0.18), right_hip=(0.5, 0.0, 0.0)), posture(left_hip=(0.5, 0.0, -0.18))
)


@pytest.mark.parametrize("movement", [THROUGH, IN_PASSING], ids=["to the other side", "in passing"])
def test_legs_do_not_pass_through_each_other(movement: Floats) -> None:
    assert legs_depth(BODY, movement[[0, -1]]).max() == 0.0
    assert legs_depth(BODY, movement).max() > 0.035
    assert legs_depth(BODY, apart(movement)).max() < 0.02


@pytest.mark.parametrize("movement", [THROUGH, IN_PASSING], ids=["to the other side", "in passing"])
def test_ends_stay_and_the_rest_of_the_body_hardly_changes(movement: Floats) -> None:
    out = apart(movement)
    np.testing.assert_allclose(out[[0, -1]], movement[[0, -1]], rtol=0.0, atol=1e-12)
    apart_by = np.degrees(rot.angle(out, apart(movement, without=["limbs"])).max(axis=0))
    knees = [BODY.index(f"{side}_knee") for side in ("left", "right")]
    assert apart_by[knees].max() < 18.0  # a leg that passes over the other bends
    assert np.delete(apart_by, [*LEGS, *knees]).max() < 0.1


@pytest.mark.parametrize("usual", [0.0, 0.2])
def test_limbs_that_are_in_each_other_at_both_ends_or_in_the_corpus_stay(usual: float) -> None:
    deep = crossed(0.05)
    assert legs_depth(BODY, deep) > 0.03
    movement = THROUGH if usual else between(deep, deep)
    out, without = apart(movement, usual=UNUSUAL + usual), apart(movement, without=["limbs"])
    assert rot.angle(out, without)[:, LEGS].max() < np.radians(2.0)


def test_postures_on_the_way_stay() -> None:
    out = apart(THROUGH, given=[9.5])
    np.testing.assert_allclose(out[9:11], THROUGH[9:11], rtol=0.0, atol=1e-12)
    assert legs_depth(BODY, out).max() <= legs_depth(BODY, THROUGH).max()


def test_a_fixed_leg_stays_and_the_other_gives_way() -> None:
    fixed = FREE.copy()
    fixed[LEGS[:2]] = True
    out = apart(THROUGH, fixed=fixed)
    np.testing.assert_allclose(out[:, LEGS[:2]], THROUGH[:, LEGS[:2]], rtol=0.0, atol=1e-12)
    assert legs_depth(BODY, out).max() < 0.02


def test_a_standing_foot_stays_where_it_stands() -> None:
    """The left leg stands straight; the right one swings through it, and does not sink into the floor."""
    swing = between(posture(right_hip=(-0.6, 0.0, 0.28)), posture(right_hip=(0.6, 0.0, 0.28)))
    root = stand(BODY, swing, np.zeros((FRAMES, 3)), np.zeros(FRAMES))
    assert legs_depth(BODY, swing).max() > 0.05
    out, went = grounded(swing, root, usual=UNUSUAL)
    assert legs_depth(BODY, out).max() < 0.02
    left = BODY.index("left_ankle")
    moved = np.linalg.norm(BODY.positions(out, went)[:, left] - BODY.positions(swing, root)[:, left], axis=-1)
    assert moved.max() < 0.02
    assert lowest_height(BODY, out, went).min() > -0.005


def test_legs_that_are_apart_are_not_driven_farther() -> None:
    movement = between(crossed(0.2, 0.25), crossed(-0.2, 0.25))
    out = apart(movement)
    assert legs_depth(BODY, movement).max() > 0.09
    assert legs_depth(BODY, out).max() < 0.02
    assert rot.angle(out, apart(movement, without=["limbs"]))[:, LEGS].max() < np.radians(18.0)


def test_limbs_that_are_apart_hardly_change() -> None:
    wide = between(posture(left_hip=(0.5, 0.0, 0.3)), posture(left_hip=(-0.5, 0.0, 0.3)))
    np.testing.assert_allclose(apart(wide), apart(wide, without=["limbs"]), rtol=0.0, atol=1e-9)


def test_a_body_without_capsules_has_no_limbs_to_keep_apart() -> None:
    body, rng = insect(), np.random.default_rng(0)
    swings = np.sin(np.linspace(0.0, np.pi, FRAMES))[:, None, None] * rng.normal(scale=0.2, size=(len(body), 3))
    root = stand(body, rot.exp(swings), np.zeros((FRAMES, 3)), np.zeros(FRAMES))
    fixed = np.zeros(len(body), dtype=np.bool_)
    with_limbs, without = (
        grounded(rot.exp(swings), root, skeleton=body, fixed=fixed, without=left)[0] for left in ((), ("limbs",))
    )
    np.testing.assert_array_equal(with_limbs, without)


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
    assert legs_depth(BODY, apart(movement, walking(movement))).max() < 0.02


def test_the_movement_stays_smooth() -> None:
    """No joint turns from frame to frame by much more than before, nor changes how fast it turns."""
    before, after = (rot.log(rot.inv_mul(each[:-1], each[1:]))[:, LEGS] for each in (THROUGH, apart(THROUGH)))
    assert np.abs(np.diff(after, axis=0)).max() < np.abs(np.diff(before, axis=0)).max() + np.radians(3.0)


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
    assert max(depth.max() for depth in penetration(BODY, out).values()) < 0.02
    hip = BODY.index("left_hip")
    assert rot.angle(out, apart(swing, without=["limbs"]))[:, hip].max() < np.radians(15.0)


@pytest.mark.long
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
