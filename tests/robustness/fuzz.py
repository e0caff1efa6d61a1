"""Gives readers damaged and generated files, and checks that each is read or refused in a line.

    python -m tests.robustness.fuzz --hours 8
    python -m tests.robustness.fuzz --seconds 60 --table

An input that fails (a traceback, a segmentation fault, more than 10 s, more than 1 GB) is kept among the cases, which
test_fuzz.py replays.
"""

from __future__ import annotations

import argparse
import faulthandler
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).parent))  # as pytest does
from fuzz_readers import Reader, readers

from motionmind.errors import MotionMindError, MotionMindWarning

try:
    import resource
except ImportError:  # the system is no POSIX
    resource = None  # type: ignore[assignment]

CASES = Path(__file__).parent / "cases"
LONGEST = 10.0  # seconds of the processor for an input, which other programs do not prolong
MOST_MEMORY = 2**30  # bytes for an input


@dataclass
class Tally:
    """Counts of a reader's inputs, the seconds that all and the slowest took, bytes of the largest, and the faults."""

    inputs: int = 0
    read: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    largest: int = 0
    faults: list[str] = field(default_factory=list)


class Overdue(BaseException):
    """A reader that takes too long; no Exception, which readers may catch."""


def _overdue(*_: object) -> None:
    raise Overdue(f"more than {LONGEST:g} s")


@contextmanager
def _limits() -> Iterator[None]:
    """End what takes too long: with an error that is kept, or, where compiled code hangs, with a traceback and all."""
    previous = signal.signal(signal.SIGPROF, _overdue)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    faulthandler.dump_traceback_later(6.0 * LONGEST, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, previous)


def forget_peak() -> None:
    """Let `peak` begin anew, where the system can: on Linux (proc(5), clear_refs)."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", "utf-8")


def peak() -> int:
    """Return the most memory that this process has had since `forget_peak`, or ever where nothing forgets it, bytes."""
    with suppress(OSError):
        status = Path("/proc/self/status").read_text("utf-8")
        return 1024 * int(status.partition("VmHWM:")[2].split()[0])
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


class Attempt(NamedTuple):
    """Whether a reader read an input, the fault in a line, "" if there is none, and the memory that it took, bytes."""

    was_read: bool
    fault: str
    memory: int


def attempt(reader: Reader, path: Path, data: bytes) -> Attempt:
    """Give a reader a damaged or generated file."""
    path.write_bytes(data)
    forget_peak()
    before, was_read, fault = peak(), False, ""
    try:
        with _limits(), warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MotionMindWarning)
            reader.read(path)
        was_read = True
    except MotionMindError:  # whose messages are single lines
        pass
    except (Exception, Overdue) as error:  # anything else is a fault, whatever it is
        frame = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{type(error).__name__}: {str(error)[:200]} ({Path(frame.filename).name}:{frame.lineno})"
    memory = peak() - before
    return Attempt(was_read, fault or (f"{memory / 1e9:.1f} GB of memory" if memory > MOST_MEMORY else ""), memory)


def folder_of(reader: Reader) -> str:
    """Return the name of the folder with a reader's cases."""
    return reader.name.translate(str.maketrans(" ", "-", ",'"))


def keep(reader: Reader, data: bytes, folder: Path) -> Path:
    """Keep an input that failed among the cases of its reader, named by its content."""
    place = folder / folder_of(reader)
    place.mkdir(parents=True, exist_ok=True)
    path = place / sha256(data).hexdigest()[:12]
    path.write_bytes(data)
    return path


def campaign(chosen: Sequence[Reader], folder: Path, seconds: float, seed: int, kept: Path = CASES) -> dict[str, Tally]:
    """Damage files for some seconds, as long for each reader; print and keep those that fail.

    The inputs of a reader follow from the seed; how many there are depends on the machine.
    """
    tallies = {reader.name: Tally() for reader in chosen}
    inputs = {reader.name: reader.inputs(seed) for reader in chosen}
    paths = {reader.name: reader.lay_out(folder / str(number)) for number, reader in enumerate(chosen)}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        reader = min(chosen, key=lambda one: tallies[one.name].seconds)
        tally, data, began = tallies[reader.name], next(inputs[reader.name]), time.perf_counter()
        was_read, fault, memory = attempt(reader, paths[reader.name], data)
        took = time.perf_counter() - began
        tally.inputs += 1
        tally.read += was_read and not fault
        tally.refused += not was_read and not fault
        tally.seconds += took
        tally.slowest = max(tally.slowest, took)
        tally.largest = max(tally.largest, memory)
        if fault:
            if fault not in tally.faults:
                print(f"{reader.name}, input {tally.inputs}: {fault}; kept as {keep(reader, data, kept)}", flush=True)
            tally.faults.append(fault)
    return tallies


def table(tallies: dict[str, Tally]) -> str:
    """Format a campaign as a table of Markdown."""
    every = list(tallies.values())
    total = Tally(
        *(sum(getattr(one, key) for one in every) for key in ("inputs", "read", "refused", "seconds")),
        *(max(getattr(one, key) for one in every) for key in ("slowest", "largest")),
    )
    rows = [
        f"| {name} | {one.inputs:,} | {one.read:,} | {1e3 * one.slowest:.0f} | {one.largest / 1e6:.0f} |"
        for name, one in {**tallies, "all": total}.items()
    ]
    head = "| reader | inputs | read | slowest, ms | memory, MB |"
    return "\n".join([head, "|---|--:|--:|--:|--:|", *rows])


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign; return 1 if an input failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.robustness.fuzz", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--hours", type=float, default=0.0, help="run for so long")
    parser.add_argument("--seconds", type=float, default=60.0, help="run for so long, if no hours are given")
    parser.add_argument("--seed", type=int, default=0, help="begin with other inputs")
    parser.add_argument("--reader", help="damage the files of this reader alone")
    parser.add_argument("--table", action="store_true", help="print the table of docs/robustness.md")
    given = parser.parse_args(arguments)
    if resource is None:
        print(
            "error: there is no POSIX here, by which time and memory are limited: use Linux or macOS", file=sys.stderr
        )
        return 2
    faulthandler.enable()
    in_memory = Path("/dev/shm")  # where files cost no time
    folder = Path(tempfile.mkdtemp(prefix="fuzz-", dir=in_memory if in_memory.is_dir() else None))
    print(f"inputs in {folder}, where the last one stays if Python itself crashes", flush=True)
    chosen = [one for one in readers(folder) if given.reader in (None, one.name)]
    if not chosen:
        parser.error(f"no reader {given.reader}; there are {', '.join(one.name for one in readers(folder))}")
    # Address space is no memory, but what asks for so much more of it than libraries have is a fault, and is caught.
    resource.setrlimit(resource.RLIMIT_DATA, (6 * MOST_MEMORY, resource.RLIM_INFINITY))
    found = campaign(chosen, folder, 3600.0 * given.hours or given.seconds, given.seed)
    if given.table:
        print(table(found))
    shutil.rmtree(folder)
    every = found.values()
    refused, faults = sum(one.refused for one in every), sum(len(one.faults) for one in every)
    print(f"{sum(one.inputs for one in every):,} inputs, {refused:,} refused, {faults:,} failed")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
