"""The documents are true: their commands and Python run, their options, links and citations exist."""

from __future__ import annotations

import ast
import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import click
import numpy as np
import pytest
from bundled_clips import ballet_clip
from click_tracks import at_tempo, clicks
from command_line import Run
from ingredients import altered
from PIL import Image, ImageChops

import motionmind
from motionmind import __version__, write_motion
from motionmind.cli import app
from motionmind.corpus.gather import Gathering
from motionmind.tween.request import SeamOptions, TweenOptions

ROOT = Path(__file__).parents[2]
README, GALLERY, REFERENCES = ROOT / "README.md", ROOT / "docs" / "gallery.md", ROOT / "docs" / "references.md"
PROOF = ROOT / "docs" / "proof.md"
GUIDES = [
    README,
    ROOT / "docs" / "tutorial.md",
    *sorted((ROOT / "docs" / "how-to").glob("*.md")),
    PROOF,
    ROOT / "docs" / "api.md",
]
EXPERIMENTS = sorted((ROOT / "experiments").rglob("README.md"))
DOCUMENTS = [
    *(ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md")),
    *sorted(path for path in (ROOT / "docs").rglob("*.md") if "_build" not in path.parts),
    *EXPERIMENTS,
]
OTHER_PROGRAMS = ("python -m tests.", "pip", "pytest", "sphinx-build", "ruff", "npm", "bash", "pre-commit")


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


each = pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)


# --- reading documents ----------------------------------------------------------------------------------------------


class Block(NamedTuple):
    """A block of code: its language, "" where it is indented or has none."""

    language: str
    text: str


def blocks(text: str) -> Iterator[Block]:
    """The blocks of code in a document, in order."""
    fenced = re.compile(r"^( *)```([^\n]*)\n(.*?)^\1```$", re.M | re.S)
    at = 0
    for found in fenced.finditer(text):
        yield from indented(text[at : found.start()])
        yield Block(found[2].strip(), found[3])
        at = found.end()
    yield from indented(text[at:])


def indented(text: str) -> Iterator[Block]:
    for is_code, lines in groupby(text.splitlines(), lambda line: line.startswith("    ")):
        if is_code:
            yield Block("", "\n".join(line.strip() for line in lines))


def commands_of(block: Block) -> list[str]:
    """The command lines of motionmind in a block, without what stands before them in a line."""
    if block.language not in ("", "sh", "bash", "console"):
        return []
    lines = (line.strip().removeprefix("$ ").rpartition("&& ")[2] for line in block.text.splitlines())
    return [line for line in lines if line.startswith("motionmind ")]


def prose(text: str) -> str:
    """A document without its blocks of code."""
    text = re.sub(r"^( *)```.*?^\1```$", "", text, flags=re.M | re.S)
    return "\n".join(line for line in text.splitlines() if not line.startswith("    "))


def spans(text: str) -> list[str]:
    """What stands in backticks in a document's prose, each on one line."""
    return [" ".join(span.split()) for span in re.findall(r"(?<!`)`([^`]+)`(?!`)", prose(text))]


