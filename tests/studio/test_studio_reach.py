"""Laws of inverse kinematics, on people and on an insect."""

from __future__ import annotations

import numpy as np
import pytest

from motionmind import Engine
from motionmind._typing import Floats
from motionmind.body.anatomy_file import anatomy_of
from motionmind.body.contact import contact_points
from motionmind.body.joint_angles import JointAngles
from motionmind.body.motion import Posture
from motionmind.geometry import rotations as rot
from motionmind.names.finding import open_collection
from motionmind.names.spelling import Source
from motionmind.studio.reach import drag, position_of, put_on_floor, standing_feet, standing_soles

MILLIMETRE = 1e-3
DRAGS = [("left_wrist", 0.12), ("right_elbow", 0.1), ("atlantal", 0.06), ("right_ankle", 0.1), ("pelvis", 0.08)]


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return Engine.load("ballet")


def _posture(engine: Engine, number: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[number], corpus.root[number])


def _place(posture: Posture, joint: str) -> Floats:
    places = posture.skeleton.positions(posture.rotations, posture.root)
    return np.asarray(places[posture.skeleton.index(joint)])


def _drags(engine: Engine, each: int = 6) -> list[tuple[Posture, str, Floats]]:
    """Postures, joints, and places that these reach by a turn of a few degrees, or lower for trunk and head."""
    rng, out = np.random.default_rng(5), []
    for joint, far in DRAGS:
        for number in rng.integers(len(engine.corpus), size=each):
            posture = _posture(engine, int(number))
            way = rng.normal(size=3)
            way *= far * rng.random() / np.linalg.norm(way)
            if joint in ("pelvis", "atlantal"):
                way[1] = -abs(way[1])
            place = _place(posture, joint) + way
            if joint == "right_ankle":
                place[1] = max(place[1], 0.25)
            out.append((posture, joint, place))
    return out


def test_a_joint_comes_to_where_it_is_dragged_and_bones_keep_their_lengths(ballet: Engine) -> None:
    reached = 0
    for posture, joint, place in _drags(ballet):
        found = drag(posture, joint, place)
        reached += np.linalg.norm(_place(found, joint) - place) < MILLIMETRE
        assert found.skeleton is posture.skeleton
        np.testing.assert_allclose(np.linalg.norm(found.rotations, axis=-1), 1.0, atol=1e-9)
    assert reached >= 0.9 * len(_drags(ballet))  # some ankles cannot get as high without the pelvis


def test_feet_that_stand_stay_and_nothing_sinks(ballet: Engine) -> None:
    for posture, joint, place in _drags(ballet):
        soles = standing_soles(posture)
        found = drag(posture, joint, place)
        was, joints = contact_points(posture.skeleton, posture.rotations, posture.root)
        now, _ = contact_points(found.skeleton, found.rotations, found.root)
        own = [posture.skeleton.index(f"right_{name}") for name in ("ankle", "toes")] if "ankle" in joint else []
        kept = [sole for sole in soles if joints[sole] not in own]
        assert np.abs(now[kept] - was[kept]).max(initial=0.0) < MILLIMETRE
        assert now[:, 1].min() > min(0.0, was[:, 1].min()) - MILLIMETRE


def test_joints_stay_within_the_limits_of_anatomy_or_of_the_posture_itself(ballet: Engine) -> None:
    anatomy = anatomy_of(ballet.corpus.skeleton)
    assert anatomy is not None
    for posture, joint, _ in _drags(ballet):
        for way in ([3.0, 1.0, 0.0], [0.0, -3.0, 2.0]):
            found = drag(posture, joint, _place(posture, joint) + way)
            was, now = anatomy.degrees(posture.rotations), anatomy.degrees(found.rotations)
            least, most = anatomy.limits
            assert (now[1:] >= np.minimum(least, was)[1:] - 1e-6).all()
            assert (now[1:] <= np.maximum(most, was)[1:] + 1e-6).all()
            named = np.isfinite(least)
            assert np.abs((now - was)[~named]).max() < 1e-6  # what is no angle of a joint does not change


def test_there_and_back_is_where_it_began(ballet: Engine) -> None:
    for posture, joint, place in _drags(ballet):
        there = drag(posture, joint, place)
        back = drag(there, joint, _place(posture, joint), start=posture)
        was = posture.skeleton.positions(posture.rotations, posture.root)
        now = back.skeleton.positions(back.rotations, back.root)
        assert np.linalg.norm(now - was, axis=-1).max() < 10 * MILLIMETRE


def test_what_is_out_of_reach_is_approached(ballet: Engine) -> None:
    posture = _posture(ballet, 0)
    shoulder, wrist = _place(posture, "left_shoulder"), _place(posture, "left_wrist")
    far = shoulder + np.array([4.0, 0.5, 1.0])
    found = posture
    for _ in range(4):  # as while the hand is held there
        found = drag(found, "left_wrist", far, start=posture)
    assert np.linalg.norm(_place(found, "left_wrist") - far) < np.linalg.norm(wrist - far) - 0.2
    # The arm is stretched towards it.
    arm = _place(found, "left_wrist") - _place(found, "left_shoulder")
    assert np.linalg.norm(arm) > 0.98 * (0.316 + 0.248)
    # No place that the hand can be dragged to is nearer.
    best = np.linalg.norm(_place(found, "left_wrist") - far)
    for way in np.eye(3):
        for sign in (-0.05, 0.05):
            other = drag(found, "left_wrist", _place(found, "left_wrist") + sign * way, start=posture)
            assert np.linalg.norm(_place(other, "left_wrist") - far) > best - 5 * MILLIMETRE


