"""Tolerances so fine that their states would not fit into memory are refused before anything is compared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bounded_runs import ROOT, run_bounded

from motionmind.discretize.codebook import codebook
from motionmind.geometry import rotations as rot

POSTURES = ROOT / "corpora" / "ballet" / "barre.score"


def test_rounded_quaternions_are_within_the_finest_tolerance_of_themselves() -> None:
    """A sample of eight digits may be off unit length by more than the tolerance's cosine is off 1."""
    q = np.round(rot.from_axis_angle([0.6, 0.0, 0.8], np.linspace(0.0, 3.0, 200)), 8)
    assert np.min(np.sum(q * q, axis=-1)) < np.cos(0.5 * np.radians(0.01))
    centres = codebook(np.concatenate([q, q]), 0.01)
    assert len(centres) == len(q)
    assert (rot.angle(q[:, None], centres).min(axis=1) <= np.radians(0.01)).all()


@pytest.mark.parametrize("kind", ["quaternion", "euler", "codebook"])
def test_a_circle_of_too_many_facings_is_refused(kind: str, tmp_path: Path) -> None:
    options = ["--discretize", kind, "--tolerance", 0.01, "--facing", "free"]
    done = run_bounded("corpus", "build", "fine", POSTURES, *options, folder=tmp_path)
    assert done.code == 2, done
    assert "corpus 'fine': the facing has 36000 states within 0.01 degrees, and can have 10000" in done.error
    assert "give pelvis a coarser tolerance" in done.error
    assert done.within_bounds, done
    assert not list((tmp_path / "home").glob("corpora/*")), "nothing is left of it"


def test_a_tolerance_whose_facings_fit_is_learned(tmp_path: Path) -> None:
    options = ["--discretize", "quaternion", "--tolerance", "0.01", "--tolerance", "pelvis=2", "--facing", "free"]
    done = run_bounded("corpus", "build", "fine", POSTURES, *options, folder=tmp_path)
    assert done.code == 0, done
    assert done.within_bounds, done
