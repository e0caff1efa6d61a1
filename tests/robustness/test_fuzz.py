"""Readers read files or refuse them in a line: inputs that once failed, and the program that finds more."""

from __future__ import annotations

import random
import sys
import time
from contextlib import suppress
from itertools import islice
from pathlib import Path

import fuzz
import numpy as np
import pytest
from fuzz_damage import damaged
from fuzz_structures import MAX_BYTES

from motionmind.errors import FormatError, MotionMindError

if fuzz.resource is None:
    pytest.skip("time and memory cannot be limited here", allow_module_level=True)

N_GENERATED = 12  # of each reader
DOCUMENT = Path(__file__).parents[2] / "docs" / "robustness.md"


@pytest.fixture(scope="module")
def readers(tmp_path_factory: pytest.TempPathFactory) -> dict[str, fuzz.Reader]:
    return {fuzz.folder_of(reader): reader for reader in fuzz.readers(tmp_path_factory.mktemp("whole"))}


@pytest.fixture
def fragile() -> fuzz.Reader:
    """A reader that fails in each of the ways that count."""

    def read(path: Path) -> None:
        text = path.read_bytes()
        if b"a" not in text:
            raise KeyError("a")
        if b"b" not in text:
            raise MotionMindError("no b\nhere")
        if b"c" not in text:
            raise FormatError("no c", path=path)

    return fuzz.Reader("fragile", "a.txt", [b"a b c"], read)


@pytest.mark.parametrize(
    "case", [path for path in sorted(fuzz.CASES.rglob("*")) if path.is_file()], ids=lambda path: f"{path.parent.name}"
)
def test_what_once_failed_is_read_or_refused_in_a_line(
    readers: dict[str, fuzz.Reader], tmp_path: Path, case: Path
) -> None:
    assert case.stat().st_size < 20_000
    reader = readers[case.parent.name]
    assert fuzz.attempt(reader, reader.lay_out(tmp_path / "a"), case.read_bytes()).fault == ""


def test_whole_files_are_read(readers: dict[str, fuzz.Reader], tmp_path: Path) -> None:
    for number, reader in enumerate(readers.values()):
        path = reader.lay_out(tmp_path / str(number))
        for whole in reader.seeds:
            assert fuzz.attempt(reader, path, whole)[:2] == (True, ""), reader.name


def test_a_reader_that_fails_is_found_out_and_its_inputs_kept(fragile: fuzz.Reader, tmp_path: Path) -> None:
    path = fragile.lay_out(tmp_path / "a")
    for data, fault in (
        (b"a b c", ""),
        (b"a b", ""),
        (b"b c", "KeyError: 'a' (test_fuzz.py:"),
        (b"a c", ""),
    ):
        found = fuzz.attempt(fragile, path, data).fault
        assert found.startswith(fault)
        assert bool(found) == bool(fault)
    tally = fuzz.campaign([fragile], tmp_path / "work", 0.5, 0, tmp_path / "kept")["fragile"]
    assert tally.faults
    assert tally.inputs == tally.read + tally.refused + len(tally.faults)
    kept = list((tmp_path / "kept" / "fragile").iterdir())
    assert kept
    assert all(fuzz.attempt(fragile, path, case.read_bytes()).fault for case in kept)


def test_a_reader_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(_: Path) -> None:
        while True:
            with suppress(Exception):
                while True:
                    pass

    monkeypatch.setattr(fuzz, "LONGEST", 0.1)
    reader = fuzz.Reader("slow", "a.txt", [b""], read)
    assert fuzz.attempt(reader, reader.lay_out(tmp_path / "a"), b"").fault.startswith("Overdue: more than 0.1 s")


def test_a_reader_that_takes_too_much_memory_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz, "MOST_MEMORY", 5 * 10**7)
    monkeypatch.setattr(fuzz, "LONGEST", 300.0)  # so much memory may take its time beside other tests
    more = 10**7 if sys.platform == "linux" else fuzz.peak() // 8 + 10**7  # numbers of 8 bytes
    reader = fuzz.Reader("large", "a.txt", [b""], lambda path: np.ones(more).sum())
    small = fuzz.Reader("small", "a.txt", [b""], lambda path: None)
    path = reader.lay_out(tmp_path / "a")
    for _ in range(2 if sys.platform == "linux" else 1):  # each input for itself
        found = fuzz.attempt(reader, path, b"")
        assert found.was_read
        assert found.fault.endswith(" GB of memory")
        assert 7 * 10**7 < found.memory < 10 * more
        assert fuzz.attempt(small, path, b"").fault == ""


def test_a_seed_makes_the_same_inputs_again_whenever_that_is(
    readers: dict[str, fuzz.Reader], monkeypatch: pytest.MonkeyPatch
) -> None:
    for reader in readers.values():
        once, other = (list(islice(reader.inputs(seed), 20)) for seed in (3, 4))
        with monkeypatch.context() as patch:
            patch.setattr(time, "time", lambda: 1e9)
            again = list(islice(reader.inputs(3), 20))
        assert once == again != other


@pytest.mark.long
def test_generated_files_are_small_read_or_refused(readers: dict[str, fuzz.Reader], tmp_path: Path) -> None:
    """Most generators make some files that are read: a reader that refuses all at the first word proves little."""
    read: set[str] = set()
    for number, reader in enumerate(readers.values()):
        if reader.generate is None:
            continue
        path, rng = reader.lay_out(tmp_path / str(number)), random.Random(1)
        for _ in range(N_GENERATED):
            data = reader.generate(reader.seeds, rng)
            assert len(data) <= MAX_BYTES
            found = fuzz.attempt(reader, path, data)
            assert found.fault == "", reader.name
            read |= {reader.name} if found.was_read else set()
    assert {"GLB", "glTF, text", "npz", "JSON movement", "report", "index of corpora"} <= read


def test_most_damage_is_slight(readers: dict[str, fuzz.Reader]) -> None:
    """Damage that every reader refuses at the first word tries nothing behind it."""
    whole, rng = readers["BVH"].seeds[0], random.Random(0)
    kept = [len({*damaged(whole, [whole], rng).split()} & {*whole.split()}) for _ in range(200)]
    assert sorted(kept)[100] > 0.8 * len({*whole.split()})


def test_the_document_has_a_row_for_each_reader(readers: dict[str, fuzz.Reader]) -> None:
    tallies = {reader.name: fuzz.Tally(1) for reader in readers.values()}
    text = DOCUMENT.read_text("utf-8").partition("| reader |")
    rows = [line.split("|")[1].strip() for line in "".join(text[1:]).split("\n\n")[0].splitlines() if line[1] == " "]
    assert rows == [line.split("|")[1].strip() for line in fuzz.table(tallies).splitlines() if line.startswith("| ")]
