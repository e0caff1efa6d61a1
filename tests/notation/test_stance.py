"""Legs on the floor: laws of whatever stance, and a slow computation of the same that shares none of its code."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize
from scipy.spatial.transform import Rotation

import motionmind.body
from motionmind._typing import Floats
from motionmind.body.anatomy import Anatomy
from motionmind.body.anatomy_file import anatomy_named
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.notation.stance import Feet, Stance, place_legs

SIDES = ("left", "right")
SIGN = (1.0, -1.0)
HUMAN = anatomy_named("human23")
BONES: Skeleton = human23()
TOML = tomllib.loads((Path(motionmind.body.__file__).parent / "bodies" / "human23.toml").read_text("utf-8"))
TOES = BONES.offsets[BONES.index("left_toes")]  # the ball of the foot, seen from the ankle
SHANK = -BONES.offsets[BONES.index("left_ankle")][1]
THIGH = -BONES.offsets[BONES.index("left_knee")][1]
APART = BONES.offsets[BONES.index("left_hip")][0]


@dataclass(frozen=True)
class Case:
    """Postures with what their feet do, before they are placed."""

    angles: dict[str, Floats]
    feet: Feet

    @property
    def rotations(self) -> Floats:
        return HUMAN.rotations(self.angles)

    def placed(self) -> Stance:
        return place_legs(HUMAN, HUMAN.leg, self.rotations, self.feet)  # type: ignore[arg-type]

    def pick(self, rows: list[int]) -> Case:
        chosen = {field.name: getattr(self.feet, field.name)[rows] for field in fields(Feet)}
        return Case({name: values[rows] for name, values in self.angles.items()}, Feet(**chosen))


def feet_of(count: int, **said: Any) -> Feet:
    """Feet of `count` postures: zeros but for what is said; angles in degrees, lengths in centimetres."""
    out: dict[str, Any] = {}
    for field in fields(Feet):
        shape = (count, 2)
        value = np.broadcast_to(np.asarray(said.get(field.name, 0.0), dtype=float), shape)
        match field.name:
            case "stands" | "touches" | "planted":
                out[field.name] = value > 0.0
            case "turn" | "knee" | "heel" | "bend" | "towards":
                out[field.name] = np.radians(value)
            case "weight":
                out[field.name] = np.array(value)
            case _:
                out[field.name] = value / 100.0
    return Feet(**out)


HEEL = np.array([0.0, -0.066, -0.045])  # in the ankle's frame, metres: under it and behind

# What legs may be: both stand; one does, and the other is in the air, or touches.
WAYS = ((("stand", "stand"), 3), (("stand", "air"), 1), (("air", "stand"), 1), (("stand", "touch"), 1))
WAYS += ((("touch", "stand"), 1),)

numbers = st.floats(0.0, 1.0).map(lambda share: round(share, 3))


def within(low: float, high: float) -> st.SearchStrategy[float]:
    return numbers.map(lambda share: low + share * (high - low))


def both(low: float, high: float) -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(within(low, high), within(low, high))


@st.composite
def cases(draw: Callable[..., Any], kinds: st.SearchStrategy[tuple[str, str]] | None = None) -> Case:
    """One posture: trunk, arms and a leg in the air anywhere within their limits, feet wherever they can well be."""
    kind = draw(kinds or st.sampled_from([way for way, often in WAYS for _ in range(often)]))
    turn = draw(both(-5.0, 75.0))
    aside = draw(both(-12.0, 12.0))
    feet = feet_of(
        1,
        stands=[[word == "stand" for word in kind]],
        touches=[[word == "touch" for word in kind]],
        out=[draw(both(-4.0, 20.0))],
        ahead=[draw(both(-14.0, 22.0))],
        turn=[turn],
        knee=[np.add(turn, aside)],
        heel=[draw(st.sampled_from([(0.0, 0.0), (48.0, 48.0)]) | both(0.0, 55.0))],
        bend=[draw(st.just((0.0, 0.0)) | both(0.0, 70.0))],
        towards=[draw(both(-20.0, 180.0))],
        weight=[draw(both(1.0, 100.0))],
        lean=[draw(st.just((0.0, 0.0)) | both(-6.0, 6.0))],
    )
    angles = {}
    modest = {"pelvis": {"tilt": (-15.0, 40.0), "list": (-12.0, 12.0), "turn": (-25.0, 25.0)}}
    modest["knee"] = {"flexion": (0.0, 25.0)}  # or a leg that touches never comes down to the floor
    share = draw(st.sampled_from([0.0, 0.3, 1.0]))  # of the way to the limits
    for name in BONES.names:
        stem, joint = HUMAN.anatomy(name)
        angles[name] = np.zeros((1, 3))
        for word, angle in joint.angles.items():
            low, high = modest.get(stem, {}).get(word, angle.range)
            if stem == "shoulder":
                low, high = max(low, -90.0), min(high, 120.0)
            angles[name][0, angle.axis] = angle.sign * share * draw(within(low, high))
    return Case(angles, feet)


@pytest.fixture(scope="module")
def many() -> Case:
    """Some hundreds of postures, all random, as one batch."""
    rng = np.random.default_rng(20)
    T = 300
    kinds = rng.choice(len(WAYS), T, p=[0.4, 0.15, 0.15, 0.15, 0.15])
    said = np.array([[way for way, _ in WAYS][kind] for kind in kinds])
    angles = {}
    for name in BONES.names:
        stem, joint = HUMAN.anatomy(name)
        angles[name] = np.zeros((T, 3))
        for angle in joint.angles.values():
            low, high = (-15.0, 25.0) if stem == "pelvis" else np.clip(angle.range, -90.0, 120.0)
            angles[name][:, angle.axis] = angle.sign * rng.uniform(low, high, T)
        if stem == "knee":
            angles[name] *= 0.2

    def two(low: float, high: float) -> Floats:
        return rng.uniform(low, high, (T, 2))

    turn = two(-5.0, 75.0)
    feet = feet_of(
        T,
        stands=said == "stand",
        touches=said == "touch",
        out=two(-4.0, 20.0),
        ahead=two(-14.0, 22.0),
        turn=turn,
        knee=turn + two(-12.0, 12.0),
        heel=two(-30.0, 55.0).clip(0.0),
        bend=two(-40.0, 70.0).clip(0.0),
        towards=two(-20.0, 180.0),
        weight=two(1.0, 100.0),
        lean=two(-6.0, 6.0),
    )
    return Case(angles, feet)


# --- where things are in what was placed, by forward kinematics -------------------------------------------------------


def points(stance: Stance) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Joints and tips by name [T, 3], metres."""
    found = BONES.positions_and_tips(stance.rotations, stance.root)
    joints = {name: found[:, index] for index, name in enumerate(BONES.names)}
    return joints, {name: found[:, len(BONES) + index] for index, name in enumerate(BONES.names)}