def slugs(text: str) -> set[str]:
    """The anchors of a document's headings, as hosts of repositories and MyST make them."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ +(.+)$", re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S), re.M):
        slug = re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        numbered = (f"{slug}-{n}" if n else slug for n in range(100))
        found.add(next(one for one in numbered if one not in found))
    return found


def test_blocks_prose_and_anchors_are_read_from_markdown() -> None:
    text = "# A `b`, c\nSay `--x\ny`.\n\n    $ pip install . && motionmind list\n\n"
    text += "```python\n# no heading\n```\n## A b c\n"
    assert [*blocks(text)] == [Block("", "$ pip install . && motionmind list"), Block("python", "# no heading\n")]
    assert commands_of(next(blocks(text))) == ["motionmind list"]
    assert spans(text) == ["b", "--x y"]
    assert slugs(text) == {"a-b-c", "a-b-c-1"}


# --- commands and options -------------------------------------------------------------------------------------------


def all_commands(group: click.Group) -> Iterator[click.Command]:
    for command in group.commands.values():
        yield command
        if isinstance(command, click.Group):
            yield from all_commands(command)


@cache
def all_options() -> frozenset[str]:
    """Every option of every command."""
    options = {"--help"}
    for command in all_commands(app):
        for parameter in command.params:
            options |= {*parameter.opts, *parameter.secondary_opts}
    return frozenset(options)


def check_command(line: str, *, whole: bool = True) -> None:
    """Fail if a command line names no command, or a command no such options or not so many arguments."""
    words = shlex.split(line)[1:]
    command: click.Command = app
    context = click.Context(app, info_name="motionmind")
    while isinstance(command, click.Group) and words and not words[0].startswith("-"):
        name, *words = words
        assert name in command.commands, f"{line}: there is no command {name}"
        command = command.commands[name]
        context = click.Context(command, context, name)
    if not whole:
        unknown = [word for word in words if word.startswith("--") and word.partition("=")[0] not in all_options()]
        assert not unknown, f"{line}: {unknown}"
        return
    try:
        values, left, _ = command.make_parser(context).parse_args(words)
    except click.UsageError as error:
        pytest.fail(f"{line}: {error.format_message()}")
    assert not left, f"{line}: {left} is too much"
    missing = [one.name for one in command.params if one.required and values.get(one.name or "") in (None, ())]
    assert not missing, f"{line}: without {missing}"


@each
def test_every_command_exists_with_its_options(document: Path) -> None:
    text = document.read_text("utf-8")
    for block in blocks(text):
        for line in commands_of(block):
            check_command(line)
    for span in spans(text):
        if re.match(r"motionmind [a-z]", span):
            check_command(span, whole=False)


@each
def test_every_option_in_the_prose_exists(document: Path) -> None:
    known = set(all_options())
    for script in document.parent.glob("*.py"):
        known |= set(re.findall(r"--[a-z][a-z-]*", script.read_text("utf-8")))
    for span in spans(document.read_text("utf-8")):
        if not span.startswith(OTHER_PROGRAMS):
            named = re.findall(r"(?<!\S)--[a-z][a-z-]*", span)
            assert set(named) <= known, f"`{span}`"


@pytest.mark.parametrize("document", EXPERIMENTS, ids=name_of)
def test_every_command_of_an_experiment_names_its_script_and_options(document: Path) -> None:
    lines = [line.strip() for block in blocks(document.read_text("utf-8")) for line in block.text.splitlines()]
    commands = [shlex.split(line) for line in lines if line.startswith("python ")]
    assert commands
    for _, first, *words in commands:
        if first == "-m":
            assert words[0] == "experiments"
            assert words[1:] == [document.parent.name]
            assert (document.parent / "run.py").exists()
        else:
            source = (ROOT / first).read_text("utf-8")
            assert [word for word in words if word.startswith("--") and f'"{word}"' not in source] == []


# --- running --------------------------------------------------------------------------------------------------------


@pytest.fixture
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the corpora that a document builds are."""
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two recordings, a song, a character and a licence, as a user has them."""
    folder = tmp_path_factory.mktemp("recordings")
    for name, clip, frames in (("clip", "adagio", 600), ("plies", "plies", 300)):
        write_motion(folder / f"{name}.bvh", ballet_clip(clip).resample(30.0).slice(0, frames))
    write_motion(folder / "character.glb", ballet_clip("plies").slice(0, 1))
    (folder / "song.wav").write_bytes(clicks(at_tempo(108.0, 0.4, 39.0), 40.0).encode("WAV"))
    (folder / "LICENCE.txt").write_text("Free for all uses.\n")
    return folder


@pytest.fixture
def here(tmp_path: Path, home: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder outside of any checkout, where commands run."""
    monkeypatch.setenv("MOTIONMIND_HOME", str(home))
    return tmp_path


def write_files(document: Path, folder: Path) -> None:
    """Write the files that a document's commands read: its blocks that begin with a comment and a name."""
    for block in blocks(document.read_text("utf-8")):
        if named := re.match(r"# (\S+\.toml)\n", block.text):
            (folder / named[1]).write_text(block.text, "utf-8")


def call(run: Run, line: str) -> None:
    """Run a command line in this process; words with a * are patterns, as a shell has them."""
    words = shlex.split(line)[1:]
    done = run(*(name for word in words for name in (sorted(Path().glob(word)) if "*" in word else [word])))
    assert done.code == 0, f"{line}: {done.err}"


def test_readme_leads_with_the_two_commands() -> None:
    commands = [line.strip() for line in re.findall(r"^    (\S.*)$", README.read_text("utf-8"), re.M)]
    assert commands[0].startswith("pip install . && motionmind tween ")
    assert commands[1] == 'pip install -e ".[dev]" && pytest'


