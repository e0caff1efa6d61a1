"""The list of mistakes fits the code as it stands, and nothing old hides one that is made."""

from __future__ import annotations

import ast
from collections import Counter
from dataclasses import replace
from pathlib import Path

import mutants
import pytest

LISTED = mutants.mutants()
SOURCES = mutants.ROOT / "motionmind"


@pytest.mark.parametrize("mutant", LISTED, ids=lambda mutant: mutant.name)
def test_every_mutant_applies_in_one_place_and_is_still_python(mutant: mutants.Mutant) -> None:
    source = (SOURCES / mutant.file).read_text(encoding="utf-8")
    assert ast.dump(ast.parse(mutant.apply(source))) != ast.dump(ast.parse(source))


def test_the_tests_that_should_notice_are_there() -> None:
    for mutant in LISTED:
        assert mutant.tests, mutant.name
        for test in mutant.tests:
            path, *name = test.split("::")
            text = (mutants.ROOT / "tests" / path).read_text(encoding="utf-8")
            assert all(f"def {part}(" in text for part in name), f"{mutant.name}: no {test}"


def test_there_are_enough_of_them_each_with_a_name_of_its_own() -> None:
    assert max(Counter(mutant.name for mutant in LISTED).values()) == 1
    count = Counter(mutant.package for mutant in LISTED)
    assert count["search"] >= 15
    assert all(count[package] >= 10 for package in ("grammar", "retarget", "formats", "metrics", "realise", "tween"))
    assert sum(mutant.file == "body/mirror.py" for mutant in LISTED) >= 5
    assert sum(bool(mutant.survives) for mutant in LISTED) <= 0.05 * len(LISTED)


def test_text_that_is_not_there_once_is_refused() -> None:
    mutant = replace(LISTED[0], old="a", new="b")
    assert mutant.apply("an") == "bn"
    for source, found in (("", "occurs 0 times"), ("aa", "occurs 2 times")):
        with pytest.raises(ValueError, match=found):
            mutant.apply(source)
    with pytest.raises(ValueError, match="would change nothing"):
        replace(mutant, new="a").apply("a")


def test_a_copy_is_changed_for_a_while_and_no_bytecode_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here/motionmind/search").mkdir(parents=True)
    (tmp_path / "here/motionmind/search/plain.py").write_text("y = 1\n")
    monkeypatch.setattr(mutants, "ROOT", tmp_path / "here")
    monkeypatch.setattr(mutants, "COPIED", ["motionmind"])
    copy = mutants.Copy(tmp_path / "there")
    path = copy.folder / "motionmind/search/plain.py"
    bytecode = path.parent / "__pycache__/plain.cpython-311.pyc"
    bytecode.parent.mkdir()
    bytecode.touch()
    with copy.changed(mutants.Mutant("a", "search/plain.py", "= 1", "= 2", "it", ())):
        assert path.read_text() == "y = 2\n"
        assert not bytecode.exists()
        bytecode.touch()
    assert path.read_text() == "y = 1\n"
    assert not bytecode.exists()


@pytest.mark.parametrize(
    ("test", "outcome"),
    [
        ("assert y == 1", mutants.KILLED),
        ("assert y > 0", mutants.SURVIVED),
        ("import time; y == 2 and time.sleep(60)", mutants.HANGS),
        ("import os; os._exit(2 if y == 2 else 0)", mutants.DOES_NOT_APPLY),
        ("import os; y == 2 and os.abort()", mutants.KILLED),
        ("assert y == 2", mutants.FAILS_ANYWAY),
    ],
)
def test_outcomes(test: str, outcome: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutants, "ROOT", tmp_path / "here")
    monkeypatch.setattr(mutants, "COPIED", ["motionmind", "tests"])
    monkeypatch.setattr(mutants, "LONGEST_START", 1.0 if outcome == mutants.HANGS else 60.0)
    monkeypatch.setattr(mutants, "PATIENCE", 1.0)
    # These tests need no plugin but that for `-n`; others take most of a start.
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_PLUGINS", "xdist.plugin")
    for name, text in (
        ("motionmind/__init__.py", ""),
        ("motionmind/plain.py", "y = 1\n"),
        ("tests/test_plain.py", f"from motionmind.plain import y\ndef test_y():\n    {test}\n"),
    ):
        (tmp_path / "here" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "here" / name).write_text(text)
    copy = mutants.Copy(tmp_path / "there")
    mutant = mutants.Mutant("a", "plain.py", "y = 1", "y = 2", "it", ("test_plain.py",))
    assert copy.outcome(mutant) == outcome
    if outcome == mutants.FAILS_ANYWAY:
        with pytest.raises(RuntimeError, match="ends with exit code"):
            copy.seconds("test_none.py")


def test_the_table_counts_by_subpackage_and_names_survivors() -> None:
    mine = [
        mutants.Mutant("one", "search/a.py", "", "", "it breaks", ()),
        mutants.Mutant("two", "search/a.py", "", "", "it breaks", ()),
        mutants.Mutant("three", "grammar/a.py", "", "", "nothing is seen", (), "it is slower, and the same"),
    ]
    rows = mutants.table(mine, [mutants.KILLED, mutants.HANGS, mutants.SURVIVED]).splitlines()
    assert "| grammar | 1 | 0 | 0 | 1 |" in rows
    assert "| search | 2 | 1 | 1 | 0 |" in rows
    assert "| all | 3 | 1 | 1 | 1 |" in rows
    assert rows[-1] == "| `three` | nothing is seen | it is slower, and the same |"


def test_a_log_saves_trying_what_was_killed_unless_it_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tried: list[str] = []

    def outcome(copy: mutants.Copy, mutant: mutants.Mutant) -> str:
        tried.append(mutant.name)
        return mutants.SURVIVED if mutant.name == LISTED[1].name else mutants.KILLED

    monkeypatch.setattr(mutants, "COPIED", [])
    monkeypatch.setattr(mutants.Copy, "outcome", outcome)
    chosen = [replace(mutant, survives="") for mutant in LISTED[:3]]
    monkeypatch.setattr(mutants, "mutants", lambda: chosen)
    arguments = ["--log", str(tmp_path / "log.json")]
    assert mutants.main(arguments) == 1
    assert mutants.main(arguments) == 1
    assert tried == [*(one.name for one in chosen), chosen[1].name]
    assert capsys.readouterr().out.count("| all | 3 | 2 | 0 | 1 |") == 2
    chosen[:] = [replace(chosen[0], new="pass"), replace(chosen[1], survives="it is seen by nobody"), chosen[2]]
    assert mutants.main(arguments) == 0
    assert tried[4:] == [chosen[0].name, chosen[1].name]
