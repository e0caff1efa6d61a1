"""Variations within limits: stretches that are long enough, insertions that take no more than their share."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given, settings
from hypothesis import strategies as st

from motionmind._typing import Ints, Singles
from motionmind.chaos.flows import FLOWS, find_flow
from motionmind.chaos.reorder import Itinerary, reorder
from motionmind.cli.variations import print_seams_beyond
from motionmind.errors import FormatError, MotionMindError
from motionmind.formats import write_motion
from motionmind.learned.plausibility import MEASURES
from motionmind.tween.engine import Engine
from motionmind.variation.departure import departure
from motionmind.variation.insertion_times import estimate_insertions, estimate_pairs
from motionmind.variation.piece import Piece
from motionmind.variation.seams import TransitionTest, judge_transitions
from motionmind.variation.stretches import cheapest_order
from motionmind.variation.variation import Variation, vary
from motionmind.variation.variation_json import read_variation, write_variation


@pytest.fixture(scope="module")
def karate() -> Engine:
    return Engine.load("karate")


@pytest.fixture(scope="module")
def kata(karate: Engine) -> Piece:
    clip = next(one for one in karate.corpus.clips if one.name == "heian-shodan")
    return Piece.of(karate.corpus.motion(clip), facing=karate.corpus.facing)


@pytest.fixture(scope="module")
def short(kata: Piece) -> Piece:
    """The first half of it."""
    return Piece.of(kata.motion.slice(0, 56), facing=kata.facing)


@pytest.fixture(scope="module")
def within(kata: Piece, karate: Engine) -> Variation:
    """A variation of the kata of which insertions take 0.3 of the time at most."""
    return vary(kata, karate, inserted=0.3, alternatives=1)


def stretches(order: Ints) -> list[int]:
    """Numbers of postures from each seam of an order to the next, its ends included; stays are no new postures."""
    lengths = [1]
    for i, k in pairwise(order):
        if k == i + 1:
            lengths[-1] += 1
        elif k != i:
            lengths.append(1)
    return lengths


# --- the cheapest order ---------------------------------------------------------------------------------------------


def course_of(sites: list[int], points: list[int]) -> Itinerary:
    where = (np.array(sites, dtype=float)[:, None], np.array(points, dtype=float)[:, None])
    return Itinerary(*where, reorder(*where))


def price_of(course: Itinerary, order: Ints, seconds: Singles, charge: float) -> float:
    """What an order costs, by the definition."""
    scale = np.sqrt(np.sum((course.sites - course.sites.mean(axis=0)) ** 2) / len(course.sites))
    off, least = (np.abs(course.points - course.sites[which])[:, 0] for which in (order, course.indices))
    seams = sum(float(seconds[i, k]) for i, k in pairwise(order) if k not in (i, i + 1))
    return float((off - least).sum() / scale + charge * seams)


@settings(max_examples=60, deadline=None)
@given(
    sites=st.lists(st.integers(0, 40), min_size=2, max_size=5, unique=True),
    points=st.lists(st.integers(0, 40), min_size=2, max_size=5),
    stretch=st.integers(1, 3),
    charge=st.sampled_from([0.0, 0.1, 1.0]),
    seed=st.integers(0, 99),
)
def test_no_order_with_such_stretches_is_cheaper(
    sites: list[int], points: list[int], stretch: int, charge: float, seed: int
) -> None:
    course = course_of(sites, points)
    seconds = np.random.default_rng(seed).integers(0, 5, (len(sites), len(sites))).astype(np.float32)
    stays = np.diff(course.indices) == 0
    allowed = []
    for order in map(np.array, product(range(len(sites)), repeat=len(points))):
        begins = np.flatnonzero(~np.isin(np.diff(order), (0, 1))) + 1
        firm = [n for begin in (0, *begins) for n in range(begin, begin + stretch - 1)]
        stayed = np.flatnonzero(np.diff(order) == 0)
        if min(stretches(order)) >= stretch and stays[stayed].all() and not set(firm) & set(stayed.tolist()):
            allowed.append(price_of(course, order, seconds, charge))
    if not allowed:
        with pytest.raises(MotionMindError, match=f"in stretches of {stretch} at least: the piece has {len(sites)}"):
            cheapest_order(course, seconds, charge, stretch)
        return
    found = cheapest_order(course, seconds, charge, stretch)
    assert min(stretches(found)) >= stretch
    assert price_of(course, found, seconds, charge) == pytest.approx(min(allowed), abs=1e-5)


@pytest.mark.parametrize("flow", sorted(FLOWS))
def test_without_price_and_stretches_it_is_the_trajectorys_own_order(flow: str, kata: Piece) -> None:
    np.testing.assert_array_equal(
        vary(kata, flow=find_flow(flow), nudge=0.3, stretch=1).postures,
        vary(kata, flow=find_flow(flow), nudge=0.3).order,
    )


# --- estimates ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("whole_body", [False, True])
def test_seams_that_a_corpus_knows_are_estimated_to_insert_nothing_and_no_others(
    short: Piece, karate: Engine, whole_body: bool
) -> None:
    seconds = estimate_insertions(short, TransitionTest(karate, whole_body))
    pairs = [(i, k) for i in range(0, len(short), 8) for k in range(len(short))]
    for one in judge_transitions(short, pairs, karate, whole_body):
        assert one.is_abrupt == (seconds[one.start, one.end] > 0.0), (one.start, one.end)
    assert 0.0 < (seconds == 0.0).mean() < 0.5


def test_pairs_of_postures_are_estimated_like_all_of_them(short: Piece, karate: Engine) -> None:
    test = TransitionTest(karate)
    seconds = estimate_insertions(short, test)
    chosen = [(i, k) for i in range(0, len(short), 7) for k in range(0, len(short), 3)]
    pairs = [(short.ends(i, i)[0], short.ends(k, k)[0], float(short.durations[i])) for i, k in chosen]
    np.testing.assert_allclose(estimate_pairs(pairs, test), [seconds[pair] for pair in chosen], rtol=1e-5)
    assert estimate_pairs([], test).shape == (0,)


# --- variations -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("flow", ["lorenz", "rossler"])
@pytest.mark.parametrize(("share", "stretch"), [(0.3, None), (0.3, 1), (0.1, 2), (0.0, 4), (1.0, 8)])
def test_limits_hold(short: Piece, karate: Engine, flow: str, share: float, stretch: int | None) -> None:
    found = vary(short, karate, flow=find_flow(flow), inserted=share, stretch=stretch, alternatives=1)
    assert min(stretches(found.postures)) >= (stretch or 4)
    inserted = sum(seam.insertion.motion.times[-1] for seam in found.seams if seam.insertion)
    seconds = found.motion().times[-1]
    assert inserted / seconds <= share + 1e-9
    counts = found.report()["counts"]
    assert counts["inserted_share"] == pytest.approx(inserted / seconds, abs=1e-6)
    assert counts["departed"] == departure(found.postures)
    assert counts["abrupt"] == counts["unjudged"] == 0
    assert counts["departed"] > 0.0 or share == 0.0


@pytest.mark.long
def test_of_insertions_no_more_is_given_up_than_needed(kata: Piece, karate: Engine) -> None:
    def varied(inserted: float | None = None) -> Variation:
        return vary(kata, karate, nudge=0.3, stretch=2, alternatives=1, length=70, inserted=inserted)

    free = varied()
    share = free.report()["counts"]["inserted_share"]
    assert share > 0.3
    np.testing.assert_array_equal(varied(inserted=share + 0.01).postures, free.postures)
    some, few = (varied(inserted=one) for one in (0.3, 0.1))
    numbers = [sum(seam.insertion is not None for seam in one.seams) for one in (few, some, free)]
    assert numbers == sorted(set(numbers))
    assert len(few.seams) > 0.5 * len(free.seams)  # those that need no insertion stay


def test_whoever_ends_the_smoothing_gets_an_order_whose_seams_are_smoothed_later(short: Piece, karate: Engine) -> None:
    ended = vary(short, karate, inserted=0.3, alternatives=1, watch=lambda _: True)
    assert min(stretches(ended.postures)) >= 4
    assert all(seam.transition for seam in ended.seams)
    assert any(seam.transition and seam.transition.is_pending for seam in ended.seams)
    later = ended.smooth(karate, alternatives=1)
    assert not any(seam.is_abrupt for seam in later.seams)
    np.testing.assert_array_equal(later.postures, ended.postures)


def test_a_variation_within_limits_is_read_as_it_was_written(kata: Piece, within: Variation, tmp_path: Path) -> None:
    found = within
    for name in ("a.json", "b.json"):
        write_variation(tmp_path / name, found)
        found = read_variation(tmp_path / name)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert found.report()["limits"] == {"inserted": 0.3, "stretch": 4}
    file = json.loads((tmp_path / "a.json").read_bytes())
    file["variation"]["kept"]["order"][3] = len(kata)
    (tmp_path / "a.json").write_text(json.dumps(file))
    with pytest.raises(FormatError, match="order must name postures of the piece, 0 to 108"):
        read_variation(tmp_path / "a.json")
    write_variation(tmp_path / "free.json", vary(kata, nudge=0.3))
    assert b'"kept"' not in (tmp_path / "free.json").read_bytes()


@pytest.mark.long
def test_what_cannot_be_reached_is_refused_in_a_line(
    kata: Piece, karate: Engine, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("motionmind.plots.portrait.N_SHEET_STEPS", 20_000)  # which are drawn quickly
    for options, message in (
        ({"inserted": 0.3}, "inserted needs a corpus"),
        ({"inserted": 1.5, "engine": karate}, "must be from 0 to 1, not 1.5"),
        ({"stretch": 0}, "stretch must be a whole number from 1, not 0"),
        ({"stretch": 110}, "stretch must be at most 109, the postures of piece and variation, not 110"),
        ({"stretch": 100, "length": 150}, "no variation of 150 postures in stretches of 100 at least"),
        ({"stretch": 4, "depart": 0.6}, "depart 0.6 cannot be reached in stretches of 4 postures"),
        ({"stretch": 4, "length": 5000}, "up to 4,000 postures, not of 5,000"),
    ):
        with pytest.raises(MotionMindError, match=message):
            vary(kata, **options)  # type: ignore[arg-type]
    quick = ("--alternatives", 1, "--length", 20)
    ran = run("vary", "ballet/promenade", "--inserted", 0.3, *quick, "-o", "v.json")
    assert ran.code == 0
    assert "limits: at most 30% inserted, stretches of at least 4 postures" in ran.out
    assert "insertions take" not in ran.err
    cut = run("review", "v.json", "--cut", "1..2", "--paste", 8, "-o", "cut.json", "--list")
    assert "limits: at most 30% inserted; " in cut.out
    smoothed = run("review", "cut.json", "--smooth", "ballet", "--alternatives", 1, "--list")
    assert smoothed.code == 0
    assert "kept" not in smoothed.out
    ran = run("vary", "ballet/promenade", "--depart", 0.25, *quick, "-o", "v.json")
    assert " of the time: --inserted 0.3 keeps more of the piece" in ran.err
    assert run("attractor", "--of", "v.json", "-o", "v.svg").code == 0
    other = ("--corpus", "ballet", "--to", 7, "--length", 15, "--stretch", 4, "--alternatives", 1)
    ran = run("vary", "karate/heian-shodan", "--inserted", 0, *other, "-o", "v.json")
    assert ran.code == 0
    assert "note: no order of 15 postures found with at most 0% of the time inserted; this one has " in ran.err
    write_motion("piece.json", ballet_clip("jump"))
    ran = run("vary", "piece.json", "--inserted", 0.1, "-o", "v.json")
    assert (ran.code, "--inserted needs --corpus" in ran.err) == (2, True)


def test_seams_that_a_viewer_would_wince_at_are_named(
    within: Variation, karate: Engine, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lenient, strict = (
        replace(karate, plausibility=replace(karate.plausibility, most=np.full(len(MEASURES), most)))
        for most in (1e9, 0.0)
    )
    print_seams_beyond(within, lenient)
    assert capsys.readouterr().out == ""
    monkeypatch.setattr("motionmind.learned.plausibility.NEGLIGIBLE_EXCESS", np.full(len(MEASURES), 1e-3))
    print_seams_beyond(within, strict)
    (slides,) = [line for line in capsys.readouterr().out.splitlines() if "feet slide" in line]
    values = {
        seam.number: strict.plausibility.shown(seam.insertion.motion)["sliding"].value or 0.0
        for seam in within.seams
        if seam.insertion
    }
    worst = max(values, key=lambda number: values[number])
    assert slides.startswith(f"warning   seam {worst}: feet slide: one moves near the floor for {values[worst]:.0%} of")
    assert run_of(slides) == sorted(number for number, value in values.items() if value > 1e-3 and number != worst)


def run_of(line: str) -> list[int]:
    """The other seams that a line names."""
    found = re.search(r"\(seams? ([\d, ]+), too\)", line)
    return list(map(int, found[1].split(", "))) if found else []
