"""Likeness: what a classifier sees of movement, how well it tells two kinds apart, and what is kept of a label."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from click.testing import CliRunner

from motionmind import Motion
from motionmind._typing import Floats
from motionmind.geometry import rotations as rot

if TYPE_CHECKING:
    from experiments.likeness.classify import Auc

ROOT = Path(__file__).parents[1]

pytestmark = [pytest.mark.long, pytest.mark.usefixtures("_importable")]


@pytest.fixture
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT))


def takes(frames: int) -> dict[str, Motion]:
    """The longest piece of each take of karate that has so many frames."""
    from experiments.material import movement

    return {take: max(pieces, key=len) for take, pieces in movement(None, "karate", frames).items()}


def seen_of(motions: list[Motion]) -> Floats:
    """Features [N, F] of movements of the same length."""
    from experiments.likeness.features import features

    rotations, root = np.stack([one.rotations for one in motions]), np.stack([one.root for one in motions])
    found = features(motions[0].skeleton, rotations, root, np.zeros(len(motions)))
    return np.stack(list(found.values()), axis=1)


# --- features ---------------------------------------------------------------------------------------------------------


def test_every_joint_is_in_one_group() -> None:
    from experiments.likeness.features import GROUPS, joints_of

    skeleton = next(iter(takes(60).values())).skeleton
    joints = [joint for group in GROUPS for joint in joints_of(skeleton, group)]
    assert sorted(joints) == list(range(len(skeleton)))


def test_features_know_no_place_direction_or_time() -> None:
    from dataclasses import replace

    from experiments.likeness.features import features, of_upper_body

    whole = next(iter(takes(200).values()))
    parts = [whole.slice(start, start + 61) for start in (20, 90)]
    turn = rot.about_vertical(1.2)
    moved = []
    for part in parts:
        turned = part.rotations.copy()
        turned[:, 0] = rot.mul(turn, turned[:, 0])
        moved.append(replace(part, rotations=-turned, root=rot.mul_vec(turn, part.root) + np.array([3.0, 0.0, -2.0])))
    np.testing.assert_allclose(seen_of(moved), seen_of(parts), atol=1e-9)
    np.testing.assert_allclose(seen_of(parts[::-1]), seen_of(parts)[[2, 3, 0, 1]], atol=1e-12)
    found = features(whole.skeleton, parts[0].rotations[None], parts[0].root[None], np.zeros(1))
    upper = [name for name in found if of_upper_body(name)]
    assert {name.split()[0] for name in upper} == {"spine", "head", "arms", "hands", "upper"}
    assert not any(word in name for name in found for word in ("jerk", "reversal", "time", "take", "frame"))


def test_the_upper_body_shows_nothing_of_the_rest() -> None:
    from dataclasses import replace

    from experiments.likeness.features import features, joints_of, of_upper_body

    whole = next(iter(takes(200).values()))
    part = whole.slice(20, 81)
    other = part.rotations.copy()
    for group in ("legs", "feet", "pelvis"):
        other[:, joints_of(whole.skeleton, group)] = whole.rotations[90:151][:, joints_of(whole.skeleton, group)]
    changed = replace(part, rotations=other, root=whole.root[90:151])
    one, two = (features(whole.skeleton, x.rotations[None], x.root[None], np.zeros(1)) for x in (part, changed))
    for name in one:
        same = np.allclose(one[name], two[name], atol=1e-9)
        assert same if of_upper_body(name) else not same or name.startswith("feet")


def test_smoothing_keeps_steady_turns_and_takes_off_noise() -> None:
    from experiments.likeness.features import smooth

    angle = 0.1 * np.arange(40)
    steady = np.stack([np.sin(angle / 2), 0 * angle, 0 * angle, np.cos(angle / 2)], axis=-1)[None, :, None]
    steady = steady if rot.IDENTITY[3] else np.roll(steady, 1, axis=-1)
    line = np.linspace([0.0, 1.0, 0.0], [2.0, 1.0, 1.0], 40)[None]
    flipped = steady * np.where(np.arange(40) % 3 == 0, -1.0, 1.0)[:, None, None]
    turned, moved = smooth(flipped, line)
    assert rot.angle(turned, steady)[:, 5:-5].max() < 1e-6
    assert rot.angle(turned, steady).max() < 0.01
    np.testing.assert_allclose(moved, line, atol=1e-12)
    noise = np.random.default_rng(0).normal(scale=0.02, size=(1, 40, 1, 3))
    shaken, _ = smooth(rot.mul(steady, rot.exp(noise)), line)
    assert rot.angle(shaken, steady).std() < 0.7 * np.linalg.norm(noise, axis=-1).std()


def test_pieces_are_cut_from_the_middle() -> None:
    from experiments.likeness.features import cut, cuts

    assert [cuts(frames) for frames in (18, 36, 60, 120)] == [[], [3], [0, 30], [0, 30, 60, 90]]
    frames = np.arange(61)[None] + 100 * np.arange(2)[:, None]
    assert cut(frames)[:, 0].tolist() == [0, 30, 100, 130]
    assert cut(frames).shape == (4, 31)


def told(danced: Floats, made: Floats, families: list[str], classifier: Callable[[], Any]) -> Auc:
    """How well pieces are told apart by what is learned from the others."""
    from experiments.likeness.classify import Sample, folds_of, lenient, told_apart

    folds = folds_of(families)
    fold, tested = np.array([folds[family] for family in families]), Sample(danced, made, families)
    return told_apart(tested, fold, lenient(tested, fold), classifier)


# --- classifiers ------------------------------------------------------------------------------------------------------


def test_what_is_the_same_cannot_be_told_apart_and_half_the_speed_can() -> None:
    from experiments.likeness.classify import CLASSIFIERS

    danced, slow, families = [], [], []
    for take, whole in takes(200).items():
        for start in range(0, len(whole) - 61, 30):
            danced.append(whole.slice(start, start + 61))
            slow.append(danced[-1].resample(60.0).slice(30, 91))
            families += [take, take]
    danced_seen, slow_seen = seen_of(danced), seen_of(slow)
    assert len(set(families)) > 2
    for make in CLASSIFIERS.values():
        same = told(danced_seen, danced_seen, families, make)
        assert same == (0.5, 0.5, 0.5)
        # Frames are counted at 30 a second, so that twice as many are half as fast.
        assert told(danced_seen, slow_seen, families, make).value > 0.75
    still = np.zeros_like(danced_seen)
    assert told(danced_seen, still, families, CLASSIFIERS["linear"]).value == pytest.approx(1.0)


def test_no_family_is_learned_from_and_tested() -> None:
    from experiments.likeness.classify import FOLDS, folds_of

    families = [f"family {k}" for k, size in enumerate((40, 3, 9, 17, 1, 22, 8)) for _ in range(size)]
    folds = folds_of(families)
    assert set(folds) == set(families)
    assert set(folds.values()) == set(range(FOLDS))
    assert np.bincount([folds[family] for family in families]).min() >= 9
    assert set(folds_of(["a", "b", "b"]).values()) == {0, 1}


def test_areas_are_those_of_scikit_learn_and_intervals_are_over_families() -> None:
    from sklearn.metrics import roc_auc_score

    from experiments.likeness.classify import auc_over_families, linear

    rng = np.random.default_rng(0)
    danced, made = rng.integers(8, size=60) / 8.0, rng.integers(3, 11, size=60) / 8.0
    families = [f"{k % 6}" for k in range(60)]
    found = auc_over_families(danced, made, families)
    assert found.value == pytest.approx(roc_auc_score(np.repeat([0, 1], 60), np.concatenate([danced, made])))
    assert found.low < found.value < found.high
    alike = auc_over_families(np.tile(danced[:10], 6), np.tile(made[:10], 6), np.repeat(list("abcdef"), 10).tolist())
    assert alike.low == pytest.approx(alike.high)
    assert np.isnan(told(danced[:, None], made[:, None], ["one"] * 60, linear).value)


def test_what_is_learned_from_is_made_without_the_tested_families(monkeypatch: pytest.MonkeyPatch) -> None:
    from experiments.likeness import making
    from experiments.likeness.filled import Filled, rival
    from experiments.likeness.run import maker_of

    maker = maker_of(None, "karate", (1.2,), 4, 3)
    learned = []

    def lesson_of(data: str | None, names: tuple[str, ...], left_out: tuple[str, ...]) -> Any:
        learned.append(left_out)
        return SimpleNamespace(engine=SimpleNamespace(corpus=SimpleNamespace(clips=[])))

    monkeypatch.setattr(making, "lesson_of", lesson_of)
    folds = maker.practise({"slerp": rival("slerp")})["slerp"]
    assert len(folds) == 3
    assert len(learned) == 6
    truth = maker.truth
    for fold, filled in enumerate(folds):
        families = {case.family for case, found in zip(truth.cases, filled.found, strict=True) if found}
        assert families == {family for family, its in truth.folds.items() if its != fold}
        tested = next(family for family, its in truth.folds.items() if its == fold)
        assert sum(tested in left_out for left_out in learned) == 2 + 2  # as the tested, and each as its own
    again = Filled.joined(folds).split(3)
    for one, other in zip(folds, again, strict=True):
        np.testing.assert_array_equal(one.found, other.found)
        assert all(np.array_equal(a, b) for a, b in zip(one.rotations, other.rotations, strict=True))


# --- windows, labels and tables ---------------------------------------------------------------------------------------


def test_windows_are_few_and_spread_over_all() -> None:
    from experiments.likeness.windows import MOVING, POSTURES, cases_of, key_of, spread, window_of
    from experiments.material import families

    assert spread(list(range(100)), 4) == [0, 33, 66, 99]
    assert spread([1, 2], 4) == [1, 2]
    together = families(None, "karate")[:2]
    cases = cases_of(None, "karate", together, (0.6, 1.2), 5)
    for takes_of_family in together:
        for frames in (18, 36):
            mine = [case for case in cases if case.family == takes_of_family[0] and case.frames == frames]
            known = [case for case in mine if case.given == POSTURES]
            moving = [case for case in mine if case.given == MOVING]
            assert 1 <= len(known) <= 5
            assert len(moving) <= (len(known) + 1) // 2
            assert {case._replace(given=POSTURES) for case in moving} <= set(known)
            assert all(window_of(None, "karate", case).surrounded for case in moving)
    assert key_of(cases) == key_of(list(cases)) != key_of(cases[1:])


def test_gains_are_compared_in_the_same_windows() -> None:
    from experiments.likeness.tables import beside, gain, interval, low_feet

    def row(take: str, l2q: float, windows: int = 10, **more: float) -> dict[str, object]:
        about = {"given": "two postures", "family": take, "take": take, "seconds": 1.2, "windows": windows}
        return about | {"l2q": l2q, "slerp": 2.0} | more

    one, other = [row("a", 1.5), row("b", 1.0)], [row("a", 1.6), row("b", 1.1), row("c", 9.0)]
    assert gain(one) == pytest.approx(0.375)
    low, high = interval(one)
    assert (low, high) == (pytest.approx(0.25), pytest.approx(0.5))
    assert beside(one, other) == (pytest.approx(0.05),) * 3
    assert np.isnan(beside(one, [row("a", 1.6, windows=9)])[0])
    feet = {"low": 0.5, "low danced": 0.25, "slid": 0.1, "slid danced": 0.1}
    assert low_feet([row("a", 1.0, **feet)]) == pytest.approx(0.5)


def test_likeness_is_measured_on_what_is_bundled(tmp_path: Path) -> None:
    from test_experiments import Here

    from experiments.harness import Setting, answer

    rows = answer("likeness", Setting(quick=True, data=None), Here(), tmp_path)
    kinds = {(row["given"], row["kind"]) for row in rows}
    assert {("two postures", kind) for kind in ("danced", "slerp", "nearest segment", "motionmind")} <= kinds
    assert {("moving ends", kind) for kind in ("danced", "hermite", "motionmind")} <= kinds
    for row in rows:
        if row["kind"] == "danced":
            assert row["l2q"] == pytest.approx(0.0, abs=1e-9)
            assert row["arms"] == row["arms danced"]
            assert np.isnan(row["upper linear"])
        if row["kind"] == "slerp":
            assert row["l2q"] == pytest.approx(row["slerp"], rel=1e-5)
            assert row["whole linear"] > 0.8
    assert "### Told apart" in (tmp_path / "README.md").read_text()


def test_only_a_new_label_is_made(tmp_path: Path) -> None:
    from experiments.likeness.run import main

    def run(*more: str) -> tuple[int, str]:
        fixed = [
            "karate",
            "--data",
            str(tmp_path),
            "--out",
            str(tmp_path / "rows"),
            "--windows",
            "1",
            "--families",
            "2",
        ]
        result = CliRunner().invoke(main, [*fixed, *more])
        return result.exit_code, result.output

    code, shown = run("--label", "one")
    assert code == 0
    assert "| two postures | one |" in shown
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.rglob("1-*/*.npz")}
    assert len(before) == 5
    practice = [path.name for path in tmp_path.rglob("practice/*.npz")]
    assert sorted(practice) == ["nearest segment.npz", "one.npz"]
    code, shown = run("--label", "two", "--options", '{"guide": 0.0}')
    assert code == 0
    assert "beside one" in shown
    assert "| two postures | two |" in shown
    after = {path.name: path.stat().st_mtime_ns for path in tmp_path.rglob("1-*/*.npz")}
    assert after.items() - before.items() == {("two.npz", after["two.npz"])}
    code, shown = run("--label", "one", "--options", '{"guide": 0.0}')
    assert code != 0
    assert "another label" in shown
    code, shown = run("--show", "two")
    assert code == 0
    assert "one |" not in shown
