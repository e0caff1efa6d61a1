"""Relations of two dancers: measured, learned, and the cheapest path of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind.body.motion import Motion
from motionmind.duets.coupling import (
    COUPLE_RATE_FPS,
    Coupling,
    _move_costs,
    _state_of,
    _states,
    cells_of,
    find_relations,
    learn_coupling,
)
from motionmind.duets.relations import HELD_M, N_LEADER_STATES, Relations, leader_states, relate
from motionmind.ensemble.dancers import Dancer


def danced(place: tuple[float, float], degrees: float, clip: str = "balances", frames: int = 40) -> Motion:
    piece = ballet_clip(clip).slice(0, frames).resample(COUPLE_RATE_FPS)
    motion = Dancer("one", piece, place, np.radians(degrees)).placed()
    return replace(motion, times=motion.times - motion.times[0])


def straight(places: list[tuple[float, float]], degrees: list[float]) -> Relations:
    count = len(places)
    return Relations(np.array(places), np.radians(degrees), np.full((count, 4, 3), 1.0))


def test_a_relation_does_not_depend_on_where_the_couple_is_on_stage() -> None:
    one, two = danced((0.0, 0.0), 0.0), danced((0.3, 1.2), 140.0)
    found = relate(one, two)
    np.testing.assert_allclose(found.distances, np.linalg.norm((two.root - one.root)[:, [0, 2]], axis=1))
    moved = [danced((2.0 + 1.2, -1.0 - 0.3), 140.0 + 90.0), danced((2.0, -1.0), 90.0)]  # turned by 90, then shifted
    for got, wanted in zip(relate(moved[1], moved[0]), found, strict=True):
        np.testing.assert_allclose(got, wanted, atol=1e-9)


def test_a_follower_in_front_is_at_positive_z_and_one_who_faces_the_leader_is_turned_by_180_degrees() -> None:
    leader = danced((0.0, 0.0), 35.0)
    ahead = 1.5 * np.array([np.sin(np.radians(35.0)), np.cos(np.radians(35.0))])
    facing = danced((float(ahead[0]), float(ahead[1])), 35.0 + 180.0)
    start = np.cos(relate(leader, facing).facings[0])
    assert start == pytest.approx(-1.0, abs=1e-9)
    heading = relate(leader, replace(leader, root=leader.root + np.array([ahead[0], 0.0, ahead[1]]))).places[0]
    assert np.hypot(*heading) == pytest.approx(1.5)


def test_hands_are_held_when_they_are_near() -> None:
    one = danced((0.0, 0.0), 0.0)
    names = one.skeleton.names
    left, right = (one.positions()[:, names.index(f"{side}_fingers")] for side in ("left", "right"))
    two = replace(one, root=one.root + (left - right)[:1] + [0.5 * HELD_M, 0.0, 0.0])
    held = relate(one, two).held[0]
    assert held.tolist() == [False, True, False, False]  # the leader's left, the follower's right


def test_the_state_of_a_leader_depends_on_its_own_frame_alone() -> None:
    one, other = danced((0.0, 0.0), 0.0), danced((3.0, 1.0), 77.0)
    np.testing.assert_array_equal(leader_states(one), leader_states(other))
    assert leader_states(one).max() < N_LEADER_STATES
    forward = replace(one, root=one.root[:1] + np.outer(one.times, [0.0, 0.0, 1.0]))
    ways = [leader_states(replace(forward, root=forward.root * sign)) // 27 for sign in ([1, 1, 1], [1, 1, -1])]
    assert {int(way) for way in np.concatenate(ways)} == {1, 3}  # to the front, to the back


def test_couples_that_are_learned_have_rows_that_sum_to_one() -> None:
    duets = [(danced((0.0, 0.0), 0.0, clip), danced((0.7, 0.0), 20.0, clip)) for clip in ("balances", "valse")]
    coupling = learn_coupling(duets)
    rows = np.exp(-coupling.moves).sum(axis=1)
    np.testing.assert_allclose(rows[coupling.visits > 0.0], 1.0)
    assert np.all(np.isinf(coupling.moves[coupling.visits == 0.0]))
    given = np.exp(-coupling.likelihood_costs(np.arange(N_LEADER_STATES, dtype=np.int32)))[:, :-1].sum(axis=1)
    np.testing.assert_allclose(given, 1.0)
    np.testing.assert_array_equal(cells_of(coupling.means)[:, :3], coupling.cells[:, :3])
    again = learn_coupling(duets)  # from the cache
    some = leader_states(duets[0][0])
    np.testing.assert_array_equal(again.likelihood_costs(some), coupling.likelihood_costs(some))


def by_brute_force(coupling: Coupling, leader: Motion, a: Relations, b: Relations) -> float:
    """The least cost of all paths of relations."""
    steps, count = len(leader), len(coupling.cells)
    shares = np.linspace(0.0, 1.0, steps)
    turn = np.angle(np.exp(1j * (b.facings - a.facings)))
    between = Relations(
        a.places + shares[:, None] * (b.places - a.places),
        a.facings + shares * turn,
        a.hands + shares[:, None, None] * (b.hands - a.hands),
    )
    likely = coupling.likelihood_costs(leader_states(leader))
    own = [_states(coupling.means, between, {0: a, steps - 1: b}.get(k), k) for k in range(steps)]
    moves = [_move_costs(coupling, own[k - 1], own[k], leader, k) for k in range(1, steps)]
    ends = [_state_of(coupling, end) for end in (a, b)]
    least = np.inf
    for path in product(range(count + 1), repeat=steps):
        if ends[0][path[0]] and ends[1][path[-1]]:
            cost = sum(moves[k - 1][path[k - 1], path[k]] for k in range(1, steps))
            least = min(least, cost + sum(likely[k, path[k]] for k in range(1, steps - 1)))
    return float(least)


@pytest.mark.parametrize("degrees", [0.0, 70.0])
def test_no_path_of_relations_is_cheaper(degrees: float) -> None:
    one = danced((0.0, 0.0), 0.0)
    two = danced((0.9, 0.2), degrees)
    two = replace(two, root=two.root + np.outer(np.sin(2.0 * one.times), [0.5, 0.0, 0.3]))
    coupling = learn_coupling([(one.slice(0, 8), two.slice(0, 8))])
    assert 1 < len(coupling.cells) <= 8
    leader, relations = one.slice(4, 9), relate(one, two)
    a, b = relations.part(slice(0, 1)), relations.part(slice(3, 4))
    found = find_relations(coupling, leader, a, b)
    assert found.cost == pytest.approx(by_brute_force(coupling, leader, a, b))


def test_without_duets_a_couple_goes_straight_from_relation_to_relation() -> None:
    leader = danced((0.0, 0.0), 0.0).slice(0, 6)
    a, b = straight([(1.0, 0.0)], [170.0]), straight([(0.0, 2.0)], [-170.0])
    found = find_relations(learn_coupling([]), leader, a, b)
    np.testing.assert_allclose(found.relations.places[:, 1], np.linspace(0.0, 2.0, 6))
    np.testing.assert_allclose(np.degrees(found.relations.facings), np.linspace(170.0, 190.0, 6))
    assert found.attested == 0.0


def test_a_couple_takes_the_way_that_the_duets_show() -> None:
    """The follower always goes round the leader's front, half a circle at 1 m; so does the path, not through it."""
    leader = danced((0.0, 0.0), 0.0).slice(0, 1)
    times = np.arange(21) / COUPLE_RATE_FPS
    turn = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 21)
    rotations, root = (array.repeat(21, axis=0) for array in (leader.rotations, leader.root))
    still = replace(leader, rotations=rotations, root=root, times=times)
    round_front = np.stack([np.sin(turn), np.zeros(21), np.cos(turn)], axis=1)
    other = replace(still, root=still.root + round_front)
    coupling, relations = learn_coupling([(still, other)] * 3), relate(still, other)
    found = find_relations(coupling, still, relations.part(slice(0, 1)), relations.part(slice(20, 21)))
    assert found.attested == 1.0
    assert found.relations.distances.min() > 0.7
    alone = find_relations(learn_coupling([]), still, relations.part(slice(0, 1)), relations.part(slice(20, 21)))
    assert alone.relations.distances.min() < 0.1