def lowest_of(stance: Stance, side: str) -> Floats:
    """Height of the lowest of a foot's ball, tip and heel [T], metres."""
    joints, tips = points(stance)
    turned = BONES.global_rotations(stance.rotations)[:, BONES.index(f"{side}_ankle")]
    heel = joints[f"{side}_ankle"] + rot.mul_vec(turned, HEEL)
    return np.min([joints[f"{side}_toes"][:, 1], tips[f"{side}_toes"][:, 1], heel[:, 1]], axis=0)


def direction(degrees: Floats, side: int) -> Floats:
    """Level, so many radians outward."""
    return np.stack([SIGN[side] * np.sin(degrees), np.zeros(len(degrees)), np.cos(degrees)], axis=-1)


def bend_of(joints: dict[str, Floats], side: str) -> Floats:
    """The angle between thigh and shank, radians; that of a straight leg is 0."""
    thigh = joints[f"{side}_knee"] - joints[f"{side}_hip"]
    shank = joints[f"{side}_ankle"] - joints[f"{side}_knee"]
    cross = np.linalg.norm(np.cross(thigh, shank), axis=-1)
    return np.arctan2(cross, (thigh * shank).sum(axis=-1))


def support(feet: Feet) -> Floats:
    """Where the weight belongs [T, 2]: over each foot's place by its share."""
    out, total = np.zeros((len(feet.out), 2)), np.zeros((len(feet.out), 1))
    for side in (0, 1):
        foot = np.stack([SIGN[side] * (APART + feet.out[:, side]), feet.ahead[:, side]], axis=-1)
        lifted = np.minimum(np.degrees(feet.heel[:, side]) / 24.0, 1.0)
        back = (1.0 - lifted) * TOES[2] / 2.0  # halfway to the ankle, or over the ball
        foot -= back[:, None] * direction(feet.turn[:, side], side)[:, [0, 2]]
        share = np.where(feet.stands[:, side], feet.weight[:, side], 0.0)[:, None]
        out, total = out + share * foot, total + share
    return out / total


