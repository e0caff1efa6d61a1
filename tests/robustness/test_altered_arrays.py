"""A built corpus whose arrays were altered is an error in a line, or works: compiled code reads what is there."""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import time
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from saved_corpora import put_array

from motionmind.corpus import store
from motionmind.corpus.arrays import CHECKED
from motionmind.corpus.clip import JointFlip, JointRepair
from motionmind.errors import FormatError, MotionMindError, NoPathError
from motionmind.learned.persistence import _read_movement
from motionmind.learned.validity import MOVEMENT
from motionmind.tween.engine import Engine

TRIALS = 1000
EVERY = 10  # of the corpora that load, one is used


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus with bridges, coordination, detail and faults, of few postures."""
    folder = tmp_path_factory.mktemp("built") / "hexapod"
    engine = Engine.load("walk-hexapod")
    first, *others = engine.corpus.clips
    joint = engine.corpus.skeleton.names[1]
    mended = replace(first, repairs=(JointRepair(joint, 3, 5, (0.1, 0.2), exact=False),), performer="Zoë")
    faults = JointFlip(first.name, joint, 3, 100.0, "reconstructed"), JointFlip(first.name, joint, 9, 50.0)
    replace(engine, corpus=replace(engine.corpus, clips=(mended, *others), faults=faults)).save(folder)
    return folder


def altered(array: NDArray[Any], rng: random.Random) -> NDArray[Any]:
    """An array with some entries that are too large, too small, no numbers, of other entries, or of other bits."""
    out = np.array(array)
    flat = out.reshape(-1)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for _ in range(rng.choice([1, 1, 1, 3, 30])):
            at = rng.randrange(flat.size)
            match rng.randrange(5):
                case 0:
                    flat[at] = flat[rng.randrange(flat.size)]
                case 1:
                    flat[at : at + 1] += np.array([rng.choice([-1, 1])]).astype(out.dtype)
                case 2:
                    flat.view(np.uint8)[rng.randrange(flat.nbytes)] ^= 1 << rng.randrange(8)
                case 3:
                    flat[at : at + 1] *= np.array([rng.choice([-1, 0, 2])]).astype(out.dtype)
                case 4:
                    wild = (
                        [np.nan, np.inf, -np.inf, 1e300, -1e-300] if out.dtype.kind == "f" else [-1, 10**4, 2**31 - 1]
                    )
                    flat[at] = np.array(rng.choice(wild)).astype(out.dtype)
    return out


def use(engine: Engine, rng: random.Random) -> None:
    """Join two postures, by all that a corpus knows."""
    count = len(engine.corpus)
    a, b = (engine.corpus.motion(engine.corpus.clips[0]).posture(rng.randrange(20)) for _ in range(2))
    assert count > 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        engine.tween(a, b, moves=rng.randint(1, 6), node_budget=1000)
        engine.check(pairs=10)


@pytest.mark.long
def test_a_thousand_alterations_are_each_an_error_in_a_line_or_work(
    built: Path, tmp_path: Path, empty_cache: Path
) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    stored, rng = store.load(folder), random.Random(0)
    names = [name for name in MOVEMENT if stored.arrays[name].size]
    messages: list[str] = []
    used = 0
    for trial in range(TRIALS):
        name = names[trial % len(names)]
        put_array(folder, name, altered(stored.arrays[name], rng))
        try:
            _read_movement(folder, store.load(folder))
            if trial // len(names) % EVERY == 0:
                used += 1
                use(Engine.load(str(folder)), rng)
        except NoPathError:
            pass
        except MotionMindError as error:
            messages.append(str(error))
        put_array(folder, name, stored.arrays[name])
    assert [message for message in messages if "\n" in message or len(message) > 1000] == []
    assert len(messages) > TRIALS // 4
    assert used > TRIALS // EVERY // 8


@pytest.mark.parametrize("name", [name for name, form in MOVEMENT.items() if form.kind in ("i4", "i8")])
@pytest.mark.parametrize("value", [-1, 2**31 - 1])
def test_an_index_of_what_is_not_there_is_refused_wherever_it_stands(
    built: Path, tmp_path: Path, name: str, value: int
) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    whole = store.load(folder).arrays[name]
    for at in {0, whole.size // 2, whole.size - 1}:
        array = whole.copy()
        array.reshape(-1)[at] = value
        put_array(folder, name, array)
        with pytest.raises(FormatError, match=f"{name} .*; rebuild it"):
            Engine.load(str(folder))


def test_the_state_after_the_last_is_refused(built: Path, tmp_path: Path) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    array = store.load(folder).arrays["states"].copy()
    array[-1, 1] = Engine.load(str(built)).space.sizes[1]
    put_array(folder, "states", array)
    with pytest.raises(FormatError, match="states holds an index out of range"):
        Engine.load(str(folder))


def test_times_that_fall_within_a_clip_are_refused(built: Path, tmp_path: Path) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    stored = store.load(folder)
    array, start = stored.arrays["times"].copy(), stored.arrays["clips.starts"][1]
    for later in (start + 1, start - 1):  # the second posture of a clip, and the last of the one before
        changed = array.copy()
        changed[later] = changed[later - 1]
        put_array(folder, "times", changed)
        with pytest.raises(FormatError, match="times does not rise within a clip"):
            Engine.load(str(folder))


@pytest.mark.parametrize("name", [name for name, form in MOVEMENT.items() if form.kind == "f8"])
def test_what_is_no_number_is_refused_wherever_it_stands(built: Path, tmp_path: Path, name: str) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    array = store.load(folder).arrays[name].copy()
    for value in (np.nan, np.inf):
        array.reshape(-1)[array.size // 2] = value
        put_array(folder, name, array)
        with pytest.raises(MotionMindError, match=name):
            Engine.load(str(folder))


@pytest.mark.parametrize(
    ("name", "value", "fault"),
    [
        ("clips.text", b"\xff", "clips.text holds what is no entry"),
        ("clips.text", b"[", "clips.text holds what is no entry"),
        ("clips.text", b'"\n', "clips.text holds what is no entry"),
        ("faults.text", b"\0", "faults.text holds what is no entry"),
    ],
)
def test_a_clip_or_a_fault_that_cannot_be_read_is_refused(
    built: Path, tmp_path: Path, name: str, value: bytes, fault: str
) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    array = store.load(folder).arrays[name].copy()
    array[: len(value)] = np.frombuffer(value, np.uint8)
    put_array(folder, name, array)
    with pytest.raises(FormatError, match=f"{fault}: .*; rebuild it"):
        Engine.load(str(folder))


def test_columns_that_are_of_other_clips_are_refused(built: Path, tmp_path: Path) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder)
    arrays, clips = store.load(folder).arrays, len(Engine.load(str(built)).corpus.clips)
    for name, change in (
        ("clips.weights", lambda array: 0.5 * array),
        ("clips.order", lambda array: np.full(clips, 1, np.int32)),
        ("clips.starts", lambda array: array + np.eye(1, clips + 1, 1, dtype=np.int64)[0]),
    ):
        put_array(folder, name, change(arrays[name]))
        with pytest.raises(FormatError, match=f"{name} is not what clips.text says; rebuild it"):
            Engine.load(str(folder))
        put_array(folder, name, arrays[name])
    Engine.load(str(folder))


def test_arrays_are_checked_once_and_again_when_a_file_is_another(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder, ignore=shutil.ignore_patterns(CHECKED))
    Engine.load(str(folder))
    mark = store.load(folder).place / CHECKED
    assert not mark.exists()  # files as new as this may change and keep their times
    time.sleep(2.1)
    Engine.load(str(folder))
    assert store.load(folder).is_checked
    written = mark.stat().st_mtime_ns
    with monkeypatch.context() as patch:
        patch.setattr(hashlib, "file_digest", lambda *_: pytest.fail("it was hashed again"))
        Engine.load(str(folder))
    assert mark.stat().st_mtime_ns == written
    file = mark.with_name("states.npy")
    before = file.stat()
    array = np.load(file)
    array[3] = 10**6
    with file.open("r+b") as same:
        np.save(same, array)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    with pytest.raises(FormatError, match=r"states.npy: its checksum is not the manifest's"):
        Engine.load(str(folder))


def test_a_corpus_that_cannot_be_written_to_is_checked_each_time(built: Path, tmp_path: Path) -> None:
    folder = tmp_path / "altered"
    shutil.copytree(built, folder, ignore=shutil.ignore_patterns(CHECKED))
    mark = store.load(folder).place / CHECKED
    mark.mkdir()
    time.sleep(2.1)
    Engine.load(str(folder))
    assert not store.load(folder).is_checked
