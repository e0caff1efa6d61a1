"""Readers read files or refuse them in a line: inputs that once failed, and the program that finds more."""

from __future__ import annotations

import random
import time
from contextlib import suppress
from itertools import islice
from pathlib import Path

import fuzz
import numpy as np
import pytest

from motionmind.errors import FormatError

if fuzz.resource is None:
    pytest.skip("time and memory cannot be limited here", allow_module_level=True)

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
            raise FormatError("no b\nhere", path=path)
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
    _, fault = fuzz.attempt(reader, reader.lay_out(tmp_path / "a"), case.read_bytes())
    assert fault == ""


def test_whole_files_are_read(readers: dict[str, fuzz.Reader], tmp_path: Path) -> None:
    for number, reader in enumerate(readers.values()):
        path = reader.lay_out(tmp_path / str(number))
        for whole in reader.seeds:
            assert fuzz.attempt(reader, path, whole) == (True, ""), reader.name


def test_a_reader_that_fails_is_found_out_and_its_inputs_kept(fragile: fuzz.Reader, tmp_path: Path) -> None:
    path = fragile.lay_out(tmp_path / "a")
    for data, fault in (
        (b"a b c", ""),
        (b"a b", ""),
        (b"b c", "KeyError: 'a' (test_fuzz.py:"),
        (b"a c", "a message of several lines: "),
    ):
        found = fuzz.attempt(fragile, path, data)[1]
        assert found.startswith(fault)
        assert bool(found) == bool(fault)
    tally = fuzz.campaign([fragile], tmp_path / "work", 0.5, 0, tmp_path / "kept")["fragile"]
    assert tally.faults
    assert tally.inputs == tally.read + tally.refused + len(tally.faults)
    kept = list((tmp_path / "kept" / "fragile").iterdir())
    assert kept
    assert all(fuzz.attempt(fragile, path, case.read_bytes())[1] for case in kept)


def test_a_reader_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(_: Path) -> None:
        while True:
            with suppress(Exception):
                while True:
                    pass

    monkeypatch.setattr(fuzz, "LONGEST", 0.1)
    reader = fuzz.Reader("slow", "a.txt", [b""], read)
    assert fuzz.attempt(reader, reader.lay_out(tmp_path / "a"), b"")[1].startswith("Overdue: more than 0.1 s")


def test_a_reader_that_takes_too_much_memory_is_found_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz, "MOST_MEMORY", 5 * 10**7)
    monkeypatch.setattr(fuzz, "LONGEST", 300.0)  # so much memory may take its time beside other tests
    more = fuzz.largest() // 8 + 10**7  # numbers of 8 bytes, which this process never had
    reader = fuzz.Reader("large", "a.txt", [b""], lambda path: np.ones(more).sum())
    was_read, fault = fuzz.attempt(reader, reader.lay_out(tmp_path / "a"), b"")
    assert was_read
    assert fault.endswith(" GB of memory")


def test_a_seed_makes_the_same_inputs_again_whenever_that_is(
    readers: dict[str, fuzz.Reader], monkeypatch: pytest.MonkeyPatch
) -> None:
    for reader in readers.values():
        once, other = (list(islice(reader.inputs(seed), 20)) for seed in (3, 4))
        with monkeypatch.context() as patch:
            patch.setattr(time, "time", lambda: 1e9)
            again = list(islice(reader.inputs(3), 20))
        assert once == again != other


def test_most_damage_is_slight(readers: dict[str, fuzz.Reader]) -> None:
    """Damage that every reader refuses at the first word tries nothing behind it."""
    whole, rng = readers["BVH"].seeds[0], random.Random(0)
    kept = [len({*fuzz.damaged(whole, [whole], rng).split()} & {*whole.split()}) for _ in range(200)]
    assert sorted(kept)[100] > 0.8 * len({*whole.split()})


def test_the_document_has_a_row_for_each_reader(readers: dict[str, fuzz.Reader]) -> None:
    tallies = {reader.name: fuzz.Tally(1) for reader in readers.values()}
    text = DOCUMENT.read_text("utf-8").partition("| reader |")
    rows = [line.split("|")[1].strip() for line in "".join(text[1:]).split("\n\n")[0].splitlines() if line[1] == " "]
    assert rows == [line.split("|")[1].strip() for line in fuzz.table(tallies).splitlines() if line.startswith("| ")]