def check_feet(case: Case, stance: Stance) -> None:
    """Feet that stand are on the floor where they should be, and point where they should."""
    joints, tips = points(stance)
    for side, name in enumerate(SIDES):
        stands = case.feet.stands[:, side]
        ball, tip, ankle = joints[f"{name}_toes"], tips[f"{name}_toes"], joints[f"{name}_ankle"]
        out, ahead = case.feet.out[:, side], case.feet.ahead[:, side]
        wanted = np.stack([SIGN[side] * (APART + out), np.zeros(len(out)), ahead], axis=-1)
        forward = direction(case.feet.turn[:, side], side)
        np.testing.assert_allclose(ball[stands], wanted[stands], atol=1e-6)
        np.testing.assert_allclose(tip[stands, 1], 0.0, atol=1e-6)
        length = np.linalg.norm(tip - ball, axis=-1, keepdims=True)
        np.testing.assert_allclose(((tip - ball) / length)[stands], forward[stands], atol=1e-6)
        # The foot is turned about its ball by the heel, in the plane of where it points.
        heel = case.feet.heel[:, side]
        back = TOES[2] * np.cos(heel) + TOES[1] * np.sin(heel)
        high = -TOES[1] * np.cos(heel) + TOES[2] * np.sin(heel)
        there = ball - back[:, None] * forward + high[:, None] * [0.0, 1.0, 0.0]
        np.testing.assert_allclose(ankle[stands], there[stands], atol=1e-6)


def check_knees(case: Case, stance: Stance) -> None:
    """Knees bend as much as they must, no hips could be higher, and they point where they should."""
    joints, _ = points(stance)
    spare = np.full((len(stance.root), 2), np.inf)
    for side, name in enumerate(SIDES):
        stands = case.feet.stands[:, side]
        hip, knee, ankle = (joints[f"{name}_{joint}"] for joint in ("hip", "knee", "ankle"))
        bend, least = bend_of(joints, name), case.feet.bend[:, side]
        assert (
            bend[stands] >= least[stands] - 1e-4
        ).all()  # the bend of a straight leg is known to the root of rounding
        reach = np.sqrt(THIGH**2 + SHANK**2 + 2.0 * THIGH * SHANK * np.cos(least))
        spare[:, side] = np.where(stands, reach - np.linalg.norm(hip - ankle, axis=-1), np.inf)
        higher = np.linalg.norm(hip - ankle + np.array([0.0, 1e-3, 0.0]), axis=-1)
        spare_higher = np.where(stands, reach - higher, np.inf)
        spare[:, side] = np.where(spare[:, side] < spare_higher, np.nan, spare[:, side])  # hips go up, legs get longer
        # The knee is off the line from hip to ankle towards where it points, as seen at right angles to that line.
        line = (ankle - hip) / np.linalg.norm(ankle - hip, axis=-1, keepdims=True)
        off = (knee - hip) - ((knee - hip) * line).sum(axis=-1, keepdims=True) * line
        forward = direction(case.feet.knee[:, side], side)
        across = np.cross(line, forward)
        across /= np.linalg.norm(across, axis=-1, keepdims=True)
        assert np.abs((off * across).sum(axis=-1)[stands]).max(initial=0.0) < 1e-6
        assert ((off * forward).sum(axis=-1)[stands] >= -1e-7).all()
    standing = case.feet.stands.any(axis=1)
    assert not np.isnan(spare).any()
    assert (spare.min(axis=1)[standing] > -1e-6).all()
    assert (spare.min(axis=1)[standing] < 1e-6).all()  # one leg is as long as it may be: 1 mm higher is too high


def check_weight(case: Case, stance: Stance) -> None:
    assert stance.imbalance.max() < 1e-6
    centre = HUMAN.centre_of_mass(stance.rotations, stance.root)[:, [0, 2]]
    np.testing.assert_allclose(centre, support(case.feet) + case.feet.lean, atol=1e-6)


