"""The motion and its path: what is asked of a joint is seen, and the rest of the path leads the movement softly."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind._typing import Floats
from motionmind.body.limbs import parts_of
from motionmind.body.motion import Posture
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.synthesis.bending import FREE_PULL_RATIO
from motionmind.synthesis.synthesise import synthesise
from motionmind.synthesis.wishes import Style, Wishes
from motionmind.tween.engine import FOLLOWED_SLACK_DEG, Engine
from motionmind.tween.result import Tween


@cache
def engine_of(name: str) -> Engine:
    return Engine.load(name)


@pytest.fixture(scope="module")
def ballet() -> Engine:
    return engine_of("ballet")


def posture(engine: Engine, row: int) -> Posture:
    corpus = engine.corpus
    return Posture(corpus.skeleton, corpus.rotations[row], corpus.root[row])


def pairs(engine: Engine, count: int, seed: int = 0) -> list[tuple[Posture, Posture]]:
    rows = np.random.default_rng(seed).integers(0, len(engine.corpus), (count, 2))
    return [(posture(engine, a), posture(engine, b)) for a, b in rows.tolist()]


def degrees_from(engine: Engine, tween: Tween, states: Floats) -> Floats:
    """Angles between the motion at each move and one state of each chain [T + 1, L], degrees."""
    at = engine.corpus.to_chains(tween.motion.at(tween.motion.insertions[0].times).rotations)
    return engine.space.distance(at, np.broadcast_to(states, tween.path.shape))


# --- what is asked is seen --------------------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.parametrize("name", ["ballet", "karate", "walk-hexapod"])
def test_a_held_joint_stays_where_it_would_have_moved(name: str) -> None:
    """Of any joint that starts and ends in one state, and that the free movement takes away from it, legs and all."""
    engine = engine_of(name)
    tolerances, held, legs = engine.space.tolerances, 0, 0
    for a, b in pairs(engine, 6 if name == "ballet" else 12):
        states = engine.space.assign(engine.corpus.to_chains(np.stack([a.rotations, b.rotations])))
        try:
            free = engine.tween(a, b, moves=8)
        except NoPathError:
            continue
        moved = degrees_from(engine, free, states[0]).max(axis=0) > 1.2 * tolerances
        for chain in np.flatnonzero(moved & (states[0] == states[1]))[:3]:
            joint = engine.corpus.chains[chain]
            try:
                tween = engine.tween(a, b, moves=8, hold=[joint])
            except NoPathError:
                continue
            assert np.all(tween.path[:, chain] == states[0, chain])
            assert np.all(tween.path_degrees[1:-1, chain] <= tolerances[chain] + FOLLOWED_SLACK_DEG), joint
            assert tween.followed[1:-1, chain].all()
            # Between moves, too, it stays near.
            chains = engine.corpus.to_chains(tween.motion.rotations)[:, chain]
            off = np.degrees(rot.angle(chains, engine.space.of(int(chain))[states[0, chain]]))
            assert off.max() < 1.5 * tolerances[chain] + 1.0, joint
            held += 1
            legs += "hip" in joint or "knee" in joint or "ankle" in joint or "tibia" in joint
    assert held >= 3
    assert legs >= 1


@pytest.mark.parametrize("end", ["A", "B"])
def test_a_pinned_joint_is_where_it_is_pinned(ballet: Engine, end: str) -> None:
    pinned = 0
    for a, b in pairs(ballet, 4, seed=3):
        states = ballet.space.assign(ballet.corpus.to_chains(np.stack([a.rotations, b.rotations])))
        for joint in ("right_elbow", "left_knee", "cervical"):
            chain = ballet.corpus.chains.index(joint)
            if states[0, chain] == states[1, chain]:
                continue
            try:
                tween = ballet.tween(a, b, moves=7, pin={joint: end})
            except NoPathError:
                continue
            state = states[0 if end == "A" else 1]
            off = degrees_from(ballet, tween, state)[1:-1, chain]
            assert off.max() <= ballet.space.tolerances[chain] + 0.1  # of an arc between frames
            assert tween.followed[1:-1, chain].all()
            pinned += 1
    assert pinned > 5


def test_the_motion_goes_as_the_path_does_where_a_state_is_avoided(ballet: Engine) -> None:
    avoided = 0
    for a, b in pairs(ballet, 5, seed=4):
        plain = ballet.tween(a, b, moves=6)
        for joint in ("right_shoulder", "right_hip"):
            chain = ballet.corpus.chains.index(joint)
            state = int(plain.path[3, chain])
            if state in plain.path[[0, -1], chain]:
                continue
            tween = ballet.tween(a, b, moves=6, avoid=[(joint, state)])
            assert state not in tween.path[:, chain]
            assert tween.followed[1:-1, chain].all()
            avoided += 1
    assert avoided > 2


@pytest.mark.parametrize(
    "options", [{"novelty": 0.6}, {"guide": 0.0}, {"sample": True}, {"coordination": "progression", "guide": 0.0}]
)
def test_wishes_of_the_whole_path_are_seen_in_all_of_the_body_but_planted_legs(options: dict[str, Any]) -> None:
    engine = engine_of("karate")
    legs = ("hip", "knee", "ankle", "toes")
    carried = [k for k, joint in enumerate(engine.corpus.chains) if not joint.endswith(legs)]
    for a, b in pairs(engine, 2, seed=5):
        tween = engine.tween(a, b, **options)
        beyond = (tween.path_degrees - engine.space.tolerances)[1:-1, carried]
        assert beyond.max() < 1.0  # of a quick arc between frames
        assert tween.followed[1:-1, carried].mean() > 0.97


def test_the_motion_is_seldom_far_from_the_path_even_where_nothing_is_asked(ballet: Engine) -> None:
    """Only where the walks are far from all states; but it is not bound to the path as closely as where it is asked."""
    legs = ("hip", "knee", "ankle", "toes")
    carried = [k for k, joint in enumerate(ballet.corpus.chains) if not joint.endswith(legs)]
    shares = []
    for a, b in pairs(ballet, 8, seed=6):
        off = ballet.tween(a, b).path_degrees[1:-1, carried] / ballet.space.tolerances[carried]
        shares.extend(off.ravel().tolist())
    assert np.mean(np.array(shares) <= FREE_PULL_RATIO + 0.01) > 0.97
    assert np.max(shares) < 3.0 * FREE_PULL_RATIO
    assert np.mean(np.array(shares) > 1.02) > 0.05


# --- the path leads ---------------------------------------------------------------------------------------------------


def test_other_states_on_the_way_are_another_motion(ballet: Engine) -> None:
    """Paths through other states: each joint's motion changes with them, towards them."""
    rng = np.random.default_rng(0)
    for a, b in pairs(ballet, 3, seed=7):
        tween = ballet.tween(a, b, moves=6)
        shuffled = tween.path.copy()
        for chain, size in enumerate(ballet.space.sizes):
            shuffled[1:-1, chain] = rng.integers(0, size, 5)
        tolerances = np.radians(ballet.space.tolerances)
        none = np.zeros(len(tolerances), dtype=np.bool_)
        style = Style(ballet.corpus, ballet.grammar, ballet.statistics, tolerances)
        motions = [
            synthesise(path, style, Wishes(a, b, none, none, 30.0, 2.4)).motion for path in (tween.path, shuffled)
        ]
        apart = np.degrees(rot.angle(*(motion.rotations for motion in motions)))
        assert apart[20:-20].max(axis=0).mean() > 10.0
        at = [ballet.corpus.to_chains(motion.at(motion.insertions[0].times).rotations) for motion in motions]
        rest = np.setdiff1d(np.arange(23), parts_of(ballet.corpus.skeleton)[1][1:])  # legs do what feet need
        off = [ballet.space.distance(chains, shuffled)[1:-1, rest].mean() for chains in at]
        assert off[1] < 0.7 * off[0]