def test_the_same_drag_leads_to_the_same_posture(ballet: Engine) -> None:
    posture, joint, place = _drags(ballet, 1)[0]
    first, second = (drag(posture, joint, place) for _ in range(2))
    assert first.rotations.tobytes() == second.rotations.tobytes()


def test_a_foot_near_the_floor_is_put_down_flat(ballet: Engine) -> None:
    posture = put_on_floor(_posture(ballet, 0))
    place = _place(posture, "left_ankle") + np.array([0.1, 0.01, 0.05])
    found = drag(posture, "left_ankle", place)
    assert "left_toes" in standing_feet(found)
    points, joints = contact_points(found.skeleton, found.rotations, found.root)
    skeleton = found.skeleton
    toes = points[joints == skeleton.index("left_toes")]
    np.testing.assert_allclose(toes[:, 1], 0.0, atol=MILLIMETRE)
    np.testing.assert_allclose(_place(found, "left_ankle")[[0, 2]], place[[0, 2]], atol=MILLIMETRE)


def test_what_is_put_on_the_floor_touches_it(ballet: Engine) -> None:
    for number in (0, 300, 900, 1500):
        posture = _posture(ballet, number)
        lifted = Posture(posture.skeleton, posture.rotations, posture.root + np.array([0.0, 0.4, 0.0]))
        found = put_on_floor(lifted)
        lowest = contact_points(found.skeleton, found.rotations, found.root)[0][:, 1].min()
        assert abs(lowest) < MILLIMETRE


def test_angles_and_rotations_are_inverses(ballet: Engine) -> None:
    posture = _posture(ballet, 700)
    angles = JointAngles(posture.skeleton, posture.rotations[None])
    values = angles.of(posture.rotations)
    turned, axes = angles.turns(values)
    np.testing.assert_allclose(turned, posture.skeleton.global_rotations(posture.rotations), atol=1e-9)
    step, joint, axis = 1e-4, posture.skeleton.index("left_hip"), 1
    values[joint, axis] += step
    after = posture.skeleton.global_rotations(angles.rotations(values))
    # An axis says how a small change of its angle turns the joint.
    way = rot.log(rot.mul_inv(after[joint], turned[joint])) / step
    np.testing.assert_allclose(way, axes[joint, axis], atol=1e-3)


def test_an_insect_reaches_too() -> None:
    engine = Engine.load("walk-hexapod")
    posture = _posture(engine, 3)
    skeleton = posture.skeleton
    leaf = next(name for i, name in enumerate(skeleton.names) if i and not skeleton.children(i))
    place = _place(posture, leaf) + 0.02 * skeleton.height * np.array([0.0, 1.0, 0.0])
    found = drag(posture, leaf, place, standing=[name for name in standing_feet(posture) if name != leaf])
    assert np.linalg.norm(_place(found, leaf) - place) < MILLIMETRE


def _standing(engine: Engine, name: str) -> Posture:
    """A posture of the ballet's that stands, by name."""
    return open_collection(Source("ballet", "corpus", engine.corpus.name), None).posture(name)


@pytest.mark.parametrize("name", ["first", "fifth", "arabesque"])
def test_a_heel_that_is_dragged_up_raises_the_body_over_the_balls_that_stay(ballet: Engine, name: str) -> None:
    posture = _standing(ballet, name)
    feet, skeleton = standing_feet(posture), posture.skeleton
    heels = [foot.replace("toes", "heel") for foot in feet]
    up = position_of(posture, heels[0]) + np.array([0.0, 0.09, 0.0])
    risen = drag(posture, heels[0], up)
    for foot, heel in zip(feet, heels, strict=True):  # both, where both stand
        assert abs(position_of(risen, heel)[1] - up[1]) < MILLIMETRE
        assert np.linalg.norm(_place(risen, foot) - _place(posture, foot)) < MILLIMETRE
    assert _place(risen, "atlantal")[1] - _place(posture, "atlantal")[1] > 0.05
    knees = [skeleton.index(foot.replace("toes", "knee")) for foot in feet]
    assert np.degrees(rot.angle(risen.rotations[knees], posture.rotations[knees])).max() < 15.0
    assert standing_feet(risen) == feet
    back = drag(risen, heels[0], up - np.array([0.0, 0.09, 0.0]))
    assert max(abs(position_of(back, heel)[1] - position_of(posture, heel)[1]) for heel in heels) < MILLIMETRE


def test_a_heel_rises_alone_where_the_other_foot_may_leave(ballet: Engine) -> None:
    posture = _standing(ballet, "first")
    up = position_of(posture, "left_heel") + np.array([0.0, 0.09, 0.0])
    alone = drag(posture, "left_heel", up, standing=["left_toes"])
    assert abs(position_of(alone, "left_heel")[1] - up[1]) < MILLIMETRE
    assert position_of(alone, "right_heel")[1] < up[1] - MILLIMETRE  # it hangs where the body takes it


def test_the_heel_of_a_foot_in_the_air_goes_where_it_is_dragged(ballet: Engine) -> None:
    posture = _standing(ballet, "arabesque")
    heel = next(f"{side}_heel" for side in ("left", "right") if f"{side}_toes" not in standing_feet(posture))
    place = position_of(posture, heel) + np.array([0.05, -0.05, 0.05])
    assert np.linalg.norm(position_of(drag(posture, heel, place), heel) - place) < MILLIMETRE