def check_touch(case: Case, stance: Stance) -> None:
    """Of a leg that touches the lowest point of the foot is on the floor; it goes where it should, as it was."""
    joints, _ = points(stance)
    before = case.rotations
    for side, name in enumerate(SIDES):
        touches = case.feet.touches[:, side]
        np.testing.assert_allclose(lowest_of(stance, name)[touches], 0.0, atol=1e-6)
        for joint in ("knee", "ankle", "toes"):
            index = BONES.index(f"{name}_{joint}")
            np.testing.assert_array_equal(stance.rotations[touches, index], before[touches, index])
        thigh = joints[f"{name}_knee"] - joints[f"{name}_hip"]
        aside = np.cross(direction(case.feet.towards[:, side], side), [0.0, 1.0, 0.0])
        assert np.abs((thigh * aside).sum(axis=-1)[touches]).max(initial=0.0) < 1e-6
        # The thigh is raised from hanging, by a swing without twist, after the turn about its length that was given.
        turned = BONES.global_rotations(stance.rotations)[:, BONES.index(f"{name}_hip")]
        swing = rot.between(np.broadcast_to([0.0, -1.0, 0.0], thigh.shape), thigh)
        _, hip = HUMAN.anatomy(f"{name}_hip")
        outward = case.angles[f"{name}_hip"][:, hip.angles["rotation"].axis]
        twist = rot.about_vertical(SIGN[side] * np.radians(outward))
        assert rot.angle(rot.mul(swing, twist), turned)[touches].max(initial=0.0) < 1e-6


def check_rest(case: Case, stance: Stance) -> None:
    """What is not a leg on the floor is as it was."""
    before = case.rotations
    for index, name in enumerate(BONES.names):
        side, _, joint = name.partition("_")
        placed = case.feet.stands | case.feet.touches if joint in ("hip", "knee", "ankle", "toes") else None
        free = slice(None) if placed is None else ~placed[:, SIDES.index(side)]
        np.testing.assert_array_equal(stance.rotations[free, index], before[free, index])


CHECKS = {
    "feet": check_feet,
    "knees": check_knees,
    "weight": check_weight,
    "touch": check_touch,
    "rest": check_rest,
}


@pytest.mark.parametrize("law", CHECKS)
def test_a_law_holds_for_random_postures(law: str, many: Case) -> None:
    stance = many.placed()
    reached = np.flatnonzero((stance.shortfall == 0.0).all(axis=1))
    assert len(reached) > 250
    chosen = many.pick(list(reached))
    CHECKS[law](chosen, Stance(*(getattr(stance, field.name)[reached] for field in fields(stance))))


@given(cases())
@settings(max_examples=40)
def test_all_laws_hold_for_any_posture(case: Case) -> None:
    stance = case.placed()
    assume((stance.shortfall == 0.0).all())
    for check in CHECKS.values():
        check(case, stance)


def test_a_posture_does_not_depend_on_those_that_are_placed_with_it(many: Case) -> None:
    together = many.placed()
    for t in range(0, len(together.root), 15):
        alone = many.pick([t]).placed()
        np.testing.assert_array_equal(alone.rotations[0], together.rotations[t])
        np.testing.assert_array_equal(alone.root[0], together.root[t])


def test_the_mirror_image_is_placed_as_the_mirror_image(many: Case) -> None:
    partner = [BONES.index(_other(name)) for name in BONES.names]
    feet = Feet(**{field.name: getattr(many.feet, field.name)[:, ::-1] for field in fields(Feet)})
    feet = replace(feet, lean=many.feet.lean * [-1.0, 1.0])
    stance = many.placed()
    mirrored = place_legs(HUMAN, HUMAN.leg, rot.mirror(many.rotations)[:, partner], feet)  # type: ignore[arg-type]
    reached = (stance.shortfall == 0.0).all(axis=1)
    np.testing.assert_array_equal(reached, (mirrored.shortfall == 0.0).all(axis=1))
    np.testing.assert_allclose(mirrored.root[reached], (stance.root * [-1.0, 1.0, 1.0])[reached], atol=1e-6)
    off = rot.angle(mirrored.rotations, rot.mirror(stance.rotations)[:, partner])
    assert off[reached].max() < 1e-4  # a straight knee's angle is known to the root of the height's 1e-7


