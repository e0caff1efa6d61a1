"""Laws of corpora that are mirrored, reversed and mixed.

What is learned is counted a second time here, in dictionaries, from walks whose states are known beforehand.
"""

from __future__ import annotations

import json
import math
import re
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bodies import insect
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from saved_corpora import entries, put_entries

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.mirror import find_sides, mirrored, other_side
from motionmind.body.motion import Motion
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.gather import gather
from motionmind.discretize import Codebook
from motionmind.errors import CorpusError, FormatError, SkeletonError
from motionmind.formats import read_motion, write_motion, write_posture
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import PSEUDO_COUNT
from motionmind.tween.certificate import Source
from motionmind.tween.engine import Engine
from motionmind.tween.result import Tween

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"


# --- bodies -----------------------------------------------------------------------------------------------------------


CONVENTIONS: dict[str, tuple[Callable[[str], str], Callable[[str], str]]] = {
    "words in front": (lambda j: f"left_{j}", lambda j: f"right_{j}"),
    "camel case": (lambda j: f"Left{j.title()}", lambda j: f"Right{j.title()}"),
    "namespace": (lambda j: f"rig:Left{j.title()}", lambda j: f"rig:Right{j.title()}"),
    "capitals": (lambda j: f"{j.upper()}_LEFT", lambda j: f"{j.upper()}_RIGHT"),
    "small letters in front": (lambda j: f"l{j}", lambda j: f"r{j}"),
    "great letters in front": (lambda j: f"L{j.title()}Joint", lambda j: f"R{j.title()}Joint"),
    "suffix of Blender": (lambda j: f"{j}.L", lambda j: f"{j}.R"),
    "numbered": (lambda j: f"{j}.L.001", lambda j: f"{j}.R.001"),
    "underscore": (lambda j: f"{j}_l", lambda j: f"{j}_r"),
    "suffix": (lambda j: f"{j}L", lambda j: f"{j}R"),
    "between": (lambda j: f"Bip01 L {j}", lambda j: f"Bip01 R {j}"),
}


def renamed(convention: str) -> Skeleton:
    """human23 with other names for its sides; most say nothing to those who know rigs."""
    left, right = CONVENTIONS[convention]
    names = []
    for name in human23().names:
        side, _, joint = name.partition("_")
        names.append(left(joint) if side == "left" else right(joint) if side == "right" else f"mid{name}")
    return replace(human23(), name=convention, names=tuple(names))


def turned(skeleton: Skeleton, turn: Floats) -> Skeleton:
    """The same body with other axes: a rest pose that is turned in the world."""
    offsets, tips = (rot.mul_vec(turn, places) for places in (skeleton.offsets, skeleton.tips))
    return replace(skeleton, name=f"{skeleton.name}, turned", offsets=offsets, tips=tips)


_S = math.sqrt(0.5)
ACROSS, UPRIGHT = np.array([0.0, _S, 0.0, _S]), np.array([0.0, 0.0, _S, _S])  # x becomes -z; x becomes y
BODIES = {
    "human23": human23(),
    "insect": insect(),
    **{name: renamed(name) for name in CONVENTIONS},
    "facing along x": turned(human23(), ACROSS),
    "lying": turned(human23(), UPRIGHT),
    "standing in z": turned(human23(), np.array([_S, 0.0, 0.0, _S])),
}
LATERAL = {"facing along x": 2, "lying": 1}


def tumble(skeleton: Skeleton, seed: int, frames: int = 3) -> Motion:
    rng = np.random.default_rng(seed)
    q = rot.normalise(rng.normal(size=(frames, len(skeleton), 4)))
    return Motion(skeleton, q, rng.normal(size=(frames, 3)), np.arange(frames) * 0.1, "tumble")


# --- the mirror -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", BODIES)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_a_mirrored_body_stands_where_its_image_is_seen(body: str, seed: int) -> None:
    skeleton = BODIES[body]
    motion = tumble(skeleton, seed)
    sides, image = find_sides(skeleton), mirrored(motion)
    assert sides.axis == LATERAL.get(body, 0)
    reflection = np.ones(3)
    reflection[2 if body == "facing along x" else 0] = -1.0  # level, whatever the body's own axes are
    seen = skeleton.positions_and_tips(motion.rotations, motion.root) * reflection
    partners = np.concatenate([sides.partners, sides.partners + len(skeleton)])
    # On the mirrored body, and, as these are symmetric, on the body itself.
    for on in (image.skeleton, skeleton):
        np.testing.assert_allclose(on.positions_and_tips(image.rotations, image.root)[:, partners], seen, atol=1e-12)
    np.testing.assert_array_equal(image.times, motion.times)


@pytest.mark.parametrize("body", BODIES)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=5)
def test_mirrored_twice_is_the_movement_itself(body: str, seed: int) -> None:
    motion = tumble(BODIES[body], seed)
    again = mirrored(mirrored(motion))
    assert again.skeleton == motion.skeleton
    np.testing.assert_array_equal(again.rotations, motion.rotations)
    np.testing.assert_array_equal(again.root, motion.root)


def test_on_human23_left_and_right_are_exchanged_and_two_coefficients_change_their_sign() -> None:
    motion = tumble(human23(), 5)
    image, names = mirrored(motion), human23().names
    for joint, name in enumerate(names):
        other = {"left": f"right{name[4:]}", "right": f"left{name[5:]}"}.get(name.split("_")[0], name)
        q = motion.rotations[:, names.index(other)]
        np.testing.assert_array_equal(image.rotations[:, joint], q * [1.0, -1.0, -1.0, 1.0])
    np.testing.assert_array_equal(image.root, motion.root * [-1.0, 1.0, 1.0])


def test_a_performer_whose_sides_differ_a_little_is_mirrored_onto_a_mirrored_body() -> None:
    body = human23()
    offsets = body.offsets.copy()
    offsets[body.index("left_knee")] += (0.004, -0.012, 0.003)
    motion = tumble(replace(body, offsets=offsets), 1)
    image, partners = mirrored(motion), find_sides(body).partners
    seen = motion.skeleton.positions(motion.rotations, motion.root) * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(image.skeleton.positions(image.rotations, image.root)[:, partners], seen, atol=1e-12)
    assert image.skeleton != motion.skeleton


