"""Effort-like descriptors: movement of which they are known, and laws that they keep."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from bodies import insect
from bundled_clips import ballet_clip
from command_line import Run
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import hilbert

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.formats import write_motion
from motionmind.geometry import rotations as rot
from motionmind.metrics import measure_effort
from motionmind.metrics.effort import (
    EFFORT,
    MassPoints,
    directness,
    effort_of,
    extension,
    flow_effort,
    phase_locking,
    points_of,
    quantity_of_motion,
    space_effort,
    time_effort,
    weight_effort,
)

FPS = 30.0
seeds = st.integers(0, 2**32 - 1)


def moving(*paths: Floats, shares: tuple[float, ...] = ()) -> MassPoints:
    """Points that move on paths [T, 3], weighted alike, or by shares."""
    return MassPoints(np.stack(paths, axis=1), np.array(shares or [1.0 / len(paths)] * len(paths)))


def circle(radius: float, turns_per_s: float, seconds: float, fps: float = FPS) -> Floats:
    angle = 2.0 * np.pi * turns_per_s * np.arange(round(seconds * fps) + 1) / fps
    return radius * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)


def swinging(seconds: float, **phases: tuple[float, float]) -> Motion:
    """A body that swings joints forward and back by 0.5 rad: the times a second and the phase, radians, of each."""
    t = np.arange(round(seconds * FPS) + 1) / FPS
    body = human23()
    turned = np.tile(rot.IDENTITY, (len(t), len(body), 1))
    for joint, (rate, phase) in phases.items():
        turned[:, body.index(joint)] = rot.from_axis_angle([1.0, 0.0, 0.0], 0.5 * np.sin(2 * np.pi * rate * t + phase))
    return Motion(body, turned, np.tile([0.0, 1.0, 0.0], (len(t), 1)), t)


# --- known paths ------------------------------------------------------------------------------------------------------


@given(st.floats(0.1, 2.0), st.floats(0.1, 1.0))
def test_a_circle_at_constant_speed_has_the_figures_of_its_radius_and_speed(radius: float, rate: float) -> None:
    fps, turn = 300.0, 2.0 * np.pi * rate
    points = moving(circle(radius, rate, 3.0, fps))
    assert weight_effort(points, fps) == pytest.approx((radius * turn) ** 2, rel=1e-3)
    assert quantity_of_motion(points, fps) == pytest.approx(radius * turn, rel=1e-3)
    assert time_effort(points, fps) == pytest.approx(radius * turn**2, rel=1e-3)
    assert flow_effort(points, fps) == pytest.approx(radius * turn**3, rel=1e-3)


def test_half_a_circle_is_half_pi_times_as_long_as_its_diameter_and_a_whole_one_leads_nowhere() -> None:
    half, whole = moving(circle(0.7, 0.5, 1.0, 300.0)), moving(circle(0.7, 0.5, 2.0, 300.0))
    assert space_effort(half) == pytest.approx(np.pi / 2.0, rel=1e-4)
    assert directness(half) == pytest.approx(2.0 / np.pi, rel=1e-4)
    assert directness(whole) == pytest.approx(0.0, abs=1e-9)
    closed = whole.places.copy()
    closed[-1] = closed[0]
    assert space_effort(whole._replace(places=closed)) == np.inf


@given(seeds, st.floats(0.01, 5.0))
def test_a_straight_line_at_constant_speed_is_direct_and_has_neither_time_nor_flow(seed: int, speed: float) -> None:
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    points = moving(rng.normal(size=3) + direction * speed * np.arange(20)[:, None] / FPS)
    found = [weight_effort(points, FPS), quantity_of_motion(points, FPS), space_effort(points), directness(points)]
    assert found == pytest.approx([speed**2, speed, 1.0, 1.0])
    assert [time_effort(points, FPS), flow_effort(points, FPS)] == pytest.approx([0.0, 0.0], abs=1e-9)


@given(st.floats(0.05, 1.0), st.integers(1, 4))
def test_a_harmonic_has_two_over_pi_of_its_peaks(size: float, rate: int) -> None:
    fps, turn = 600.0, 2.0 * np.pi * rate
    path = size * np.sin(turn * np.arange(601) / fps)[:, None] * [0.0, 1.0, 0.0]
    points = moving(path)
    mean = 2.0 / np.pi
    assert weight_effort(points, fps) == pytest.approx((size * turn) ** 2, rel=2e-3)
    assert quantity_of_motion(points, fps) == pytest.approx(mean * size * turn, rel=5e-3)
    assert time_effort(points, fps) == pytest.approx(mean * size * turn**2, rel=5e-3)
    assert flow_effort(points, fps) == pytest.approx(mean * size * turn**3, rel=1e-2)


def test_points_count_by_their_shares() -> None:
    line, rest = np.arange(9)[:, None] / FPS * [2.0, 0.0, 0.0], np.zeros((9, 3))
    points = moving(line, rest, shares=(0.25, 0.75))
    assert weight_effort(points, FPS) == pytest.approx(0.25 * 4.0)
    assert quantity_of_motion(points, FPS) == pytest.approx(0.25 * 2.0)
    assert (space_effort(points), directness(points)) == pytest.approx((1.0, 1.0))  # what rests has no path


def test_a_body_at_rest_has_no_directness_and_no_phase() -> None:
    still = swinging(1.0)
    found = effort_of(still)
    undefined = {"space_effort", "directness", "arms_synchrony", "arms_phase", "legs_synchrony", "legs_phase"}
    assert {name for name, value in found.items() if np.isnan(value)} == undefined
    assert all(found[name] == pytest.approx(0.0, abs=1e-9) for name in ("weight_effort", "time_effort", "flow_effort"))


@given(seeds, st.floats(-np.pi, np.pi))
def test_the_place_and_the_facing_of_a_movement_count_for_nothing(seed: int, turn: float) -> None:
    rng = np.random.default_rng(seed)
    body = human23()
    turned = rot.exp(np.cumsum(0.05 * rng.normal(size=(40, len(body), 3)), axis=0))
    root = np.cumsum(0.02 * rng.normal(size=(40, 3)), axis=0)
    motion = Motion(body, turned, root, np.arange(40) / FPS)
    about, elsewhere = rot.about_vertical(turn), turned.copy()
    elsewhere[:, 0] = rot.mul(about, turned[:, 0])
    moved = replace(motion, rotations=elsewhere, root=rot.mul_vec(about, root) + rng.normal(size=3))
    assert effort_of(moved) == pytest.approx(effort_of(motion), rel=1e-6, nan_ok=True)


def test_half_the_speed_is_a_quarter_of_the_weight_and_time_and_an_eighth_of_the_flow() -> None:
    fast, slow = (moving(circle(0.5, rate, 1.0 / rate, 300.0)[:-40]) for rate in (1.0, 0.5))
    ratios = [f(slow, 300.0) / f(fast, 300.0) for f in (weight_effort, time_effort, flow_effort)]
    assert ratios == pytest.approx([0.25, 0.25, 0.125], rel=1e-3)


def test_masses_are_those_of_the_segments_and_joints_count_alike_where_unknown() -> None:
    person = points_of(swinging(0.2))
    body = human23()
    assert person.shares.sum() == pytest.approx(1.0)
    assert person.shares[body.index("left_hip")] > 10.0 * person.shares[body.index("left_wrist")]
    crawling = Motion(insect(), np.tile(rot.IDENTITY, (9, 14, 1)), np.zeros((9, 3)), np.arange(9) / FPS)
    assert np.allclose(points_of(crawling).shares, 1.0 / 14.0)


# --- extension and phase ----------------------------------------------------------------------------------------------


def test_extension_is_the_radius_of_a_ring_and_falls_when_a_body_folds() -> None:
    ring = circle(0.8, 1.0 / 12.0, 12.0, 1.0)[None, :-1]
    assert extension(ring) == pytest.approx(0.8)
    assert extension(ring + np.array([3.0, -1.0, 2.0])) == pytest.approx(0.8)
    folded = swinging(0.2)
    turned = folded.rotations.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        turned[:, folded.skeleton.index(f"{side}_hip")] = rot.from_axis_angle([1.0, 0.0, 0.0], -2.2)
        turned[:, folded.skeleton.index(f"{side}_knee")] = rot.from_axis_angle([1.0, 0.0, 0.0], 2.2)
        turned[:, folded.skeleton.index(f"{side}_elbow")] = rot.from_axis_angle([0.0, sign, 0.0], -2.2)
    assert effort_of(replace(folded, rotations=turned))["extension"] < 0.8 * effort_of(folded)["extension"]


@given(seeds)
def test_phases_are_those_of_the_analytic_signal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = (rng.normal(size=int(rng.integers(4, 40))) for _ in range(2))
    count = min(len(one), len(other))
    one, other = one[:count] - one[:count].mean(), other[:count] - other[:count].mean()
    expected = np.mean(np.exp(1j * (np.angle(hilbert(one)) - np.angle(hilbert(other)))))
    assert phase_locking(one, other) == pytest.approx(expected)
    assert abs(phase_locking(3.0 * one, one)) == pytest.approx(1.0)
    assert phase_locking(one, -one) == pytest.approx(-1.0)


@pytest.mark.parametrize("degrees", [0.0, 45.0, 90.0, 180.0])
@pytest.mark.parametrize(("limbs", "joint"), [("arms", "shoulder"), ("legs", "hip")])
def test_two_limbs_have_the_phase_between_them(limbs: str, joint: str, degrees: float) -> None:
    swung = swinging(4.0, **{f"left_{joint}": (1.0, 0.0), f"right_{joint}": (1.0, np.radians(degrees))})
    # The arms stretch sideways at rest, and would turn about their own length.
    down = swung.rotations.copy()
    for side, sign in (("left", -1.0), ("right", 1.0)):
        index = swung.skeleton.index(f"{side}_shoulder")
        down[:, index] = rot.mul(down[:, index], rot.from_axis_angle([0.0, 0.0, 1.0], sign * np.pi / 2.0))
    found = effort_of(replace(swung, rotations=down))
    assert found[f"{limbs}_synchrony"] == pytest.approx(1.0, abs=0.02)
    assert found[f"{limbs}_phase"] == pytest.approx(degrees, abs=3.0)
    others = "legs" if limbs == "arms" else "arms"
    assert np.isnan(found[f"{others}_phase"])


@pytest.mark.parametrize(("sign", "degrees"), [(-1.0, 0.0), (1.0, 180.0)])
def test_arms_that_rise_together_are_in_phase_and_arms_that_sway_to_one_side_are_not(
    sign: float, degrees: float
) -> None:
    still = swinging(4.0)
    swing = 0.4 * np.sin(2.0 * np.pi * still.times)
    turned = still.rotations.copy()
    for side, angle in (("left", swing - 0.8), ("right", sign * swing + 0.8)):
        turned[:, still.skeleton.index(f"{side}_shoulder")] = rot.from_axis_angle([0.0, 0.0, 1.0], angle)
    assert effort_of(replace(still, rotations=turned))["arms_phase"] == pytest.approx(degrees, abs=3.0)


def test_limbs_at_different_paces_are_out_of_synchrony() -> None:
    found = effort_of(swinging(12.0, left_hip=(1.0, 0.0), right_hip=(1.5, 0.0)))
    assert found["legs_synchrony"] < 0.1


def test_a_walker_alternates() -> None:
    legs = {f"{side}_hip": (1.0, phase) for side, phase in (("left", 0.0), ("right", np.pi))}
    walk = swinging(4.0, **legs)
    ahead = replace(walk, root=walk.root + walk.times[:, None] * [0.4, 0.0, 1.2])
    assert effort_of(ahead)["legs_phase"] == pytest.approx(180.0, abs=3.0)


# --- rows and the table -----------------------------------------------------------------------------------------------


def test_windows_follow_each_other_and_are_measured_alone() -> None:
    motion = ballet_clip("adagio")
    rows = measure_effort(motion, window=1.0)
    assert [row["start"] for row in rows] == pytest.approx([*range(len(rows))])
    assert [row["end"] - row["start"] for row in rows] == pytest.approx([1.0] * len(rows))
    assert motion.times[-1] - motion.times[0] - len(rows) < 1.0
    (whole,) = measure_effort(motion)
    assert whole["end"] == pytest.approx(motion.times[-1] - motion.times[0], abs=1.0 / FPS)
    assert max(row["weight_effort"] for row in rows) <= whole["weight_effort"] + 1e-9
    assert list(whole) == ["start", "end", *EFFORT]


@pytest.mark.parametrize("window", [0.0, -1.0, 0.1, np.nan, np.inf])
def test_a_window_needs_five_frames(window: float) -> None:
    with pytest.raises(MotionMindError, match=r"a window must be 0\.13 s or more"):
        measure_effort(swinging(1.0), window=window)


def test_movement_shorter_than_a_window_is_refused() -> None:
    with pytest.raises(MotionMindError, match=r"lasts 1\.00 s, and effort needs 2\.00 s"):
        measure_effort(swinging(1.0), window=2.0)
    with pytest.raises(MotionMindError, match=r"effort needs 0\.13 s"):
        measure_effort(swinging(0.1))


def test_pandas_reads_the_table_with_a_row_for_each_clip_or_window(run: Run) -> None:
    swing = swinging(2.1, left_hip=(1.0, 0.0), right_hip=(1.0, np.pi))
    write_motion("swing.json", swing)
    done = run("measure", "swing.json", "ballet", "--csv", "effort.csv")
    assert (done.code, done.err) == (0, "")
    table = pd.read_csv("effort.csv")
    assert list(table.columns) == ["clip", "start", "end", *EFFORT]
    assert table["clip"][0] == "swing.json"
    assert set(table["clip"][1:]) > {"ballet/adagio", "ballet/jump"}
    assert f"{len(table)} rows" in done.out
    expected = measure_effort(swing)[0]
    assert table.iloc[0, 1:].to_dict() == pytest.approx(expected, rel=1e-5, abs=1e-5, nan_ok=True)
    assert run("measure", "swing.json", "--csv", "effort.csv", "--window", "0.5").code == 0
    assert pd.read_csv("effort.csv")["start"].tolist() == pytest.approx([0.0, 0.5, 1.0, 1.5])
    done = run("measure", "swing.json", "ballet", "--csv", "effort.csv", "--window", "4")
    assert "left out, shorter than 4.00 s: swing" in done.err
    assert len(pd.read_csv("effort.csv")) > 0


def test_the_figures_of_effort_stand_beside_the_corpus(run: Run) -> None:
    shown = run("measure", "ballet/jump", "--corpus", "ballet", "--effort")
    assert shown.code == 0
    names = [line.split("  ")[0].replace(" ", "_") for line in io.StringIO(shown.out).read().splitlines()[2:]]
    assert names == list(EFFORT)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--csv", "effort.csv", "--window", "9"], "no clip lasts 9.00 s"),
        (["--csv", "effort.json"], "effort.json: cannot be written: the name must end in one of .csv"),
        (["--csv", "nowhere/effort.csv"], "there is no folder"),
        (["missing.json", "--csv", "effort.csv"], "missing.json"),
        (["--csv", "effort.csv", "--corpus", "ballet"], "--corpus excludes --csv"),
        (["--csv", "effort.csv", "--json"], "--json excludes --csv"),
        (["--window", "1", "--corpus", "ballet"], "--window is only for --csv FILE"),
        (["short.json", "--corpus", "ballet"], "2 SOURCEs are only for --csv FILE"),
        (["--effort", "--all", "--corpus", "ballet"], "--effort and --all exclude each other"),
    ],
)
def test_a_table_that_cannot_be_made_is_not_begun(run: Run, arguments: list[str], words: str) -> None:
    write_motion("short.json", swinging(1.0))
    said = run("measure", "short.json", *arguments)
    assert (said.code, said.out) == (2, "")
    assert words in said.err.splitlines()[-1]
    assert not [*Path().glob("effort.*")]