def _other(name: str) -> str:
    side, _, rest = name.partition("_")
    return f"{SIDES[1 - SIDES.index(side)]}_{rest}" if side in SIDES else name


def test_a_leg_too_short_for_its_place_says_by_how_much() -> None:
    case = Case({"pelvis": np.zeros((2, 3))}, feet_of(2, stands=1.0, weight=50.0, out=[[190.0, 0.0], [10.0, 10.0]]))
    stance = case.placed()
    assert stance.shortfall[0].max() > 0.0
    np.testing.assert_array_equal(stance.shortfall[1], 0.0)


def test_a_foot_that_stays_above_the_floor_says_by_how_much() -> None:
    """It cannot touch: the other leg stands on the ball of its foot, and this one's knee is bent."""
    feet = feet_of(1, stands=[[0.0, 1.0]], touches=[[1.0, 0.0]], weight=50.0, heel=48.0)
    stance = Case({"left_knee": np.array([[70.0, 0.0, 0.0]])}, feet).placed()
    lowest = lowest_of(stance, "left")[0]
    assert stance.shortfall[0, 0] == pytest.approx(lowest, abs=1e-6)
    assert lowest > 0.05


def test_between_two_straight_legs_the_weight_is_found() -> None:
    """A hair's breadth of the pelvis bends one knee or the other: nowhere is the balance less smooth."""
    feet = feet_of(1, stands=1.0, weight=50.0, out=27.0, ahead=4.0, turn=72.0, knee=63.0)
    for turn in (1.0, 5.0, 17.0, 40.0):
        stance = Case(
            {"cervical": np.array([[0.0, turn, 0.0]]), "atlantal": np.array([[3.0, turn, 2.0]])}, feet
        ).placed()
        assert stance.imbalance.max() < 1e-6


def test_a_foot_without_weight_does_not_move_the_body() -> None:
    """Wherever it is put, as long as the other leg decides how high the hips are."""
    zeros = {"pelvis": np.zeros((3, 3))}
    said = {"stands": 1.0, "weight": [[100.0, 0.0]], "bend": [[40.0, 0.0]]}
    stance = Case(zeros, feet_of(3, **said, ahead=[[0.0, 0.0], [0.0, 10.0], [0.0, -10.0]])).placed()
    legs = np.ptp(HUMAN.centre_of_mass(stance.rotations, stance.root)[:, [0, 2]], axis=0)
    assert legs.max() < 1e-6


def test_standing_straight_is_the_rest_pose_on_the_floor() -> None:
    """With the weight over the ankles, hips over them, knees straight."""
    stance = Case({"pelvis": np.zeros((1, 3))}, feet_of(1, stands=1.0, weight=50.0)).placed()
    joints, _ = points(stance)
    height = joints["left_hip"][0, 1] - joints["left_ankle"][0, 1]
    assert height == pytest.approx(THIGH + SHANK, abs=0.01)
    assert np.degrees(bend_of(joints, "left")[0]) == pytest.approx(0.0, abs=0.01)


# --- the same, computed otherwise -------------------------------------------------------------------------------------
#
# By geometry and scipy's general solvers: the root's place is what maximises the height of the hips, under the
# conditions that no leg is longer than it may be and that the weight is over its place. Masses are read from the file.


