"""Passages: found at the least cost of all, and what a movement takes from them."""

from __future__ import annotations

from functools import partial
from itertools import pairwise, product

import numpy as np
import pytest

from motionmind._typing import Floats, Ints
from motionmind.body.contact import CONTACT_FPS
from motionmind.body.motion import Posture
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.walks.expectation import Expectation, expect
from motionmind.walks.frames import Frames, all_frames
from motionmind.walks.passages import (
    CHANGE_COST_RAD2,
    END_VELOCITY_HORIZON_S,
    FREE_POSTURE_WEIGHT,
    GIVEN_POSTURE_WEIGHT,
    HALF_LIVELINESS_HZ,
    N_HALF_LIVELINESS_PERIODS,
    NODE_FRAMES,
    PASSAGE_BLEND_S,
    WARP_COST_RAD2,
    WARP_FRAMES,
    Passage,
    Place,
    cutoff_frequency,
    dance,
    displacements,
    find_passage,
    node_distances,
    velocities,
)
from motionmind.walks.stops import Rates, Stop, stop_at


def frames(chains: Floats, counts: tuple[int, ...], rates: Floats | None = None) -> Frames:
    """Frames of chains [F, L, 4], in stretches of so many."""
    count = len(chains)
    if rates is None:
        rates = np.zeros((count, chains.shape[1], 3))
    return Frames(
        chains, np.repeat(np.arange(len(counts)), counts), np.arange(count), np.arange(count) / CONTACT_FPS, rates
    )


def random_recording(counts: tuple[int, ...], seed: int = 0) -> Frames:
    """Stretches in which two joints turn to and fro at their own frequencies."""
    rng, parts = np.random.default_rng(seed), []
    for count in counts:
        angles = rng.uniform(2.0, 6.0, (2, 3)) * np.arange(count)[:, None, None] / CONTACT_FPS + rng.uniform(
            0.0, 6.0, (2, 3)
        )
        parts.append(rot.exp(0.5 * np.sin(angles)))
    chains = np.concatenate(parts)
    rates = CONTACT_FPS * rot.log(rot.inv_mul(chains, np.roll(chains, -1, axis=0)))
    return frames(chains, counts, rates)


def stop(chains: Floats, rates: Floats | None = None) -> Stop:
    """A stop at some chains [L, 4], with velocities of its joints [J, 3]."""
    none = np.zeros(3)
    return Stop(chains, none, None if rates is None else Rates(rates, np.zeros(()), none))


def at_rest(poses: Floats) -> tuple[Stop, Stop]:
    return stop(poses[0]), stop(poses[-1])


def costs_of(recorded: Frames, shown: Ints, apart: Floats, given: Ints) -> Floats:
    """What passages [N, K] cost, by the definition [N]."""
    count, nodes = len(recorded.chains), np.arange(shown.shape[1])
    leads = np.full((count, count), CHANGE_COST_RAD2)
    for one, other in product(range(count), repeat=2):
        if recorded.stretches[one] == recorded.stretches[other] and other - one in WARP_FRAMES:
            leads[one, other] = min(WARP_COST_RAD2 * abs(other - one - NODE_FRAMES), CHANGE_COST_RAD2)
    weights = np.where(np.isin(nodes, given), GIVEN_POSTURE_WEIGHT, FREE_POSTURE_WEIGHT)
    costs: Floats = (weights * apart[nodes, shown]).sum(axis=1) + leads[shown[:, :-1], shown[:, 1:]].sum(axis=1)
    return costs


