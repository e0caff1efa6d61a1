"""The commands that fetch corpora that others publish, and publish one's own."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import click

from motionmind.cli import completion
from motionmind.cli.options import HOME, Section, command, option, output
from motionmind.cli.printing import count, progress
from motionmind.cli.types import EXISTING_FILE, FOLDER
from motionmind.cli.warming import prepare
from motionmind.display import displayed, displayed_path, printable
from motionmind.errors import CorpusError
from motionmind.files import read_bytes

if TYPE_CHECKING:
    from motionmind.registry.index import Entry, Recipe

INDEX = option(
    "--index",
    section=Section.CORPORA,
    envvar="MOTIONMIND_INDEX",
    show_envvar=True,
    metavar="PLACE",
    help="Look in this index first, by file or address  [default: only the one that comes with MotionMind]",
)
_LICENCE_CHARS = 300  # characters of a title or a licence
_LINE_CHARS = 100  # characters to which sentences are wrapped


@command("motionmind corpus fetch hands --index public/index.json --as fingers")
@click.argument("name", shell_complete=completion.published)
@option(
    "--as", "new_name", section=Section.CORPORA, metavar="NAME", help="Give the corpus this name  [default: its own]"
)
@INDEX
@HOME
def fetch(name: str, new_name: str | None, index: str | None, home: Path | None) -> None:
    """Fetch a corpus that others publish.

    NAME is a name in the index, or the address of another index, with #NAME after it where that holds several corpora.
    The archive is verified against the index and kept; where a download ends early, the next one goes on. Of
    collections that may not be passed on, the recipe is printed: where they are, under which licence, and how to build
    a corpus of them.
    """
    from motionmind.registry.fetching import fetch, look_up
    from motionmind.registry.index import Recipe

    found, source = look_up(name, index)
    if isinstance(found, Recipe):
        _print_recipe(found)
        raise CorpusError(f"{found.name} is not passed on; the steps above lead to it")
    _print_terms(found)
    prepare()
    with click.progressbar(
        length=found.archive.size, label="fetching", file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        place = fetch(found, source, name=new_name, home=home, on_progress=lambda here: bar.update(here - bar.pos))
    click.echo(f"fetched {displayed_path(place)}")


def _print_terms(entry: Entry) -> None:
    """Print what a corpus is, and under which terms it may be used."""
    from motionmind.credits.licences import find_licence

    size = f"{entry.archive.size / 10**6:,.1f} MB"
    click.echo(
        f"{displayed(entry.title, _LICENCE_CHARS)} "
        f"({count(entry.clips, 'clip')}, {count(entry.postures, 'posture')}, {size})"
    )
    rows = [
        ("performed by", ", ".join(entry.performers)),
        ("source", entry.source),
        ("licence", f"{entry.licence}: {find_licence(entry.licence).terms}"),
        *(("part of it", f"{one.name}, {one.source}, {one.licence or 'no licence'}") for one in entry.origins),
        ("cite", entry.citation),
    ]
    for label, text in rows:
        if text:
            click.echo(f"{label:12} {displayed(text, _LICENCE_CHARS)}")


def _print_recipe(recipe: Recipe) -> None:
    """Print how to come by a collection, whole: each line of it matters."""
    rows = [
        ("title", recipe.title),
        ("performed by", recipe.performers),
        ("source", recipe.source),
        ("size", f"{recipe.size} ({recipe.form})"),
        ("licence", recipe.licence),
        ("", recipe.licence_text),
        ("to accept", recipe.accept),
        ("cite", recipe.citation),
        *((f"step {number}", step) for number, step in enumerate(recipe.steps, start=1)),
        *(("unverified", text) for text in recipe.unverified),
    ]
    for label, text in rows:
        is_command = text.startswith("motionmind ")  # to be copied, in one line
        lines = [text] if is_command else wrap(text, _LINE_CHARS, break_on_hyphens=False, break_long_words=False)
        for first, line in zip([label, *[""] * len(lines)], lines, strict=False):
            click.echo(f"{first:12} {printable(line)}")


def print_index(place: str | None, *, as_json: bool) -> None:
    """Print what an index holds, and the recipes that come with MotionMind.

    Args:
        place: the index, as for --index.
        as_json: whether to print entries and recipes whole, as JSON.
    """
    import msgspec

    from motionmind.registry.index import open_index

    sources = [open_index(one) for one in ([place, None] if place else [None])]
    corpora = [entry for source in sources for entry in source.index.corpora]
    recipes = [recipe for source in sources for recipe in source.index.recipes]
    if as_json:
        click.echo(json.dumps(msgspec.to_builtins({"corpora": corpora, "recipes": recipes})))
        return
    rows: list[tuple[str, str, str]] = [
        (entry.name, f"{entry.archive.size / 10**6:,.1f} MB", f"{entry.title}; {entry.licence}") for entry in corpora
    ]
    rows += [(recipe.name, "recipe", f"{recipe.title}; {recipe.licence}") for recipe in recipes]
    width = max((len(displayed(name)) for name, *_ in rows), default=0)
    for name, size, text in rows:
        click.echo(f"{displayed(name):{width}}  {size:>10}  {displayed(text, _LICENCE_CHARS)}")


@command(
    "motionmind corpus publish hands -o public --url https://example.org/public/ --date 2026-11-23 "
    "--licence-file LICENCE.txt"
)
@click.argument("folder", shell_complete=completion.corpora)
@output("Write into this folder; corpora that its index lists stay.", type=FOLDER)
@option(
    "--url",
    section=Section.ABOUT,
    required=True,
    metavar="ADDRESS",
    help="State the address that the folder will have on the network.",
)
@option(
    "--date", section=Section.ABOUT, required=True, metavar="DAY", help="State the day of publication, as 2026-11-23."
)
@option(
    "--licence-file",
    section=Section.ABOUT,
    required=True,
    type=EXISTING_FILE,
    help="Publish the text of the licence, from this file.",
)
@option(
    "--licence-url", section=Section.ABOUT, metavar="ADDRESS", help="State the address by which the licence is known."
)
@HOME
def publish(
    folder: str,
    output: Path,
    licence_file: Path,
    **options: Any,
) -> None:
    """Publish a corpus, by name or folder.

    What is written can be put on any server that serves files: an archive, metadata in the words of Croissant, by which
    search engines find data sets, and an index for `motionmind corpus fetch`. The same corpus gives the same bytes.
    Title, author, source and licence are those that the corpus was built with.
    """
    from motionmind.formats.text import decode
    from motionmind.registry.publishing import publish

    progress("packing")
    published = publish(folder, output, licence_text=decode(read_bytes(licence_file)), **options)
    for file in published.files:
        click.echo(f"wrote {displayed_path(file)}")