def body_of(rows: Mapping[str, tuple[str, tuple[float, float, float]]]) -> Skeleton:
    names = tuple(rows)
    parents = tuple(names.index(parent) if parent else -1 for parent, _ in rows.values())
    return Skeleton("beast", names, parents, np.array([offset for _, offset in rows.values()]))


TRUNK = {"root": ("", (0.0, 0.0, 0.0)), "head": ("root", (0.0, 0.5, 0.0))}
HANDS = {"left_hand": ("root", (0.6, 0.0, 0.0)), "right_hand": ("root", (-0.6, 0.0, 0.0))}


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ({"left_hand": HANDS["left_hand"]}, "left_hand has no partner: .* nothing of that name hangs from root"),
        ({**HANDS, "sword": ("left_hand", (0.0, 0.5, 0.0))}, "sword has no partner: .* hangs from right_hand"),
        (
            {**HANDS, "left_thumb": ("left_hand", (0.1, 0.0, 0.0)), "right_thumb": ("head", (-0.1, 0.0, 0.0))},
            "left_thumb has no partner: on the other side right_thumb does not hang from right_hand",
        ),
        ({**HANDS, "pack": ("root", (0.2, 0.0, 0.0))}, r"pack has no partner: it stands 0\.2 m off the middle"),
        (
            {**HANDS, "right_hand": ("root", (-0.5, 0.2, 0.0))},
            r"(left|right)_hand and (left|right)_hand are no mirror images of each other at rest: they stand at \(",
        ),
        ({"elbow": ("root", (0.3, 0.0, 0.0))}, r"elbow has no partner: it stands 0\.3 m off the middle"),
        (
            {**HANDS, **dict.fromkeys(("left_r_eye", "right_r_eye", "left_l_eye"), ("head", (0.0, 0.1, 0.0)))},
            "left_r_eye has no partner: both right_r_eye and left_l_eye could be it",
        ),
    ],
)  # fmt: skip
def test_a_body_without_two_sides_is_refused_and_the_joint_named(
    rows: dict[str, tuple[str, tuple[float, float, float]]], words: str
) -> None:
    with pytest.raises(SkeletonError, match=f"^beast cannot be mirrored: {words}"):
        mirrored(tumble(body_of(TRUNK | rows), 0))


@pytest.mark.parametrize("axis", [0, 2])
def test_sides_so_near_each_other_that_several_axes_fit_lie_along_the_one_that_parts_them(axis: int) -> None:
    near = {
        f"{side}_hand": ("root", tuple(sign * 0.01 * np.eye(3)[axis])) for side, sign in (("left", 1), ("right", -1))
    }
    assert find_sides(body_of(TRUNK | near)).axis == axis


def test_what_has_no_sides_and_no_breadth_is_its_own_image() -> None:
    snake = body_of({"head": ("", (0.0, 0.0, 0.0)), "neck": ("head", (0.0, 0.0, -1.0)), "tail": ("neck", (0.0, 0, -1))})
    assert find_sides(snake).partners.tolist() == [0, 1, 2]
    np.testing.assert_array_equal(mirrored(tumble(snake, 0)).rotations, rot.mirror(tumble(snake, 0).rotations))


def test_names_of_the_other_side() -> None:
    for left, right in CONVENTIONS.values():
        assert right("knee") in other_side(left("knee"))
        assert left("knee") in other_side(right("knee"))
    assert other_side("pelvis") == set()
    # A name may hold letters that look like sides; such a partner has to be there to count.
    assert {joint for joint in human23().names if other_side(joint) & set(human23().names)} == {
        joint for joint in human23().names if joint.startswith(("left_", "right_"))
    }


def test_any_file_is_mirrored_or_refused_by_name(shared_data: Path) -> None:
    mirrors, refused = 0, []
    for path in sorted((shared_data / "importer").glob("*.bvh")):
        try:
            with warnings.catch_warnings(action="ignore"):
                motion = read_motion(path).slice(0, 5)
        except FormatError:
            continue
        try:
            image, partners = mirrored(motion), find_sides(motion.skeleton).partners
        except SkeletonError as error:
            refused.append(str(error))
            continue
        seen = motion.skeleton.positions(motion.rotations, motion.root) * [-1.0, 1.0, 1.0]
        np.testing.assert_allclose(image.skeleton.positions(image.rotations, image.root)[:, partners], seen, atol=1e-9)
        mirrors += 1
    assert mirrors >= 8
    assert all("no partner" in words or "no mirror images" in words for words in refused)


# --- walks whose states are known -------------------------------------------------------------------------------------

STEP = 30.0  # degrees from state to state
POLE = Skeleton("pole", ("pole", "flag"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))


def walk(name: str, states: Sequence[int], flags: Sequence[int] | None = None, seconds: float = 0.2) -> Motion:
    """A pole that leans by so many steps, and a flag that does; both without a heading."""
    angles = np.radians(STEP) * np.array([states, flags or states], dtype=float).T
    q = rot.from_axis_angle([0.0, 0.0, 1.0], angles)
    root = np.stack([np.array(states, dtype=float), np.zeros(len(states)), np.zeros(len(states))], axis=1)
    return Motion(POLE, q, root, np.arange(len(states)) * seconds, name)


def learned(clips: Sequence[Motion], **options: Any) -> Engine:
    return Engine.fit(clips, discretization=Codebook(STEP / 3.0), facing="stage", **options)


def steps(engine: Engine, chain: int = 0) -> list[int]:
    """What each state of a chain is called in the walks."""
    return [round(math.degrees(float(rot.log(q)[2])) / STEP) for q in engine.space.of(chain)]


def edges(engine: Engine, values: NDArray[Any], chain: int = 0) -> dict[tuple[int, int], float]:
    """Values [E] of a chain's transitions, by the walks' states."""
    graph, called = engine.grammar.transitions, steps(engine, chain)
    rows = graph.sources - graph.starts[chain]
    mine = range(graph.indptr[graph.starts[chain]], graph.indptr[graph.starts[chain + 1]])
    return {(called[rows[e]], called[graph.targets[e]]): float(values[e]) for e in mine}


def weights(engine: Engine, chain: int = 0) -> dict[tuple[int, int], float]:
    return edges(engine, engine.grammar.transitions.weights("conditional"), chain)


def counted(walks: Sequence[Sequence[int]]) -> Counter[tuple[int, int]]:
    return Counter(move for states in walks for move in pairwise(states))


