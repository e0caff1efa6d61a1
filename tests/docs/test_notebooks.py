"""The notebooks run, from the first cell to the last, in a kernel, and say no figure that they do not compute."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))

nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")

each = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def read(path: Path) -> Any:
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    return notebook


def words(path: Path) -> str:
    return "\n\n".join(cell.source for cell in read(path).cells if cell.cell_type == "markdown")


def test_there_are_notebooks() -> None:
    assert {path.stem for path in NOTEBOOKS} >= {"own-corpus", "certificate", "variations"}


@each
def test_a_notebook_runs_and_shows_what_its_words_promise(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed")
    monkeypatch.setenv("MOTIONMIND_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    folder = tmp_path / "notebook"
    folder.mkdir()
    notebook = read(path)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    outputs = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
    assert [output for output in outputs if output.get("name") == "stderr"] == []  # no warning either
    assert any("<iframe" in output.get("data", {}).get("text/html", "") for output in outputs)
    assert sum(len(re.findall(r"\d", output.get("text", ""))) for output in outputs) > 50
    last_lines = [
        cell.source.splitlines()[-1].strip() for cell in notebook.cells if cell.cell_type == "code" and not cell.outputs
    ]
    assert [line for line in last_lines if not line.startswith("write_motion")] == []


@each
def test_no_word_states_a_figure_that_a_cell_could_compute(path: Path) -> None:
    prose = re.sub(r"`[^`]*`|\]\([^)]*\)", "", words(path))
    assert re.findall(r"\d+\.\d+|\d+ ?%|\d+ (?:nats|postures|moves|seconds|jumps)", prose) == []


@each
def test_a_notebook_is_stored_without_outputs(path: Path) -> None:
    for cell in read(path).cells:
        if cell.cell_type == "code":
            assert (cell.outputs, cell.execution_count) == ([], None)


@each
def test_every_link_of_a_notebook_leads_to_a_file(path: Path) -> None:
    links = re.findall(r"\]\(([^)#]+)", words(path))
    assert links
    assert [link for link in links if not (path.parent / link).is_file()] == []


def test_the_how_to_names_every_notebook() -> None:
    text = (ROOT / "docs" / "how-to" / "notebooks.md").read_text("utf-8")
    assert [path.name for path in NOTEBOOKS if f"../notebooks/{path.name}" not in text] == []
