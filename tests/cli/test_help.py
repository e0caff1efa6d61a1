"""The help of the command line: complete, listed by subject, with examples that run."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from bundled_clips import ballet_clip
from command_line import Run

from motionmind.cli import app
from motionmind.cli.options import Command, Option, Section
from motionmind.cli.search_options import SEARCH_OPTIONS
from motionmind.formats import write_motion
from motionmind.tween.options import OPTIONS

BALLET = Path(__file__).parents[2] / "corpora" / "ballet"
README = Path(__file__).parents[2] / "README.md"
ARABESQUE, FIFTH = (BALLET / "postures" / f"{name}.json" for name in ("arabesque", "fifth"))


def commands(group: click.Group = app, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], click.Command]]:
    for name, command in group.commands.items():
        yield (*path, name), command
        if isinstance(command, click.Group):
            yield from commands(command, (*path, name))


COMMANDS = dict(commands())
PAGES = [(), *COMMANDS]
EXAMPLES = [command.epilog.split("\n")[-1].strip() for command in COMMANDS.values() if command.epilog]


def flags_in(page: str) -> list[str]:
    """The flags that a page of help lists, each at the beginning of a line below the first heading."""
    lines = re.split(r"^\S.*:$", page, maxsplit=1, flags=re.M)[-1].splitlines()
    names = (line.strip().split("  ")[0] for line in lines if line.startswith("  -"))
    return [flag for name in names for flag in re.findall(r"--[\w-]+", name)]


def options_of(path: tuple[str, ...]) -> list[click.Option]:
    command = COMMANDS.get(path, app)
    options = command.get_params(click.Context(command, info_name=command.name))
    return [option for option in options if isinstance(option, click.Option) and not option.hidden]


def long_flags(options: list[click.Option]) -> set[str]:
    return {flag for option in options for flag in (*option.opts, *option.secondary_opts) if flag.startswith("--")}


def is_advanced(option: click.Option) -> bool:
    return isinstance(option, Option) and option.section == Section.ADVANCED


def test_there_are_the_commands_that_the_documents_name() -> None:
    assert {" ".join(path) for path in COMMANDS} == {
        *(
            "tween",
            "postures",
            "posture",
            "convert",
            "clean",
            "loop",
            "plan",
            "transcribe",
            "laban",
            "restyle",
            "corpus",
            "corpus build",
            "corpus add",
            "corpus remove",
            "corpus restore",
            "corpus list",
            "corpus info",
            "corpus check",
            "corpus gaps",
            "corpus rename",
            "corpus delete",
            "corpus publish",
            "corpus fetch",
        ),
        *(
            "compose",
            "library",
            "sheet",
            "render",
            "explain",
            "graph",
            "measure",
            "credits",
            "vary",
            "review",
            "attractor",
            "studio",
            "serve",
            "warm",
            "completion",
        ),
    }


@pytest.mark.parametrize("path", COMMANDS, ids=" ".join)
def test_every_command_and_option_has_help(path: tuple[str, ...], run: Run) -> None:
    command = COMMANDS[path]
    assert command.help
    for option in options_of(path):
        assert option.help, f"{option.opts[0]} has no help"
    shown = run(*path, "--help")
    assert shown.code == 0
    assert shown.err == ""
    if not isinstance(command, click.Group):
        assert re.search(rf"Example:\n +motionmind {' '.join(path)}\b", shown.out)


@pytest.mark.parametrize("path", PAGES, ids=" ".join)
def test_help_has_whole_sentences_and_no_range_without_bounds(path: tuple[str, ...], run: Run) -> None:
    page = run(*path, "--help").out
    assert "=None" not in page
    assert "RANGE" not in page
    assert not re.search(r"[a-z]\.\.\.$", page.partition("\nCommands:")[2], re.M)


@pytest.mark.parametrize("path", PAGES, ids=" ".join)
def test_help_lists_few_options(path: tuple[str, ...], run: Run) -> None:
    listed = [line for line in run(*path, "--help").out.splitlines() if line.startswith("  -")]
    assert len(listed) <= 24


@pytest.mark.parametrize("path", PAGES, ids=" ".join)
def test_every_option_is_in_exactly_one_section(path: tuple[str, ...]) -> None:
    command = COMMANDS.get(path, app)
    assert isinstance(command, Command)
    sections = command.sections(click.Context(command, info_name=command.name))
    assert list(sections) == [section for section in Section if section in sections]
    listed = [option.opts[0] for options in sections.values() for option in options]
    assert sorted(listed) == sorted(option.opts[0] for option in options_of(path))
    of_click = {option.opts[-1] for option in options_of(path) if not isinstance(option, Option)}
    assert of_click <= {"--help", "--version"}


@pytest.mark.parametrize("path", PAGES, ids=" ".join)
def test_help_hides_the_advanced_options_alone_and_help_all_none(path: tuple[str, ...], run: Run) -> None:
    options = options_of(path)
    advanced = [option for option in options if is_advanced(option)]
    usual, whole = run(*path, "--help").out, run(*path, "--help-all")
    assert (whole.code, whole.err) == (0, "")
    assert sorted(flags_in(whole.out)) == sorted(long_flags(options))
    assert sorted(flags_in(usual)) == sorted(long_flags(options) - long_flags(advanced))
    assert (f"\n{Section.ADVANCED}:\n" in whole.out) == bool(advanced)
    last = usual.splitlines()[-1]
    assert (last == f"motionmind {' '.join(path)} --help-all lists the advanced options, too.") == bool(advanced)
    assert "--help-all" not in whole.out.splitlines()[-1]


def test_each_field_of_a_request_has_one_option_but_for_those_of_tween_alone() -> None:
    options = [row.field for row in SEARCH_OPTIONS]
    assert sorted(options) == sorted(OPTIONS.keys() - {"unlike", "what_if", "reach", "stay", "to", "along"})


@pytest.mark.long
def test_the_examples_run_outside_a_checkout(run: Run) -> None:
    write_motion("clip.bvh", ballet_clip("plies").resample(30.0).slice(0, 300))
    Path("new").mkdir()
    Path("LICENCE.txt").write_text("Free for all uses.\n")
    write_motion("new/jump.bvh", ballet_clip("jump").resample(30.0))
    run("tween", ARABESQUE, FIFTH, "--corpus", "ballet", "-o", "tween.json", "--report", "report.json")
    run("vary", "ballet/jump", "-o", "variation.json")
    assert len(EXAMPLES) == 38
    in_readme = {line.strip() for line in README.read_text("utf-8").splitlines() if line.startswith("    motionmind ")}
    for line in EXAMPLES:
        if line.startswith(("motionmind serve", "motionmind studio")):  # which do not end
            continue
        if line in in_readme and "corpus build" not in line:  # which the test of that document runs in the same way
            continue
        program, *words = shlex.split(line)
        assert program == "motionmind"
        ran = run(*(found for word in words for found in (sorted(Path().glob(word)) if "*" in word else [word])))
        assert ran.code == 0, f"{line}\n{ran.err}"


@pytest.mark.parametrize("path", [(), ("corpus",)])
def test_alone_it_shows_its_help(path: tuple[str, ...], run: Run) -> None:
    shown = run(*path)
    assert (shown.code, shown.err) == (0, "")
    assert shown.out == run(*path, "--help").out


def test_version(run: Run) -> None:
    assert re.fullmatch(r"motionmind \d+\.\d+\.\d+\n", run("--version").out)
