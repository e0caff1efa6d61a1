"""Directives that write the reference from the code: public names, commands and their options, file formats.

```{public-names}      the names of `motionmind` and its packages (their `__all__`), by subject
```{command-line}      every command with its arguments and its options, in groups where a command has groups
```{json-schema} dotted.name
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator
from importlib import import_module
from types import FunctionType
from typing import Any, ClassVar

import click
import msgspec
from docutils import nodes
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

_log = logging.getLogger(__name__)

SUBJECTS = {
    "Tweens": (
        "Engine",
        "TweenRequest",
        "SearchOptions",
        "Tween",
        "Bridge",
        "Wait",
        "Source",
        "learned.Sighting",
        "credits.Credit",
    ),
    "Reports": (
        "TweenReport",
        "read_report",
        "explain",
        "Explanation",
        "metrics.measure",
        "metrics.Figure",
        "metrics.measure_effort",
    ),
    "Corpora": ("list_corpora", "Corpus", "gaps.find_gaps", "gaps.Gaps"),
    "Movement": (
        "Posture",
        "find_posture",
        "FoundPosture",
        "Motion",
        "Velocity",
        "Insertion",
        "Skeleton",
        "human23",
        "human44",
    ),
    "Duets": ("duets.tween_duet", "duets.DuetTween"),
    "Cleaning": ("clean.clean_motion", "clean.Cleaning"),
    "Files": (
        "read_motion",
        "read_posture",
        "write_motion",
        "write_posture",
        "formats.lossy_fields",
        "formats.MotionReader",
        "formats.MotionWriter",
    ),
    "Scores": (
        "compose",
        "read_score",
        "Score",
        "transcription.transcribe",
        "transcription.Transcription",
        "transcription.Deviation",
        "transcription.restyle",
        "transcription.pass_through",
        "transcription.Restyled",
        "transcription.Link",
    ),
    "Skeletons of your own": ("own_skeleton", "retarget.to_human23", "retarget.read_joint_mapping"),
    "States": (
        "discretize.make_discretization",
        "discretize.Discretization",
        "discretize.StateSpace",
        "discretize.name_states",
        "discretize.read_library",
        "discretize.write_library",
        "discretize.Library",
    ),
    "Variations": (
        "vary",
        "Variation",
        "Piece",
        "Seam",
        "read_variation",
        "write_variation",
        "chaos.find_flow",
        "chaos.Flow",
    ),
    "Music": ("music.read_beats", "music.Beats", "music.read_sound", "music.Sound"),
    "Pictures": (
        "draw_picture",
        "draw_sheet",
        "plots.draw_angles",
        "plots.draw_joint_graph",
        "plots.draw_attractor",
        "plots.draw_cleaning",
        "plots.draw_deviation",
        "plots.draw_floor_plan",
        "plots.find_overstep",
        "plots.Plate",
    ),
    "Errors": (
        "MotionMindError",
        "FormatError",
        "SkeletonError",
        "CorpusError",
        "NoPathError",
        "WrongTypeError",
        "MotionMindWarning",
    ),
}

# The types of files and reports.
SCHEMAS = {
    "posture": "motionmind.formats.posture_json.PostureSchema",
    "motion": "motionmind.formats.motion_json.MotionSchema",
    "variation": "motionmind.variation.variation_json.VariationSchema",
    "tween-report": "motionmind.tween.report.TweenReport",
    "explanation": "motionmind.tween.narrative.Explanation",
    "diagnosis": "motionmind.tween.diagnosis.Diagnosis",
    "source-manifest": "motionmind.corpus.manifest.SourceManifest",
    "built-manifest": "motionmind.corpus.manifest.BuiltManifest",
    "index": "motionmind.registry.index.Index",
    "corpus-summary": "motionmind.learned.summary.CorpusSummary",
    "corpus-check": "motionmind.learned.summary.CorpusCheck",
    "gaps": "motionmind.gaps.gaps.Gaps",
    "measure-report": "motionmind.metrics.figures.MeasureReport",
    "variation-report": "motionmind.variation.report.VariationReport",
}


def _without_raw(schema: Any) -> Any:
    """Return a struct whose fields of undecoded JSON, which no schema can have as a default, are optional objects."""
    if not issubclass(schema, msgspec.Struct):
        return schema
    fields = msgspec.structs.fields(schema)
    if all(field.type is not msgspec.Raw for field in fields):
        return schema
    described = []
    for field in fields:
        if field.type is msgspec.Raw:
            described.append((field.name, dict[str, Any] | msgspec.UnsetType, msgspec.UNSET))
        elif field.required:
            described.append((field.name, field.type))
        else:
            described.append(
                (field.name, field.type, msgspec.field(default=field.default, default_factory=field.default_factory))
            )
    plain = msgspec.defstruct(schema.__name__, described, kw_only=True, forbid_unknown_fields=True)
    plain.__doc__ = schema.__doc__
    return plain


def schema_text(kind: str) -> str:
    """Return the JSON Schema of one of `SCHEMAS`."""
    module, _, name = SCHEMAS[kind].rpartition(".")
    schema = msgspec.json.schema(_without_raw(getattr(import_module(module), name)))
    return json.dumps(schema, indent=2, ensure_ascii=False)


def commands(context: click.Context) -> Iterator[click.Context]:
    """Yield a context for every command of a group and of the groups in it."""
    assert isinstance(context.command, click.Group)
    for name, command in context.command.commands.items():
        inner = click.Context(command, context, name, **command.context_settings)
        yield inner
        if isinstance(command, click.Group):
            yield from commands(inner)


def options_by_section(command: click.Command, context: click.Context) -> dict[str, list[tuple[str, str]]]:
    """Return the options of a command, names and help, by the heading under which its own help lists them."""
    sections: dict[str, list[tuple[str, str]]] = {}
    for option in command.get_params(context):
        if isinstance(option, click.Option) and (record := option.get_help_record(context)):
            sections.setdefault(str(getattr(option, "section", "Options")), []).append(record)
    order = list(map(str, command.sections(context))) if hasattr(command, "sections") else list(sections)
    return {heading: sections[heading] for heading in order if heading in sections}


def command_text(context: click.Context) -> str:
    """Return the section of one command, as Markdown."""
    command, path = context.command, context.command_path
    lines = [f"## {path}", "", f"    {path} {' '.join(command.collect_usage_pieces(context))}", ""]
    paragraphs = (command.help or "").replace("\b\n", "").split("\n\n")
    lines += [_prose(" ".join(paragraph.split())) + "\n" for paragraph in paragraphs]
    if isinstance(command, click.Group):
        return "\n".join(lines)
    for heading, options in options_by_section(command, context).items():
        lines += [f"**{heading}**", "", "| option | |", "|---|---|"]
        lines += [f"| `{_cell(names)}` | {_prose(_cell(text))} |" for names, text in options]
        lines.append("")
    example = re.search(r"^ +(motionmind .*)$", command.epilog or "", re.M)
    if example:
        lines += ["Example:", "", f"    {example[1]}", ""]
    return "\n".join(lines)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def _prose(text: str) -> str:
    """Escape what Markdown would take for markup."""
    return re.sub(r"([*_<>\[\]])", r"\\\1", text)


class CommandLine(SphinxDirective):
    """Every command with its options."""

    def run(self) -> list[nodes.Node]:
        """Walk the commands and write a section for each."""
        from motionmind.cli import app

        top = click.Context(app, info_name="motionmind", **app.context_settings)
        text = "\n\n".join(map(command_text, commands(top)))
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def public_names() -> set[str]:
    """Return the public names, those of a package after its name: "Engine", "metrics.measure"."""
    import motionmind

    names = set(motionmind.__all__)
    for room in {name.rpartition(".")[0] for group in SUBJECTS.values() for name in group} - {""}:
        names |= {f"{room}.{name}" for name in import_module(f"motionmind.{room}").__all__}
    return names


class PublicNames(SphinxDirective):
    """The public names by subject; a name without a subject is a warning."""

    def run(self) -> list[nodes.Node]:
        """Write a section for each subject."""
        grouped = {name for names in SUBJECTS.values() for name in names}
        for name in sorted(grouped ^ public_names()):
            _log.warning("docs/_extensions/reference.py: SUBJECTS and the public names differ in %s", name)
        listed = (f"**{subject}**\n\n{self._list(names)}" for subject, names in SUBJECTS.items())
        entries = ("\n".join([f"## {subject}", *map(self._entry, names)]) for subject, names in SUBJECTS.items())
        text = "\n\n".join(["## Names", *listed, *entries])
        return self.parse_text_to_nodes(text, allow_section_headings=True)

    @staticmethod
    def _list(names: Iterable[str]) -> str:
        """Return a table of names with links and first sentences."""
        rows = "\n   ".join([".. autosummary::", ":nosignatures:", "", *names])
        return _rest(f".. currentmodule:: motionmind\n\n{rows}\n\n.. currentmodule:: None")

    @staticmethod
    def _entry(name: str) -> str:
        room, _, last = f"motionmind.{name}".rpartition(".")
        thing = getattr(import_module(room), last)
        if not isinstance(thing, type):
            kind, members = "function", ""
        elif issubclass(thing, Exception):
            kind, members = "exception", ""
        else:
            kind, members = "class", _inherited_methods(thing) if name == "Engine" else "\n   :members:"
        return _rest(f".. auto{kind}:: {room}.{last}{members}")


def _inherited_methods(thing: type) -> str:
    """Return directives for a class's methods, those of its base classes first, in the order of their sources."""
    names = {
        name: None
        for base in reversed(thing.__mro__)
        for name, one in vars(base).items()
        if not name.startswith("_") and isinstance(one, FunctionType | classmethod)
    }
    return "\n" + "".join(f"\n   .. automethod:: {name}" for name in names)


def _rest(text: str) -> str:
    """Return reStructuredText as a block of Markdown."""
    return f"\n```{{eval-rst}}\n{text}\n```\n"


class JsonSchema(SphinxDirective):
    """The JSON Schema of a file or a report."""

    required_arguments: ClassVar[int] = 1

    def run(self) -> list[nodes.Node]:
        """Write it as a block of code."""
        text = schema_text(self.arguments[0])
        return [nodes.literal_block(text, text, language="json")]


def setup(app: Any) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("command-line", CommandLine)
    app.add_directive("public-names", PublicNames)
    app.add_directive("json-schema", JsonSchema)
    return {"parallel_read_safe": True}
