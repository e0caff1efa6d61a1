"""Learning from a corpus: what it depends on, and how it is summarised."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import platformdirs
import pytest

import motionmind
from motionmind.corpus.fingerprint import LEARNED_BY, fingerprint
from motionmind.learned.model import LearnedCorpus
from motionmind.learned.summary import CorpusCheck, CorpusSummary, summarise, to_plain
from motionmind.tween.engine import Engine

PACKAGE = Path(motionmind.__file__).parent


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a built corpus."""
    folder = tmp_path_factory.mktemp("built") / "hexapod"
    LearnedCorpus.load("walk-hexapod").save(folder)
    return folder


# --- loading ----------------------------------------------------------------------------------------------------------


def test_an_engine_is_what_its_corpus_is_learned_as(built: Path) -> None:
    engine, learned = Engine.load(str(built)), LearnedCorpus.load(str(built))
    assert type(engine) is Engine
    assert type(learned) is LearnedCorpus
    np.testing.assert_array_equal(engine.states, learned.states)
    assert engine.load_seconds > 0.0


# --- summaries --------------------------------------------------------------------------------------------------------


def test_summaries_are_plain_values_in_the_order_of_their_fields(built: Path) -> None:
    engine = Engine.load(str(built))
    info, check = engine.info(), engine.check(pairs=10)
    assert tuple(info) == CorpusSummary.__struct_fields__
    assert tuple(check) == CorpusCheck.__struct_fields__
    assert list(check.items())[: len(info)] == list(info.items())
    assert info == json.loads(json.dumps(info))
    weighted = replace(engine.corpus, rate=np.float64(2.0))
    assert type(to_plain(summarise(weighted, engine.grammar))["rate"]) is float


# --- the fingerprint --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package's sources."""
    folder = tmp_path_factory.mktemp("package") / "motionmind"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.mark.parametrize("file", ["render/camera.py", "cli/tweens.py", "search/astar.py", "__init__.py"])
def test_a_change_to_what_learning_does_not_use_leaves_the_fingerprint(copied: Path, file: str) -> None:
    before = fingerprint([], copied)
    assert before == fingerprint([])
    source = (copied / file).read_bytes()
    (copied / file).write_bytes(source + b"\n# changed\n")
    assert fingerprint([], copied) == before
    (copied / file).write_bytes(source)


@pytest.mark.parametrize(
    "file",
    ["learned/posture_statistics.py", "geometry/rotations.py", "formats/bvh.py", "jit.py", "body/bodies/human23.toml"],
)
def test_a_change_to_what_learning_uses_changes_the_fingerprint(copied: Path, file: str) -> None:
    before, source = fingerprint([], copied), (copied / file).read_bytes()
    (copied / file).write_bytes(source + b"\n# changed\n")
    assert fingerprint([], copied) != before
    (copied / file).write_bytes(source)
    assert fingerprint([], copied) == before


def test_learning_imports_nothing_that_the_fingerprint_leaves_out(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "from motionmind.learned.model import LearnedCorpus\n"
        "LearnedCorpus.load('hands')\n"
        "print(*sorted(name for name in sys.modules if name.startswith('motionmind')))\n"
    )
    places = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "MOTIONMIND_HOME": str(tmp_path / "home")}
    usual = platformdirs.user_cache_dir("motionmind", appauthor=False)
    compiled = {"NUMBA_CACHE_DIR": os.environ.get("NUMBA_CACHE_DIR", usual)}  # which is not what is tested
    run = subprocess.run(
        [sys.executable, "-c", program], env=os.environ | places | compiled, capture_output=True, text=True, check=True
    )
    rooms = {name.split(".")[1] for name in run.stdout.split() if "." in name}
    assert "notation" in rooms  # it was learned, not found
    assert rooms <= {Path(name).stem for name in LEARNED_BY}
