"""Breaks the code on purpose, one mistake at a time, and checks that the tests notice.

    python -m tests.robustness.mutants
    python -m tests.robustness.mutants --package search --only "astar-*"
    python -m tests.robustness.mutants --log mutants.json

The mistakes, *mutants*, are listed in mutants.toml. Each is made in a copy of the tree, in which the tests that should
notice run in a process of their own. No bytecode is written there, and compiled code is kept by the time at which its
sources last changed (`motionmind.jit`), so that nothing old hides a mutant.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fnmatch import fnmatch
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIST = Path(__file__).with_suffix(".toml")
COPIED = ["motionmind", "tests", "experiments", "corpora", "discretization", "docs", "pyproject.toml", "README.md"]
PATIENCE = 6.0  # times what the tests take of the code as it is, after which a mutant is said to hang
LONGEST_START = 120.0  # seconds, beyond those: code that is mutated is compiled again

KILLED, SURVIVED, HANGS = "killed", "survived", "hangs"
DOES_NOT_APPLY = "does not apply"  # its tests cannot be collected
FAILS_ANYWAY = "fails anyway"  # its tests fail of the code as it is


@dataclass(frozen=True)
class Mutant:
    """A mistake.

    Attributes:
        name: of the mutant, unique.
        file: that it is made in, below `motionmind`.
        old: text that occurs once in the file.
        new: text in its place.
        breaks: a few words on what is wrong then.
        tests: files that should notice, below `tests`, or tests in them, as pytest names them.
        survives: the reason why nothing can notice, "" if something should.
    """

    name: str
    file: str
    old: str
    new: str
    breaks: str
    tests: tuple[str, ...]
    survives: str = ""

    @property
    def package(self) -> str:
        """The subpackage of `motionmind` that it is in."""
        return self.file.split("/", maxsplit=1)[0]

    def apply(self, source: str) -> str:
        """Return the source with the mistake; ValueError if that is not possible in one way."""
        if self.old == self.new or (count := source.count(self.old)) != 1:
            found = "would change nothing" if self.old == self.new else f"occurs {count} times in {self.file}"
            raise ValueError(f"mutant {self.name}: {self.old!r} {found}")
        return source.replace(self.old, self.new)

    @property
    def key(self) -> str:
        """Its name, and a hash of what it is and of the file that it is made in."""
        source = (ROOT / "motionmind" / self.file).read_text(encoding="utf-8")
        return f"{self.name} {sha256(repr((self, source)).encode()).hexdigest()[:16]}"


def mutants() -> list[Mutant]:
    """Read the list of mutants."""
    listed = tomllib.loads(LIST.read_text(encoding="utf-8"))["mutant"]
    return [Mutant(**{**one, "tests": tuple(one["tests"])}) for one in listed]


class Copy:
    """A copy of the tree, in which one file at a time is changed.

    Attributes:
        folder: where it is.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "tree"
        for name in COPIED:
            source, target = ROOT / name, self.folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__", "_build"))
            else:
                shutil.copy2(source, target)
        own = {name: str(folder / name.lower()) for name in ("XDG_CACHE_HOME", "XDG_DATA_HOME", "NUMBA_CACHE_DIR")}
        self._environment = {**os.environ, **own, "PYTHONPATH": str(self.folder)}
        self._seconds: dict[str, float] = {}

    @contextmanager
    def changed(self, mutant: Mutant) -> Iterator[None]:
        """Make a mistake, and unmake it."""
        path = self.folder / "motionmind" / mutant.file
        source = path.read_text(encoding="utf-8")
        self._write(path, mutant.apply(source))
        try:
            yield
        finally:
            self._write(path, source)

    def _write(self, path: Path, source: str) -> None:
        """Replace a module, and remove its bytecode."""
        path.write_text(source, encoding="utf-8")
        for bytecode in (path.parent / "__pycache__").glob(f"{path.stem}.*"):
            bytecode.unlink()

    def run(self, tests: Sequence[str], longest: float | None) -> int | None:
        """Run tests until one fails, and return pytest's exit code; None if they take too long, in seconds."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-n", "0", "-p", "no:cacheprovider", "--tb=no"]
        process = subprocess.Popen(
            [*command, *(f"tests/{test}" for test in tests)],
            cwd=self.folder,
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that what tests have started can be ended with them
        )
        try:
            return process.wait(longest)
        except subprocess.TimeoutExpired:
            return None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()

    def seconds(self, test: str) -> float:
        """Return how long a test takes of the code as it is; RuntimeError if it does not pass."""
        if test not in self._seconds:
            began = time.monotonic()
            if (code := self.run([test], None)) != 0:
                raise RuntimeError(f"of the code as it is, {test} ends with exit code {code}")
            self._seconds[test] = time.monotonic() - began
        return self._seconds[test]

    def outcome(self, mutant: Mutant) -> str:
        """Return what becomes of a mutant."""
        try:
            longest = LONGEST_START + PATIENCE * sum(map(self.seconds, mutant.tests))
        except RuntimeError:
            return FAILS_ANYWAY
        with self.changed(mutant):
            code = self.run(mutant.tests, longest)
        if code is None:
            return HANGS
        if code > 1:  # of pytest's: tests that cannot be collected or do not exist; below 0 a signal, such as SIGSEGV
            return DOES_NOT_APPLY
        return SURVIVED if code == 0 else KILLED


def is_as_listed(mutant: Mutant, outcome: str) -> bool:
    """Return whether the tests noticed a mutant, or did not and the list says why."""
    return (outcome in (KILLED, HANGS)) != bool(mutant.survives)


def table(chosen: Sequence[Mutant], outcomes: Sequence[str]) -> str:
    """Format a campaign as tables of Markdown: counts by subpackage, and the survivors."""
    rows = ["| where | mutants | killed | hang | survived |", "|---|--:|--:|--:|--:|"]
    packages = [one.package for one in chosen]
    for name in [*sorted(set(packages)), "all"]:
        mine = [outcome for package, outcome in zip(packages, outcomes, strict=True) if name in (package, "all")]
        rows.append(f"| {name} | {len(mine)} | {mine.count(KILLED)} | {mine.count(HANGS)} | {mine.count(SURVIVED)} |")
    left = [one for one, outcome in zip(chosen, outcomes, strict=True) if outcome not in (KILLED, HANGS)]
    if left:
        rows += ["", "| survivor | what is broken | why nothing notices |", "|---|---|---|"]
        rows += [f"| `{one.name}` | {one.breaks} | {one.survives} |" for one in left]
    return "\n".join(rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign; return 1 if an outcome is not as listed."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.robustness.mutants", description=(__doc__ or "").split("\n", maxsplit=1)[0]
    )
    parser.add_argument("--package", help="try the mutants of this subpackage alone")
    parser.add_argument("--only", default="*", help="try those whose names match, such as 'astar-*'")
    parser.add_argument(
        "--log",
        type=Path,
        help="keep outcomes in this file; those killed by an earlier run with it are not tried again",
    )
    given = parser.parse_args(arguments)
    chosen = [one for one in mutants() if given.package in (None, one.package) and fnmatch(one.name, given.only)]
    if not chosen:
        parser.error("no mutant is of that package and name")
    known: dict[str, str] = json.loads(given.log.read_text()) if given.log and given.log.exists() else {}
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = Copy(Path(folder))
        for one in chosen:
            if known.get(one.key) == KILLED:
                continue
            began = time.monotonic()
            known[one.key] = copy.outcome(one)
            seconds = time.monotonic() - began
            mark = "" if is_as_listed(one, known[one.key]) else "  <-- not as listed"
            print(f"{seconds:5.0f} s  {known[one.key]:9}  {one.package}: {one.name}{mark}", flush=True)
            if given.log:
                given.log.write_text(json.dumps(known, indent=1))
    outcomes = [known[one.key] for one in chosen]
    print(table(chosen, outcomes))
    return int(not all(map(is_as_listed, chosen, outcomes)))


if __name__ == "__main__":
    sys.exit(main())
