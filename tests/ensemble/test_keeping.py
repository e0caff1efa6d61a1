"""Dancers who keep a distance: by the least shifts, as trying all of them finds; and what cannot be kept."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind.ensemble.dancers import Dancer, Ensemble, find_approaches
from motionmind.ensemble.formations import places_in
from motionmind.ensemble.keeping import MAX_KEPT_DANCERS, Shift, keep_apart
from motionmind.ensemble.reading import read_ensemble
from motionmind.ensemble.writing import format_ensemble
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

PIECE = ballet_clip("temps-lie")


def nearest(ensemble: Ensemble) -> float:
    return find_approaches(ensemble.motions())[0].metres


def canon(count: int, spacing: float, beat: float = 2.0, formation: str = "line") -> Ensemble:
    places = places_in(formation, count, spacing)
    dancers = (Dancer(f"d{i}", PIECE, (float(x), float(z)), 0.0, beat * i) for i, (x, z) in enumerate(places))
    return Ensemble("canon", tuple(dancers), 60.0)


def drifting(seed: int, count: int = 3) -> Ensemble:
    """Dancers who turn different ways, each drifting over the floor, for 1.2 s at 25 frames a second."""
    rng = np.random.default_rng(seed)
    frames, dancers = np.arange(31), []
    for i in range(count):
        rotations = np.repeat(PIECE.rotations[4:5], 31, axis=0)
        rotations[:, 0] = rot.mul(rot.about_vertical(frames * rng.uniform(-0.1, 0.1)), rotations[:, 0])
        root = PIECE.root[4] + np.outer(frames, [*(rng.uniform(-0.02, 0.02, 3) * [1, 0, 1])])
        piece = replace(PIECE, rotations=rotations, root=root, times=frames / 25.0)
        place = float(rng.uniform(-0.7, 0.7)), float(rng.uniform(-0.7, 0.7))
        dancers.append(Dancer(f"d{i}", piece, place, 0.0, float(rng.integers(1, 3))))
    return Ensemble("drift", tuple(dancers), 60.0)


@pytest.mark.long
@pytest.mark.parametrize(("seed", "counts"), [(0, 0), (3, 0), (4, 0), (8, 0), (10, 0), (11, 1)])
def test_the_shifts_are_the_least_of_all(seed: int, counts: int) -> None:
    ensemble = drifting(seed)
    metres = nearest(ensemble) + 0.05
    steps = (-1, 0, 1)
    choices = [Shift(e, (0.1 * x, 0.1 * z)) for e, x, z in product(range(-counts, counts + 1), steps, steps)]
    times = np.arange(0.0, 5.0, 1.0 / 25.0)
    moved = [
        [
            replace(
                dancer,
                place=(dancer.place[0] + one.place[0], dancer.place[1] + one.place[1]),
                entry=dancer.entry + one.counts,
            ).at(times)
            for one in choices
        ]
        for dancer in ensemble.dancers
    ]
    keeps = {
        (i, k): np.array([[find_approaches([a, b])[0].metres >= metres for b in moved[k]] for a in moved[i]])
        for i, k in combinations(range(3), 2)
    }
    weights = np.array([one.weight for one in choices])
    total = weights[:, None, None] + weights[None, :, None] + weights
    total[~(keeps[0, 1][:, :, None] & keeps[0, 2][:, None, :] & keeps[1, 2][None])] = np.inf
    if seed == 0:
        assert np.isinf(total.min())
        with pytest.raises(MotionMindError, match="no shifts within"):
            keep_apart(ensemble, metres, steps=1, counts=counts)
        return
    kept = keep_apart(ensemble, metres, steps=1, counts=counts)
    assert kept.is_least
    assert sum(one.weight for one in kept.shifts) == pytest.approx(float(total.min()))
    assert nearest(kept.ensemble) >= metres - 1e-6


def test_dancers_keep_their_distance_by_the_shifts_that_are_reported() -> None:
    ensemble = canon(3, 1.0)
    assert nearest(ensemble) < 0.5
    kept = keep_apart(ensemble, 0.5)
    assert nearest(kept.ensemble) >= 0.5 - 1e-6
    for dancer, other, shift in zip(ensemble.dancers, kept.ensemble.dancers, kept.shifts, strict=True):
        assert other.entry == pytest.approx(dancer.entry + shift.counts)
        np.testing.assert_allclose(other.place, np.add(dancer.place, shift.place))


def test_who_keeps_a_distance_already_stays() -> None:
    ensemble = canon(3, 4.0)
    kept = keep_apart(ensemble, 0.6)
    assert kept.is_least
    assert all(one.weight == 0.0 for one in kept.shifts)


def test_nobody_leaves_the_stage_or_enters_before_count_one() -> None:
    ensemble = canon(2, 0.6, beat=0.0)
    reach = max(float(np.abs(motion.root[:, 0]).max()) for motion in ensemble.motions())
    small = replace(ensemble, stage=(2.0 * reach + 0.1, 20.0))
    kept = keep_apart(small, 0.4)
    assert max(float(np.abs(motion.root[:, 0]).max()) for motion in kept.ensemble.motions()) <= reach + 0.05 + 1e-6
    assert min(dancer.entry for dancer in kept.ensemble.dancers) >= 0.0


def test_a_spent_budget_is_said() -> None:
    assert not keep_apart(canon(4, 1.0), 0.5, nodes=12).is_least


def test_shifts_found_for_a_larger_distance_are_not_said_to_be_the_least() -> None:
    rng = np.random.default_rng(10)
    dancers = []
    for i in range(2):  # who pass each other in a hurry, at a tempo whose counts fall between frames
        way = np.outer(np.arange(-15, 16), rng.uniform(-0.12, 0.12, 3) * [1.0, 0.0, 1.0])
        rotations = np.repeat(PIECE.rotations[4:5], 31, axis=0)
        piece = replace(PIECE, rotations=rotations, root=PIECE.root[4] + way, times=np.arange(31) / 25.0)
        place = float(way[0, 0]) + 0.3 * i, float(way[0, 2])
        dancers.append(Dancer(f"d{i}", piece, place, 0.0, float(rng.integers(1, 3))))
    ensemble = Ensemble("passing", tuple(dancers), 97.0)
    sought = {metres: keep_apart(ensemble, metres, steps=1, counts=2) for metres in (0.257, 0.3)}
    assert all(nearest(kept.ensemble) >= metres - 1e-6 for metres, kept in sought.items())
    assert [kept.is_least for kept in sought.values()] == [False, True]


@pytest.mark.parametrize(
    ("ensemble", "metres", "words"),
    [
        (replace(canon(2, 0.5), stage=(1.0, 1.0)), 1.5, "no shifts within 1 m and 4 counts keep all 1.5 m apart; d0"),
        (canon(2, 1.0), 0.0, "keep takes from 0.01 to 2 m, not 0"),
        (canon(2, 1.0), float("nan"), "not nan"),
        (canon(MAX_KEPT_DANCERS + 1, 1.0), 0.5, "up to 24 dancers"),
    ],
)
def test_what_cannot_be_kept_is_said(ensemble: Ensemble, metres: float, words: str) -> None:
    with pytest.raises(MotionMindError, match=words):
        keep_apart(ensemble, metres)


CHANGED = """piece = "ballet/temps-lie"
tempo = 108
piece_tempo = 120
canon = 2
formation = "grid"
facing = "centre"
mirror = true
stage = [8, 6]
[[dancer]]
name = "A \\"b\\""
[[dancer]]
[[dancer]]
[[change]]
at = 9
counts = 4
formation = "circle"
"""


def test_a_written_ensemble_is_read_again(tmp_path: Path) -> None:
    (tmp_path / "one.toml").write_text(CHANGED, "utf-8")
    one = read_ensemble(tmp_path / "one.toml", lambda _: PIECE)
    (tmp_path / "two.toml").write_text(format_ensemble(one, str), "utf-8")
    two = read_ensemble(tmp_path / "two.toml", lambda _: PIECE)
    assert (one.tempo, one.stage) == (two.tempo, two.stage)
    for first, second in zip(one.motions(), two.motions(), strict=True):
        assert first.name == second.name
        np.testing.assert_allclose(second.root, first.root, atol=1e-6)
        np.testing.assert_allclose(second.rotations, first.rotations, atol=1e-6)


@pytest.mark.parametrize("name", ["Zo\u00eb \U0001fa70", "a\x7fb", "tab\t \\ \u2028"])
def test_names_and_long_paths_are_read_again(tmp_path: Path, name: str) -> None:
    piece = f"{'deep/' * 60}{name}.json"
    one = Ensemble("one", (Dancer(name, PIECE, (0.0, 0.0), source=piece),))
    (tmp_path / "one.toml").write_text(format_ensemble(one, str), "utf-8")
    (dancer,) = read_ensemble(tmp_path / "one.toml", lambda _: PIECE).dancers
    assert (dancer.name, dancer.source) == (name, piece)


def test_a_path_that_is_not_utf_8_is_refused_before_writing() -> None:
    one = Ensemble("one", (Dancer("a", PIECE, (0.0, 0.0), source="\udcff.json"),))
    with pytest.raises(MotionMindError, match=r"udcff.json'.*: cannot be written in TOML, which is UTF-8"):
        format_ensemble(one, str)


def test_convert_writes_the_ensemble_and_says_what_moved(run: Run) -> None:
    Path("sub").mkdir()
    assert run("convert", "ballet/temps-lie", "piece.json").code == 0
    text = 'piece = "piece.json"\ntempo = 120\ncanon = 2\nspacing = 1.2\n[[dancer]]\nname = "Anna"\n[[dancer]]\n'
    Path("duo.toml").write_text(text, "utf-8")
    ran = run("convert", "duo.toml", "sub/apart.toml", "--keep", "0.6")
    assert ran.code == 0, ran.err
    assert ran.out.startswith("sub/apart.toml: all at least 0.6 m apart; no lighter shifts do")
    assert "moved     " in ran.out
    assert " cm " in ran.out
    again = run("convert", "sub/apart.toml", "again.toml", "--keep", "0.6")
    assert again.out == "again.toml: all at least 0.6 m apart; nobody had to move\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("convert", "duo.toml", "duo.glb", "--keep", "0.6"), ".toml"),
        (("convert", "duo.toml", "duo.toml", "--keep", "0.6"), "duo.toml"),
        (("convert", "ballet/jump", "duo.toml", "--keep", "0.6"), "is not one"),
        (("convert", "duo.toml", "out.toml", "--keep", "2", "--fps", "3"), "--fps is not for"),
        (("convert", "duo.toml", "out.toml", "--keep", "1.9"), "keep all 1.9 m apart"),
    ],
)
def test_what_cannot_be_written_is_refused(run: Run, arguments: tuple[str, ...], words: str) -> None:
    text = 'piece = "ballet/jump"\nspacing = 0.1\nstage = [1, 1]\n[[dancer]]\n[[dancer]]\n'
    Path("duo.toml").write_text(text, "utf-8")
    ran = run(*arguments)
    assert (ran.code, ran.out) == (2, "")
    assert words in ran.err
    assert Path("duo.toml").read_text("utf-8") == text
    assert not Path("out.toml").exists()
