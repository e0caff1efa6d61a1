"""Workers and room change nothing of what is learned; percentiles hold a tail alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from same import assert_learned_alike

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.corpus.gather import gather
from motionmind.discretize.codebook import Codebook
from motionmind.errors import SkeletonError
from motionmind.executors import workshop as workshops
from motionmind.executors.workshop import Workshop
from motionmind.geometry import rotations as rot
from motionmind.learned import posture_statistics, validity
from motionmind.learned.learning import learn
from motionmind.learned.percentiles import Percentile

BODY = human23()


def dances() -> Iterator[Motion]:
    """Two recordings of a body that moves all joints, each in a rhythm of its own, and keyframes of it."""
    rng = np.random.default_rng(0)
    for name, seconds in (("one", 9.0), ("other", 4.0), ("keys", 3.0)):
        times = np.arange(round(30.0 * seconds)) / 30.0
        rhythm, phase = rng.uniform(0.5, 4.0, (2, len(BODY), 3))
        turned = rng.normal(0.0, 0.3, (len(BODY), 3)) * np.sin(rhythm * times[:, None, None] + phase)
        root = np.stack([np.sin(times), 0.95 + 0.05 * np.sin(3.0 * times), 0.0 * times], axis=-1)
        motion = Motion(BODY, rot.exp(turned), root, times, name)
        yield replace(motion.resample(4.0), keyframed=True) if name == "keys" else motion


@pytest.mark.filterwarnings("ignore:frames per second")
@pytest.mark.parametrize("workers", [2, 7])
def test_what_is_learned_depends_neither_on_workers_nor_on_room(
    workers: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind = Codebook(20.0, {"hip": 10.0})
    monkeypatch.setattr(posture_statistics, "MAX_FULL_SEARCH", 100)  # so that there are trees
    plain = learn(gather("dances", dances(), mirror=True), kind)
    monkeypatch.setattr(workshops, "MAPPED_BYTES", 0)
    workshop = Workshop.of(workers, tmp_path)
    learned = learn(gather("dances", dances(), mirror=True, workshop=workshop), kind, workshop)
    assert_learned_alike(learned, plain)
    assert [*tmp_path.iterdir()] == []  # the files have no names


def test_a_pile_is_its_rows_on_each_other(tmp_path: Path) -> None:
    rows = [np.arange(6.0).reshape(2, 3), np.zeros((0, 3)), np.ones((1, 3))[:, ::-1]]
    for folder in (None, tmp_path):
        pile, empty = Workshop(folder=folder).pile(), Workshop(folder=folder).pile()
        for some in rows:
            pile.add(some)
            empty.add(some[:, :0])
        np.testing.assert_array_equal(pile.array(), np.concatenate(rows))
        assert empty.array().shape == (3, 0)


def test_a_full_disk_is_an_error_before_anything_is_written() -> None:
    small = Path("/dev/shm")
    if not small.is_dir():
        pytest.skip("there is no small disk here")
    with pytest.raises(OSError, match="No space left"):
        Workshop(folder=small).empty((1 << 50,))


@given(
    rows=st.integers(1, 300),
    percent=st.sampled_from([0.0, 1.0, 5.0, 50.0, 93.0, 99.0, 99.5, 100.0]),
    seed=st.integers(0, 2**32 - 1),
)
def test_percentiles_are_numpys_to_the_last_bit(rows: int, percent: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(rows, 3)) * [1.0, 1e-9, 0.0]
    found = Percentile(percent, rows)
    for part in np.split(values, np.sort(rng.integers(0, rows, size=4))):
        found.add(part)
    np.testing.assert_array_equal(found.value(), np.percentile(values, percent, axis=0))


def test_a_percentile_holds_a_tail_alone() -> None:
    found = Percentile(99.0, 100_000)
    for block in np.random.default_rng(0).normal(size=(100, 1000, 1)):
        found.add(block)
        assert sum(map(len, found._rows)) <= 3002


def test_an_array_is_checked_in_the_memory_of_a_part(tmp_path: Path) -> None:
    status = Path("/proc/self/status")
    if not status.exists():
        pytest.skip("this system does not say which memory is files'")

    def of_files() -> int:
        return int(re.findall(r"RssFile:\s+(\d+)", status.read_text())[0])

    np.save(tmp_path / "ones.npy", np.ones((500_000, 8)))
    mapped = np.asarray(np.load(tmp_path / "ones.npy", mmap_mode="r"))
    before, most = of_files(), [0]

    def are_ones(part: np.ndarray) -> np.ndarray:
        good = part == 1.0
        most.append(of_files())
        return good

    assert validity._is_all(mapped, are_ones)
    assert max(most) - before < 10_000  # kB of 32,000
    assert len(most) > 5


def test_settings_of_one_joint_do_not_stop_others() -> None:
    names, rotations = ("left_hip", "spine"), rot.normalise(np.random.default_rng(0).normal(size=(200, 2, 4)))
    kind = Codebook(30.0, {"hip": 20.0})
    whole = kind.fit(names, rotations)
    for joint in range(2):
        alone = kind.fit_joint(names, joint, rotations[:, joint])
        np.testing.assert_array_equal(alone.centres, whole.of(joint))
        assert alone.tolerances[0] == whole.tolerances[joint]
    with pytest.raises(SkeletonError, match="no joint 'hop'"):
        Codebook(30.0, {"hop": 20.0}).fit_joint(names, 1, rotations[:, 1])
