"""The public interface: small, documented, with examples that run, quick to import."""

import ast
import doctest
import importlib
import inspect
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import motionmind

PACKAGE = Path(motionmind.__file__).parent
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if "_bundled" not in path.parts)

# Packages of specialised names; those of the command line and of notebooks have their own tests.
ROOMS = sorted(
    path.parent.name
    for path in PACKAGE.glob("*/__init__.py")
    if "__all__" in path.read_text("utf-8") and path.parent.name not in ("cli", "notebook")
)
NAMES = sorted(
    f"{package}.{name}"
    for package in ("motionmind", *(f"motionmind.{room}" for room in ROOMS))
    for name in importlib.import_module(package).__all__
)


@cache
def tree_of(path: Path) -> ast.Module:
    """The syntax of a module, which two tests look at."""
    return ast.parse(path.read_text("utf-8"))


def public(name: str) -> Any:
    """Return what a dotted public name stands for."""
    package, _, last = name.rpartition(".")
    return getattr(importlib.import_module(package), last)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_exists_and_is_documented(name: str) -> None:
    thing = public(name)
    assert inspect.getdoc(thing)
    if inspect.isclass(thing):
        methods = inspect.getmembers(thing, lambda member: inspect.isfunction(member) or inspect.ismethod(member))
        undocumented = [key for key, method in methods if not key.startswith("_") and not inspect.getdoc(method)]
        assert not undocumented


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_has_an_example_that_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = {one.name: one for one in doctest.DocTestFinder().find(public(name), name, globs={})}
    assert name in found, f"{name} shows no example"
    # Nothing is at hand but what the example itself imports, as for a reader who types it.
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL)
    for one in found.values():  # also of its methods
        runner.run(one)
    assert runner.failures == 0


def test_the_package_has_few_names() -> None:
    assert len(motionmind.__all__) <= 45
    assert len({name.rpartition(".")[2] for name in NAMES}) == len(NAMES), "a name is public in two places"


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("__init__.pyi")), ids=lambda path: path.parent.name)
def test_the_names_are_those_of_the_stub_and_each_is_found_by_tab(path: Path) -> None:
    stub = ast.parse(path.read_text("utf-8"))
    imported = [alias.name for node in stub.body if isinstance(node, ast.ImportFrom) for alias in node.names]
    package = importlib.import_module(".".join(path.relative_to(PACKAGE.parent).parts[:-1]))
    assert sorted(imported) == sorted(set(imported)) == sorted(package.__all__)
    listed = next(node for node in stub.body if isinstance(node, ast.Assign))
    assert ast.literal_eval(listed.value) == sorted(imported)
    assert set(package.__all__) <= set(dir(package))


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="Motor"):
        motionmind.Motor  # noqa: B018


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_everything_that_is_not_private_has_a_docstring(path: Path) -> None:
    tree = tree_of(path)
    assert len(ast.get_docstring(tree) or "") > 3
    undocumented = [node.name for node in _public(tree) if not ast.get_docstring(node)]
    assert not undocumented


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_docstrings_begin_with_a_verb_or_a_noun(path: Path) -> None:
    tree = tree_of(path)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    nodes = [node for node in ast.walk(tree) if isinstance(node, documented)]
    first = {getattr(node, "name", path.stem): (ast.get_docstring(node) or "").split(" ")[0] for node in nodes}
    assert {name: word for name, word in first.items() if word in ("What", "How", "Whose", "Why")} == {}


def _public(node: ast.Module | ast.ClassDef) -> Iterator[ast.FunctionDef | ast.ClassDef]:
    """Functions and classes that are not private, and the methods of such classes."""
    for child in node.body:
        if isinstance(child, ast.FunctionDef | ast.ClassDef) and not child.name.startswith("_"):
            yield child
            if isinstance(child, ast.ClassDef):
                yield from _public(child)


def test_importing_motionmind_imports_nothing_heavy() -> None:
    code = (
        "import sys, motionmind; print([m for m in ('numpy', 'numba', 'scipy', 'pgmpy', 'click') if m in sys.modules])"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip() == "[]"
    )
