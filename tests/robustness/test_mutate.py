"""Mutants are programs, each a mistake away from the code; tests notice some, and the others are reported."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import mutate
import pytest

FILE = Path("motionmind/room/plain.py")
SOURCE = '''"""A module."""


def at_least(a: float, b: float) -> bool:
    """Return whether "é" is there."""
    return a + 0.5 >= b and not f"{a + b}" == "é"
'''
TEST = "from motionmind.room.plain import at_least\ndef test_it():\n    assert {}\n"


@pytest.mark.parametrize(
    ("source", "mistakes"),
    [
        ("x = a < b", {"x = a <= b", "x = a >= b"}),
        ("x = a is not b", {"x = a is b"}),
        ("x = a * (b - c)", {"x = a / (b - c)", "x = a * (b + c)"}),
        ("x = a and b", {"x = a or b"}),
        ("if a:\n    b = 2", {"if not (a):\n    b = 2", "if a:\n    b = 3"}),
        ("x = 2.0", {"x = 3.0"}),
        ("x = True", {"x = False"}),
        ("x += f(a)", {"x -= f(a)", "pass"}),
        ("f(a, b)", {"f(b, a)", "pass"}),
        ("max(a, b)", {"pass"}),
        ("def f(x: int = 1) -> int:\n    return x", {
            "def f(x: int = 2) -> int:\n    return x",
            "def f(x: int = 1) -> int:\n    return 0\n    return x",
        }),
        ('x = f"{1 + 2}"', set()),
        ("x = a", set()),
    ],
)  # fmt: skip
def test_mistakes(source: str, mistakes: set[str]) -> None:
    assert {one.apply(source) for one in mutate.mutants(FILE, source)} == mistakes


def test_a_mistake_is_a_program_and_not_the_same_one() -> None:
    def is_different(old: str, new: str) -> bool:
        return mutate.Mutant(FILE, 1, 0, len(old), new).is_different(old)

    assert is_different("x = 1", "x = 2")
    assert not is_different("x = 1", "x = (1)")
    assert not is_different("x = 1", "break")


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A toy checkout with a module and its room of tests."""
    root = tmp_path / "here"
    for name, text in (("motionmind/__init__.py", ""), ("motionmind/room/__init__.py", ""), (str(FILE), SOURCE)):
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, "utf-8")
    (root / "tests/room").mkdir(parents=True)
    (root / "pytest.ini").write_text("[pytest]\nmarkers = long: slow\n")
    (root / "tests/room/test_plain.py").write_text(TEST.format("at_least(1.0, 1.0) is True"), "utf-8")
    for arguments in (["init", "-q"], ["add", "."]):
        subprocess.run(["git", *arguments], cwd=root, check=True)
    return root


@pytest.fixture
def _few_plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    """Load only what the options of the run need: other plugins take most of a start."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_PLUGINS", "xdist.plugin")


needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")


@needs_git
@pytest.mark.usefixtures("_few_plugins")
def test_one_is_noticed_and_one_is_not_and_the_checkout_stays_as_it_was(
    checkout: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = mutate.Checkout(checkout, tmp_path / "there")
    found = {one.new: one for one in mutate.mutants(FILE, SOURCE)}
    tests = ("tests/room",)
    assert own.outcome(found["a - 0.5"], tests) == mutate.KILLED
    assert own.outcome(found["a + 0.5 > b"], tests) == mutate.SURVIVED
    monkeypatch.setattr(mutate.Checkout, "run", lambda *_: None)
    assert own.outcome(found["a - 0.5"], tests) == mutate.TIMED_OUT
    assert (checkout / FILE).read_text("utf-8") == (own.folder / FILE).read_text("utf-8") == SOURCE


@needs_git
@pytest.mark.usefixtures("_few_plugins")
def test_tests_end_after_their_time(checkout: Path, tmp_path: Path) -> None:
    (checkout / "tests/room/test_plain.py").write_text("import time\ntime.sleep(60)\n")
    assert mutate.Checkout(checkout, tmp_path / "there").run(["tests/room"], 0.5) is None


@needs_git
@pytest.mark.usefixtures("_few_plugins")
def test_tests_must_pass_without_a_mutant(checkout: Path, tmp_path: Path) -> None:
    (checkout / "tests/room/test_plain.py").write_text(TEST.format("False"))
    own = mutate.Checkout(checkout, tmp_path / "there")
    with pytest.raises(RuntimeError, match="without a mutant, pytest ends with exit code 1: tests/room"):
        own.outcome(mutate.mutants(FILE, SOURCE)[0], ("tests/room",))


@needs_git
def test_a_run_reports_survivors_by_line_and_difference(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(
        mutate.Checkout, "outcome", lambda _, mutant, tests: mutate.SURVIVED if ">" in mutant.new else mutate.KILLED
    )
    assert mutate.main(["--count", "99"], checkout) == 1
    printed = capsys.readouterr().out
    assert "survived  motionmind/room/plain.py:6\n--- motionmind/room/plain.py\n+++ mutant\n" in printed
    assert "\n-    return a + 0.5 >= b" in printed
    monkeypatch.setattr(mutate.Checkout, "outcome", lambda _, mutant, tests: mutate.KILLED)
    assert mutate.main(["--count", "2", "--only", "motionmind/room/*"], checkout) == 0
    assert "2 killed, 0 survived, 0 timed out" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        mutate.main(["--only", "tests/*"], checkout)


@needs_git
def test_tests_are_those_of_the_room_and_those_that_import_the_module(checkout: Path) -> None:
    for name, text in (
        ("a", "from motionmind.room.plain import at_least"),
        ("b", "from motionmind.room import other, plain"),
        ("c", "from motionmind.room import other\nplain = 1"),
    ):
        (checkout / f"tests/test_{name}.py").write_text(text)
    assert mutate.tests_of(checkout, FILE) == ["tests/room", "tests/test_a.py", "tests/test_b.py"]
