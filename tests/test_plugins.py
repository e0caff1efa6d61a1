"""What other packages add, by a package that is really installed: a folder on the path with its module and metadata."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind import (
    Engine,
    FormatError,
    Motion,
    MotionMindError,
    read_motion,
    read_variation,
    vary,
    write_motion,
    write_variation,
)
from motionmind.chaos import find_flow
from motionmind.discretize import make_discretization
from motionmind.discretize.spec import from_spec, to_spec
from motionmind.discretize.states import StateSpace
from motionmind.formats import lossy_fields
from motionmind.plots.portrait import portrait_of
from motionmind.plugins import Group, added

ADAGIO = ballet_clip("adagio").slice(0, 12)

MODULE = '''
import json
from dataclasses import dataclass, field, replace

import numpy as np
from motionmind import FormatError, Motion, human23
from motionmind.chaos import Flow
from motionmind.discretize import make_discretization


class Dots:
    """Movement of human23 as JSON, without its name."""

    def read_motion(self, path, *, fps):
        try:
            data = json.loads(path.read_bytes())
        except ValueError as error:
            raise FormatError(f"not dots: {error}", path=path) from None
        times = np.arange(len(data["root"])) / fps if fps else data["times"]
        return Motion(human23(), data["rotations"], data["root"], times)

    def motion_bytes(self, motion):
        parts = {name: getattr(motion, name).tolist() for name in ("rotations", "root", "times")}
        return json.dumps(parts).encode()

    def lossy_fields(self, motion):
        return ["the name"]


@dataclass(frozen=True)
class Halves:
    """Two states a joint at most: the codebook of 180 degrees."""

    tolerance: float = 15.0
    per_joint: dict = field(default_factory=dict)
    kind = "halves"

    def fit(self, names, rotations):
        return make_discretization("codebook", 180.0).fit(names, rotations)

    def to_spec(self):
        return {"kind": self.kind, "tolerance": self.tolerance, "per_joint": dict(self.per_joint)}


def product(x, a):
    return x[1] * x[2], x[0] - x[1], a - x[0] * x[1]


# Sprott, Phys. Rev. E 50:R647 (1994), case B
sprott = Flow("sprott", product, start=(0.05, 0.05, 0.05), step=0.05, parameters={"a": 1.0}, dimensions=("u", "v", "w"))


class Torn:
    def read_motion(self, path, *, fps):
        raise KeyError("no such\\nthing")

    def motion_bytes(self, motion):
        return "text"

    def lossy_fields(self, motion):
        return []


class Reading:
    def read_motion(self, path, *, fps):
        return 42


number = 42
'''
ENTRY_POINTS = """
[motionmind.formats]
dots = tiny_motion:Dots
torn = tiny_motion:Torn
reading = tiny_motion:Reading
absent = tiny_motion.nowhere:Dots
bvh = tiny_motion:Torn

[motionmind.discretizations]
halves = tiny_motion:Halves
numbers = tiny_motion:number
codebook = tiny_motion:number

[motionmind.flows]
sprott = tiny_motion:sprott
other = tiny_motion:sprott
lorenz = tiny_motion:number
"""


def install(folder: Path, name: str, entry_points: str) -> None:
    metadata = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(entry_points)


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Where the package tiny-motion is installed."""
    place = tmp_path / "site"
    install(place, "tiny-motion", ENTRY_POINTS)
    (place / "tiny_motion.py").write_text(MODULE)
    monkeypatch.syspath_prepend(place)
    monkeypatch.setenv("PYTHONPATH", str(place), prepend=":")
    yield place
    sys.modules.pop("tiny_motion", None)


@pytest.mark.usefixtures("installed")
def test_a_format_is_read_and_written_by_its_suffix(tmp_path: Path, run: Run) -> None:
    write_motion(tmp_path / "clip.dots", ADAGIO)
    again = read_motion(tmp_path / "clip.dots")
    assert isinstance(again, Motion)
    np.testing.assert_array_equal(again.rotations, ADAGIO.rotations)
    np.testing.assert_allclose(read_motion(tmp_path / "clip.dots", fps=10.0).times, np.arange(12) / 10.0)
    assert lossy_fields(ADAGIO, "clip.dots") == ["the name"]
    done = run("convert", "clip.dots", "clip.json")
    assert done.code == 0, done.err
    done = run("convert", "clip.json", "other.dots")
    assert done.code == 0, done.err
    assert "the name" in done.err + done.out
    np.testing.assert_allclose(read_motion(tmp_path / "other.dots").rotations, ADAGIO.rotations, atol=1e-9)
    done = run("corpus", "build", "mine", "clip.dots", "--rate", "2")
    assert done.code == 0, done.err


@pytest.mark.usefixtures("installed")
def test_a_discretization_is_made_by_its_name_and_by_its_specification() -> None:
    halves = make_discretization("halves", tolerance=20.0, per_joint={"left_hip": 5.0})
    assert to_spec(halves) == {"kind": "halves", "tolerance": 20.0, "per_joint": {"left_hip": 5.0}}
    assert from_spec(to_spec(halves)) == halves
    engine = Engine.fit([ADAGIO], discretization=halves)
    assert isinstance(engine.space, StateSpace)
    assert max(engine.grammar.transitions.sizes()[:23]) <= 2