# --- the passage of least cost ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(12))
def test_no_passage_costs_less(seed: int) -> None:
    rng = np.random.default_rng(seed)
    recorded = frames(rot.exp(rng.normal(0.0, 0.2, (10, 2, 3))), (6, 4), rng.normal(0.0, 1.0, (10, 2, 3)))
    poses, times = rot.exp(rng.normal(0.0, 0.2, (4, 2, 3))), 0.1 * np.arange(4.0)
    ends = stop(poses[0], rng.normal(0.0, 1.0, (2, 3))), stop(poses[-1])
    given = np.array([0, 3] if seed % 2 else [0, 1, 3])
    found = find_passage(recorded, poses, times, ends, given)
    apart = node_distances(recorded, poses, ends)
    of_all = costs_of(recorded, np.array([*product(range(10), repeat=4)]), apart, given)
    assert costs_of(recorded, found.frames[None], apart, given)[0] == pytest.approx(of_all.min())
    begins = [0]
    for node, (one, other) in enumerate(pairwise(found.frames.tolist()), start=1):
        if recorded.stretches[one] != recorded.stretches[other] or other - one not in WARP_FRAMES:
            begins.append(node)
    assert found.starts.tolist() == begins


def test_velocities_at_the_ends_count_as_where_they_lead_to() -> None:
    rng = np.random.default_rng(0)
    recorded = frames(rot.exp(rng.normal(size=(6, 3, 3))), (6,), rng.normal(size=(6, 3, 3)))
    poses, rates = rot.exp(rng.normal(size=(4, 2, 3))), rng.normal(size=(2, 3))
    plain = node_distances(recorded, poses, at_rest(poses))
    moving = node_distances(recorded, poses, (stop(poses[0]), stop(poses[-1], rates)))
    np.testing.assert_array_equal(moving[:-1], plain[:-1])
    off = ((recorded.rates[:, :2] - rates) ** 2).sum(axis=(1, 2)) / 2
    np.testing.assert_allclose(moving[-1] - plain[-1], END_VELOCITY_HORIZON_S**2 * off)


@pytest.mark.parametrize("number", [3, 9, 17])
def test_a_piece_of_a_recording_is_found_again(cmu05: Engine, number: int) -> None:
    recorded = all_frames(cmu05.corpus)
    own = np.flatnonzero(recorded.stretches == number)
    nodes = own[7:52:NODE_FRAMES]
    poses = recorded.chains[nodes, :-1]
    found = find_passage(
        recorded, poses, 0.1 * np.arange(float(len(nodes))), at_rest(poses), np.array([0, len(nodes) - 1])
    )
    np.testing.assert_array_equal(found.frames, nodes)
    assert found.starts.tolist() == [0]
    np.testing.assert_array_equal(found.postures, recorded.postures[nodes])


@pytest.mark.parametrize("faster", [0.8, 1.25])
def test_passages_are_found_at_other_tempi(cmu05: Engine, faster: float) -> None:
    recorded = all_frames(cmu05.corpus)
    for number in (3, 9, 17):
        own = np.flatnonzero(recorded.stretches == number)
        nodes = own[0] + np.round(10 + NODE_FRAMES * faster * np.arange(11)).astype(np.int64)
        poses = recorded.chains[nodes, :-1]
        found = find_passage(recorded, poses, 0.1 * np.arange(11.0), at_rest(poses), np.array([0, 10]))
        assert np.all(recorded.stretches[found.frames] == number)
        assert np.abs(found.frames - nodes).max() <= 8
        apart = node_distances(recorded, poses, at_rest(poses))[[0, -1], found.frames[[0, -1]]]
        assert GIVEN_POSTURE_WEIGHT * apart.max() < CHANGE_COST_RAD2


@pytest.mark.parametrize("warp", WARP_FRAMES)
def test_a_tempo_up_to_a_third_off_is_followed_through_what_is_given(warp: int) -> None:
    recorded, nodes = random_recording((60, 60)), 65 + warp * np.arange(8)
    poses = recorded.chains[nodes]
    found = find_passage(recorded, poses, 0.1 * np.arange(8.0), at_rest(poses), np.arange(8))
    np.testing.assert_array_equal(found.frames[1:-1], nodes[1:-1])
    np.testing.assert_allclose(found.frames, nodes, atol=1)  # a frame off at an end may cost less than a warp
    assert found.starts.tolist() == [0]


