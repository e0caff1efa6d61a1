"""From a path of states to movement: durations, the root, walks, detail, and the whole."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from motionmind._typing import Floats, Int32s
from motionmind.body.contact import lowest_height, pose
from motionmind.body.human import human23
from motionmind.body.limbs import parts_of
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Corpus, Facing
from motionmind.corpus.gather import gather
from motionmind.footing.feet import find_free_feet
from motionmind.footing.root import LEAST_TRAVEL_SHARE, root_trajectory, stand, steps_easily
from motionmind.footing.shape import lowest, points_of_feet
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline
from motionmind.grammar.transitions import Transitions, count_transitions
from motionmind.learned.posture_statistics import FIRMNESS_HALVED_MPS, PostureStatistics, learn_posture_statistics
from motionmind.synthesis.bending import FIRM_PULL_RATIO
from motionmind.synthesis.retime import SPEED_HEADROOM_RATIO, keep_pace
from motionmind.synthesis.synthesise import synthesise
from motionmind.synthesis.timeline import durations
from motionmind.synthesis.wishes import Style, Wishes
from motionmind.walks.expectation import Expectation
from motionmind.walks.likelihood import P_CONTINUE, P_TELEPORT, squared_distances
from motionmind.walks.marginals import posterior_marginals
from motionmind.walks.means import mean_rotations

# --- durations and the root -------------------------------------------------------------------------------------------


def graph(states: Int32s, seconds: list[float]) -> Transitions:
    """The transitions of one clip whose postures are in `states` [N, L]."""
    return count_transitions(
        states.astype(np.int32), states.max(axis=0) + 1, np.arange(len(states) - 1), np.array(seconds)
    )


def test_moves_take_the_time_that_moving_chains_took() -> None:
    clip = np.array([[0, 0, 0], [1, 0, 0], [2, 1, 0], [2, 1, 0], [0, 0, 0]])
    transitions = graph(clip, [0.1, 0.2, 5.0, 0.4])
    path = np.array([[0, 0, 0], [1, 0, 0], [2, 1, 0], [2, 1, 0], [1, 1, 0]], dtype=np.int32)
    usual = np.median(transitions.seconds)
    # A hold is timed by holds only where nothing moves; a bridge has no time of its own.
    np.testing.assert_allclose(durations(path, transitions), [0.1, 0.2, np.median([5.0, 5.0, 5.7 / 4.0]), usual])


def test_bodies_stand_as_high_as_they_are_told() -> None:
    rng = np.random.default_rng(0)
    q, root = rot.normalise(rng.normal(size=(20, 23, 4))), rng.normal(size=(20, 3))
    heights = rng.uniform(0.0, 0.5, 20)
    placed = stand(human23(), q, root, heights)
    np.testing.assert_allclose(lowest_height(human23(), q, placed), heights, atol=1e-12)
    np.testing.assert_array_equal(placed[:, [0, 2]], root[:, [0, 2]])


def test_a_foot_that_stands_carries_the_body() -> None:
    """A body that sways over its feet: from the postures alone the root's trajectory is found again."""
    stander, rest = human23(), np.tile(rot.IDENTITY, (30, 23, 1))
    sway = rot.from_axis_angle([1.0, 0.0, 0.0], 0.2 * np.sin(np.arange(30) / 5.0))
    rest[:, [stander.index("left_hip"), stander.index("right_hip")]] = sway[:, None]
    rest[:, [stander.index("left_ankle"), stander.index("right_ankle")]] = rot.inv(sway)[:, None]
    feet = [stander.index("left_toes"), stander.index("right_toes")]
    seen = stander.positions(rest, np.zeros((30, 3)))[:, feet].mean(axis=1)
    root = root_trajectory(
        stander,
        pose(stander, rest),
        np.zeros(30),
        np.ones((29, 6)),
        np.zeros((29, 3)),
        (-seen[0], -seen[-1]),
        1.0,
        np.ones(29),
    )
    np.testing.assert_allclose(root[:, [0, 2]], -seen[:, [0, 2]], atol=0.01)
    assert np.ptp(seen[:, 2]) > 0.1


