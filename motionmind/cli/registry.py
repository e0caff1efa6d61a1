"""The commands that fetch published corpora and publish your own."""

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
    help="Index to search first, by file or address  [default: only the one bundled with MotionMind]",
)
_MAX_TEXT_CHARS = 300  # of a title or a licence


@command("motionmind corpus fetch hands --index public/index.json --as fingers")
@click.argument("name", shell_complete=completion.published)
@option("--as", "new_name", section=Section.CORPORA, metavar="NAME", help="New name of the corpus  [default: its own]")
@INDEX
@HOME
def fetch(name: str, new_name: str | None, index: str | None, home: Path | None) -> None:
    """Fetch a published corpus.

    NAME is a name in the index, or the address of another index, followed by #NAME if it lists several corpora. The
    command verifies the archive against the index and keeps it; an interrupted download resumes. For a collection that
    may not be redistributed, the command prints a recipe: its address, its licence, and how to build a corpus from it.
    """
    from motionmind.registry.fetching import fetch, look_up
    from motionmind.registry.index import Recipe

    found, source = look_up(name, index)
    if isinstance(found, Recipe):
        _print_recipe(found)
        raise CorpusError(f"{found.name} may not be redistributed; the steps above build it")
    _print_terms(found)
    prepare()
    with click.progressbar(
        length=found.archive.size, label="fetching", file=sys.stderr, hidden=not sys.stderr.isatty()
    ) as bar:
        place = fetch(found, source, name=new_name, home=home, on_progress=lambda here: bar.update(here - bar.pos))
    click.echo(f"fetched {displayed_path(place)}")


def _print_terms(entry: Entry) -> None:
    """Print the metadata of a corpus and its terms of use."""
    from motionmind.credits.licences import find_licence

    size = f"{entry.archive.size / 10**6:,.1f} MB"
    click.echo(
        f"{displayed(entry.title, _MAX_TEXT_CHARS)} "
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
            click.echo(f"{label:12} {displayed(text, _MAX_TEXT_CHARS)}")


def _print_recipe(recipe: Recipe) -> None:
    """Print a recipe in full, since each line matters."""
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
        is_command = text.startswith("motionmind ")  # one line, to be copied
        lines = [text] if is_command else wrap(text, 100, break_on_hyphens=False, break_long_words=False)
        for first, line in zip([label, *[""] * len(lines)], lines, strict=False):
            click.echo(f"{first:12} {printable(line)}")


def print_index(place: str | None, *, as_json: bool) -> None:
    """Print the corpora and recipes of an index and of the bundled one.

    Args:
        place: the index, as for --index; None for the bundled one alone.
        as_json: whether to print all fields, as JSON.
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
        click.echo(f"{displayed(name):{width}}  {size:>10}  {displayed(text, _MAX_TEXT_CHARS)}")


@command(
    "motionmind corpus publish hands -o public --url https://example.org/public/ --date 2026-11-23 "
    "--licence-file LICENCE.txt"
)
@click.argument("folder", shell_complete=completion.corpora)
@output("Folder to write to; corpora already in its index stay.", type=FOLDER)
@option(
    "--url",
    section=Section.ABOUT,
    required=True,
    metavar="ADDRESS",
    help="Address at which the folder will be served.",
)
@option("--date", section=Section.ABOUT, required=True, metavar="DAY", help="Day of publication, as 2026-11-23.")
@option(
    "--licence-file",
    section=Section.ABOUT,
    required=True,
    type=EXISTING_FILE,
    help="File with the text of the licence.",
)
@option("--licence-url", section=Section.ABOUT, metavar="ADDRESS", help="Address of the licence.")
@HOME
def publish(
    folder: str,
    output: Path,
    licence_file: Path,
    **options: Any,
) -> None:
    """Publish a corpus, by name or folder.

    The output suits any server of static files: an archive, Croissant metadata, by which search engines find data sets,
    and an index for `motionmind corpus fetch`. The same corpus gives the same bytes. Title, author, source and licence
    come from corpus build.
    """
    from motionmind.formats.text import decode
    from motionmind.registry.publishing import publish

    progress("packing")
    published = publish(folder, output, licence_text=decode(read_bytes(licence_file)), **options)
    for file in published.files:
        click.echo(f"wrote {displayed_path(file)}")