def expected(counts: Mapping[tuple[int, int], float]) -> dict[tuple[int, int], float]:
    """-log P(next | state) of weighted counts."""
    leaving: dict[int, float] = defaultdict(float)
    for (before, _), number in counts.items():
        leaving[before] += number
    return {move: math.log(leaving[move[0]]) - math.log(number) for move, number in counts.items()}


def assert_rows_sum_to_one(engine: Engine) -> None:
    graph = engine.grammar.transitions
    p = np.bincount(graph.sources, np.exp(-graph.weights("conditional")), len(graph.visits))
    np.testing.assert_allclose(p[np.diff(graph.indptr) > 0], 1.0, rtol=1e-12)


WALKS = st.lists(st.lists(st.integers(-2, 2), min_size=2, max_size=9), min_size=1, max_size=3)
PRICES = st.sampled_from([0.0, 0.3, 1.0, 2.5, 40.0, 100.0])
few = settings(max_examples=25)


# --- backwards --------------------------------------------------------------------------------------------------------


def backwards(walks: Sequence[Sequence[int]], price: float) -> dict[tuple[int, int], float]:
    """Counts of what was made, and of the way back at exp(-price)."""
    counts: dict[tuple[int, int], float] = defaultdict(float)
    for (before, after), number in counted(walks).items():
        counts[before, after] += number
        counts[after, before] += number * math.exp(-price)
    return counts


@given(walks=WALKS, price=PRICES)
@few
def test_the_way_back_is_attested_and_rows_sum_to_one(walks: list[list[int]], price: float) -> None:
    clips = [walk(f"clip{i}", states) for i, states in enumerate(walks)]
    forth, both = learned(clips), learned(clips, reverse=price)
    assert weights(both).keys() == weights(forth).keys() | {(b, a) for a, b in weights(forth)}
    found = weights(both)
    assert found == pytest.approx(expected(backwards(walks, price)), rel=1e-9, abs=1e-9)
    assert_rows_sum_to_one(both)


@given(walks=WALKS, price=PRICES)
@few
def test_what_is_made_one_way_costs_the_price_more_the_other(walks: list[list[int]], price: float) -> None:
    """The law, exactly: w(b, a) - w(a, b) = price + log C(b) - log C(a), C the counts that leave.

    So of two moves out of one state that were seen alike often, one forwards and one backwards, the second costs the
    price more; and along a path the logarithms cancel but for its ends.
    """
    engine = learned([walk(f"clip{i}", states) for i, states in enumerate(walks)], reverse=price)
    seen, counts, found = counted(walks), backwards(walks, price), weights(engine)
    leaving: dict[int, float] = defaultdict(float)
    for (before, _), number in counts.items():
        leaving[before] += number
    one_way = [(a, b) for a, b in seen if (b, a) not in seen]
    for a, b in one_way:
        more = price + math.log(leaving[b]) - math.log(leaving[a])
        assert found[b, a] - found[a, b] == pytest.approx(more, rel=1e-9, abs=1e-9)
    for a, b in one_way:
        for c, d in one_way:
            if b == c and seen[a, b] == seen[c, d]:
                assert found[b, a] - found[c, d] == pytest.approx(price, rel=1e-9, abs=1e-9)
    for states in walks:
        if all(move in one_way for move in pairwise(states)):
            forth = sum(found[move] for move in pairwise(states))
            back = sum(found[b, a] for a, b in pairwise(states))
            ends = math.log(leaving[states[-1]]) - math.log(leaving[states[0]])
            assert back - forth == pytest.approx((len(states) - 1) * price + ends, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("price", [0.0, 0.7, 3.0])
def test_along_a_thread_every_move_back_costs_exactly_the_price_more(price: float) -> None:
    """Where the corpus knows one way forth (P = 1), one way back is learned, each move of it dearer by the price.

    Forth costs log(1 + exp(-price)), for what may be undone is no longer certain.
    """
    engine = learned([walk("thread", range(-5, 6))], reverse=price)
    found = weights(engine)
    for state in range(-4, 4):
        assert found[state, state + 1] == pytest.approx(math.log1p(math.exp(-price)), abs=1e-12)
        assert found[state + 1, state] - found[state, state + 1] == pytest.approx(price, abs=1e-12)


@pytest.mark.parametrize("price", [0.0, 0.7, 3.0])
def test_a_tween_against_the_time_of_the_corpus_costs_the_price_a_move_and_joint(price: float) -> None:
    clip = walk("thread", range(-5, 6))
    engine = learned([clip], reverse=price)
    a, b = clip.posture(2), clip.posture(7)
    plain = {"strict": True, "lambda_": 0.0, "guide": 0.0, "moves": 5}
    forth, back = engine.tween(a, b, **plain), engine.tween(b, a, **plain)
    assert back.cost - forth.cost == pytest.approx(5 * 2 * price, abs=1e-9)
    assert {(s.clip, s.corpus, s.reversed) for row in back.sources for s in row if s} == {("thread", "corpus", True)}
    assert [row[0].posture for row in back.sources if row[0]] == [7, 6, 5, 4, 3]
    assert not any(s.reversed for row in forth.sources for s in row if s)
    # It takes as long, and goes back over the ground that it came.
    np.testing.assert_allclose(back.motion.insertions[0].times, forth.motion.insertions[0].times)
    if price == 0.0:  # the mean way is the same only where both directions count alike
        np.testing.assert_allclose(back.motion.root, forth.motion.root[::-1], atol=0.1)
    with pytest.raises(Exception, match="no path from A to B"):
        learned([clip]).tween(b, a, strict=True)


@given(walks=WALKS, price=PRICES)
@few
def test_what_is_made_both_ways_alike_costs_what_it_did(walks: list[list[int]], price: float) -> None:
    clips = [walk(f"clip{i}", states + states[::-1]) for i, states in enumerate(walks)]
    forth, both = weights(learned(clips)), weights(learned(clips, reverse=price))
    assert both == pytest.approx(forth, abs=1e-9)


def test_the_root_travels_back_as_it_came() -> None:
    engine = learned([walk("thread", [0, 1, 3])], reverse=1.0)
    np.testing.assert_allclose(engine.carriage.travel[:, 0], 0.5 * np.array([1.0, 2.0, -1.0, -2.0]), atol=1e-12)
    np.testing.assert_allclose(engine.carriage.travel[:, 1:], 0.0, atol=1e-12)


def test_the_price_leaves_postures_and_how_joints_stand_together_alone() -> None:
    clips = [walk("a", [0, 1, 2, 1], [0, 0, 1, 1]), walk("b", [2, 0], [1, 2])]
    forth, both = learned(clips), learned(clips, reverse=0.5)
    for name in ("pair_costs", "child_costs", "parent_costs"):
        one, other = (getattr(engine.grammar.coordination, name) for engine in (forth, both))
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(forth.grammar.transitions.visits, both.grammar.transitions.visits)


# --- mixed ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Home:
    """A folder of corpora."""

    folder: Path

    def keep(self, name: str, clips: Sequence[Motion], **options: Any) -> Engine:
        engine = learned(clips, name=name, home=self.folder, **options)
        engine.save(self.folder / "corpora" / name)
        return engine

    def mix(self, name: str, clips: Sequence[Motion], mix: Mapping[str, float], **options: Any) -> Engine:
        return learned(clips, name=name, mix=mix, home=self.folder, **options)


@pytest.fixture
def home(tmp_path: Path) -> Home:
    return Home(tmp_path / "home")


ONE, TWO = [0, 1, 2, 1, 0, 1], [1, 0, -1, 0, 1, 1, 2]


@pytest.mark.parametrize("weight", [0.25, 0.3, 1.0, 7.0, 1e-6, 1e6])
def test_a_mix_is_the_weighted_union_of_counts(home: Home, weight: float) -> None:
    home.keep("other", [walk("two", TWO)])
    engine = home.mix("mixed", [walk("one", ONE)], {"other": weight})
    counts: dict[tuple[int, int], float] = defaultdict(float, counted([ONE]))
    for move, number in counted([TWO]).items():
        counts[move] += weight * number
    for chain in (0, 1):
        assert weights(engine, chain) == pytest.approx(expected(counts), rel=1e-9, abs=1e-9)
    assert_rows_sum_to_one(engine)
    # P(1 | 0) by hand, so that the counting is checked as well: both of one's moves out of 0, and one of two's two.
    p = math.exp(-weights(engine)[0, 1])
    assert p == pytest.approx((2.0 + weight * 1.0) / (2.0 + weight * 2.0))


def test_how_long_a_move_takes_and_where_it_leads_is_weighed_alike(home: Home) -> None:
    home.keep("other", [walk("two", [0, 1, 0], seconds=0.5)])
    steps_twice = replace(walk("one", [0, 1]), root=np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]))
    engine = home.mix("mixed", [steps_twice], {"other": 0.25})
    assert edges(engine, engine.grammar.transitions.seconds) == pytest.approx({(0, 1): 0.26, (1, 0): 0.5})
    visits = dict(zip(steps(engine), engine.grammar.transitions.visits[:2].tolist(), strict=True))
    assert visits == {0: 1.5, 1: 1.25}
    np.testing.assert_allclose(engine.carriage.travel[:, 0], 0.5 * np.array([3.0, 1.0, -1.0]))
    np.testing.assert_allclose(engine.carriage.weights, [1.0, 1.0, 0.25, 0.25, 0.25, 1.0, 0.25, 0.25])