@pytest.mark.usefixtures("installed")
def test_a_flow_varies_a_piece_and_is_found_again_in_its_file(tmp_path: Path, run: Run) -> None:
    assert find_flow("sprott", a=1.1).parameters["a"] == 1.1
    write_variation(tmp_path / "variation.json", vary(ADAGIO, flow=find_flow("sprott"), nudge=0.5))
    assert portrait_of(read_variation(tmp_path / "variation.json")).flow.dimensions == ("u", "v", "w")
    write_motion(tmp_path / "clip.json", ADAGIO)
    done = run("vary", "clip.json", "--attractor", "sprott", "--nudge", "0.5", "-o", "varied.json")
    assert done.code == 0, done.err


@pytest.mark.usefixtures("installed")
def test_what_is_built_in_stays(tmp_path: Path) -> None:
    write_motion(tmp_path / "clip.bvh", ADAGIO.resample(10.0))
    assert len(read_motion(tmp_path / "clip.bvh")) == len(ADAGIO.resample(10.0))
    assert make_discretization("codebook").kind == "codebook"
    assert find_flow("lorenz").parameters["rho"] == 45.0


@pytest.mark.usefixtures("installed")
def test_a_broken_package_is_named_in_a_line(tmp_path: Path, run: Run) -> None:
    for name in ("clip.torn", "clip.reading", "clip.absent", "clip.nothing"):
        (tmp_path / name).write_text("[")
    (tmp_path / "clip.dots").write_text("[")
    reads = {
        "clip.torn": "torn in motionmind.formats, by the package tiny-motion, fails: KeyError: 'no such",
        "clip.reading": "reading in motionmind.formats, by the package tiny-motion, must be a MotionReader, which",
        "clip.absent": "absent in motionmind.formats, by the package tiny-motion, cannot be imported: ModuleNotFound",
        "clip.dots": "clip.dots: not dots: ",
        "clip.nothing": "files that can be read end in .json, .bvh, .*, .absent, .bvh, .dots, .reading, .torn",
    }
    for name, words in reads.items():
        with pytest.raises(MotionMindError, match=words) as error:
            read_motion(tmp_path / name)
        assert "\n" not in str(error.value)
        done = run("render", name, "-o", "clip.png")
        assert (done.code, done.err.count("\n")) == (2, 1), done.err
    writes = {"out.torn": "which returns bytes, not a str", "out.reading": "must be a MotionWriter to be written"}
    for name, words in writes.items():
        with pytest.raises(MotionMindError, match=words):
            write_motion(tmp_path / name, ADAGIO)
        assert not (tmp_path / name).exists()
    for make, words in (
        (lambda: make_discretization("numbers"), "numbers in motionmind.discretizations, by .* must be a class or"),
        (lambda: from_spec({"kind": "halves", "width": 3}), "fails: TypeError: .*'width'"),
        (lambda: make_discretization("halvs"), "did you mean halves"),
        (
            lambda: find_flow("other"),
            "other in motionmind.flows, by the package tiny-motion, must be a Flow of that name",
        ),
        (lambda: find_flow("sprot"), "did you mean sprott"),
    ):
        with pytest.raises(MotionMindError, match=words):
            make()


def test_one_name_in_two_packages_is_said_to_be(installed: Path) -> None:
    install(installed, "other-motion", "[motionmind.formats]\ndots = tiny_motion:Dots\n")
    with pytest.raises(
        MotionMindError, match=r"several packages add .*: other-motion, tiny-motion; uninstall all but one"
    ):
        write_motion(installed / "clip.dots", ADAGIO)


@pytest.mark.parametrize("group", ["motionmind.formats", "motionmind.discretizations", "motionmind.flows"])
def test_where_nothing_is_installed_nothing_is_added(group: Group) -> None:
    assert added(group) == []
    with pytest.raises(FormatError, match=r"suffix '.dots' is unknown; .*\.vrma$"):
        read_motion("clip.dots")


def test_packages_are_imported_only_when_they_are_used(installed: Path, tmp_path: Path) -> None:
    """What is built in is found without a look at what is installed."""
    write_motion(tmp_path / "clip.json", ADAGIO)
    code = (
        "import sys\n"
        "import motionmind as mm\n"
        "from motionmind import chaos, discretize\n"
        "motion = mm.read_motion('clip.json'); mm.write_motion('clip.glb', motion)\n"
        "discretize.make_discretization('codebook'); mm.vary(motion, flow=chaos.find_flow('lorenz'))\n"
        "print('tiny_motion' in sys.modules)\n"
        "from motionmind.plugins import added\n"
        "print(added('motionmind.formats'), 'tiny_motion' in sys.modules)\n"
        "chaos.find_flow('sprott'); print('tiny_motion' in sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines == ["False", "['absent', 'bvh', 'dots', 'reading', 'torn'] False", "True"]
