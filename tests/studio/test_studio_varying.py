"""Laws of varying a piece of stretches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from motionmind.errors import MotionMindError
from motionmind.studio.attractor_map import drawn, map_of
from motionmind.studio.edits import Arrange, Block, Insert
from motionmind.studio.piece import State, apply
from motionmind.studio.varying import (
    Clock,
    Estimates,
    Kept,
    Proposal,
    Unit,
    Wanted,
    find_order,
    kept_in,
    units_of,
    vary_blocks,
)
from motionmind.variation.limits import inserted_share

PIECE = (Block("b1", "ballet/adagio", 0, 59), Block("b2", "m-0011223344556677", 10, 250, mirrored=True))


def clocks(key: str) -> Clock:
    """A clip with a posture every 0.2 s, and a recording of 120 frames a second."""
    return Clock(np.arange(60) / 5.0, None) if key.startswith("ballet") else Clock(np.arange(400) / 120.0, 5.0)


def vary(wanted: Wanted, blocks: tuple[Block, ...] = PIECE) -> Proposal:
    return vary_blocks(blocks, wanted, clocks, used={"b1", "b2"})


def frames(blocks: tuple[Block, ...]) -> list[tuple[str, bool, int]]:
    return [(b.source, b.mirrored, frame) for b in blocks for frame in range(b.first, b.last + 1)]


def test_units_hold_each_frame_once() -> None:
    units = units_of(PIECE, clocks)
    held = [(u.source, u.mirrored, frame) for u in units for frame in range(u.first, u.last + 1)]
    assert held == frames(PIECE)
    assert [u.last - u.first + 1 for u in units[60:-1]] == [24] * (len(units) - 61)  # 120 frames a second, 5 units


@pytest.mark.parametrize("flow", ["lorenz", "rossler"])
def test_no_departure_gives_the_piece_back(flow: str) -> None:
    assert vary(Wanted(flow=flow, nudge=0.0)).blocks == PIECE


@pytest.mark.parametrize("stretch", [1, 2, 4])
def test_departs_as_it_is_asked_to(stretch: int) -> None:
    little, much = (vary(Wanted(depart=depart, stretch=stretch)) for depart in (0.05, 0.2))
    assert little.order.departs < much.order.departs
    assert len(little.blocks) < len(much.blocks)
    assert len({block.id for block in much.blocks}) == len(much.blocks)
    assert set(frames(much.blocks)) <= set(frames(PIECE))


def test_kept_stretches_stay_in_their_places() -> None:
    first = vary(Wanted(depart=0.2))
    kept = tuple(Kept(block, place) for block, place in list(zip(first.blocks, first.places, strict=True))[2:9:3])
    again = vary(Wanted(depart=0.2, start=(10.0, 5.0, 40.0), kept=kept))
    found = dict(zip((block.id for block in again.blocks), zip(again.blocks, again.places, strict=True), strict=True))
    for one in kept:
        assert found[one.block.id] == (one.block, one.place)
    assert again.blocks != first.blocks
    rest = [block for block in again.blocks if block.id not in again.kept]
    held = set(frames(tuple(one.block for one in kept)))
    assert not held & set(frames(tuple(rest)))
    # What is kept of this one stays where it is in the next one, too.
    third = vary(Wanted(depart=0.1, kept=kept))
    assert again.kept == third.kept
    assert [b.id for b in third.blocks if b.id in third.kept] == [one.block.id for one in kept]


def test_a_stretch_of_the_piece_stays_where_it_is() -> None:
    blocks = (
        Block("a", "ballet/adagio", 0, 19),
        Block("b", "ballet/adagio", 20, 29),
        Block("c", "ballet/adagio", 30, 59),
    )
    (kept,) = kept_in(blocks, {"b"}, clocks)
    assert kept.place == 20
    found = vary(Wanted(depart=0.3, kept=(kept,)), blocks)
    at = found.blocks.index(blocks[1])
    assert found.places[at] == 20
    assert 0 < at < len(found.blocks) - 1


def test_a_run_ends_before_a_stretch_that_is_kept() -> None:
    kept = Block("k", "m-0011223344556677", 10, 33, mirrored=True)
    present = (Block("a", "ballet/adagio", 0, 19), kept, Block("b", "ballet/adagio", 20, 59))
    stands = kept_in(present, {"k"}, clocks)
    found = vary_blocks(PIECE[:1], Wanted(nudge=0.0, kept=stands), clocks, present=present)
    assert found.blocks == present


def test_what_was_varied_is_varied_from_its_first_order_again() -> None:
    found = vary(Wanted(depart=0.2))
    kept = kept_in(found.blocks, {found.blocks[3].id}, clocks)
    again = vary_blocks(PIECE, Wanted(depart=0.2, kept=kept), clocks, present=found.blocks, used={"b1", "b2"})
    assert found.blocks[3] in again.blocks
    back = vary_blocks(PIECE, Wanted(nudge=0.0), clocks, present=found.blocks)
    assert frames(back.blocks) == frames(PIECE)[: len(frames(back.blocks))]


def test_a_variation_is_an_edit_of_the_piece() -> None:
    state = State()
    for block in PIECE:
        state = apply(state, Insert(block.id, block.source, block.first, block.last, block.mirrored))
    found = vary(Wanted(depart=0.2))
    assert apply(state, Arrange(found.blocks)).blocks == found.blocks
    assert vary(Wanted(depart=0.2)).blocks == found.blocks  # the same wish gives the same


def test_a_nudge_is_the_one_of_the_command_line() -> None:
    from motionmind.chaos.flows import FLOWS
    from motionmind.chaos.reorder import itinerary

    order = find_order(Wanted(nudge=0.3), 80, 80)
    assert order.indices.tolist() == itinerary(FLOWS["lorenz"], 80, nudge=0.3).indices.tolist()


def test_a_start_on_the_map_is_where_the_piece_begins() -> None:
    point = tuple(map_of("lorenz")["points"][700])
    order = find_order(Wanted(start=point, nudge=0.1), 30, 30)
    assert drawn(order.piece)[0] == pytest.approx(point)


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        (Wanted(flow="opera"), "no attractor 'opera'"),
        (Wanted(flow="duffing"), "no attractor"),  # in four dimensions
        (Wanted(start=(1e12, 0.0, 0.0)), "diverges"),
        (Wanted(kept=kept_in(PIECE, {"b1", "b2"}, clocks)), "release"),
        (Wanted(kept=(Kept(PIECE[0], 0), Kept(PIECE[1], 50))), "choose them again"),
    ],
)
def test_what_cannot_be_varied(wanted: Wanted, words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        vary(wanted)


def test_insertions_are_limited_as_they_are_estimated() -> None:
    """Between the first half and the second seams insert much: with a limit there are fewer of them."""

    def insertions(units: Sequence[Unit]) -> Estimates:
        halves = np.arange(len(units)) < len(units) // 2
        return Estimates(np.where(halves[:, None] == halves, 0.1, 5.0).astype(np.float32), np.full(len(units), 0.2))

    def inserted(proposal: Proposal) -> float:
        estimates = insertions(units_of(PIECE, clocks))
        order = proposal.order.indices
        steps = np.diff(order)
        seams = np.where((steps != 0) & (steps != 1), estimates.seconds[order[:-1], order[1:]], 0.0)
        return inserted_share(seams, estimates.durations[order[:-1]])

    free, limited = (
        vary_blocks(PIECE, Wanted(depart=0.2, stretch=2, inserted=share), clocks, insertions=insertions)
        for share in (None, 0.2)
    )
    assert inserted(free) > 0.3
    assert 0.0 < inserted(limited) <= 0.2
    assert limited.order.nudge == free.order.nudge


def test_a_variation_that_has_become_the_piece_is_found_again() -> None:
    """Also where a stretch comes several times: each keeps its id."""
    wanted = Wanted(depart=0.3)
    first = vary(wanted)
    assert len({(b.source, b.first, b.last) for b in first.blocks}) < len(first.blocks)
    ids = {"b1", "b2", *(block.id for block in first.blocks)}
    again = vary_blocks(PIECE, wanted, clocks, present=first.blocks, total=first.count, used=ids)
    assert again.blocks == first.blocks
