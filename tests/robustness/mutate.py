"""Break the code on purpose, one random mistake at a time, and report the mistakes that no test notices.

    python -m tests.robustness.mutate --since HEAD~5 --count 50 --seed 0
    python -m tests.robustness.mutate --only "motionmind/search/*.py"

The tool changes one node of a module's syntax tree in a copy of the checkout. There it runs the tests of the module's
room and all other tests that import the module. Compiled code is cached by the contents of its sources
(`motionmind.codecache`), so a mutant recompiles only what depends on it.
"""

from __future__ import annotations

import argparse
import ast
import difflib
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from fnmatch import fnmatch
from itertools import islice
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
KILLED, SURVIVED, TIMED_OUT = "killed", "survived", "timed out"

_OPERATORS: dict[type[ast.AST], list[type[ast.AST]]] = {
    **{ast.Lt: [ast.LtE, ast.GtE], ast.LtE: [ast.Lt, ast.Gt], ast.Gt: [ast.GtE, ast.LtE], ast.GtE: [ast.Gt, ast.Lt]},
    **{ast.Eq: [ast.NotEq], ast.NotEq: [ast.Eq], ast.Is: [ast.IsNot], ast.IsNot: [ast.Is]},
    **{ast.In: [ast.NotIn], ast.NotIn: [ast.In], ast.And: [ast.Or], ast.Or: [ast.And]},
    **{ast.Add: [ast.Sub], ast.Sub: [ast.Add], ast.Mult: [ast.Div], ast.Div: [ast.Mult]},
}
_DEFAULTS = {"bool": "False", "int": "0", "float": "0.0", "str": "''", "None": "None"}
_SYMMETRIC = {"min", "max", "minimum", "maximum", "isinstance", "hypot", "isclose", "allclose", "array_equal"}


@dataclass(frozen=True)
class Mutant:
    """A mistake: the bytes from `start` to `end` of a file in UTF-8 become `new`."""

    file: Path
    line: int
    start: int
    end: int
    new: str

    def apply(self, source: str) -> str:
        """Return the text of the file with the mistake."""
        data = source.encode()
        return (data[: self.start] + self.new.encode() + data[self.end :]).decode()

    def is_different(self, source: str) -> bool:
        """Return whether the mistake leaves a program, and another one: it may leave a `break` without its loop."""
        try:
            compile(mutated := self.apply(source), "mutant", "exec")
        except SyntaxError:
            return False
        return ast.dump(ast.parse(mutated)) != ast.dump(ast.parse(source))


def changed(node: Any, **fields: Any) -> Any:
    """Return a shallow copy of a node with other fields."""
    other = copy(node)
    vars(other).update(fields)
    return other


def replacements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what may stand in the place of a node by mistake."""
    match node:
        case ast.Compare(ops=[*ops]):
            for k, op in enumerate(ops):
                for other in _OPERATORS[type(op)]:
                    yield changed(node, ops=[*ops[:k], other(), *ops[k + 1 :]])
        case ast.BinOp(op=op) | ast.BoolOp(op=op) | ast.AugAssign(op=op):
            for other in _OPERATORS.get(type(op), []):
                yield changed(node, op=other())
        case ast.IfExp(test=test):
            yield changed(node, test=ast.UnaryOp(ast.Not(), test))
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value)):
            yield ast.Constant(value + 1)
        case ast.Constant(value=float(value)):
            yield ast.Constant(value * 1.5 if value else 1.0)
        case ast.Call(func=func, args=[first, second, *rest]) if not isinstance(first, ast.Starred):
            name = func.attr if isinstance(func, ast.Attribute) else getattr(func, "id", "")
            if name not in _SYMMETRIC and not isinstance(second, ast.Starred):
                yield changed(node, args=[second, first, *rest])
    match node:  # drop a statement
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Continue() | ast.Break() | ast.Raise():
            yield ast.Pass()
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript()]):
            yield ast.Pass()


def mutants(file: Path, source: str) -> list[Mutant]:
    """Return the mutants of a module; a few may be no program, or the same one."""
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found: list[Mutant] = []

    def add(node: Any, new: str, *, insert: bool = False) -> None:
        start = starts[node.lineno - 1] + node.col_offset
        end = start if insert else starts[node.end_lineno - 1] + node.end_col_offset
        found.append(Mutant(file, node.lineno, start, end, new))

    def visit(node: Any) -> None:
        if isinstance(node, ast.JoinedStr):  # before Python 3.12 the places of its parts are unknown
            return
        for other in replacements(node):
            add(node, ast.unparse(ast.fix_missing_locations(other)))
        if isinstance(node, ast.If | ast.While) and not isinstance(node.test, ast.NamedExpr):
            add(node.test, f"not ({ast.unparse(node.test)})")
        if isinstance(node, ast.FunctionDef) and node.returns:
            default = _DEFAULTS.get(ast.unparse(node.returns))
            body = node.body[1:] if ast.get_docstring(node) else node.body
            if default and body:
                add(body[0], f"return {default}\n{' ' * body[0].col_offset}", insert=True)
        for name, value in ast.iter_fields(node):
            if name not in ("annotation", "decorator_list", "returns"):
                for child in value if isinstance(value, list) else [value]:
                    if isinstance(child, ast.AST):
                        visit(child)

    visit(ast.parse(source))
    return found


def git(root: Path, *arguments: str) -> list[str]:
    """Return the lines that git prints."""
    return subprocess.run(["git", *arguments], cwd=root, check=True, capture_output=True, text=True).stdout.splitlines()


def tests_of(root: Path, file: Path) -> list[str]:
    """Return the tests of a module's room, a folder of `tests`, and the test files elsewhere that import the module."""
    package, room = ".".join(file.with_suffix("").parts[:-1]), f"tests/{file.parts[1]}"
    module = file.stem
    imports = re.compile(
        rf"^ *(from|import) {package}\.{module}\b|^ *from {package} import (\([^)]*|.*)\b{module}\b", re.M
    )
    found = [room] if (root / room).is_dir() else []
    for test in sorted(root.glob("tests/**/test_*.py")):
        name = test.relative_to(root).as_posix()
        if not name.startswith(f"{room}/") and imports.search(test.read_text("utf-8")):
            found.append(name)
    return found