@pytest.mark.parametrize(("share", "changes"), [(0.98, False), (1.02, True)])
def test_another_stretch_is_taken_where_it_saves_more_than_a_change(share: float, changes: bool) -> None:
    """The first stretch is at the poses but for the last one, the second at the last alone."""
    turned = rot.exp(
        np.array([2.0 * np.arcsin(0.5 * np.sqrt(share * CHANGE_COST_RAD2 / GIVEN_POSTURE_WEIGHT)), 0.0, 0.0])
    )
    chains = np.tile(rot.IDENTITY, (60, 2, 1))
    chains[30:] = turned
    poses = np.tile(rot.IDENTITY, (6, 2, 1))
    poses[-1] = turned
    found = find_passage(frames(chains, (30, 30)), poses, 0.1 * np.arange(6.0), at_rest(poses), np.array([0, 5]))
    assert np.all(found.frames[:-1] < 30)
    assert (found.frames[-1] >= 30) == changes
    assert len(found.starts) == 1 + changes


# --- its velocities ---------------------------------------------------------------------------------------------------


def test_a_passage_at_its_own_tempo_has_the_velocities_of_the_recording() -> None:
    recorded, nodes = random_recording((60,)), 5 + NODE_FRAMES * np.arange(11)
    passage = Passage(0.1 * np.arange(11.0), nodes, recorded, np.array([0]))
    found = velocities(passage, np.arange(31) / CONTACT_FPS)
    np.testing.assert_allclose(found, recorded.rates[5:35], atol=1e-9)


@pytest.mark.parametrize("warp", WARP_FRAMES)
def test_a_passage_at_another_tempo_has_them_in_proportion(warp: int) -> None:
    recorded, nodes = random_recording((90,)), 5 + warp * np.arange(11)
    passage = Passage(0.1 * np.arange(11.0), nodes, recorded, np.array([0]))
    times = np.arange(warp * 10 + 1) / (10.0 * warp)
    found = velocities(passage, times)
    np.testing.assert_allclose(found, warp / NODE_FRAMES * recorded.rates[5 : 5 + 10 * warp], atol=1e-9)


def test_where_stretches_change_velocities_are_blended() -> None:
    recorded = random_recording((90, 90))
    nodes = np.concatenate([10 + NODE_FRAMES * np.arange(6), 110 + NODE_FRAMES * np.arange(5)])
    passage = Passage(0.1 * np.arange(11.0), nodes, recorded, np.array([0, 6]))
    times = np.arange(31) / CONTACT_FPS
    found, middles, change = velocities(passage, times), times[:-1] + 0.5 / CONTACT_FPS, 0.55
    before, after = recorded.rates[10:40], recorded.rates[110 - 18 : 110 + 12]
    share = np.clip(0.5 + (middles - change) / PASSAGE_BLEND_S, 0.0, 1.0)[:, None, None]
    np.testing.assert_allclose(found, (1.0 - share) * before + share * after, atol=1e-9)
    is_before, is_after = middles < change - 0.5 * PASSAGE_BLEND_S, middles > change + 0.5 * PASSAGE_BLEND_S
    np.testing.assert_allclose(found[is_before], before[is_before], atol=1e-9)
    np.testing.assert_allclose(found[is_after], after[is_after], atol=1e-9)


def test_beyond_the_ends_of_a_recording_nothing_moves() -> None:
    recorded = random_recording((12,))
    passage = Passage(np.array([0.0, 0.1, 0.2]), np.array([5, 8, 11]), recorded, np.array([0]))
    found = velocities(passage, np.arange(-10, 11) / CONTACT_FPS)
    np.testing.assert_allclose(found[:5], 0.0, atol=1e-9)
    np.testing.assert_allclose(found[5:16], recorded.rates[:11], atol=1e-9)
    np.testing.assert_allclose(found[16:], 0.0, atol=1e-9)


# --- displacements ----------------------------------------------------------------------------------------------------

ROWS = np.array([0, 7, 8, 20])


def toy(seed: int = 0) -> tuple[Floats, Floats, Floats]:
    """A movement of two joints [21, 2, 4], its times, and velocities of a passage; 0.05 s between rows, then 0.03."""
    rng = np.random.default_rng(seed)
    times = np.concatenate([0.05 * np.arange(8), [0.4], 0.4 + 0.03 * np.arange(1, 13)])
    return rot.exp(rng.normal(0.0, 0.5, (21, 2, 3))), times, rng.normal(0.0, 2.0, (20, 2, 3))