def test_the_movement_of_a_mix_goes_the_way_of_the_corpus_that_weighs_more(home: Home) -> None:
    """Both corpora lean the pole by the same steps; one leans the flag to one side, the other to the other."""
    pole, aside = [0, 1, 2, 1, 0], [0, 2, 0, 2, 0]
    home.keep("other", [walk("left", pole, [-flag for flag in aside])])
    leans = []
    for weight in (0.01, 0.2, 1.0, 5.0, 100.0):
        engine = home.mix("mixed", [walk("right", pole, aside)], {"other": weight})
        a, b = (walk("ends", [0, 2], [0, 0]).posture(end) for end in (0, 1))
        tween = engine.tween(a, b, moves=2)
        middle = tween.motion.at(tween.motion.insertions[0].times).rotations[1, 1]
        leans.append(math.degrees(float(rot.log(middle)[2])) / STEP)
    assert np.all(np.diff(leans) < -1e-4)
    assert leans[0] > 0.9 > -0.9 > leans[-1]
    np.testing.assert_allclose(leans, -np.array(leans)[::-1], atol=0.02)  # what one gains the other loses


def test_on_the_way_too_a_movement_hardly_shows_what_weighs_a_hundredth(home: Home) -> None:
    """Both corpora hold the flag alike until half the way is gone, so that walks may go over from one to the other."""
    pole, late = list(range(9)), [0, 0, 0, 0, 1, 2, 2, 2, 0]
    clip = walk("right", pole, late)
    home.keep("other", [walk("left", pole, [-flag for flag in late])])

    def leans(engine: Engine) -> Floats:
        a, b = (walk("ends", [0, 8], [0, 0]).posture(end) for end in (0, 1))
        tween = engine.tween(a, b, moves=8)
        return np.degrees(rot.log(tween.motion.at(tween.motion.insertions[0].times).rotations[4:8, 1])[:, 2])

    alone = leans(learned([clip]))
    assert np.all(alone > 5.0)
    shares = np.array([leans(home.mix("mixed", [clip], {"other": w})) / alone for w in (0.01, 0.2, 1.0, 5.0, 100.0)])
    assert np.all(np.diff(shares.mean(axis=1)) < 0.0)
    assert shares[0].min() > 0.95
    assert shares[-1].max() < -0.95
    assert 0.4 < shares[1].mean() < 0.95


def test_how_joints_stand_together_is_weighed_alike(home: Home) -> None:
    weight, called = 0.3, {}
    one, two = ([0, 1, 1, 0], [0, 0, 1, 1]), ([0, 1, 0], [1, 1, 2])
    home.keep("other", [walk("two", *two)])
    engine = home.mix("mixed", [walk("one", *one)], {"other": weight})
    pairs: dict[tuple[int, int], float] = defaultdict(float)
    for (poles, flags), each in ((one, 1.0), (two, weight)):
        for pole, flag in zip(poles, flags, strict=True):
            pairs[pole, flag] += each
    total = sum(pairs.values())
    called = {"pole": steps(engine, 0), "flag": steps(engine, 1)}
    cpd = engine.network().get_cpds("flag").get_values()
    table = engine.grammar.coordination.table(1, engine.grammar.transitions.starts)
    for p, pole in enumerate(called["pole"]):
        above = sum(number for (above, _), number in pairs.items() if above == pole)
        for c, flag in enumerate(called["flag"]):
            marginal = sum(number for (_, below), number in pairs.items() if below == flag) / total
            probability = (pairs[pole, flag] + PSEUDO_COUNT * marginal) / (above + PSEUDO_COUNT)
            assert cpd[c, p] == pytest.approx(probability)
            assert table[p, c] == pytest.approx(-math.log(probability))


