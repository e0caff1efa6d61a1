"""Commands whose help lists options by subject, and the options that commands share."""

from __future__ import annotations

from collections.abc import Callable, Collection
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeVar

import click
from click.core import ParameterSource

from motionmind.cli import completion
from motionmind.cli.types import EXISTING_FILE, FILE, FOLDER, RATE, CorpusName

_Function = TypeVar("_Function", bound=Callable[..., Any])

OUTPUT_KINDS = (
    "movement (.json, .bvh, .glb, .npz, .vrma), a picture or film (.png, .gif, .mp4, .svg), or a page (.html)"
)
_SHOW_ALL_KEY = "motionmind.cli.options.show_all"  # key of a context's `meta`


class Section(StrEnum):
    """Headings of options in --help, in their order."""

    OUTPUT = "Output"
    CORPORA = "Corpora"
    INPUT = "Input files"
    PART = "Selection"
    EDITS = "Edits"
    TRAJECTORY = "Trajectory"
    THROUGH = "Constraints"
    SEARCH = "Search"
    WEIGH = "Costs"
    MOTION = "Motion"
    LEARN = "Learning"
    STATES = "States"
    WORKERS = "Workers"
    CHECK = "Checks"
    DRAW = "Drawing"
    ABOUT = "Metadata"
    ADVANCED = "Advanced"
    HELP = "Help"