def test_limbs_stand_the_less_the_faster_their_lowest_points_move() -> None:
    """A body that is drawn along, one leg swinging so that its foot stays: only that foot stands."""
    drawn, t = human23(), np.arange(9) * 0.2
    q = np.tile(rot.IDENTITY, (9, 23, 1))
    root = np.stack([0.0 * t, 0.9 + 0.0 * t, 0.6 * t], axis=1)
    stands = learn_posture_statistics(gather("drawn", [Motion(drawn, q, root, t, "drawn")])).stands
    np.testing.assert_allclose(stands, 1.0 / (1.0 + (0.6 / FIRMNESS_HALVED_MPS) ** 2), atol=1e-9)
    hip, toes = drawn.index("left_hip"), drawn.index("left_toes")
    offset = drawn.positions(q[0], np.zeros(3))[toes]
    # Turned about x until the tip of its toes, the lowest point of the leg, is where it was.
    reach = offset + drawn.tips[toes] - drawn.offsets[hip]
    angle = np.arcsin((reach[2] - root[:, 2] + root[4, 2]) / np.hypot(*reach[1:])) - np.arctan2(reach[2], -reach[1])
    q[:, hip] = rot.from_axis_angle([1.0, 0.0, 0.0], -angle)
    stands = learn_posture_statistics(gather("drawn", [Motion(drawn, q, root, t, "drawn")])).stands
    assert stands[9 + 2 : 9 + 6, 0].min() > 0.95
    np.testing.assert_allclose(stands[:, 1:], 1.0 / (1.0 + (0.6 / FIRMNESS_HALVED_MPS) ** 2), atol=1e-9)
    np.testing.assert_allclose(stands[1:8], 0.5 * (stands[9:16] + stands[10:17]), atol=1e-12)


def test_in_the_air_a_body_travels_as_the_corpus_does_and_ends_where_it_is_to() -> None:
    motion, drift = walk(12), np.random.default_rng(0).normal(size=(11, 3))
    a, b = np.zeros(3), np.array([1.0, 0.0, -2.0])
    flown = root_trajectory(
        human23(),
        pose(human23(), motion.rotations),
        np.full(12, 3.0),
        np.ones((11, 6)),
        drift,
        (a, b),
        1.0,
        np.ones(11),
    )
    missing = b - drift.sum(axis=0)
    added = np.diff(flown, axis=0) - drift
    share = added @ missing / (missing @ missing)
    np.testing.assert_allclose(added, share[:, None] * missing, atol=1e-9)
    # Evenly, but that it starts and stops.
    np.testing.assert_allclose(share, share[::-1], atol=1e-12)
    np.testing.assert_allclose(share[4:-4], share[5], rtol=0.1)
    assert share[0] < 0.5 * share[5]
    np.testing.assert_allclose(flown[[0, -1]], [a, b], atol=1e-12)


def test_a_little_way_that_is_missing_is_made_up_in_the_air_rather_than_on_the_floor() -> None:
    still, clearance = np.tile(rot.IDENTITY, (21, 23, 1)), np.where(np.arange(21) > 10, 1.0, 0.0)
    flown = root_trajectory(
        human23(),
        pose(human23(), still),
        clearance,
        np.ones((20, 6)),
        np.zeros((20, 3)),
        (np.zeros(3), np.array([0.01, 0.0, 0.0])),
        1.0,
        np.ones(20),
    )
    steps = np.diff(flown[:, 0])
    assert steps[:10].max() < 0.3 * steps[11:].min()