def test_of_weight_1_a_mix_is_what_both_files_give(home: Home) -> None:
    home.keep("other", [walk("two", TWO), walk("three", [2, 2, -2])])
    mixed = home.mix("mixed", [walk("one", ONE)], {"other": 1.0})
    plain = learned([walk("one", ONE), walk("two", TWO), walk("three", [2, 2, -2])])
    assert_same_grammar(mixed, plain)
    assert [(clip.name, clip.corpus, clip.weight) for clip in mixed.corpus.clips] == [
        ("one", "", 1.0),
        ("two", "other", 1.0),
        ("three", "other", 1.0),
    ]


def test_only_the_ratios_of_weights_matter(home: Home) -> None:
    home.keep("one", [walk("a", ONE)])
    home.keep("two", [walk("a", TWO)])
    mixes = [home.mix("mixed", [], {"one": w, "two": w / 4.0}, reverse=1.0) for w in (1.0, 4.0, 1e-3)]
    for other in mixes[1:]:
        assert_same_grammar(mixes[0], other)
    assert [clip.weight for clip in mixes[1].corpus.clips] == [1.0, 0.25]
    # The heaviest counts whole, whether it is what is built or what is mixed in.
    assert_same_grammar(mixes[0], home.mix("mixed", [walk("a", ONE)], {"two": 0.25}, reverse=1.0))


def assert_same_grammar(one: Engine, other: Engine) -> None:
    for part in ("transitions", "bridges", "coordination"):
        for name, array in vars(getattr(one.grammar, part)).items():
            np.testing.assert_allclose(getattr(getattr(other.grammar, part), name), array, rtol=1e-12, err_msg=name)
    np.testing.assert_allclose(other.carriage.travel, one.carriage.travel, rtol=1e-12, atol=1e-12)


def test_a_mix_of_mixes_remembers_where_each_clip_is_from(home: Home) -> None:
    home.keep("one", [walk("a", ONE)])
    home.keep("two", [walk("a", TWO)], mix={"one": 0.5}, reverse=2.0)
    engine = home.mix("three", [walk("a", [0, 2])], {"two": 0.5})
    assert [(c.corpus, c.name, c.weight, c.reverse) for c in engine.corpus.clips] == [
        ("", "a", 1.0, None),
        ("two", "a", 0.5, 2.0),
        ("one", "a", 0.25, 2.0),
    ]
    priced = home.mix("three", [walk("a", [0, 2])], {"two": 0.5}, reverse=1.0)
    assert [clip.reverse for clip in priced.corpus.clips] == [1.0, 1.0, 1.0]
    assert [clip.label for clip in engine.corpus.clips] == ["a", "two: a", "one: a"]


def test_what_a_mixed_corpus_has_mirrored_is_not_mirrored_again(home: Home) -> None:
    body = insect()
    home.keep("two", [replace(tumble(body, 0, 4), name="a")], mirror=True)
    engine = home.mix("three", [replace(tumble(body, 1, 4), name="a")], {"two": 1.0}, mirror=True)
    assert [clip.label for clip in engine.corpus.clips] == ["a", "two: a", "two: a (mirrored)", "a (mirrored)"]
    image = mirrored(engine.corpus.motion(engine.corpus.clips[1]))
    np.testing.assert_array_equal(image.rotations, engine.corpus.motion(engine.corpus.clips[2]).rotations)


def test_detail_goes_with_a_corpus_that_is_mixed_in_at_its_rate_or_another(home: Home) -> None:
    shaken = shaking_dance("a")
    one = gather("one", [shaken], rate=5.0)
    for rate in (5.0, None, 2.5):
        mix = gather("two", [], mix=[(one, 0.5)], rate=rate, mirror=True)
        for clip, exact in zip(mix.clips, (shaken, mirrored(shaken)), strict=True):
            found = mix.recording(clip)
            assert rot.angle(found.rotations, exact.at(found.times).rotations).max() < 2e-4


def shaking_dance(name: str) -> Motion:
    """Human23 for 8 s at 30 frames a second, shaking faster than 5 postures a second tell."""
    times = np.arange(241) / 30.0
    phase = np.random.default_rng(1).uniform(0.0, 6.0, (2, 23, 3))
    turns = 0.3 * np.sin(times[:, None, None] + phase[0]) + 0.03 * np.sin(40.0 * times[:, None, None] + phase[1])
    return Motion(human23(), rot.exp(turns), np.zeros((241, 3)), times, name)


def test_postures_of_a_mixed_corpus_are_brought_to_the_rate(home: Home) -> None:
    home.keep("even", [walk("a", range(-4, 5), seconds=0.1)], rate=10.0)
    home.keep("keys", [walk("b", [0, 2], seconds=0.4)])
    engine = home.mix("mixed", [walk("c", [0, 1], seconds=0.2)], {"even": 1.0, "keys": 1.0}, rate=5.0)
    assert engine.corpus.rate == 5.0
    assert [len(clip) for clip in engine.corpus.clips] == [2, 5, 3]
    np.testing.assert_allclose(engine.corpus.seconds, 0.2)
    assert home.mix("mixed", [], {"even": 1.0}).corpus.rate == 10.0
    assert home.mix("mixed", [walk("c", [0, 1])], {"keys": 1.0}).corpus.rate is None
    with pytest.raises(
        CorpusError, match=r"the recordings and corpus 'even' are of different rates \(frame by frame, 10"
    ):
        home.mix("mixed", [walk("c", [0, 1])], {"even": 1.0})
    with pytest.raises(CorpusError, match="corpus 'keys' and corpus 'even' are of different rates"):
        home.mix("mixed", [], {"keys": 1.0, "even": 1.0}, rate=None)
    with pytest.raises(CorpusError, match="corpus 'even' has 10 postures a second; 20 cannot be made of them"):
        home.mix("mixed", [], {"even": 1.0}, rate=20.0)