class Checkout:
    """A copy of a checkout, in `folder`, in which one file at a time is changed."""

    def __init__(self, root: Path, folder: Path) -> None:
        self.folder = folder / "tree"
        for name in git(root, "ls-files", "-co", "--exclude-standard"):
            if (root / name).is_file():
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(root / name, self.folder / name)
        if (root.parent / "shared").is_dir():  # recordings that some tests need
            (folder / "shared").symlink_to(root.parent / "shared")
        own = {name: str(folder / name.lower()) for name in ("XDG_CACHE_HOME", "XDG_DATA_HOME", "NUMBA_CACHE_DIR")}
        self._environment = {**os.environ, **own, "PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}
        self._usual_s: dict[tuple[str, ...], float] = {}

    def run(self, tests: Sequence[str], limit_s: float | None = None) -> int | None:
        """Run tests until one fails; return pytest's exit code, or None after `limit_s` seconds."""
        options = ["-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-p", "no:randomly", "-m", "not long", "--tb=no"]
        process = subprocess.Popen(
            [sys.executable, "-m", "pytest", *options, *tests],
            cwd=self.folder,
            env=self._environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that processes which tests started end with them
        )
        try:
            return process.wait(limit_s)
        except subprocess.TimeoutExpired:
            return None
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()

    def outcome(self, mutant: Mutant, tests: tuple[str, ...]) -> str:
        """Return what the tests make of a mutant; RuntimeError if they fail without it."""
        if tests not in self._usual_s:
            began = time.monotonic()
            if (code := self.run(tests)) != 0:
                raise RuntimeError(f"without a mutant, pytest ends with exit code {code}: {' '.join(tests)}")
            self._usual_s[tests] = time.monotonic() - began
        path = self.folder / mutant.file
        source = path.read_text("utf-8")
        path.write_text(mutant.apply(source), "utf-8")
        try:
            code = self.run(tests, 120 + 4 * self._usual_s[tests])  # a mutant recompiles what depends on it
        finally:
            path.write_text(source, "utf-8")
        return TIMED_OUT if code is None else SURVIVED if code == 0 else KILLED


def main(arguments: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Try a sample of mutants; return 1 if one survives."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--since", metavar="REVISION", help="change the files that differ from this revision of git")
    parser.add_argument("--only", action="append", metavar="GLOB", help="change files such as motionmind/search/*.py")
    parser.add_argument("--count", type=int, default=20, help="number of mutants (default: 20)")
    parser.add_argument("--seed", type=int, default=0, help="seed of the sample (default: 0)")
    given = parser.parse_args(arguments)
    names = git(root, "diff", "--name-only", given.since) if given.since else git(root, "ls-files")
    sources = {
        Path(one): (root / one).read_text("utf-8")
        for one in names
        if fnmatch(one, "motionmind/*.py") and any(fnmatch(one, glob) for glob in given.only or ["*"])
        if (root / one).is_file() and tests_of(root, Path(one))
    }
    every = [one for file, source in sources.items() for one in mutants(file, source)]
    if not every:
        parser.error("no file of motionmind with tests and mutants is among them")
    random.Random(given.seed).shuffle(every)
    sample = list(islice((one for one in every if one.is_different(sources[one.file])), given.count))
    outcomes: Counter[str] = Counter()
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        checkout = Checkout(root, Path(folder))
        for one in sorted(sample, key=lambda one: (one.file, one.line)):
            outcomes[outcome := checkout.outcome(one, tuple(tests_of(root, one.file)))] += 1
            print(f"{outcome:9} {one.file}:{one.line}", flush=True)
            if outcome == SURVIVED:
                texts = (text.splitlines() for text in (sources[one.file], one.apply(sources[one.file])))
                print("\n".join(difflib.unified_diff(*texts, str(one.file), "mutant", n=1, lineterm="")), flush=True)
    print(", ".join(f"{outcomes[kind]} {kind}" for kind in (KILLED, SURVIVED, TIMED_OUT)))
    return int(outcomes[SURVIVED] > 0)


if __name__ == "__main__":
    sys.exit(main())