def test_a_far_way_is_gone_where_both_feet_are_low() -> None:
    """A leg that is raised for a while is no time to travel: on one leg the body would hop."""
    dancer = human23()
    raised = np.tile(rot.IDENTITY, (91, 23, 1))
    raised[30:60, dancer.index("left_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], np.array(-1.4))
    still = np.zeros((91, 3))
    posed = pose(dancer, raised)
    feet = find_free_feet(dancer, np.zeros(23, dtype=bool))
    heights = lowest(posed.places, points_of_feet(dancer, posed.joints, feet))
    easily = steps_easily(heights, 30.0)
    assert easily.shape == (90,)
    np.testing.assert_allclose(easily[[0, 15, 75, 89]], 1.0)
    np.testing.assert_allclose(easily[35:55], LEAST_TRAVEL_SHARE)
    np.testing.assert_allclose(steps_easily(heights[:, ::-1] + 1.0, 30.0), easily)
    np.testing.assert_array_equal(steps_easily(heights[:, :1], 30.0), np.ones(90))
    far = np.array([0.0, 0.0, 6.0])
    root = root_trajectory(dancer, posed, still[:, 0], np.zeros((90, 6)), still[1:], (still[0], far), 3.0, easily)
    steps = np.diff(root[:, 2])
    assert steps[36:54].max() < 0.4 * steps[[20, 70]].min()
    np.testing.assert_allclose(root[-1], far, atol=1e-12)


def test_each_half_step_is_slowed_as_much_as_its_fastest_joint_needs() -> None:
    corpus = gather("walks", [walk(5)], facing="stage")
    times, poses = np.linspace(0.0, 2.0, 21), np.tile(rot.IDENTITY, (21, 23, 1))
    elbow = human23().index("left_elbow")
    poses[9:12, elbow] = rot.from_axis_angle([1.0, 0.0, 0.0], np.array([0.4, 1.0, 0.5]))
    still = Expectation(times, poses, np.zeros(21), np.zeros((21, 1)), np.zeros((20, 1)), np.ones((20, 23)))
    frames, fastest = np.linspace(0.0, 2.0, 121), np.full(25, 3.0)
    slower = keep_pace(still, frames, corpus, fastest, np.zeros((20, 3)), (False, False))
    turned = still.chains(corpus, frames)[:, elbow]
    speeds = rot.angle(turned[:-1], turned[1:]) * 60.0
    assert speeds.max() > 6.0
    needed = speeds.reshape(20, 6).max(axis=1) / (SPEED_HEADROOM_RATIO * 3.0)
    assert np.all(slower >= np.maximum(needed, 1.0) - 1e-9)
    np.testing.assert_array_equal(slower[[0, 1, 2, -3, -2, -1]], 1.0)


# --- walks -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
def test_posterior_marginals_are_sums_over_all_walks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count, steps = 4, 3
    begins, ends = np.array([0, 1, 2, 2]), np.array([1, 2, 3, 0])
    shares = np.array([1.0, 1.0, 0.3, 0.7])
    clusters = np.array([0, 1, 0, 1], dtype=np.int32)
    near, weights = rng.uniform(0.1, 1.0, (steps + 1, count)), rng.uniform(0.01, 2.0, count)
    go = np.zeros((count, count))
    go[begins, ends] = shares
    alike = weights * (clusters[:, None] == clusters)
    alike /= alike.sum(axis=1, keepdims=True)
    anywhere = np.tile(weights / weights.sum(), (count, 1))
    move = go @ (P_CONTINUE * np.eye(count) + (1.0 - P_CONTINUE - P_TELEPORT) * alike + P_TELEPORT * anywhere)
    expected = np.zeros((steps + 1, count))
    for walked in product(range(count), repeat=steps + 1):
        weight = weights[walked[0]] * np.prod(near[np.arange(steps + 1), walked])
        weight *= np.prod([move[p] for p in pairwise(walked)])
        expected[np.arange(steps + 1), walked] += weight
    expected /= expected.sum(axis=1, keepdims=True)
    for array in (begins, ends, shares, weights):
        array.setflags(write=False)  # as a corpus's: for others it would be compiled once more
    np.testing.assert_allclose(posterior_marginals(begins, ends, shares, clusters, weights, near), expected, atol=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("signs", list(product((1.0, -1.0), repeat=3)))
def test_the_mean_of_rotations_about_one_axis_whatever_their_signs(signs: tuple[float, float, float]) -> None:
    q = rot.about_vertical(np.radians([10.0, 30.0]))[:, None] * np.reshape(signs[:2], (2, 1, 1))
    about = np.tile(signs[2] * rot.IDENTITY, (2, 1, 1))
    mean = mean_rotations(np.array([[0.5, 0.5], [1.0, 0.0]]), q, np.array([0]), about)
    np.testing.assert_allclose(rot.heading(mean[:, 0]), np.radians([20.0, 10.0]), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(mean, axis=-1), 1.0, atol=1e-12)
    assert np.all(np.sum(mean * about, axis=-1) > 0.0)  # in its hemisphere
    none = mean_rotations(np.zeros((2, 2)), q, np.array([0]), about)
    np.testing.assert_array_equal(none, about)


def test_the_mean_of_rotations_takes_each_in_the_hemisphere_of_what_it_is_about() -> None:
    rng = np.random.default_rng(3)
    q, weights = rot.normalise(rng.normal(size=(23, 2, 4))), rng.uniform(size=(6, 23))  # no multiple of four samples
    weights[weights < 0.2] = 1e-7  # too little to count
    for spread in (0.01, 0.5, 5.0):  # the wider, the more rotations have one sign here and the other there
        about = rot.normalise(np.array([0.1, 0.2, 0.3, 0.9]) + spread * rng.normal(size=(6, 2, 4)))
        cosines = np.einsum("tjc,ijc->tij", about, q)
        counted = np.where(weights < 1e-6, 0.0, weights)[..., None] * np.sign(cosines)
        expected = rot.normalise(np.einsum("tij,ijc->tjc", counted, q))
        np.testing.assert_allclose(mean_rotations(weights, q, np.arange(2), about), expected, atol=1e-12)


@pytest.mark.long
def test_parts_are_as_far_from_postures_as_their_joints_are_in_the_mean() -> None:
    rng = np.random.default_rng(5)
    shown, postures = rot.normalise(rng.normal(size=(7, 4, 4))), rot.normalise(rng.normal(size=(2, 3, 4)))
    shown = shown[:, :3]  # of a joint more, as in the corpus: for arrays without gaps it would be compiled once more
    far = squared_distances(shown, np.array([[0, 1], [0, 1], [0, 2]]), 3, postures)
    turns = 4.0 * np.sin(0.5 * rot.angle(shown, postures[:, None])) ** 2
    expected = [turns.mean(axis=-1), turns[..., :2].mean(axis=-1), turns[..., 2]]
    np.testing.assert_allclose(far, expected, atol=1e-12)


# --- detail -----------------------------------------------------------------------------------------------------------


def recorded(seconds: float = 8.0, seed: int = 3) -> Motion:
    """A body at 30 frames a second that also trembles, faster than 5 postures a second tell."""
    slow = walk(int(seconds * 5.0) + 1, seed=seed)
    times = np.arange(int(seconds * 30.0) + 1) / 30.0
    tremble = (
        0.05 * np.sin(2.0 * np.pi * 6.0 * times)[:, None] * np.random.default_rng(seed).normal(size=(23, 3))[:, None]
    )
    rotations = rot.mul(rotation_spline(slow.times, slow.rotations, times), rot.exp(np.swapaxes(tremble, 0, 1)))
    return Motion(slow.skeleton, rotations, natural_spline(slow.times, slow.root, times), times, "trembling")


# --- the whole --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Learned:
    """As much of an engine's grammar as the synthesis reads; the only state of each chain is what a posture shows."""

    corpus: Corpus
    states: Int32s
    transitions: Transitions
    centres: Floats
    statistics: PostureStatistics


def walk(frames: int = 40, sink: float = 0.0, seed: int = 0) -> Motion:
    """A body that walks in a curve, each joint on a course of its own, its lowest point on the floor."""
    rng = np.random.default_rng(seed)
    body, t = human23(), np.arange(frames) * 0.2
    phase, size = rng.uniform(0.0, 6.0, (23, 3)), rng.uniform(0.0, 0.35, (23, 3))
    q = rot.exp(size * np.sin(1.3 * t[:, None, None] + phase))
    q[:, 0] = rot.mul(rot.about_vertical(0.3 * t), q[:, 0])
    root = np.stack([np.sin(t), 0.0 * t, np.cos(t)], axis=1)
    return Motion(body, q, stand(body, q, root, np.full(frames, -sink)), t, "walk")


def learned(motion: Motion, facing: Facing = "free", rate: float | None = None) -> Learned:
    corpus = gather("walks", [motion], facing=facing, rate=rate)
    states = np.repeat(np.arange(len(corpus), dtype=np.int32)[:, None], 23, axis=1)
    sizes = [len(corpus)] * 23
    ring = rot.about_vertical(np.arange(24) * np.pi / 12.0)
    centres = list(np.swapaxes(corpus.to_chains(corpus.rotations)[:, :23], 0, 1))
    if facing == "free":
        steps = np.round(rot.heading(corpus.rotations[:, 0]) / (np.pi / 12.0)).astype(np.int32) % 24
        states, sizes, centres = np.concatenate([states, steps[:, None]], axis=1), [*sizes, 24], [*centres, ring]
    pooled = 23 if facing == "free" else None
    transitions = count_transitions(states, np.array(sizes), corpus.begins, corpus.seconds, pooled=pooled)
    return Learned(corpus, states, transitions, np.concatenate(centres), learn_posture_statistics(corpus))


def synthesised(
    known: Learned,
    rows: list[int],
    a: Posture,
    b: Posture,
    fps: float = 30.0,
    within: float = np.pi,
    **options: Any,
) -> Motion:
    """The motion along postures `rows` of the corpus, each chain `within` radians of its states."""
    path = known.states[rows]
    return realised_path(known, path, a, b, fps, within, **options)


def realised_path(
    known: Learned, path: Int32s, a: Posture, b: Posture, fps: float, within: float, **options: Any
) -> Motion:
    tolerances, none = np.full(path.shape[1], within), np.zeros(path.shape[1], dtype=np.bool_)
    peaks = options.pop("peaks", None)
    style = Style(known.corpus, known, known.statistics, tolerances, peaks=peaks)  # type: ignore[arg-type]
    return synthesise(path, style, Wishes(a, b, ~none, none, fps, **options)).motion


@pytest.fixture(scope="module", params=["free", "stage"])
def walking(request: pytest.FixtureRequest) -> Learned:
    return learned(walk(), request.param)


@pytest.mark.long
@pytest.mark.parametrize("fps", [30.0, 120.0, 24.0, 7.0])
@pytest.mark.parametrize("rows", [[3, 4], [3, 4, 5, 6, 7], [3, 4, 5, 5, 6, 20, 21]])
def test_the_ends_are_a_and_b_bit_by_bit_and_frames_are_even(walking: Learned, rows: list[int], fps: float) -> None:
    motion = walk()
    a, b = motion.posture(rows[0]), motion.posture(rows[-1])
    a = replace(a, rotations=-a.rotations, root=a.root + np.array([7.0, 0.0, 3.0]))
    found = synthesised(walking, rows, a, b, fps)
    np.testing.assert_array_equal(found.rotations[[0, -1]], [a.rotations, b.rotations])
    np.testing.assert_array_equal(found.root[[0, -1]], [a.root, b.root])
    np.testing.assert_allclose(np.diff(found.times), 1.0 / fps, rtol=1e-9)
    assert found.times[0] == 0.0
    (planned,) = found.insertions
    assert len(planned.times) == len(rows)
    assert (planned.times[0], planned.times[-1]) == (0.0, found.times[-1])
    assert abs(found.times[-1] - durations(walking.states[rows], walking.transitions).sum()) <= 0.5 / fps + 1e-9


@pytest.mark.long
def test_a_motion_is_within_what_is_asked_of_its_states_at_each_move(walking: Learned) -> None:
    """But for the legs, which feet that stand may bend; and the path is not followed closer than that."""
    motion, rows = walk(), [5, 6, 7, 20, 21, 30, 8, 9]
    carried = np.setdiff1d(np.arange(23), parts_of(human23())[1][1:])
    for within in np.radians([1.0, 5.0, 12.0]):
        # The moves of this path fall on frames.
        found = synthesised(walking, rows, motion.posture(5), motion.posture(9), 60.0, within)
        at = found.at(found.insertions[0].times)
        chains = [walking.corpus.to_chains(q)[:, carried] for q in (at.rotations, motion.rotations[rows])]
        off = rot.angle(*chains)
        assert off.max() < within + 1e-6
        assert off.max() > 0.99 * FIRM_PULL_RATIO * within


@pytest.mark.long
def test_given_postures_are_not_bent_to_their_states_nor_does_the_movement_leap_from_them(walking: Learned) -> None:
    """Ends and a posture on the way are all far from the states that the path has for them."""
    motion, rows, rng = walk(), [5, 6, 7, 8, 9, 10, 11], np.random.default_rng(0)
    off = 0.3 * rng.normal(size=(3, 23, 3))
    off[:, 0] = 0.0
    a, via, b = (
        replace(motion.posture(row), rotations=rot.mul(motion.rotations[row], rot.exp(by)))
        for row, by in zip((5, 8, 11), off, strict=True)
    )
    found = synthesised(walking, rows, a, b, 240.0, 0.02, through={3: via})
    passed = found.at(found.insertions[0].times[[3]])
    assert rot.angle(passed.rotations[0, 1:], via.rotations[1:]).max() < 0.005
    speed = rot.angle(found.rotations[1:], found.rotations[:-1])
    assert speed[[0, -1]].max() < 1.5 * speed[1:-1].max()


def test_what_the_corpus_does_is_done_again(walking: Learned) -> None:
    """The mean walk lies near the recorded movement between the same postures, much nearer than the straight line; but
    for the legs, whose feet slid as it was recorded."""
    motion = walk()
    rows = list(range(5, 17))
    found = synthesised(walking, rows, motion.posture(5), motion.posture(16), fps=5.0)
    share = np.linspace(0.0, 1.0, len(rows))[:, None]
    straight = rot.slerp(motion.rotations[5], motion.rotations[16], share)
    rest = np.setdiff1d(np.arange(23), parts_of(human23())[1][1:])
    off, straight_off = (
        rot.angle(*(walking.corpus.to_chains(x)[:, rest] for x in (q, motion.rotations[rows]))).mean()
        for q in (found.rotations, straight)
    )
    assert off < 0.5 * straight_off


def test_no_frame_is_below_the_floor_where_a_and_b_stand_on_it(walking: Learned) -> None:
    motion = walk()
    for rows in ([3, 4], [2, 3, 4, 5, 6, 7, 8], [0, 9, 30, 31, 32]):
        found = synthesised(walking, rows, motion.posture(rows[0]), motion.posture(rows[-1]))
        assert lowest_height(human23(), found.rotations, found.root).min() > -0.006


def test_a_body_that_stands_on_a_stage_stays_on_it(walking: Learned) -> None:
    """Both ends are 30 cm higher than the corpus knows bodies to be."""
    motion, rows, up = walk(), [2, 3, 4, 5, 6, 7, 8], np.array([0.0, 0.3, 0.0])
    a, b = (replace(motion.posture(row), root=motion.root[row] + up) for row in (2, 8))
    found = synthesised(walking, rows, a, b)
    np.testing.assert_allclose(lowest_height(human23(), found.rotations, found.root), 0.3, atol=0.03)


def test_a_body_whose_floor_is_below_zero_stays_on_it(walking: Learned) -> None:
    sunk = walk(sink=0.11)
    found = synthesised(walking, [2, 3, 4, 5, 6, 7], sunk.posture(2), sunk.posture(7))
    np.testing.assert_allclose(lowest_height(human23(), found.rotations, found.root), -0.11, atol=0.03)
    up = synthesised(walking, [2, 3, 4, 5, 6, 7], sunk.posture(2), walk().posture(7))
    heights = lowest_height(human23(), up.rotations, up.root)
    np.testing.assert_allclose(heights, np.linspace(-0.11, 0.0, len(heights)), atol=0.03)


@pytest.mark.long
def test_a_jump_of_the_corpus_is_jumped_and_its_floor_is_not_its_zero() -> None:
    jumping = walk(sink=0.4)
    root = jumping.root.copy()
    root[10:13, 1] += 0.25
    known = learned(replace(jumping, root=root))
    grounded, rows = walk(), list(range(5, 18))
    found = synthesised(known, rows, grounded.posture(5), grounded.posture(17), 30.0, 1e-6)
    heights = lowest_height(human23(), found.rotations, found.root)
    assert 0.8 < heights.argmax() / 30.0 < 1.6
    assert 0.12 < heights.max() < 0.35
    assert heights[[*range(6), *range(-6, 0)]].max() < 0.03
    # Nobody jumps higher on the way than dancers do in movement of that length.
    for rise, jumps in ((3.0, True), (0.8, False)):  # heights a second
        peaks = np.append(np.full(25, 50.0), [rise, 500.0])
        ends = grounded.posture(5), grounded.posture(17)
        found = synthesised(known, rows, *ends, 30.0, 1e-6, peaks=lambda *_, peaks=peaks: peaks)
        heights = lowest_height(human23(), found.rotations, found.root)
        assert (heights.max() > 0.12) == jumps


def test_no_frame_jumps(walking: Learned) -> None:
    motion = walk()
    rows = [3, 4, 5, 6, 7, 8, 9, 10]
    found = synthesised(walking, rows, motion.posture(3), motion.posture(10), fps=60.0)
    keys = motion.rotations[rows]
    fastest = rot.angle(keys[1:], keys[:-1]).max(axis=0) / 0.2
    speed = rot.angle(found.rotations[1:], found.rotations[:-1]).max(axis=0) * 60.0
    # The corpus's feet slide; these step, and their legs are as quick as those of people who walk.
    leg = np.isin(np.arange(23), parts_of(human23())[1][1:])
    assert np.all(speed < np.where(leg, 18.0, 2.0 * fastest + 1e-6))
    assert np.linalg.norm(np.diff(found.root, axis=0), axis=1).max() * 60.0 < 2.1 * 1.2
    turned = np.diff(found.rotations * np.sign(np.sum(found.rotations * found.rotations[:1], -1, keepdims=True)), 2, 0)
    assert np.abs(turned[:, ~leg]).max() < 0.01
    assert np.abs(turned).max() < 0.15


def test_the_motion_is_on_the_body_of_a_even_where_b_was_on_shorter_legs() -> None:
    known, motion = learned(walk()), walk()
    a, b = motion.posture(3), motion.posture(6)
    small = Skeleton("small", a.skeleton.names, a.skeleton.parents, 0.7 * a.skeleton.offsets, 0.7 * a.skeleton.tips)
    root = stand(small, b.rotations[None], b.root[None], np.zeros(1))[0]
    found = synthesised(known, [3, 4, 5, 6], a, Posture(small, b.rotations, root))
    assert found.skeleton is a.skeleton
    np.testing.assert_array_equal(found.root[-1], root)
    assert np.abs(np.diff(found.root[:, 1])).max() < 0.1  # lower by 0.35 in the last of three moves


def test_no_moves_are_one_frame(walking: Learned) -> None:
    a = walk().posture(3)
    found = synthesised(walking, [3], a, a)
    assert (len(found), found.name, found.insertions[0].times.tolist()) == (1, "tween", [0.0])
    np.testing.assert_array_equal(found.rotations[0], a.rotations)