def test_displacements_are_the_least_squares() -> None:
    base, times, rates = toy()
    for cutoff in (0.0, 0.4, 2.0):
        found = displacements(base, times, rates, ROWS, cutoff)
        np.testing.assert_array_equal(found[ROWS], 0.0)
        moved = rot.log(rot.inv_mul(base[:-1], base[1:]))
        for begin, end in pairwise(ROWS.tolist()):
            count, step = end - begin, times[begin + 1] - times[begin]
            if count == 1:
                continue
            differences = np.diff(np.eye(count + 1), axis=0)[:, 1:-1] / step
            screen = 2.0 * np.pi * cutoff * np.eye(count - 1)
            wanted = (rates[begin:end] - moved[begin:end] / step).reshape(count, -1)
            system, right = np.vstack([differences, screen]), np.vstack([wanted, np.zeros((count - 1, 6))])
            least = np.linalg.lstsq(system, right, rcond=None)[0]
            np.testing.assert_allclose(found[begin + 1 : end], least.reshape(-1, 2, 3), atol=1e-10)


def test_with_no_cutoff_velocities_are_the_passages_but_for_a_constant() -> None:
    base, times, rates = toy(1)
    missing = np.diff(times)[:, None, None] * rates - rot.log(rot.inv_mul(base[:-1], base[1:]))
    off = np.diff(displacements(base, times, rates, ROWS, 0.0), axis=0) - missing
    for begin, end in pairwise(ROWS.tolist()):
        np.testing.assert_allclose(off[begin:end], np.broadcast_to(off[begin], off[begin:end].shape), atol=1e-12)


def test_the_higher_the_cutoff_the_less_is_displaced() -> None:
    base, times, rates = toy(2)
    sizes = [np.linalg.norm(displacements(base, times, rates, ROWS, cutoff)) for cutoff in (0.0, 0.2, 1.0, 5.0, 1e3)]
    assert all(more > less for more, less in pairwise(sizes))
    assert sizes[-1] < 1e-3 * sizes[0]


def test_each_joint_is_displaced_on_its_own() -> None:
    base, times, rates = toy(3)
    found = displacements(base, times, rates, ROWS, 0.5)
    np.testing.assert_array_equal(displacements(base[:, ::-1], times, rates[:, ::-1], ROWS, 0.5), found[:, ::-1])
    np.testing.assert_array_equal(displacements(base[:, 1:], times, rates[:, 1:], ROWS, 0.5), found[:, 1:])


def test_the_cutoff_falls_from_infinity_to_none() -> None:
    assert cutoff_frequency(1.0, 3.0) == 0.0
    assert cutoff_frequency(0.5, 100.0) == HALF_LIVELINESS_HZ
    assert cutoff_frequency(0.5, 0.5) == N_HALF_LIVELINESS_PERIODS / 0.5
    found = [cutoff_frequency(liveliness, 2.0) for liveliness in (1e-6, 0.1, 0.5, 0.9, 1.0)]
    assert all(more > less for more, less in pairwise(found))
    assert found[0] > 1e5


# --- a walk's mean danced ---------------------------------------------------------------------------------------------

MOVES, SECONDS = 8, 1.6


def posture(engine: Engine, row: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row])


def walk(engine: Engine, rows: dict[int, int]) -> tuple[Expectation, dict[float, Stop]]:
    """What walks expect that pass some of the corpus's postures, by the moves that lead there."""
    stops = {move: stop_at(engine.corpus, posture(engine, row)) for move, row in rows.items()}
    expected = expect(engine.corpus, engine.statistics, stops, np.linspace(0.0, SECONDS, 2 * MOVES + 1))
    return expected, {SECONDS * move / MOVES: found for move, found in stops.items()}