def test_corpora_are_brought_to_the_recordings_rate_unless_one_is_given(
    home: Home, caplog: pytest.LogCaptureFixture
) -> None:
    home.keep("even", [walk("a", range(-4, 5), seconds=0.1)], rate=10.0)
    home.keep("keys", [walk("b", [0, 2], seconds=0.4)])
    film = walk("c", [0] * 31, seconds=1 / 30)
    with caplog.at_level("INFO"):
        engine = home.mix("mixed", [film], {"keys": 1.0, "even": 1.0}, rate="auto")
    assert "corpus mixed: 5 postures a second, also of 'keys', 'even'" in caplog.messages
    given = home.mix("mixed", [film], {"keys": 1.0, "even": 1.0}, rate=5.0)
    assert engine.corpus.rate == 5.0
    assert np.array_equal(engine.corpus.rotations, given.corpus.rotations)
    assert engine.corpus.clips == given.corpus.clips
    alone = home.mix("mixed", [], {"keys": 1.0, "even": 1.0}, rate="auto")
    assert alone.corpus.rate == 10.0
    assert [len(clip) for clip in alone.corpus.clips] == [5, 9]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"mix": {"other": 0.0}}, "the weight of corpus 'other' must be from 1e-06 to 1e\\+06, not 0"),
        ({"mix": {"other": -1.0}}, "the weight of corpus 'other'"),
        ({"mix": {"other": math.nan}}, "the weight of corpus 'other'"),
        ({"mix": {"other": math.inf}}, "the weight of corpus 'other'"),
        ({"mix": {"nobody": 1.0}}, "no corpus 'nobody'; there are again, "),
        ({"mix": {"ballet": 1.0}}, "corpus 'ballet' is on another skeleton than pole: human23 lacks"),
        ({"mix": {"other": 1.0}, "name": "other"}, "corpus 'other' cannot be mixed into itself"),
        ({"mix": {"other": 1.0, "again": 1.0}}, "two of the corpora to mix are called 'other'"),
        ({"reverse": -0.1}, "the price of a move backwards must be from 0 to 100 nats, not -0.1"),
        ({"reverse": math.nan}, "the price of a move backwards"),
        ({"reverse": 101.0}, "the price of a move backwards"),
    ],
)
def test_what_cannot_be_mixed_is_refused(home: Home, options: dict[str, Any], words: str) -> None:
    home.keep("other", [walk("two", TWO)]).save(home.folder / "corpora" / "again")
    with pytest.raises(CorpusError, match=words):
        learned([walk("one", ONE)], home=home.folder, **options)
    with pytest.raises(CorpusError, match="no recordings given"):
        learned([])


def test_what_cannot_be_mirrored_names_the_clip() -> None:
    arm = Skeleton("arm", ("shoulder", "elbow"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))
    with pytest.raises(SkeletonError, match=r"^wave: arm cannot be mirrored: elbow has no partner"):
        learned([replace(walk("wave", ONE), skeleton=arm)], mirror=True)


# --- who attests what -------------------------------------------------------------------------------------------------


def dance(name: str, seed: int, frames: int = 14) -> Motion:
    """A person who moves every joint a little, in no symmetric way."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames) * 0.2
    phase, size = rng.uniform(0.0, 6.0, (23, 3)), rng.uniform(0.1, 0.5, (23, 3))
    q = rot.exp(size * np.sin(1.1 * t[:, None, None] + phase))
    q[:, 0] = rot.mul(rot.about_vertical(rng.uniform(-0.5, 0.5) * t), q[:, 0])
    return Motion(human23(), rot.normalise(q), np.stack([np.sin(t), 1.0 + 0.0 * t, t], axis=1), t, name)


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> Engine:
    """People of two corpora, one of them mirrored already, all mirrored and reversed."""
    folder = tmp_path_factory.mktemp("home")
    other = Engine.fit([dance("solo", 3), dance("duet", 4)], name="other", mirror=True, discretization=Codebook(20.0))
    other.save(folder / "corpora" / "other")
    return Engine.fit(
        [dance("solo", 1), dance("trio", 2)],
        name="mine",
        mirror=True,
        reverse=1.0,
        mix={"other": 0.3},
        home=folder,
        discretization=Codebook(20.0),
    )


def assert_attested(engine: Engine, source: Source, chain: int, before: int, after: int) -> None:
    """That the source's postures are in the states of the transition."""
    (clip,) = (
        clip
        for clip in engine.corpus.clips
        if (clip.name, clip.corpus or engine.corpus.name, clip.mirrored)
        == (source.clip, source.corpus, source.mirrored)
    )
    to = source.posture + (-1 if source.reversed else 1)
    assert min(source.posture, to) >= 0
    assert max(source.posture, to) < len(clip)
    seen = engine.states[[clip.start + source.posture, clip.start + to], chain].astype(int)
    if engine.corpus.chains[chain] == "facing":  # pooled: by how many steps it turns
        assert (seen[1] - seen[0] - (after - before)) % engine.space.sizes[chain] == 0
    else:
        assert seen.tolist() == [before, after]
    if source.reversed:
        assert clip.reverse is not None


def test_every_transition_is_attested_where_it_is_said_to_be(everything: Engine) -> None:
    graph, corpus = everything.grammar.transitions, everything.corpus
    kinds = set()
    for chain in range(len(corpus.chains)):
        for row in range(graph.starts[chain], graph.starts[chain + 1]):
            for edge in range(graph.indptr[row], graph.indptr[row + 1]):
                posture, to = int(graph.attests[edge]), int(graph.arrives[edge])
                clip = corpus.clip_of(posture)
                source = Source(
                    clip.name, posture - clip.start, clip.corpus or corpus.name, clip.mirrored, to < posture
                )
                kinds.add((source.corpus, source.mirrored, source.reversed))
                assert_attested(everything, source, chain, row - int(graph.starts[chain]), int(graph.targets[edge]))
    assert kinds == {(name, m, r) for name in ("mine", "other") for m in (False, True) for r in (False, True)}


def test_nothing_is_said_to_be_reversed_that_is_attested_as_it_was_made(everything: Engine) -> None:
    graph, states = everything.grammar.transitions, everything.states.astype(int)
    forward = everything.corpus.moves.begins[everything.corpus.moves.ends > everything.corpus.moves.begins]
    for chain in range(len(human23())):
        made = {(states[n, chain], states[n + 1, chain]) for n in forward}
        for edge in range(graph.indptr[graph.starts[chain]], graph.indptr[graph.starts[chain + 1]]):
            move = int(graph.sources[edge] - graph.starts[chain]), int(graph.targets[edge])
            assert (graph.arrives[edge] > graph.attests[edge]) == (move in made)