class Option(click.Option):
    """An option listed under a heading of its command's help.

    Attributes:
        section: the heading.
    """

    def __init__(self, *args: Any, section: Section, advanced: bool = False, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        self.section = Section.ADVANCED if advanced else section


def option(
    *names: str, section: Section, advanced: bool = False, **attributes: Any
) -> Callable[[_Function], _Function]:
    """Add an option to a command.

    The help of an option with a value is a noun phrase for the value; the help of a flag is an imperative.

    Args:
        names: its flags, and the name of its parameter if it differs.
        section: the heading to list it under.
        advanced: whether to list it under "Advanced" instead, which only --help-all shows.
        attributes: other arguments of `click.Option`.
    """
    return click.option(*names, cls=Option, section=section, advanced=advanced, **attributes)


def _show_all(context: click.Context, _: click.Parameter, is_given: bool) -> None:
    if is_given and not context.resilient_parsing:
        context.meta[_SHOW_ALL_KEY] = True
        click.echo(context.get_help(), color=context.color)
        context.exit()


class Command(click.Command):
    """A command whose help lists its options by section; only --help-all lists the advanced ones."""

    def __init__(self, *args: Any, **attributes: Any) -> None:
        super().__init__(*args, **attributes)
        flag: dict[str, Any] = {"is_flag": True, "is_eager": True, "expose_value": False, "callback": _show_all}
        text, is_hidden = "Show all options and exit.", not self._has_advanced()
        self.params.append(Option(["--help-all"], section=Section.HELP, help=text, hidden=is_hidden, **flag))

    def get_short_help_str(self, limit: int = 45) -> str:
        """Return the whole first sentence of the help, ignoring the limit: a list of commands breaks its lines."""
        return super().get_short_help_str(max(limit, 1000))

    def sections(self, context: click.Context) -> dict[Section, list[click.Option]]:
        """Return the visible options under each heading, advanced ones too, in the order of --help."""
        found: dict[Section, list[click.Option]] = {section: [] for section in Section}
        for parameter in self.get_params(context):
            if isinstance(parameter, click.Option) and not parameter.hidden:
                found[getattr(parameter, "section", Section.HELP)].append(parameter)
        return {section: options for section, options in found.items() if options}

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the sections; the advanced one for --help-all only."""
        for section, options in self.sections(ctx).items():
            if section != Section.ADVANCED or ctx.meta.get(_SHOW_ALL_KEY):
                with formatter.section(section):
                    formatter.write_dl([record for one in options if (record := one.get_help_record(ctx))])

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the example, and mention --help-all if it lists more options."""
        super().format_epilog(ctx, formatter)
        if self._has_advanced() and not ctx.meta.get(_SHOW_ALL_KEY):
            formatter.write_paragraph()
            formatter.write_text(f"{ctx.command_path} --help-all lists the advanced options, too.")

    def _has_advanced(self) -> bool:
        return any(isinstance(one, Option) and one.section == Section.ADVANCED for one in self.params)


class Group(Command, click.Group):
    """Commands listed in the order in which they are added, instead of alphabetically."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return their names."""
        return list(self.commands)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands, then the options."""
        self.format_commands(ctx, formatter)
        super().format_options(ctx, formatter)


def command(example: str, name: str | None = None) -> Callable[[Callable[..., Any]], Command]:
    """Make a function a command whose help shows an example.

    Args:
        example: a command line that runs unchanged.
        name: the command's name; the function's by default.
    """
    return click.command(name, cls=Command, epilog=_epilog(example))


def group(example: str, name: str | None = None, **attributes: Any) -> Callable[[Callable[..., Any]], Group]:
    """Make a function a group of commands, which shows its help when called without one.

    Args:
        example: a command line that runs unchanged.
        name: the group's name; the function's by default.
        attributes: other arguments of `click.Group`.
    """
    return click.group(name, cls=Group, epilog=_epilog(example), invoke_without_command=True, **attributes)


def show_help_without_command(context: click.Context) -> None:
    """Print the help of a group called without a command."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


def _epilog(example: str) -> str:
    """Format an example on one line, which click does not wrap, to be copied."""
    return f"\b\nExample:\n  {example}"


def given_option(context: click.Context, names: Collection[str]) -> str | None:
    """Return the first flag of the first option among `names` given on the command line; None if there is none."""
    for parameter in context.command.params:
        source = context.get_parameter_source(parameter.name) if parameter.name in names else None
        if source is ParameterSource.COMMANDLINE:
            return parameter.opts[0]
    return None


def outputs(text: str, *, required: bool = True) -> Callable[[_Function], _Function]:
    """Add a repeatable -o as `outputs`: a tuple of paths.

    Args:
        text: its help text, without "Repeatable."
        required: whether it must be given.
    """
    return option(
        "-o",
        "--output",
        "outputs",
        section=Section.OUTPUT,
        type=FILE,
        multiple=True,
        required=required,
        help=f"{text} Repeatable.",
    )


def output(
    text: str,
    *,
    required: bool = True,
    type: click.ParamType[Any] = FILE,  # noqa: A002 - click's name
) -> Callable[[_Function], _Function]:
    """Add an -o that may be given once as `output`: a path, or None.

    Args:
        text: its help text.
        required: whether it must be given.
        type: of the path.
    """
    return option(
        "-o",
        "--output",
        section=Section.OUTPUT,
        type=type,
        multiple=True,
        required=required,
        callback=_only_one,
        help=text,
    )


def _only_one(context: click.Context, _: click.Parameter, paths: tuple[Path, ...]) -> Path | None:
    if len(paths) > 1:
        raise click.UsageError(f"-o is given {len(paths)} times; this command writes one file", context)
    return paths[0] if paths else None


HOME = option(
    "--home",
    section=Section.CORPORA,
    type=FOLDER,
    envvar="MOTIONMIND_HOME",
    show_envvar=True,
    help="Folder of the corpora that you build  [default: the platform's data directory]",
)
JSON = option("--json", "as_json", section=Section.OUTPUT, is_flag=True, help="Print JSON.")
CORPUS = option(
    "--corpus",
    section=Section.CORPORA,
    required=True,
    type=CorpusName(),
    metavar="NAME",
    help="Corpus to use, by name or folder.",
    shell_complete=completion.corpora,
)


def reading(function: _Function) -> _Function:
    """Add the options for reading motion files: `joints`, `unit`, `asf`, `source_fps` and `up`."""
    for decorate in (
        option(
            "--up",
            section=Section.INPUT,
            advanced=True,
            type=click.Choice(["y", "z"]),
            help="Axis that is up in the file  [default: the one that people stand along]",
        ),
        option(
            "--source-fps",
            section=Section.INPUT,
            advanced=True,
            type=RATE,
            help="Frames per second of a BVH, .amc, .npz, .pkl, .npy, .pt or .txt file  "
            "[default: the file's own; .amc 120, .pkl 60, .npy 30 or 20, .pt 30, .txt 1]",
        ),
        option(
            "--asf",
            section=Section.INPUT,
            advanced=True,
            type=EXISTING_FILE,
            help="Skeleton file of an AMC file  [default: the .asf beside it]",
        ),
        option(
            "--unit",
            section=Section.INPUT,
            metavar="UNIT",
            help="Unit of length of BVH: m, cm, mm, dm, in, ft, cmu, or metres per unit  "
            "[default: guessed from the body's height; metres for glTF and .npz]",
        ),
        option(
            "--joints",
            section=Section.INPUT,
            type=FILE,
            help="TOML or JSON file that maps joints to human23: your joint = human23's.",
        ),
    ):
        function = decorate(function)
    return function