@pytest.fixture(scope="module", params=[{0: 40, 8: 300}, {0: 130, 3: 500, 8: 610}], ids=["free", "via"])
def walked(cmu05: Engine, request: pytest.FixtureRequest) -> tuple[Expectation, dict[float, Stop]]:
    return walk(cmu05, request.param)


def test_nothing_is_displaced_where_postures_are_given(
    cmu05: Engine, walked: tuple[Expectation, dict[float, Stop]]
) -> None:
    expected, stops = walked
    found = [dance(cmu05.corpus, cmu05.statistics, expected, stops, liveliness) for liveliness in (0.0, 0.5, 1.0)]
    assert found[0] is None
    sizes = []
    for danced in found[1:]:
        assert danced is not None
        np.testing.assert_allclose(danced.at(np.array([*stops])), 0.0, atol=1e-12)
        assert np.isin([*stops], danced.times).all()
        sizes.append(rot.norm(danced.off).mean())
        chains = expected.chains(cmu05.corpus, danced.times)
        moved = danced.move(chains, danced.times)
        np.testing.assert_array_equal(moved[:, -1], chains[:, -1])  # where it faces
        np.testing.assert_allclose(rot.angle(chains, moved)[:, :-1], rot.norm(danced.off), atol=1e-6)
    assert np.radians(1.0) < sizes[0] < sizes[1]


def test_the_same_is_danced_each_time(cmu05: Engine, walked: tuple[Expectation, dict[float, Stop]]) -> None:
    one, other = (dance(cmu05.corpus, cmu05.statistics, *walked, 0.7) for _ in range(2))
    assert one is not None
    assert other is not None
    np.testing.assert_array_equal(one.off, other.off)
    np.testing.assert_array_equal(one.passage.frames, other.passage.frames)


def test_the_liveliest_moves_nearly_as_the_passage_does(
    cmu05: Engine, walked: tuple[Expectation, dict[float, Stop]]
) -> None:
    """They differ by what is constant from stop to stop, and by what turns do to each other's axes."""
    expected, stops = walked
    danced = dance(cmu05.corpus, cmu05.statistics, expected, stops, 1.0)
    assert danced is not None
    chains, bounds = expected.chains(cmu05.corpus, danced.times), np.searchsorted(danced.times, [*stops])
    asked, joints = velocities(danced.passage, danced.times), danced.off.shape[1]

    def departs(shown: Floats) -> float:
        rates = rot.log(rot.inv_mul(shown[:-1], shown[1:])) / np.diff(danced.times)[:, None, None]
        off = (rates - asked)[:, :joints]
        parts = [off[begin:end] - off[begin:end].mean(axis=0) for begin, end in pairwise(bounds.tolist())]
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

    assert departs(danced.move(chains, danced.times)) < 0.25 * departs(chains)


def test_equal_ends_without_velocities_hold_still() -> None:
    ballet = Engine.load("ballet")
    expected, stops = walk(ballet, {0: 40, 8: 40})
    call = partial(dance, ballet.corpus, ballet.statistics, expected)
    assert call(stops, 1.0) is None
    assert call(stops, 1.0, Place(5, 1.0)) is not None
    middle = stop_at(ballet.corpus, posture(ballet, 300))
    assert call({0.0: stops[0.0], 0.8: middle, SECONDS: stops[SECONDS]}, 1.0) is not None
    moving = Rates(np.full((23, 3), 0.5), np.zeros(()), np.zeros(3))
    assert call({0.0: stops[0.0]._replace(rates=moving), SECONDS: stops[SECONDS]}, 1.0) is not None


def test_a_place_is_where_the_passage_is(cmu05: Engine, walked: tuple[Expectation, dict[float, Stop]]) -> None:
    corpus = cmu05.corpus
    danced = dance(corpus, cmu05.statistics, *walked, 0.5, Place(7, 2.0))
    assert danced is not None
    passage = danced.passage
    clip = corpus.clips[7]
    assert np.all((passage.postures >= clip.start) & (passage.postures < clip.stop))
    assert passage.recorded.times[0] <= 2.0 < passage.recorded.times[0] + 0.2 + 1e-9