def test_coordination_is_in_the_path_and_in_the_motion(ballet: Engine) -> None:
    changed = 0
    for a, b in pairs(ballet, 6, seed=8):
        tween, loose = (ballet.tween(a, b, moves=8, coordination=how) for how in ("posture", "none"))
        if np.array_equal(tween.path, loose.path):
            continue
        apart = np.degrees(
            rot.angle(tween.motion.at(tween.motion.times).rotations, loose.motion.at(tween.motion.times).rotations)
        )
        changed += apart.max() > 2.0
    assert changed >= 3


# --- what is said of it -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ballet", "karate", "walk-hexapod"])
def test_followed_is_what_the_motion_does_and_sources_are_shown_by_it(name: str) -> None:
    engine = engine_of(name)
    shown, passed_by = 0, 0
    for a, b in pairs(engine, 2, seed=9):
        tween = engine.tween(a, b, fps=120.0)
        off = degrees_from(engine, tween, tween.path)
        np.testing.assert_allclose(off, tween.path_degrees, atol=0.4)  # an arc between two of 120 frames a second
        sure = np.abs(off - engine.space.tolerances) > 0.4
        np.testing.assert_array_equal(tween.followed[sure], (off <= engine.space.tolerances)[sure])
        edges = engine.grammar.transitions.edges(tween.path)
        for t, chain in np.ndindex(*edges.shape):
            seen = tween.followed[t, chain] and tween.followed[t + 1, chain]
            assert (tween.sources[t][chain] is not None) == (seen and edges[t, chain] >= 0)
            shown += seen
            passed_by += not seen
    assert shown
    assert passed_by


def test_the_motion_of_a_clip_follows_the_path_through_it() -> None:
    """Where the corpus has the very movement it is done again, and its sources are that clip."""
    engine = engine_of("ballet")
    clip = ballet_clip("adagio").resample(1.0 / float(np.median(engine.corpus.seconds)))
    named = []
    for row in (4, 12, 20):
        tween = engine.tween(clip.posture(row), clip.posture(row + 4), moves=4)
        named += [source is not None for line in tween.sources for source in line]
    assert np.mean(named) > 0.5