class Oracle:
    """One posture, as of row 0 of a case. Rotations are matrices."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self.local = Rotation.from_quat(case.rotations[0]).as_matrix()
        turned: list[Floats] = []
        for joint, parent in enumerate(BONES.parents):
            turned.append(self.local[joint] if parent < 0 else turned[parent] @ self.local[joint])
        places = np.zeros((len(BONES), 3))  # from the root
        for joint, parent in enumerate(BONES.parents[1:], start=1):
            places[joint] = places[parent] + turned[parent] @ BONES.offsets[joint]
        self.hips = [places[BONES.index(f"{side}_hip")] for side in SIDES]
        self.thighs = [turned[BONES.index(f"{side}_hip")] for side in SIDES]
        self.rest, self.mass = np.zeros(3), 0.0  # what is not a leg: its moment about the root
        for index, name in enumerate(BONES.names):
            if name.partition("_")[2] not in ("hip", "knee", "ankle", "toes"):
                mass, centre = self._part(name)
                self.rest += mass * (places[index] + turned[index] @ centre)
                self.mass += mass

    def _part(self, name: str) -> tuple[float, Floats]:
        side, _, stem = name.partition("_")
        joint = TOML["joints"][stem if side in SIDES else name]
        centre = np.array(joint.get("centre", [0.0, 0.0, 0.0])) * [-1.0 if side == "right" else 1.0, 1.0, 1.0]
        return joint.get("mass", 0.0), centre

    def centre_of_mass(self, root: Floats) -> Floats:
        moment, mass = self.rest + self.mass * root, self.mass
        for side in (0, 1):
            for weight, centre in self.leg(side, root + self.hips[side]):
                moment, mass = moment + weight * centre, mass + weight
        return np.asarray(moment / mass)

    def ankle(self, side: int) -> tuple[Floats, Floats]:
        """Where the ankle of a foot that stands is, and how the foot is turned."""
        feet = self.case.feet
        foot = Rotation.from_euler("YX", [SIGN[side] * feet.turn[0, side], feet.heel[0, side]]).as_matrix()
        ball = np.array([SIGN[side] * (APART + feet.out[0, side]), 0.0, feet.ahead[0, side]])
        return ball - foot @ TOES, foot

    def leg(self, side: int, hip: Floats) -> list[tuple[float, Floats]]:
        """Weights of a leg's parts and where they are."""
        feet = self.case.feet
        parts = [self._part(f"{SIDES[side]}_{joint}") for joint in ("hip", "knee", "ankle")]
        if feet.stands[0, side]:
            ankle, foot = self.ankle(side)
            knee = _where_spheres_meet(hip, ankle, direction(feet.knee[:1, side], side)[0])
            thigh, shank = (knee - hip) / THIGH, (ankle - knee) / SHANK
            centres = [hip - parts[0][1][1] * thigh, knee - parts[1][1][1] * shank, ankle + foot @ parts[2][1]]
        else:
            places, frames = self._hanging(side, hip, self._raised(side, hip))
            centres = [at + frame @ part[1] for at, frame, part in zip(places, frames, parts, strict=False)]
        return [(part[0], centre) for part, centre in zip(parts, centres, strict=True)]

    def _hanging(self, side: int, hip: Floats, thigh: Floats) -> tuple[list[Floats], list[Floats]]:
        """Hip, knee, ankle, ball and tip of a leg whose angles are given."""
        places, frames = [hip], [thigh]
        for joint in ("knee", "ankle", "toes"):
            index = BONES.index(f"{SIDES[side]}_{joint}")
            places.append(places[-1] + frames[-1] @ BONES.offsets[index])
            frames.append(frames[-1] @ self.local[index])
        return [*places, places[-1] + frames[-1] @ BONES.tips[index]], frames

    def _raised(self, side: int, hip: Floats) -> Floats:
        """The thigh of a leg in the air, or of one that is raised until it touches."""
        if not self.case.feet.touches[0, side]:
            return self.thighs[side]
        outward = np.radians(self.case.angles[f"{SIDES[side]}_hip"][0, 1])
        axis = np.cross([0.0, -1.0, 0.0], direction(self.case.feet.towards[:1, side], side)[0])
        twist = Rotation.from_euler("Y", SIGN[side] * outward).as_matrix()

        def thigh(angle: float) -> Floats:
            return np.asarray(Rotation.from_rotvec(angle * axis).as_matrix() @ twist)

        def height(angle: float) -> float:
            places, frames = self._hanging(side, hip, thigh(angle))
            return float(min(places[3][1], places[4][1], (places[2] + frames[2] @ HEEL)[1]))

        angles = np.linspace(0.0, np.radians(120.0), 25)
        above = next(angle for angle in angles if height(angle) > 0.0)
        return thigh(brentq(height, above - angles[1], above, xtol=1e-10) if above > 0.0 else 0.0)

    def root(self) -> Floats:
        """Where the root is: as high as can be."""
        feet = self.case.feet
        wanted = (support(feet) + feet.lean)[0]
        stands = np.flatnonzero(feet.stands[0])
        least = feet.bend[0]
        reach = np.sqrt(THIGH**2 + SHANK**2 + 2.0 * THIGH * SHANK * np.cos(least))

        def spare(x: Floats) -> Floats:
            return np.array([reach[i] - np.linalg.norm(x + self.hips[i] - self.ankle(i)[0]) for i in stands])

        def off(x: Floats) -> Floats:
            return np.asarray(self.centre_of_mass(x)[[0, 2]] - wanted)

        # From lower down, and the body over its place already but for the legs.
        start = np.array([wanted[0], 0.7, wanted[1]])
        found = minimize(
            lambda x: -x[1],
            start,
            method="SLSQP",
            constraints=[{"type": "ineq", "fun": spare}, {"type": "eq", "fun": off}],
            options={"ftol": 1e-12, "maxiter": 200},
        )
        assert spare(found.x).min() > -1e-6
        assert np.abs(off(found.x)).max() < 1e-6
        return np.asarray(found.x)


