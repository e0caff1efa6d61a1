"""What `vary` does without options: it leaves the piece's order, and inserts less than three tenths of the time."""

from __future__ import annotations

import numpy as np
import pytest
from command_line import Run

from motionmind.chaos.flows import FLOWS
from motionmind.tween.engine import Engine
from motionmind.variation.departure import departs, departure
from motionmind.variation.orders import DEFAULT_INSERTED_SHARE
from motionmind.variation.piece import Piece
from motionmind.variation.variation import Variation, vary

PIECES = {7: ("ballet", "jump"), 48: ("ballet", "adagio"), 131: ("macarena", "macarena")}  # by postures


def piece_of(count: int) -> tuple[Piece, Engine]:
    """The first postures of a bundled clip, and its corpus."""
    corpus, name = PIECES[count]
    engine = Engine.load(corpus)
    clip = next(one for one in engine.corpus.clips if one.name == name)
    return Piece.of(engine.corpus.motion(clip).slice(0, count), facing=engine.corpus.facing), engine


def share_inserted(variation: Variation) -> float:
    """The share of the movement's time that its insertions take, by its own clock."""
    inserted = sum(float(seam.insertion.motion.times[-1]) for seam in variation.seams if seam.insertion)
    return inserted / float(variation.motion().times[-1])


@pytest.mark.long
@pytest.mark.parametrize("flow", sorted(FLOWS))
@pytest.mark.parametrize("count", sorted(PIECES))
def test_a_variation_leaves_its_piece_and_is_mostly_the_piece(count: int, flow: str) -> None:
    piece, engine = piece_of(count)
    found = vary(piece, engine, flow=FLOWS[flow], alternatives=1)
    assert share_inserted(found) < 0.3
    assert departure(found.postures) > 0.04  # the fewest: macarena by chua, 6 of 130 steps
    assert np.mean(found.postures != np.arange(count)) > 0.1  # the fewest: the jump by lorenz, 1 of 7 places
    assert not any(seam.is_abrupt for seam in found.seams)


@pytest.mark.parametrize("flow", sorted(FLOWS))
@pytest.mark.parametrize("count", sorted(PIECES))
def test_without_a_corpus_it_leaves_its_piece_too(count: int, flow: str) -> None:
    piece, _ = piece_of(count)
    assert departs(vary(piece, flow=FLOWS[flow]).postures).any()


def test_where_an_insertion_takes_longer_than_the_piece_it_is_left_all_the_same(run: Run) -> None:
    """Seven postures of the macarena last two seconds, an insertion one and a half."""
    quick = ("--to", 6, "--alternatives", 1, "-o", "v.json")
    done = run("vary", "macarena", *quick)
    assert done.code == 0
    assert "1 of 6 steps leaves the piece's order; insertions take 5" in done.out
    (said,) = done.err.splitlines()
    assert said.startswith("note: no order of 7 postures found with at most 30% of the time inserted; this one has 5")
    assert "its shortest insertion takes 1." in said
    held = run("vary", "macarena", "--inserted", 0.3, *quick)  # an explicit limit is kept
    assert "note: within its limits the variation keeps the piece's order" in held.err


@pytest.mark.long
def test_a_chosen_nudge_is_named_and_a_given_one_is_followed_without_a_limit(run: Run) -> None:
    quick = ("vary", "ballet/promenade", "--length", 20, "--alternatives", 1, "-o", "v.json")
    done = run(*quick)
    report = run("review", "v.json", "--json").json
    counts, (nudge, *_) = report["counts"], report["course"]["nudge"]
    leave = f"{counts['seams']} of 19 steps leave{'s' * (counts['seams'] == 1)}"
    said = f"nudge {nudge:.2g}, chosen so that {leave} the piece's order; insertions take "
    assert f"\n{said}{counts['inserted_share']:.0%} of the time\n" in done.out
    assert "chosen" not in run("review", "v.json", "--list").out
    assert report["limits"] == {"inserted": DEFAULT_INSERTED_SHARE, "stretch": 4}
    for words in (("--nudge", 1), ("--depart", 0.25)):
        done = run(*quick, *words)
        assert ("chosen so that" in done.out) == ("--depart" in words)
        assert run("review", "v.json", "--json").json["limits"] is None