@pytest.mark.long
def test_the_first_command_runs(here: Path) -> None:
    text = README.read_text("utf-8")
    command = next(line for block in blocks(text) for line in commands_of(block))
    scripts = str(Path(sys.executable).parent)  # `motionmind` is this interpreter's
    environment = {**os.environ, "PATH": f"{scripts}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(command, shell=True, cwd=here, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    shown = next(block.text for block in blocks(text) if block.language == "text")
    assert [line.rstrip() for line in done.stdout.splitlines()] == [line.rstrip() for line in shown.splitlines()]
    assert_same_picture(here / "tween.gif", ROOT / "docs" / "arabesque-to-fifth.gif")


@pytest.mark.long
@pytest.mark.parametrize("document", GUIDES, ids=name_of)
def test_the_commands_and_the_python_of_a_guide_run(
    document: Path, here: Path, recordings: Path, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(recordings, here, dirs_exist_ok=True)
    namespace: dict[str, object] = {"__name__": "__main__"}
    first = document == README  # whose first command runs in a test of its own
    write_files(document, here)
    for block in blocks(document.read_text("utf-8")):
        for line in commands_of(block)[first:]:
            if not line.startswith("motionmind serve"):  # which does not end
                call(run, line)
        first = first and not commands_of(block)
        if block.language == "python":
            exec(compile(block.text, name_of(document), "exec"), namespace)
    capsys.readouterr()
    for line in (line for block in blocks(document.read_text("utf-8")) for line in commands_of(block)):
        written = re.search(r" -o (\S+)", line)
        if written and document != README:
            path = here / written[1]
            assert path.exists() or path.with_stem(f"{path.stem}-1").exists(), line


@pytest.mark.long
def test_the_proof_adds_up_and_would_not_if_an_ingredient_were_another(
    here: Path, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    document = [*blocks(PROOF.read_text("utf-8"))]
    (script,) = (block.text for block in document if block.language == "python")
    for block in document:
        for line in commands_of(block):
            call(run, line)
    problem = Path("problem.cfn").read_text("utf-8")

    def differences() -> list[bool]:
        """Whether moves, coordination, guide and the whole differ between the two lines that the script prints."""
        capsys.readouterr()
        exec(compile(script, name_of(PROOF), "exec"), {})
        file, report = (np.array(line.split(), dtype=np.float64) for line in capsys.readouterr().out.splitlines())
        return list(np.abs(file - report) > 1e-3)

    assert differences() == [False] * 4
    for part, changed in (("transition", 0), ("network", 1), ("guide", 2), ("allowed", 3), ("moves", 3)):
        Path("problem.cfn").write_text(altered(problem, part), "utf-8")
        assert differences() == [number in (changed, 3) for number in range(4)], part


@pytest.mark.parametrize("document", [path for path in DOCUMENTS if path not in GUIDES], ids=name_of)
def test_the_python_of_other_documents_compiles(document: Path) -> None:
    for block in blocks(document.read_text("utf-8")):
        if block.language == "python":
            compile(block.text, name_of(document), "exec")


@pytest.mark.long
def test_the_gallery_shows_what_its_commands_make(here: Path, run: Run) -> None:
    text = GALLERY.read_text("utf-8")
    commands = [line for block in blocks(text) for line in commands_of(block)]
    shown = [GALLERY.parent / path for path in re.findall(r"^!\[.*\]\((.*)\)$", text, re.M)]
    assert len(commands) == 13
    write_files(ROOT / "docs" / "how-to" / "ensembles.md", here)
    for command in commands:
        call(run, command)
    for path in shown:
        if path.suffix == ".svg":
            assert ElementTree.parse(path).getroot().attrib == ElementTree.parse(here / path.name).getroot().attrib
            assert path.stat().st_size == pytest.approx((here / path.name).stat().st_size, rel=0.02)
        elif path.name != "player.png":  # which a browser took
            assert_same_picture(here / path.name, path)


def assert_same_picture(made: Path, shown: Path) -> None:
    """All frames are alike; letters may differ with the fonts."""
    with Image.open(made) as one, Image.open(shown) as other:
        assert one.size == other.size
        frames = getattr(one, "n_frames", 1)
        assert frames == getattr(other, "n_frames", 1)
        for frame in range(frames):
            one.seek(frame)
            other.seek(frame)
            difference = ImageChops.difference(one.convert("RGB"), other.convert("RGB"))
            assert np.asarray(difference).mean() < 1.0, f"{shown.name}, frame {frame}"


# --- links and citations --------------------------------------------------------------------------------------------


@each
def test_every_link_leads_somewhere(document: Path) -> None:
    text = re.sub(r"`[^`\n]*`", "", prose(document.read_text("utf-8")))
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, anchor = target.partition("#")
        place = (document.parent / path).resolve() if path else document
        assert place.is_relative_to(ROOT), target
        assert place.exists(), target
        assert not anchor or anchor in slugs(place.read_text("utf-8")), target


def simplified(text: str) -> str:
    return " ".join(re.sub(r"[^a-z0-9]+", " ", text.lower()).split())


def notes_of(path: Path) -> Iterator[str]:
    """The docstrings and the comments of a Python file; the text of any other file. Each in one line."""
    text = path.read_text("utf-8")
    if path.suffix != ".py":
        yield " ".join(re.sub(r"^ *#(?: [a-z]+ {2,})?", " ", text, flags=re.M).split())
        return
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield " ".join(node.value.split())
    comments: list[str] = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            comments.append(token.string.lstrip("# "))
        elif token.type != tokenize.NL:
            yield " ".join(comments)
            comments = []


def sources() -> list[Path]:
    """Files that may cite something."""
    folders = ("motionmind", "corpora", "discretization", "experiments", "docs")
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*")]
    wanted = (".py", ".toml", ".score", ".md")
    return sorted(
        {path for path in paths if path.suffix in wanted and not {"_build", "_bundled"} & {*path.parts}} - {REFERENCES}
    )


# A label or a year, one of which every citation has.
CITES = r"\[(?:[A-Z][A-Za-z]*[0-9]{2}|MM)\]|references\.md#|(?:19|20)[0-9]{2}\b"


@pytest.mark.long
def test_every_citation_is_among_the_references() -> None:
    text = REFERENCES.read_text("utf-8")
    labels, listed = set(re.findall(r"^### (\S+)$", text, re.M)), simplified(text)
    cited: set[str] = set()
    lost = []
    for path in sources():
        if not re.search(CITES, path.read_text("utf-8")):  # most files, and to take one apart is most of the work
            continue
        for note in notes_of(path):
            named = set(re.findall(r"\[([A-Z][A-Za-z]*[0-9]{2}|MM)\]", note))
            linked = re.findall(r"\[\[(\w+)\]\([^)]*references\.md#(\w+)\)\]", note)
            lost += [f"{name_of(path)}: [{label}] is #{anchor}" for label, anchor in linked if label.lower() != anchor]
            named |= {label for label, _ in linked}
            cited |= named
            lost += [f"{name_of(path)}: [{label}]" for label in sorted(named - labels)]
            titles = re.findall(r'"([A-Z][^"]{12,160}?),?"(?=[^"]{0,120}\b(?:19|20)[0-9]{2}\b)', note)
            titles += re.findall(r"([0-9]+:[0-9]+ \((?:19|20)[0-9]{2}\))", note)
            lost += [f"{name_of(path)}: {title}" for title in titles if simplified(title) not in listed]
    assert not lost, "\n".join(lost)
    assert {"C98", "I98", "O10", "Kolmogorov06"} <= cited


def test_the_citation_is_of_this_version() -> None:
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_readme_and_the_map_are_short() -> None:
    assert len(README.read_text("utf-8").splitlines()) <= 150
    assert len((ROOT / "ARCHITECTURE.md").read_text("utf-8").split()) <= 1200


@pytest.mark.long
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="the extra docs is not installed")
    pytest.importorskip("myst_parser", reason="the extra docs is not installed")
    pytest.importorskip("furo", reason="the extra docs is not installed")
    build = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", str(tmp_path / "trees")]
    done = subprocess.run(
        [*build, str(ROOT / "docs"), str(tmp_path / "site")], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "site" / "cli.html").read_text("utf-8")
    shown = {
        option
        for command in all_commands(app)
        for one in command.params
        if not getattr(one, "hidden", False)
        for option in one.opts
    }
    assert [option for option in sorted(shown) if option.startswith("--") and option not in page] == []
    assert "motionmind corpus build" in page
    assert [path.name for path in (tmp_path / "site").rglob("*.html") if "mailto:" in path.read_text("utf-8")] == []
    check_python_page((tmp_path / "site" / "api.html").read_text("utf-8"))


def check_python_page(page: str) -> None:
    """Fail if the page on Python misses a name in its list, misses an option, or shows a private constructor."""
    entries = {
        name: re.sub(r"<[^>]*>", "", f"<{text}")
        for name, text in re.findall(r'id="motionmind\.([\w.]+)"(.*?)(?=<dt class="sig|\Z)', page, re.S)
    }
    listed = page[: page.index('id="motionmind.')]
    assert [name for name in motionmind.__all__ if f'href="#motionmind.{name}"' not in listed] == []
    for function, options in (("Engine.fit", Gathering), ("Engine.tween", TweenOptions), ("vary", SeamOptions)):
        found = set(re.findall(r"^(\w+) \(.* = .*\) -- \S", entries[function], re.M))
        assert found == options.__annotations__.keys(), function
    for name in ("Engine", "Corpus", "Tween", "TweenReport", "Variation", "discretize.StateSpace"):
        assert "(" not in entries[name].split("\n")[1], name
    for name in ("Motion", "Posture", "SearchOptions", "TweenRequest", "chaos.Flow"):
        assert "(" in entries[name].split("\n")[1], name
    assert "&lt;factory&gt;" not in page
