"""The public interface: small, documented, quick to import."""

import ast
import inspect
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import motionmind

PACKAGE = Path(motionmind.__file__).parent
MODULES = sorted(path for path in PACKAGE.rglob("*.py") if "_bundled" not in path.parts)


@pytest.mark.parametrize("name", motionmind.__all__)
def test_every_public_name_exists_and_is_documented(name: str) -> None:
    thing = getattr(motionmind, name)
    assert inspect.getdoc(thing)
    if inspect.isclass(thing):
        methods = inspect.getmembers(thing, lambda member: inspect.isfunction(member) or inspect.ismethod(member))
        undocumented = [key for key, method in methods if not key.startswith("_") and not inspect.getdoc(method)]
        assert not undocumented


def test_every_public_name_is_listed_once_and_typed() -> None:
    source = (PACKAGE / "__init__.py").read_text()
    typed = [
        alias.asname or alias.name
        for block in ast.parse(source).body
        if isinstance(block, ast.If)
        for statement in block.body
        if isinstance(statement, ast.ImportFrom)
        for alias in statement.names
    ]
    assert sorted(typed) == sorted(motionmind.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Motor'"):
        motionmind.Motor  # noqa: B018


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_everything_that_is_not_private_has_a_docstring(path: Path) -> None:
    tree = ast.parse(path.read_text())
    assert ast.get_docstring(tree)
    undocumented = [node.name for node in _public(tree) if not ast.get_docstring(node)]
    assert not undocumented


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
