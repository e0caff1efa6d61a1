"""The picture of a cleaning: a panel for each part, a curve for each step that moved it, a bar for each stance."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from damages import noisy, raised, recording, sliding, spiked

from motionmind.body.limbs import sided_parts
from motionmind.clean import Cleaning, clean_motion
from motionmind.clean.cleaning import STEPS
from motionmind.plots import Plate, draw_cleaning
from motionmind.plots.marks import Line, Words

DAMAGED = raised(noisy(spiked(sliding(recording(30.0)), "left_knee", 80), 0.5), 0.07)


def words(plate: Plate) -> list[str]:
    return [mark.text for mark in plate.marks if isinstance(mark, Words)]


def curves(plate: Plate) -> list[Line]:
    return [mark for mark in plate.marks if isinstance(mark, Line) and "at most" in mark.title]


@pytest.fixture(scope="module")
def cleaning() -> Cleaning:
    return clean_motion(DAMAGED)


def test_every_part_has_a_panel_and_every_step_a_colour(cleaning: Cleaning) -> None:
    plate = draw_cleaning(cleaning)
    assert set(sided_parts(DAMAGED.skeleton)) <= set(words(plate))
    assert {"flips repaired", "feet locked", "jitter filtered"} <= set(words(plate))
    assert "gaps filled" not in words(plate)
    assert any("70" in text and "above 0" in text for text in words(plate))
    assert len([mark for mark in plate.marks if isinstance(mark, Line) and mark.title == "foot locked"]) == sum(
        one.point < 2 * len(DAMAGED.skeleton) for one in cleaning.contacts
    )


def test_a_curve_is_as_high_as_its_step_moved_a_joint(cleaning: Cleaning) -> None:
    plate = draw_cleaning(cleaning)
    drawn = curves(plate)
    assert len({line.ink for line in drawn}) == 3
    most = max(1000.0 * float(cleaning.moved[step].max()) for step in ("flips", "filter", "feet"))
    highest = max(drawn, key=lambda line: float(np.ptp(line.points[:, 1])))
    assert f"{most:.1f} mm" in highest.title
    assert np.ptp(highest.points[:, 1]) == pytest.approx(54.0, abs=0.5)  # the height of a panel, pixels


def test_long_recordings_keep_their_peaks() -> None:
    motion = spiked(recording(240.0, seconds=9.0), "left_wrist", 1001)
    plate = draw_cleaning(clean_motion(motion, without=["filter", "feet"]))
    assert len(motion) > 2000
    assert all(len(line.points) <= 1200 for line in curves(plate))
    assert max(np.ptp(line.points[:, 1]) for line in curves(plate)) == pytest.approx(54.0, abs=0.5)


def test_nothing_changed_is_drawn_too(tmp_path: Path) -> None:
    plate = draw_cleaning(clean_motion(DAMAGED, without=STEPS))
    assert curves(plate) == []
    for suffix in (".svg", ".png"):
        plate.save(tmp_path / f"changes{suffix}")
    ElementTree.parse(tmp_path / "changes.svg")
