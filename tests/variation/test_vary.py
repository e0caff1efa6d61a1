"""Variations: the piece's own postures, where they stand, what is judged abrupt, and what smooths it."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionmind.body.mirror import find_sides, mirrored
from motionmind.body.motion import Insertion, Motion, Velocity
from motionmind.chaos.flows import FLOWS, find_flow
from motionmind.errors import FormatError, MotionMindError, SkeletonError
from motionmind.formats import lossy_fields, read_motion, write_motion
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Progress
from motionmind.tween.engine import Engine
from motionmind.variation.piece import Piece
from motionmind.variation.review import Smooth
from motionmind.variation.seams import BODY, Transition, judge_transitions
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import read_variation, write_variation
from motionmind.walks.headings import SPIN_RADPS

pytestmark = pytest.mark.long

DOCUMENT = Path(__file__).parents[2] / "docs" / "variations.md"


@pytest.fixture(scope="module")
def macarena() -> Engine:
    return Engine.load("macarena")


@pytest.fixture(scope="module")
def karate() -> Engine:
    return Engine.load("karate")


def piece_of(engine: Engine, clip: str) -> Piece:
    found = next(one for one in engine.corpus.clips if one.name == clip)
    return Piece.of(engine.corpus.motion(found), facing=engine.corpus.facing)


@pytest.fixture(scope="module")
def kata(karate: Engine) -> Piece:
    """A piece that travels and turns, and may face anywhere."""
    return piece_of(karate, "heian-shodan")


@pytest.fixture(scope="module")
def smoothed(kata: Piece, karate: Engine) -> Variation:
    return vary(kata, karate, flow=FLOWS["rossler"], depart=0.25, alternatives=2)


@pytest.fixture(scope="module")
def recording() -> Motion:
    return ballet_clip("jump").resample(30.0)


def inserted(variation: Variation) -> list[int]:
    return [seam.number for seam in variation.seams if seam.insertion]


def same(one: Motion, other: Motion) -> bool:
    """Whether two movements are the same to the last bit."""
    return all(np.array_equal(getattr(one, what), getattr(other, what)) for what in ("rotations", "root", "times"))


orders = st.lists(st.integers(0, 108), min_size=1, max_size=40).map(np.array)


# --- the piece's own ------------------------------------------------------------------------------------------------


@settings(max_examples=20)
@given(name=st.sampled_from(sorted(FLOWS)), count=st.integers(1, 109), skip=st.integers(0, 20), facing=st.booleans())
def test_without_a_nudge_the_variation_is_the_piece(
    kata: Piece, name: str, count: int, skip: int, facing: bool
) -> None:
    piece = Piece.of(kata.motion.slice(0, count), facing="free" if facing else "stage")
    variation = vary(piece, flow=FLOWS[name], nudge=0.0, skip=skip)
    assert variation.seams == ()
    assert same(variation.motion(), piece.motion)


@settings(max_examples=40)
@given(order=orders, facing=st.sampled_from(["free", "stage"]))
def test_every_posture_is_the_pieces_own_turned_about_the_vertical_at_most(
    kata: Piece, order: np.ndarray, facing: str
) -> None:
    piece = Piece(kata.motion, kata.frames, facing)  # type: ignore[arg-type]
    motion, frames = piece.arrange(order, {})
    own = piece.motion
    assert np.array_equal(motion.rotations[frames, 1:], own.rotations[order, 1:])
    assert np.array_equal(motion.root[frames, 1], own.root[order, 1])
    if facing == "stage":
        assert np.array_equal(motion.rotations[frames, 0], own.rotations[order, 0])
    turned = rot.mul_inv(motion.rotations[frames, 0], own.rotations[order, 0])
    np.testing.assert_allclose(turned[:, [0, 2]], 0.0, atol=1e-12)


@settings(max_examples=40)
@given(order=orders)
def test_steps_are_the_pieces_in_the_bodys_heading_and_nothing_teleports(kata: Piece, order: np.ndarray) -> None:
    motion, frames = kata.arrange(order, {})
    own, root = kata.motion, motion.root[frames][:, [0, 2]]
    headings, faced = rot.heading(motion.rotations[frames, 0]), rot.heading(own.rotations[:, 0])
    for n, (i, k) in enumerate(pairwise(order)):
        step = root[n + 1] - root[n]
        if k != i + 1:
            np.testing.assert_allclose(step, 0.0, atol=1e-12)
            np.testing.assert_allclose(np.exp(1j * headings[n + 1]), np.exp(1j * headings[n]), atol=1e-9)
            continue
        turn = Rotation.from_rotvec([0.0, headings[n] - faced[i], 0.0])
        np.testing.assert_allclose(step, turn.apply(own.root[k] - own.root[i])[[0, 2]], atol=1e-9)


@settings(max_examples=60)
@given(order=orders, spans=st.lists(st.tuples(st.integers(0, 107), st.integers(1, 5)), max_size=12))
def test_a_pieces_own_insertions_are_marked_where_the_whole_of_them_comes(
    kata: Piece, order: np.ndarray, spans: list[tuple[int, int]]
) -> None:
    ranges, end = [], 0
    for begin, moves in sorted(spans):
        if begin >= end and begin + moves < len(kata):
            ranges.append(range(begin, end := begin + moves + 1))
    times = kata.motion.times
    marks = tuple(Insertion(times[span.start : span.stop], (("pelvis", 0),)) for span in ranges)
    piece = Piece(replace(kata.motion, insertions=marks), kata.frames)
    order = np.concatenate([order, np.arange(30, 80)])
    motion, frames = piece.arrange(order, {})
    here = [
        (n, span)
        for n, first in enumerate(order)
        for span in ranges
        if span.start == first and np.array_equal(order[n : n + len(span)], span)
    ]
    assert len(motion.insertions) == len(here)
    for mark, (n, span) in zip(motion.insertions, here, strict=True):
        np.testing.assert_allclose(mark.times, motion.times[frames[n : n + len(span)]], atol=1e-9)
        assert mark.bridged == (("pelvis", 0),)


@settings(max_examples=40)
@given(order=orders)
def test_what_stays_is_counted_with_the_time_that_it_takes(kata: Piece, smoothed: Variation, order: np.ndarray) -> None:
    counts = Variation(kata, smoothed.course, order).report()["counts"]
    moving = [n for n, (i, k) in enumerate(pairwise(order)) if i != k]
    assert counts["stays"] == len(order) - 1 - len(moving)
    motion, frames = kata.arrange(order, {})
    lasting = np.diff(motion.times[frames])
    assert counts["seconds_still"] == pytest.approx(lasting.sum() - lasting[moving].sum(), abs=1e-9)


@settings(max_examples=40)
@given(order=orders)
def test_a_posture_lasts_as_long_as_in_the_piece(kata: Piece, order: np.ndarray) -> None:
    motion, frames = kata.arrange(order, {})
    lasting = np.append(np.diff(kata.motion.times), np.diff(kata.motion.times)[-1])
    np.testing.assert_allclose(np.diff(motion.times[frames]), lasting[order[:-1]], atol=1e-9)


@settings(max_examples=40)
@given(rate=st.sampled_from([2.0, 5.0, 7.0, 30.0, 200.0]), start=st.integers(0, 6), seconds=st.floats(0.0, 6.0))
def test_a_recording_keeps_its_frames_between_postures(
    recording: Motion, rate: float, start: int, seconds: float
) -> None:
    recording = recording.slice(0, 1 + int(seconds * 30))
    piece = Piece.of(recording, rate)
    assert np.all(
        np.abs(piece.motion.times[piece.frames] - np.round(piece.motion.times[piece.frames] * rate) / rate) < 0.02
    )
    assert same(vary(piece, nudge=0.0).motion(), recording.slice(0, len(piece.motion)))
    start = min(start, len(piece) - 1)
    order = np.array([len(piece) - 1, *range(start, len(piece))])
    motion, frames = piece.arrange(order, {})
    after = slice(int(frames[1]), None)
    assert np.array_equal(motion.rotations[after, 1:], piece.motion.rotations[piece.frames[start] :, 1:])
    assert recording.times[-1] - piece.motion.times[-1] < 1.0 / min(rate, 30.0) + 1e-9


def test_pieces_of_one_and_two_postures(kata: Piece, karate: Engine) -> None:
    for count in (1, 2):
        piece = Piece.of(kata.motion.slice(0, count))
        variation = vary(piece, karate, length=9)
        motion, frames = variation.arrange()
        assert len(variation.postures) == 9
        assert np.array_equal(motion.rotations[frames, 1:], piece.motion.rotations[variation.postures, 1:])


def test_the_same_asked_twice_is_the_same_to_the_byte(kata: Piece, karate: Engine, tmp_path: Path) -> None:
    for name in ("a.json", "b.json"):
        write_variation(
            tmp_path / name, vary(kata, karate, flow=FLOWS["rossler"], alternatives=2, length=12, nudge=3.0)
        )
    assert inserted(read_variation(tmp_path / "a.json"))
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"skip": -1}, "skip must be a whole number from 0"),
        ({"length": 0}, "length must be a whole number from 1"),
        ({"nudge": (1.0, 2.0)}, "nudge"),
        ({"start": (1.0,)}, "lorenz starts at 3 finite numbers"),
        ({"start": "x"}, "start must be finite numbers, not 'x'"),
        ({"nudge": "x"}, "nudge must be finite numbers, not 'x'"),
        ({"nudge": ((1.0,), (1.0, 2.0))}, "nudge must be finite numbers"),
        ({"step": "x"}, "step must be a finite number, not 'x'"),
        ({"step": (0.1,)}, "step must be a finite number"),
        ({"step": True}, "step must be"),
        ({"length": True}, "length must be a whole number from 1 to 1000000, not True"),
        ({"skip": np.float64(10.0)}, "skip must be a whole number"),
        ({"transient": 10.5}, "transient must be a whole number from 0 to 1000000000, not 10.5"),
        ({"transient": 10**30}, "transient must be a whole number"),
        ({"flow": "lorenz"}, "flow must be a Flow, such as find_flow"),
    ],
)
def test_what_cannot_be_asked_is_refused(kata: Piece, options: dict[str, object], message: str) -> None:
    with pytest.raises(MotionMindError, match=message):
        vary(kata, **options)  # type: ignore[arg-type]


def test_how_to_smooth_is_checked_where_nothing_is_smoothed(kata: Piece, karate: Engine) -> None:
    for engine in (None, karate):
        with pytest.raises(MotionMindError, match="alternatives must be a whole number from 1, not -3"):
            vary(kata, engine, nudge=0.0, alternatives=-3)
        with pytest.raises(TypeError, match="vary has no option 'novelti'; did you mean novelty"):
            vary(kata, engine, nudge=0.0, novelti=1.0)
        with pytest.raises(TypeError, match="'unlike'"):
            vary(kata, engine, nudge=0.0, unlike=[])
        with pytest.raises(TypeError, match="'what_if'"):
            vary(kata, engine, nudge=0.0, what_if=True)
    still = vary(kata, nudge=0.0)
    with pytest.raises(TypeError, match="'nonsense'"):
        still.smooth(karate, nonsense=3)


def test_progress_is_reported_before_each_search(kata: Piece, karate: Engine) -> None:
    calls: list[tuple[int, int]] = []

    def note(done: int, of: int) -> None:
        calls.append((done, of))

    short = Piece.of(kata.motion.slice(0, 12))
    vary(short, karate, flow=FLOWS["chua"], nudge=1.0, alternatives=1, on_progress=note)
    assert calls == [(done, len(calls)) for done in range(len(calls))]
    expected, calls[:] = [*calls], []
    vary(short, flow=FLOWS["chua"], nudge=1.0).smooth(karate, alternatives=1, on_progress=note)
    assert calls == expected
    with pytest.raises(TypeError, match="'told'"):
        vary(short, karate, told=note)


# --- what is abrupt -------------------------------------------------------------------------------------------------


def test_abrupt_is_what_no_move_of_the_corpus_shows(macarena: Engine) -> None:
    piece, rng = piece_of(macarena, "macarena"), np.random.default_rng(3)
    pairs = [(int(i), int(k)) for i, k in rng.integers(0, len(piece), (150, 2))]
    corpus, states = macarena.corpus, macarena.states
    begins, ends = corpus.moves.begins, corpus.moves.ends
    chains = corpus.to_chains(corpus.rotations)
    angles = np.degrees(
        [
            (Rotation.from_quat(chains[b]).inv() * Rotation.from_quat(chains[e])).magnitude()
            for b, e in zip(begins, ends, strict=True)
        ]
    )
    fastest = (angles / corpus.moves.seconds[:, None]).max(axis=0)
    bodies = {(states[b, :-1].tobytes(), states[e, :-1].tobytes()) for b, e in zip(begins, ends, strict=True)}
    seen = [set(zip(states[begins, chain], states[ends, chain], strict=True)) for chain in range(states.shape[1])]
    joined, whole = (judge_transitions(piece, pairs, macarena, whole_body) for whole_body in (False, True))
    assert any(not join.is_abrupt for join in joined)
    for join, body in zip(joined, whole, strict=True):
        i, k = join.start, join.end
        expected = {}
        for chain, name in enumerate(corpus.chains[:-1]):  # at a seam the body goes on facing as it did
            turned = np.degrees(
                (Rotation.from_quat(chains[i, chain]).inv() * Rotation.from_quat(chains[k, chain])).magnitude()
            )
            unknown = states[i, chain] != states[k, chain] and (states[i, chain], states[k, chain]) not in seen[chain]
            limit = 1.000001 * max(macarena.space.tolerances[chain], fastest[chain] * piece.durations[i])
            if unknown or turned > limit:
                expected[name] = (not unknown, turned > limit)
        assert {one.joint: (one.attested, one.fast) for one in join.abrupt_joints} == expected
        fast = {name for name, (_, fast) in expected.items() if fast}
        known = (states[i, :-1].tobytes(), states[k, :-1].tobytes()) in bodies or (
            states[i, :-1] == states[k, :-1]
        ).all()
        assert {one.joint for one in body.abrupt_joints} == fast | (set() if known else {BODY})


def test_the_piece_follows_itself_as_its_own_corpus_knows(macarena: Engine) -> None:
    piece = piece_of(macarena, "macarena")
    for whole_body in (False, True):
        found = judge_transitions(piece, list(pairwise(range(len(piece)))), macarena, whole_body)
        turning = [join for join in found if join.is_abrupt]
        # Its own turns are taken out at a seam, where a body goes on facing as it did.
        assert not turning


def test_a_piece_on_another_body_is_refused(kata: Piece) -> None:
    with pytest.raises(SkeletonError, match="the piece is on another skeleton than corpus 'walk-hexapod'"):
        vary(kata, Engine.load("walk-hexapod"), flow=FLOWS["rossler"])


# --- what smooths it ------------------------------------------------------------------------------------------------


def unattested(join: Transition, engine: Engine, which: int) -> set[tuple[str, int]]:
    """The moves of joints in a candidate that the corpus was not seen to make, but for waits."""
    states, moves = engine.states, engine.corpus.moves
    way, found = join.candidates[which], set()
    for move, (before, after) in enumerate(pairwise(way.path)):
        for chain, name in enumerate(engine.corpus.chains[:-1]):
            seen = ((states[moves.begins, chain] == before[chain]) & (states[moves.ends, chain] == after[chain])).any()
            if not seen and before[chain] != after[chain]:
                found.add((name, move))
    return found


def test_smoothing_leaves_nothing_unattested_unless_it_says_so(smoothed: Variation, karate: Engine) -> None:
    abrupt = [seam.transition for seam in smoothed.seams if seam.transition and seam.transition.is_abrupt]
    assert len(abrupt) > 10
    assert not any(seam.is_abrupt for seam in smoothed.seams)
    for join in abrupt:
        for which, way in enumerate(join.candidates):
            said = {(bridge.joint, bridge.move) for bridge in way.bridges}
            assert unattested(join, karate, which) <= said
            assert said <= {
                *way.motion.insertions[0].bridged,
                *((b.joint, b.move) for b in way.bridges if b.joint == "facing"),
            }


def test_strictly_all_is_attested_or_named(kata: Piece, karate: Engine) -> None:
    found = vary(kata, karate, flow=FLOWS["rossler"], alternatives=1, strict=True, max_moves=3, length=50)
    failed = [seam for seam in found.seams if seam.is_abrupt]
    assert failed
    assert any(seam.insertion for seam in found.seams)
    for seam in found.seams:
        assert seam.transition
        assert not any(way.bridges for way in seam.transition.candidates)
        assert (
            seam.insertion
            or not seam.is_abrupt
            or ("no path" in seam.transition.failure and seam.transition.abrupt_joints)
        )


def test_insertions_lead_from_posture_to_posture(smoothed: Variation) -> None:
    motion, frames = smoothed.arrange()
    piece = smoothed.piece
    inserted = [seam for seam in smoothed.seams if seam.insertion]
    assert len(motion.insertions) == len(inserted)
    assert np.array_equal(motion.rotations[frames, 1:], piece.motion.rotations[smoothed.postures, 1:])
    for seam, mark in zip(inserted, motion.insertions, strict=True):
        before, after = frames[seam.at], frames[seam.at + 1]
        np.testing.assert_allclose(mark.times[[0, -1]], motion.times[[before, after]], atol=1e-9)
        assert motion.inserted()[before + 1 : after].all()
        np.testing.assert_allclose(motion.root[before, [0, 2]], motion.root[after, [0, 2]], atol=1e-9)
        # The movement itself begins and ends where the postures are, so that nothing jumps.
        assert seam.insertion
        way, turn = seam.insertion.motion, rot.about_vertical(rot.heading(motion.rotations[before, 0]))
        for frame, end in ((before, 0), (after, -1)):
            faced = rot.mul(turn, way.rotations[end, 0])
            assert rot.angle(faced, motion.rotations[frame, 0]) < 1e-6
            assert np.all(rot.angle(way.rotations[end, 1:], motion.rotations[frame, 1:]) < 1e-6)
            np.testing.assert_allclose(way.root[end], motion.root[frame] * [0, 1, 0], atol=1e-9)
    kept = ~motion.inserted()
    assert kept.sum() == len(frames)


@pytest.mark.parametrize("facing", ["free", "stage"])
def test_an_insertion_turns_the_body_the_near_way_round(
    kata: Piece, karate: Engine, smoothed: Variation, facing: str
) -> None:
    """Where each posture keeps its own orientation, from one to the other; else the body ends as it began. By nearly
    half a turn it may go either way, as the corpus does, and where it spins as it leaves or arrives."""
    variation = smoothed
    if facing == "stage":
        staged = Piece(kata.motion, kata.frames, "stage")
        variation = vary(staged, karate, flow=FLOWS["rossler"], depart=0.25, alternatives=1)
    motion, frames = variation.arrange()
    headings, turns = np.degrees(rot.heading(motion.rotations[:, 0])), []
    for seam in variation.seams:
        if seam.insertion:
            way = np.unwrap(headings[frames[seam.at] : frames[seam.at + 1] + 1], period=360.0)
            near = (way[-1] - way[0] + 180.0) % 360.0 - 180.0
            steps = np.radians(np.diff(way)) / np.diff(motion.times[frames[seam.at] : frames[seam.at + 1] + 1])
            if abs(near) < 150.0 and np.abs(steps[[0, -1]]).max() < 0.8 * SPIN_RADPS:
                assert way[-1] - way[0] == pytest.approx(near, abs=1e-6)
                assert np.ptp(way) < abs(near) + 90.0
                turns.append(abs(near) > 1.0)
    assert len(turns) > 10
    assert any(turns) if facing == "stage" else not any(turns)


# --- the movement at the ends of an insertion ------------------------------------------------------------------------


def velocities(piece: Piece, i: int, k: int) -> tuple[Velocity, Velocity]:
    """The velocities with which a piece arrives at posture i and leaves posture k, as insertions are given them."""
    before, after = piece.around(i, k)
    assert before is not None
    assert after is not None
    return Velocity.at_end(before), Velocity.at_start(after)


@given(i=st.integers(1, 107), k=st.integers(1, 107), facing=st.sampled_from(["free", "stage"]))
def test_an_insertion_is_given_the_pieces_velocity_in_the_bodys_heading(
    kata: Piece, i: int, k: int, facing: str
) -> None:
    piece = Piece(kata.motion, kata.frames, facing)  # type: ignore[arg-type]
    own, ends = piece.motion, piece.ends(i, k)
    leaving, arriving = velocities(piece, i, k)
    expected = Velocity.at_end(own.slice(0, i + 1)), Velocity.at_start(own.slice(k, len(own)))
    for found, wanted, posture in ((leaving, expected[0], i), (arriving, expected[1], k)):
        np.testing.assert_allclose(found.rotations, wanted.rotations, atol=1e-9)
        turned = 0.0 if facing == "stage" else -float(rot.heading(own.rotations[posture, 0]))
        np.testing.assert_allclose(found.root, Rotation.from_rotvec([0.0, turned, 0.0]).apply(wanted.root), atol=1e-9)
    for movement, frame, end in zip(piece.around(i, k), (-1, 0), ends, strict=True):
        assert movement is not None
        np.testing.assert_allclose(movement.rotations[frame], end.rotations, atol=1e-12)
        np.testing.assert_allclose(movement.root[frame], end.root, atol=1e-12)


def test_a_piece_run_backwards_or_in_a_mirror_gives_velocities_reversed_or_mirrored(recording: Motion) -> None:
    piece, last = Piece.of(recording, rate=5.0), len(Piece.of(recording, rate=5.0)) - 1
    own = piece.motion
    times = own.times[-1] - own.times[::-1]
    backwards = replace(own, rotations=own.rotations[::-1], root=own.root[::-1], times=times)
    leaving, arriving = velocities(piece, 2, 4)
    assert np.abs(leaving.rotations).max() > 0.1
    reversed_piece = Piece(backwards, len(own) - 1 - piece.frames[::-1])
    for found, wanted in zip(velocities(reversed_piece, last - 4, last - 2), (arriving, leaving), strict=True):
        np.testing.assert_allclose(found.rotations, -wanted.rotations, atol=1e-9)
        np.testing.assert_allclose(found.root, -wanted.root, atol=1e-9)
    partners = find_sides(own.skeleton).partners
    for found, wanted in zip(velocities(Piece(mirrored(own), piece.frames), 2, 4), (leaving, arriving), strict=True):
        np.testing.assert_allclose(found.rotations, wanted.rotations[partners] * [1.0, -1.0, -1.0], atol=1e-9)
        np.testing.assert_allclose(found.root, wanted.root * [-1.0, 1.0, 1.0], atol=1e-9)


def test_frames_between_postures_show_how_the_piece_moves(recording: Motion) -> None:
    piece = Piece.of(recording, rate=2.0)
    before, after = piece.around(1, 1)
    assert before is not None
    assert after is not None
    np.testing.assert_allclose(before.times, piece.motion.times[9:16])  # a fifth of a second, up to frame 15
    np.testing.assert_allclose(after.times, piece.motion.times[15:22])


def test_where_the_piece_shows_no_velocity_none_is_given(kata: Piece) -> None:
    last = len(kata) - 1
    assert kata.around(0, last) == (None, None)
    slow = Piece(replace(kata.motion, times=0.1 + 0.5 * np.arange(last + 1)), kata.frames)  # steps are half a second,
    assert all(all(slow.around(i, i)) for i in range(1, last))  # but for rounding
    slower = replace(kata.motion, times=0.6 * np.arange(last + 1))
    assert Piece(slower, kata.frames).around(5, 9) == (None, None)


def test_every_insertion_is_given_the_movement_around_it(smoothed: Variation, kata: Piece, karate: Engine) -> None:
    searched = [seam for seam in smoothed.seams if seam.insertion]
    assert len(searched) > 5
    for variation in (smoothed, smoothed.discard(searched[0].number).smooth(karate, alternatives=1, novelty=0.5)):
        for seam in variation.seams:
            if seam.insertion and seam.transition:
                before, after = kata.around(seam.start, seam.end)
                seconds = [None if one is None else one.times[-1] - one.times[0] for one in (before, after)]
                assert [seam.transition.options["before"], seam.transition.options["after"]] == seconds


def test_no_step_is_longer_than_the_pieces_or_an_insertions(smoothed: Variation) -> None:
    def longest(motion: Motion) -> float:
        return float(np.linalg.norm(np.diff(motion.root[:, [0, 2]], axis=0), axis=1).max())

    ways = [seam.insertion.motion for seam in smoothed.seams if seam.insertion]
    assert longest(smoothed.motion()) <= max(longest(motion) for motion in (smoothed.piece.motion, *ways)) + 1e-9


def test_a_search_that_is_ended_leaves_the_rest_to_be_smoothed(
    kata: Piece, karate: Engine, smoothed: Variation
) -> None:
    def ended(_: Progress) -> bool:
        return True

    some = vary(kata, karate, flow=FLOWS["rossler"], depart=0.25, alternatives=2, watch=ended)
    pending = [seam for seam in some.seams if seam.transition and seam.transition.is_pending]
    assert pending
    assert not any(seam.transition and seam.transition.failure for seam in some.seams)
    again = some.smooth(karate, alternatives=1)
    assert not any(seam.is_abrupt for seam in again.seams)
    assert [(seam.number, seam.at) for seam in again.seams] == [(seam.number, seam.at) for seam in smoothed.seams]


def test_a_stage_piece_keeps_its_orientation_and_another_corpus_may_smooth_it(kata: Piece, macarena: Engine) -> None:
    piece = Piece.of(kata.motion, facing="stage")
    found = vary(piece, macarena, flow=FLOWS["rossler"], length=30, alternatives=1)
    motion, frames = found.arrange()
    assert any(seam.insertion for seam in found.seams)
    assert np.array_equal(motion.rotations[frames], piece.motion.rotations[found.postures])


# --- files ----------------------------------------------------------------------------------------------------------


def test_a_variation_is_read_as_it_was_written(smoothed: Variation, karate: Engine, tmp_path: Path) -> None:
    numbers = [seam.number for seam in smoothed.seams if seam.insertion]
    edited = smoothed.approve(numbers[0]).discard(numbers[1]).replace(numbers[2], 2).cut(3, 5, 20)
    edited = edited.smooth(karate, alternatives=1)
    path = tmp_path / "variation.json"
    write_variation(path, edited)
    found = read_variation(path)
    assert found.report() == edited.report()
    assert same(found.motion(), edited.motion())
    assert same(found.piece.motion, edited.piece.motion)
    first = path.read_bytes()
    write_variation(path, found)
    assert path.read_bytes() == first
    while found.edits:
        found, edited = found.undo(), edited.undo()
        assert found.report() == edited.report()
    movement = read_motion(path)
    np.testing.assert_allclose(movement.root, read_variation(path).motion().root, atol=1e-9)
    assert len(movement.insertions) == len(read_variation(path).motion().insertions)


def test_what_is_no_variation_is_refused(smoothed: Variation, tmp_path: Path) -> None:
    path = tmp_path / "variation.json"
    write_motion(path, smoothed.motion())
    with pytest.raises(FormatError, match="holds movement alone"):
        read_variation(path)
    write_variation(path, smoothed)
    whole = path.read_text()
    for old, new, message in (
        (
            '"variation": {"version":1',
            '"variation": {"version":2',
            "variation: version 2: this MotionMind reads version 1",
        ),
        ('"order":[0,1', '"order":[999,1', "order must name postures of the piece"),
        ('"frames":[0,1', '"frames":[1,0', "frames that increase from 0"),
        ('"edits":[]', '"edits":[{"edit":"approve","seams":[99]}]', "no seam 99"),
        ('"edits":[]', '"edits":[{"edit":"dance"}]', "dance"),
        ('"facing":"free"', '"facing":"up"', "up"),
        (
            '"edits":[]',
            '"edits":[{"edit":"cut","first":0,"last":1,"before":5}]',
            "a variation of an earlier version; make it again: motionmind vary PIECE --corpus NAME -o ",
        ),
    ):
        assert old in whole
        path.write_text(whole.replace(old, new, 1))
        with pytest.raises(FormatError, match=message):
            read_variation(path)


def test_insertions_that_do_not_lead_where_they_should_are_refused(smoothed: Variation, tmp_path: Path) -> None:
    path = tmp_path / "variation.json"
    joins = tuple(join for join in smoothed.transitions if len(join.candidates) == 2)[:2]
    write_variation(path, replace(smoothed, transitions=joins, edits=(Smooth(joins),)))
    whole = json.loads(path.read_text())
    first, join = 1, joins[1]
    last = len(smoothed.piece) - 1
    turned = Rotation.from_rotvec([1e-3, 0.0, 0.0])

    def turn(motion: dict[str, list[list[list[float]]]]) -> None:
        motion["rotations"][-1][3] = (turned * Rotation.from_quat(motion["rotations"][-1][3])).as_quat().tolist()

    def move(motion: dict[str, list[list[float]]]) -> None:
        motion["root"][0][0] += 1e-3

    def flip(motion: dict[str, list[list[list[float]]]]) -> None:
        motion["rotations"][0][3] = [-x for x in motion["rotations"][0][3]]

    for where in ("joins", "edits[0].joins"):
        for changed, message in (
            (turn, f"{where}[{first}].candidates[1]: does not end at posture {join.end} of the piece"),
            (move, f"{where}[{first}].candidates[1]: does not start at posture {join.start} of the piece"),
            (flip, None),
            ({"end": last + 1}, f"{where}[{first}]: from posture {join.start} to {last + 1} there is no seam"),
            ({"end": join.start}, f"{where}[{first}]: from posture {join.start} to {join.start} there is no seam"),
            ({"start": 5, "end": 6}, f"{where}[{first}]: from posture 5 to 6 there is no seam"),
        ):
            file = json.loads(json.dumps(whole))
            section = file["variation"]
            there = (section if where == "joins" else section["edits"][0])["joins"][first]
            if isinstance(changed, dict):
                there.update(changed)
            else:
                changed(there["candidates"][1]["motion"])
            path.write_text(json.dumps(file))
            if message is None:
                read_variation(path)
                continue
            with pytest.raises(FormatError, match=re.escape(f"variation.json: variation: {message}")):
                read_variation(path)


def test_damaged_files_are_refused_or_read(
    kata: Piece, karate: Engine, tmp_path: Path, mutate: Callable[[str, random.Random], bytes]
) -> None:
    short = Piece.of(kata.motion.slice(0, 12))
    variation = vary(short, karate, flow=FLOWS["chua"], nudge=1.0, alternatives=1).cut(2, 3, 7)
    assert any(seam.insertion for seam in variation.seams)
    path, rng = tmp_path / "variation.json", random.Random(5)
    write_variation(path, variation)
    section = {"variation": json.loads(path.read_text())["variation"]}
    head = path.read_text().split('"variation": ')[0]
    text = json.dumps(section)[1:]
    path.write_bytes(head.encode() + text.encode())
    assert read_variation(path).postures.tolist() == variation.postures.tolist()
    refused = 0
    for _ in range(150):
        path.write_bytes(head.encode() + mutate(text, rng))
        try:
            read_variation(path).motion()
        except MotionMindError:
            refused += 1
    assert refused > 50


def test_numpys_numbers_are_written_as_what_they_are(kata: Piece, karate: Engine, tmp_path: Path) -> None:
    whole = {"skip": 3, "transient": 500, "length": 30}
    asked = {"step": 0.01, "nudge": 0.5, "start": (1.0, 2.0, 20.0)}
    once = vary(kata, karate, **whole, **asked, alternatives=1, seed=2, novelty=0.5, moves=(3, 4))  # type: ignore[arg-type]
    assert inserted(once)
    again = vary(
        kata,
        karate,
        **{name: np.int64(value) for name, value in whole.items()},
        **{name: np.array(value)[()] for name, value in asked.items()},
        alternatives=np.int64(1),
        seed=np.int64(2),
        novelty=np.float64(0.5),
        moves=(np.int64(3), np.int64(4)),
    )
    seam = inserted(once)[0]
    write_variation(tmp_path / "a.json", once.approve(seam).replace(seam, 1).cut(1, 2, 9))
    one, two, nine = np.array([1, 2, 9])
    write_variation(tmp_path / "b.json", again.approve(np.int64(seam)).replace(np.int64(seam), one).cut(one, two, nine))
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert read_variation(tmp_path / "a.json").course.nudge == (0.5, 0.0, 0.0)


@pytest.mark.parametrize("nudge", [0.1, (0.1, -0.3, 1e-9)])
def test_a_course_holds_the_nudge_that_was_asked(kata: Piece, nudge: float | tuple[float, ...]) -> None:
    course = vary(kata, nudge=nudge).course
    assert course.nudge == (nudge if isinstance(nudge, tuple) else (nudge, 0.0, 0.0))
    assert np.array_equal(vary(kata, nudge=course.nudge).order, vary(kata, nudge=nudge).order)


def test_what_a_conversion_loses_is_said(smoothed: Variation, tmp_path: Path) -> None:
    path = tmp_path / "variation.json"
    write_variation(path, smoothed)
    assert lossy_fields(read_motion(path), tmp_path / "out.json", source=path) == [
        "the variation's original, alternatives and decisions"
    ]
    write_motion(tmp_path / "plain.json", smoothed.motion())
    assert lossy_fields(smoothed.motion(), tmp_path / "out.json", source=tmp_path / "plain.json") == []


# --- the command line -----------------------------------------------------------------------------------------------


def test_vary_from_a_corpus_to_every_kind_of_file(run: Run, tmp_path: Path) -> None:
    common = ("vary", "karate/heian-shodan", "--attractor", "rossler", "--alternatives", 1, "--length", 14)
    names = ("out.json", "out.bvh", "out.glb", "out.npz", "out.html")
    done = run(*common, *(word for name in names for word in ("-o", name)), "--report", "report.json")
    assert done.code == 0, done.err
    assert f"written   {', '.join(names)}" in done.out
    for name in names:
        assert (tmp_path / name).stat().st_size > 1000
    assert run("render", "out.json", "-o", "out.png").code == 0
    assert run("sheet", "karate/heian-shodan", "--postures", 3, "-o", "piece.png").code == 0
    done = run("convert", "out.json", "again.bvh", "--fps", 30)
    assert done.code == 0
    assert "the variation's original" in done.err
    np.testing.assert_allclose(read_motion("again.bvh").root, read_motion("out.bvh").root, atol=1e-4)
    report = run("review", "out.json", "--json").json
    assert run(*common, "-o", "again.json", "--json").json | {"motion_sha256": None} == report
    assert run(*common, "-o", "again.json", "--report", "-").json | {"motion_sha256": None} == report
    assert json.loads((tmp_path / "report.json").read_text()) | {"motion_sha256": None} == report


def test_vary_says_what_there_is_to_know(run: Run) -> None:
    write_motion("clip.json", ballet_clip("adagio").slice(0, 30))
    done = run("vary", "clip.json", "--attractor", "rossler", "--length", 80, "-o", "out.json")
    assert done.code == 0
    assert "note: without --corpus, no transition is judged" in done.err
    assert "not judged" in done.out
    done = run("vary", "clip.json", "--attractor", "lorenz", "--skip", 0, "--length", 80, "-o", "out.json")
    counts = run("review", "out.json", "--json").json["counts"]
    assert 4 * counts["stays"] > 79
    said = f"{counts['stays']} of 79 steps stay, {counts['seconds_still']:.1f} s"
    assert f"note: {said}: try another --start, or a larger --skip or --step" in done.err
    assert said in done.out.splitlines()
    done = run("vary", "clip.json", "--nudge", 0, "-o", "out.json")
    assert "steps stay" not in done.out + done.err
    assert "note: the variation keeps the piece's order" in done.err


def test_what_the_documents_show_runs(run: Run) -> None:
    text = DOCUMENT.read_text()
    commands = re.findall(r"^ +motionmind (\S.*)$", text, re.M)
    assert len(commands) == 12
    for command in commands:
        quick: tuple[object, ...] = ()  # last words count: less to search
        if command.startswith("vary") and "variation.json" not in command:
            quick = ("--alternatives", 1, *(("--to", 15) if "--by" in command else ("--length", 16)))
        done = run(*command.split(), *quick)
        assert done.code == 0, f"{command}: {done.err}"
        if command.endswith("--list"):
            listed = done.out
    shown = re.search(r"```text\n(.*?) *\.\.\.", text, re.S)
    assert shown is not None
    assert listed.startswith(shown[1])
    python = re.search(r"```python\n(.*?)```", text, re.S)
    assert python is not None
    write_motion("clip.bvh", ballet_clip("adagio").slice(0, 34).resample(30.0))
    assert run("corpus", "build", "mine", "clip.bvh", "--rate", 5).code == 0
    assert "length=100" in python[1]
    exec(python[1].replace("length=100", "length=36"), {})  # for less to search, too
    assert read_variation("variation.json").edits


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("nowhere.bvh",), "nowhere.bvh: cannot be read: there is no such file"),
        (("karate",), "karate: holds 4 clips; name one, such as karate/taikyoku-shodan"),
        (("karate/nothing",), "karate: no posture or clip 'nothing'; there are yoi, "),
        (("karate/heian-shodan", "--clip", "heian-shodan"), "already names a clip; leave out --clip"),
        (("macarena", "--attractor", "moon"), "no flow 'moon'"),
        (("macarena", "--parameter", "rho"), "--parameter rho: give NAME=VALUE"),
        (("macarena", "--parameter", "rho=1"), "lorenz (sigma 16, rho 1, beta 4)"),
        (("macarena", "--nudge", "far"), "'far' is neither a number"),
        (("clip.json", "--strict", "--hold", "left_ankle"), "--hold needs --corpus"),
        (("clip.json", "--alternatives", "3"), "--alternatives needs --corpus"),
        (("clip.json", "--lambda", "2"), "--lambda needs --corpus"),
        (("macarena", "--unit", "cm"), "macarena: --unit is only for motion files"),
        (("karate/heian-shodan", "--source-fps", "30"), "--source-fps is only for motion files"),
        (("some.score", "--joints", "some.toml"), "some.score: --joints is only for motion files"),
        (("macarena", "--corpus", "nothing"), "no corpus 'nothing'"),
        (("macarena", "--rate", "0.0001", "--via", "x.json"), "x.json: cannot be read"),
    ],
)
def test_bad_input_is_one_line(run: Run, tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    write_motion("clip.json", ballet_clip("adagio").slice(0, 30))
    done = run("vary", *arguments, "-o", "out.json")
    assert done.code == 2
    assert message in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not (tmp_path / "out.json").exists()


@pytest.mark.parametrize("command", ["sheet", "render"])
def test_pictures_too_refuse_what_is_for_files(run: Run, command: str) -> None:
    done = run(command, "macarena", "--unit", "cm", "-o", "out.png")
    assert done.code == 2
    assert "macarena: --unit is only for motion files" in done.err


def test_the_exponent_is_reported_and_says_how_fast_trajectories_part(kata: Piece) -> None:
    found = vary(kata, flow=find_flow("lorenz", rho=45.92), skip=4, step=0.005)
    assert found.course.exponent == pytest.approx(2.16 * np.log(2.0), rel=0.03)  # Wolf et al., Physica D 16:285 (1985)
    assert found.report()["course"]["parting"] == pytest.approx(found.course.exponent * 5 * 0.005)


def test_the_exponent_is_the_flows_however_small_the_step(kata: Piece) -> None:
    usual, tiny = (vary(kata, flow=find_flow("rossler"), step=step, length=5).course for step in (None, 1e-6))
    assert tiny.exponent == usual.exponent
    assert tiny.parting == pytest.approx(usual.parting * 1e-6 / usual.step)