def _where_spheres_meet(hip: Floats, ankle: Floats, forward: Floats) -> Floats:
    """Where the knee is: as far from both as it is, on the side of `forward`."""
    line = ankle - hip
    far = np.linalg.norm(line)
    along = (far**2 + THIGH**2 - SHANK**2) / (2.0 * far)
    off = np.sqrt(max(THIGH**2 - along**2, 0.0))
    aside = forward - (forward @ line) * line / far**2
    return np.asarray(hip + along * line / far + off * aside / np.linalg.norm(aside))


def _bent(case: Case) -> Case:
    """With knees that bend by 8 degrees at least: near a straight leg nothing is smooth, and solvers stumble."""
    return replace(case, feet=replace(case.feet, bend=np.maximum(case.feet.bend, np.radians(8.0))))


def test_the_body_is_where_a_general_solver_puts_it(many: Case) -> None:
    reached = np.flatnonzero((_bent(many).placed().shortfall == 0.0).all(axis=1))
    for row in reached[::16]:
        case = _bent(many.pick([row]))
        stance = case.placed()
        oracle = Oracle(case)
        centre = HUMAN.centre_of_mass(stance.rotations, stance.root)[0]
        np.testing.assert_allclose(oracle.centre_of_mass(stance.root[0]), centre, atol=1e-6)
        np.testing.assert_allclose(oracle.root(), stance.root[0], atol=2e-4)


@dataclass(frozen=True)
class _Named:
    """A stance that a person can picture, and what must be true of it."""

    feet: dict[str, Any]
    pelvis: tuple[float, float, float] = (0.0, 0.0, 0.0)


NAMED = {
    "first": _Named({"stands": 1.0, "weight": 50.0, "out": 7.0, "ahead": 4.0, "turn": 60.0}),
    "fifth": _Named({"stands": 1.0, "weight": 50.0, "out": 1.0, "ahead": [[12.0, 0.0]], "turn": 60.0}),
    "grand plie": _Named({"stands": 1.0, "weight": 50.0, "out": 20.0, "turn": 55.0, "bend": 95.0}),
    "releve": _Named({"stands": 1.0, "weight": 50.0, "turn": 30.0, "heel": 48.0}),
    "on one leg": _Named({"stands": [[1.0, 0.0]], "weight": 50.0, "turn": 60.0}),
    "lunge": _Named(
        {
            "stands": 1.0,
            "weight": [[80.0, 20.0]],
            "ahead": [[45.0, -30.0]],
            "heel": [[0.0, 40.0]],
            "bend": [[50.0, 0.0]],
        }
    ),
    "bow": _Named({"stands": 1.0, "weight": 50.0}, pelvis=(60.0, 0.0, 0.0)),
    "tendu": _Named({"stands": [[0.0, 1.0]], "touches": [[1.0, 0.0]], "weight": 50.0, "turn": 60.0, "towards": 0.0}),
}


@pytest.mark.parametrize("name", NAMED)
def test_a_stance_with_a_name_is_what_a_general_solver_finds(name: str) -> None:
    named = NAMED[name]
    angles = {joint: np.zeros((1, 3)) for joint in BONES.names}
    angles["pelvis"][0] = named.pelvis
    case = _bent(Case(angles, feet_of(1, **named.feet)))
    stance = case.placed()
    np.testing.assert_array_equal(stance.shortfall, 0.0)
    for check in CHECKS.values():
        check(case, stance)
    np.testing.assert_allclose(Oracle(case).root(), stance.root[0], atol=2e-4)


def test_the_body_of_the_tests_is_the_body() -> None:
    assert isinstance(HUMAN, Anatomy)
    assert HUMAN.skeleton == BONES