def tweens(engine: Engine) -> list[Tween]:
    ends = [(dance("a", 1), 12, dance("b", 2), 1), (dance("a", 3), 9, dance("b", 1), 2)]
    ends.append((mirrored(dance("a", 1)), 10, dance("b", 4), 3))
    return [engine.tween(a.posture(i), b.posture(k)) for a, i, b, k in ends]


def test_a_tween_tells_corpus_clip_and_posture_and_what_is_mirrored_and_reversed(everything: Engine) -> None:
    kinds = set()
    for tween in tweens(everything):
        report = json.loads(json.dumps(tween.report()))
        for move, (before, after) in enumerate(pairwise(tween.path.tolist())):
            for chain, source in enumerate(tween.sources[move]):
                edge = everything.grammar.transitions.edge(chain, before[chain], after[chain])
                followed = tween.followed[move, chain] and tween.followed[move + 1, chain]
                assert (source is None) == (edge < 0 or not followed)
                said = report["sources"][move][chain]
                if source is None:
                    assert said is None
                    continue
                assert set(said) == {*("clip", "posture", "corpus", "mirrored", "reversed", "seconds", "reconstructed")}
                assert Source(**said) == source
                assert_attested(everything, source, chain, before[chain], after[chain])
                kinds.add((source.corpus, source.mirrored, source.reversed))
    assert {corpus for corpus, _, _ in kinds} == {"mine", "other"}
    assert any(is_mirrored for _, is_mirrored, _ in kinds)
    assert any(is_reversed for _, _, is_reversed in kinds)


def test_what_a_corpus_was_made_of_is_said(everything: Engine) -> None:
    origins = json.loads(json.dumps(everything.info(), allow_nan=False))["origins"]
    assert [(row["corpus"], row["mirrored"], row["reversed"]) for row in origins] == [
        *(("mine", False, False), ("other", False, False), ("other", True, False), ("mine", True, False)),
        *(("mine", False, True), ("other", False, True), ("other", True, True), ("mine", True, True)),
    ]
    back = math.exp(-1.0)
    assert [row["weight"] for row in origins] == pytest.approx([1.0, 0.3, 0.3, 1.0, back, 0.3 * back, 0.3 * back, back])
    assert {(row["clips"], row["postures"], row["moves"]) for row in origins} == {(2, 28, 26)}
    assert sum(row["share"] for row in origins) == pytest.approx(1.0)
    assert origins[1]["share"] == pytest.approx(0.3 / (2.6 * (1.0 + back)))
    assert everything.info()["moves"] == sum(row["moves"] for row in origins)
    assert everything.check(20)["origins"] == origins
    assert [entry["name"] for entry in everything.info()["clips"]][:4] == ["solo", "trio", "other: solo", "other: duet"]


def test_what_is_loaded_answers_as_what_was_saved(everything: Engine, tmp_path: Path) -> None:
    everything.save(tmp_path / "corpora" / "mine")
    loaded = Engine.load("mine", tmp_path)
    assert loaded.info() == everything.info()
    assert loaded.corpus.clips == everything.corpus.clips
    for name in ("begins", "ends", "seconds", "weights"):
        np.testing.assert_array_equal(getattr(loaded.corpus.moves, name), getattr(everything.corpus.moves, name))
    np.testing.assert_array_equal(loaded.corpus.weights, everything.corpus.weights)
    for one, other in zip(tweens(loaded), tweens(everything), strict=True):
        assert one.sources == other.sources
        assert one.problem() == other.problem()
        np.testing.assert_array_equal(one.motion.rotations, other.motion.rotations)
    cpds = (engine.network().get_cpds("left_knee").get_values() for engine in (loaded, everything))
    np.testing.assert_array_equal(*cpds)


def test_a_manifest_that_lacks_an_array_or_has_no_such_weight_is_refused(everything: Engine, tmp_path: Path) -> None:
    everything.save(tmp_path / "old")
    manifest = json.loads((tmp_path / "old" / "manifest.json").read_text("utf-8"))
    del manifest["arrays"]["transitions.arrives"]
    (tmp_path / "old" / "manifest.json").write_text(json.dumps(manifest), "utf-8")
    with pytest.raises(FormatError, match=r"lists no array transitions\.arrives; build the corpus again: motionmind"):
        Engine.load(str(tmp_path / "old"))
    everything.save(tmp_path / "bent")
    clips = entries(tmp_path / "bent")
    for key, value in (("weight", 0.0), ("weight", -2.0), ("reverse", -1.0), ("reverse", 1e9)):
        put_entries(tmp_path / "bent", [clips[0], clips[1] | {key: value}, *clips[2:]])
        with pytest.raises(CorpusError, match="trio weighs"):
            Engine.load(str(tmp_path / "bent"))


def test_a_mirrored_corpus_is_the_same_on_both_sides() -> None:
    """As many states, moves and turns on one side as on the other, each with its image's weight."""
    engine = Engine.fit([dance("solo", 1), dance("duet", 2)], mirror=True, discretization=Codebook(20.0))
    graph, names = engine.grammar.transitions, human23().names
    partners = find_sides(human23()).partners
    for chain, name in enumerate(names):
        if not name.startswith("left_"):
            continue
        assert engine.space.sizes[chain] == engine.space.sizes[partners[chain]]
        one, other = (
            sorted(graph.counts[graph.indptr[graph.starts[side]] : graph.indptr[graph.starts[side + 1]]])
            for side in (chain, partners[chain])
        )
        assert one == other
    turns: dict[int, float] = defaultdict(float)
    facing, size = len(names), int(engine.space.sizes[-1])
    first = int(graph.starts[facing])
    for edge in range(graph.indptr[first], graph.indptr[first + 1]):
        turns[int(graph.targets[edge])] += float(graph.counts[edge])
    assert all(turns[turn] == turns[-turn % size] for turn in list(turns))


