"""Controls on the command line: made, printed, reviewed and drawn, or refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind.formats import read_motion, write_motion
from motionmind.plots import portrait
from motionmind.variation.orders import ORDERS

CONTROLS = ORDERS[1:]
MADE = {
    "shuffle": "by shuffle, seed 5",
    "chunks": "by chunks, seed 5, along rossler (a 0.2, b 0.2, c 5.7), nudge ",
    "quadrants": "by quadrants, seed 5",
    "dabby": "by dabby, along rossler (a 0.2, b 0.2, c 5.7), nudge ",
}
RANDOM = "error: a variation by {} is random, and has no trajectory to draw\n"


@pytest.fixture
def clip(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    write_motion("clip.json", ballet_clip("adagio").slice(0, 12))
    return "clip.json"


def test_every_control_has_words() -> None:
    assert MADE.keys() == {*CONTROLS}


@pytest.mark.long
@pytest.mark.parametrize("by", CONTROLS)
def test_a_control_is_made_printed_reviewed_and_drawn(
    by: str, clip: str, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(portrait, "N_SHEET_STEPS", 20_000)  # fewer strands, which are drawn quickly
    along = ("--attractor", "rossler", "--depart", 0.5) if "along" in MADE[by] else ()
    random = () if by == "dabby" else ("--seed", 5)
    asked = ("vary", clip, "--corpus", "ballet", "--alternatives", 1, "--by", by, *along, *random)
    done = run(*asked, "-o", "v.json", "-o", "v.npz")
    assert done.code == 0, done.err
    assert done.out.startswith(f"adagio, 12 postures, {MADE[by]}")
    assert "% of steps): " in done.out
    assert "\nchunk length in postures: " in done.out
    assert ("\nLyapunov exponent " in done.out) == bool(along)
    assert "no nudge found" not in done.err
    assert "--inserted" not in done.err
    report = run(*asked, "-o", "again.json", "--json").json | {"motion_sha256": None}
    assert report["control"] == {"by": by, "seed": 5 if random else None}
    assert run("review", "v.json", "--json").json == report
    assert Path("v.json").read_bytes() == Path("again.json").read_bytes()

    seams = [seam["number"] for seam in report["seams"] if seam["candidates"]]
    assert run("review", "v.json", "--approve", seams[0], "--discard", seams[1], "--sheet", "seams.png").code == 0
    listed = run("review", "v.json", "--list").out
    assert listed.startswith(f"adagio, 12 postures, {MADE[by]}")
    assert (" approved " in listed, " discarded " in listed) == (True, True)
    assert run("review", "v.json", "--undo", "--undo").code == 0
    assert Path("v.json").read_bytes() == Path("again.json").read_bytes()

    for command in (("render", "v.json", "-o", "v.png"), ("sheet", "v.json", "--postures", 4, "-o", "sheet.png")):
        assert run(*command).code == 0
    assert run("convert", "v.json", "v.bvh", "--fps", 30).code == 0
    assert len(read_motion("v.bvh")) > 12
    done = run("attractor", "--of", "v.json", "-o", "attractor.svg")
    if random:
        assert (done.code, done.err) == (2, RANDOM.format(by))
        assert not Path("attractor.svg").exists()
    else:
        assert done.code == 0
        assert "Dabby's mapping, in x alone" in Path("attractor.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--by shuffle --attractor rossler", "--attractor is not for --by shuffle, which follows no trajectory"),
        ("--by shuffle --parameter rho=28", "--parameter is not for --by shuffle, which follows no trajectory"),
        ("--by shuffle --skip 10", "--skip is not for --by shuffle, which follows no trajectory"),
        ("--by quadrants --nudge 0.1", "--nudge is not for --by quadrants, which follows no trajectory"),
        ("--by quadrants --depart 0.2", "--depart is not for --by quadrants, which follows no trajectory"),
        ("--by shuffle --start 1,1,20", "--start is not for --by shuffle, which follows no trajectory"),
        ("--by shuffle --step 0.01", "--step is not for --by shuffle, which follows no trajectory"),
        ("--by shuffle --transient 9", "--transient is not for --by shuffle, which follows no trajectory"),
        ("--by shuffle --stretch 3", "--stretch is not for --by shuffle, which follows no trajectory"),
        ("--by quadrants --inserted 0.3", "--inserted is not for --by quadrants, which follows no trajectory"),
        ("--by chunks --inserted 0.3", "--inserted is not for --by chunks, which comes in random order"),
        ("--by dabby --inserted 0.3", "--inserted is not for --by dabby, which has one order for each trajectory"),
        ("--by dabby --stretch 3", "--stretch is not for --by dabby, which has one order for each trajectory"),
        ("--by shuffle --length 9", "--length is not for --by shuffle, which goes through the piece once"),
        ("--by chunks --length 9", "--length is not for --by chunks, which goes through the piece once"),
        ("--by quadrants --length 9", "--length is not for --by quadrants, which goes through the piece once"),
        ("--by dice", "'dice' is not one of 'attractor', 'shuffle', 'chunks', 'quadrants', 'dabby'"),
        ("--by shuffle --seed -1", "-1 is not in the range x>=0"),
        ("--by dabby --seed 3", "--seed needs --corpus"),
        ("--seed 3", "--seed needs --corpus"),
    ],
)
def test_what_an_order_does_not_take_is_refused_in_one_line(
    arguments: str, message: str, clip: str, run: Run, tmp_path: Path
) -> None:
    done = run("vary", clip, *arguments.split(), "-o", "v.json")
    assert done.code == 2
    assert message in done.err
    assert len(done.err.strip().splitlines()) == 1
    assert not (tmp_path / "v.json").exists()


def test_without_a_corpus_nothing_is_judged_and_a_seed_is_taken(clip: str, run: Run) -> None:
    orders = []
    for seed in (0, 1):
        done = run("vary", clip, "--by", "shuffle", "--seed", seed, "-o", "v.json")
        assert done.code == 0
        assert "note: without --corpus, no transition is judged" in done.err
        report = run("review", "v.json", "--json").json
        assert report["counts"]["unjudged"] == len(report["seams"])
        orders.append(report["order"])
    assert orders[0] != orders[1]


def test_chunks_of_a_piece_that_is_not_left_are_the_piece(clip: str, run: Run) -> None:
    done = run("vary", clip, "--by", "chunks", "--nudge", 0, "-o", "v.json")
    assert done.code == 0
    assert done.err == "note: the variation keeps the piece's order: try --depart 0.25\n"


def test_a_studio_does_not_open_composed_postures(clip: str, run: Run, tmp_path: Path) -> None:
    pytest.importorskip("starlette")
    assert run("vary", clip, "--by", "quadrants", "-o", "v.json").code == 0
    done = run("studio", "v.json", "--no-browser", "--port", 0)
    assert (done.code, len(done.err.splitlines())) == (2, 1)
    assert "v.json: the studio arranges whole postures, which --by quadrants does not keep" in done.err
    assert not [*tmp_path.glob("*.motionmind")]