def test_gathered_clips_are_mirrored_and_priced() -> None:
    corpus = gather("people", [dance("solo", 1)], mirror=True, reverse=2.0)
    assert [(clip.label, clip.weight, clip.reverse) for clip in corpus.clips] == [
        ("solo", 1.0, 2.0),
        ("solo (mirrored)", 1.0, 2.0),
    ]
    moves = corpus.moves
    assert len(moves.begins) == 4 * 13
    np.testing.assert_array_equal(np.abs(moves.ends - moves.begins), 1)
    assert np.array_equal(moves.weights, np.repeat([1.0, math.exp(-2.0)], 26))
    np.testing.assert_allclose(moves.seconds, 0.2)


# --- the command line -------------------------------------------------------------------------------------------------


def test_a_corpus_is_built_of_files_and_another_corpus_and_tells_it(run: Run) -> None:
    write_motion("walk.json", dance("walk", 1))
    write_motion("spin.json", dance("spin", 2))
    assert run("corpus", "build", "theirs", "spin.json", "--rate", 5).code == 0
    built = run(
        *("corpus", "build", "mine", "walk.json", "--rate", 5, "--tolerance", 20),
        *("--mirror", "--reverse", 1.5, "--mix", "theirs:0.3"),
    )
    assert built.code == 0, built.err
    assert built.err == ""
    table = [line for line in built.out.splitlines() if line.startswith(("learned from", "mine (", "mine ", "theirs"))]
    assert [line.split("  ")[0] for line in table] == [
        *("learned from", "mine", "theirs", "mine (mirrored)", "theirs (mirrored)", "mine (reversed)"),
        *("theirs (reversed)", "mine (mirrored, reversed)", "theirs (mirrored, reversed)"),
    ]
    assert f"{100 / (2.6 * (1.0 + math.exp(-1.5))):.1f}%" in table[1]
    for command in ("check", "info"):
        assert "theirs (mirrored, reversed)" in run("corpus", command, "mine").out
        origins = json.loads(run("corpus", command, "mine", "--json").out)["origins"]
        assert {(row["corpus"], row["weight"]) for row in origins if not row["reversed"]} == {
            ("mine", 1.0),
            ("theirs", 0.3),
        }
    write_posture("A.json", dance("walk", 1).posture(10))
    write_posture("B.json", dance("spin", 2).posture(3))
    tween = run("tween", "A.json", "B.json", "--corpus", "mine", "--report", "report.json", "--details")
    assert tween.code == 0
    assert re.search(r" seen in (mine, theirs|theirs, mine)\b", tween.out)
    assert "moves were seen in the corpus: " in tween.out
    sources = [source for row in json.loads(Path("report.json").read_text("utf-8"))["sources"] for source in row]
    assert {source["corpus"] for source in sources if source} == {"mine", "theirs"}


def test_a_corpus_is_built_of_other_corpora_alone(run: Run, tmp_path: Path) -> None:
    write_motion("walk.json", dance("walk", 1))
    assert run("corpus", "build", "walks", "walk.json").code == 0
    built = run("corpus", "build", "both", "--mix", "ballet", "--mix", f"{tmp_path / 'home' / 'corpora' / 'walks'}:0.5")
    assert built.code == 0, built.err
    info = json.loads(run("corpus", "info", "both", "--json").out)
    assert [(row["corpus"], row["weight"]) for row in info["origins"]] == [("ballet", 1.0), ("walks", 0.5)]
    assert info["clips"][-1]["name"] == "walks: walk"
    assert (info["skeleton"], info["facing"], info["rate"]) == ("human23", "free", None)


def test_a_stranger_from_a_file_is_mirrored(run: Run) -> None:
    body = renamed("suffix of Blender")
    write_motion("walk.bvh", replace(dance("walk", 1), skeleton=body))
    built = run("corpus", "build", "strangers", "walk.bvh", "--mirror")
    assert built.code == 0, built.err
    states = json.loads(run("corpus", "info", "strangers", "--json").out)["states"]
    assert "knee.L" in states
    assert all(states[name] == states[name.replace(".L", ".R")] for name in states if name.endswith(".L"))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("corpus build mine", r"Missing argument 'FILES\.\.\.', or --mix"),
        (
            "corpus build mine walk.json --mix theirs:some",
            "--mix theirs:some: give a corpus and its weight, such as ball",
        ),
        ("corpus build mine walk.json --mix theirs:", "--mix theirs:: give a corpus and its weight"),
        ("corpus build mine walk.json --mix theirs:0", "the weight of corpus 'theirs' must be from 1e-06"),
        ("corpus build mine walk.json --mix theirs:-2", "the weight of corpus 'theirs' must be from 1e-06"),
        ("corpus build mine walk.json --mix theirs:nan", "the weight of corpus 'theirs' must be from 1e-06"),
        ("corpus build mine walk.json --mix theirs --mix theirs:2", "--mix theirs:2: theirs is given twice"),
        ("corpus build mine walk.json --mix nobody:0.3", "no corpus 'nobody'; there are ballet, "),
        ("corpus build theirs walk.json --mix theirs:0.3", "corpus 'theirs' cannot be mixed into itself"),
        ("corpus build mine walk.json --mix theirs", "are of different rates .frame by frame, 5 postures a second"),
        ("corpus build mine walk.json --mix theirs --rate 10", "has 5 postures a second; 10 cannot be made of them"),
        (
            "corpus build mine pole.json --mix theirs --rate 5",
            "corpus 'theirs' is on another skeleton than pole: human23",
        ),
        (
            "corpus build mine pole.json --mirror",
            "pole: pole cannot be mirrored: flag has no partner: it stands 1 m off",
        ),
        ("corpus build mine walk.json --reverse -1", "'--reverse': -1.0 is not in the range"),
        ("corpus build mine walk.json --reverse nan", "'--reverse': nan is not a finite number"),
        ("corpus build mine --reverse walk.json", "'--reverse': 'walk.json' is not a valid"),
    ],
)
def test_what_cannot_be_built_is_one_line(line: str, message: str, run: Run, tmp_path: Path) -> None:
    write_motion("walk.json", dance("walk", 1))
    aside = replace(POLE, offsets=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    write_motion("pole.json", replace(walk("pole", ONE), skeleton=aside))
    assert run("corpus", "build", "theirs", "walk.json", "--rate", 5).code == 0
    before = sorted(tmp_path.rglob("*"))
    ran = run(*line.split())
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.count("\n") == 1
    assert ran.err.startswith("error: ")
    assert re.search(message, ran.err)
    assert sorted(tmp_path.rglob("*")) == before
