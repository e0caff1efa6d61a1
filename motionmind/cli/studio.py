"""The command that opens the studio."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from motionmind.cli import completion
from motionmind.cli.listening import address_of, listen
from motionmind.cli.options import HOME, Section, command, given_option, option
from motionmind.cli.printing import note
from motionmind.cli.types import FILE, PORT
from motionmind.cli.warming import prepare_in_steps
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.studio.project import Project

_N_PROJECTS_LISTED = 5  # projects that are named at the start
_TERMINAL_WINDOW = "terminal"  # the window of edits that the command makes
_COMPILING_NOTE = (
    "first run: preparing in the background; searches wait for it, up to a minute (`motionmind warm --stop` ends it)"
)


@command("motionmind studio dance.motionmind --corpus ballet")
@click.argument("file", type=FILE, required=False)
@option(
    "--corpus",
    section=Section.CORPORA,
    default="ballet",
    metavar="NAME",
    help="Judge and smooth by this corpus.",
    shell_complete=completion.corpora,
)
@option(
    "--host",
    section=Section.OUTPUT,
    default="127.0.0.1",
    metavar="ADDRESS",
    help="Listen at this address; any other than that of this computer lets others work on the project, "
    "if they have the whole URL, and others still read along: it is not encrypted.",
)
@option(
    "--port",
    section=Section.OUTPUT,
    type=PORT,
    metavar="N",
    default=0,
    show_default="any that is free",
    help="Listen at this port.",
)
@option("--no-browser", section=Section.OUTPUT, is_flag=True, help="Print the URL and open no browser.")
@HOME
@click.pass_context
def studio(
    context: click.Context, file: Path | None, corpus: str, host: str, port: int, no_browser: bool, home: Path | None
) -> None:
    """Open the studio: a page in the browser in which to compose, vary and pose movement, until Ctrl-C.

    FILE is a project (.motionmind), which is made if it is not there, or movement or a variation to begin with, whose
    project then lies beside it. Without FILE a new project begins in the user's data folder. It needs the extra: pip
    install "motionmind[studio]".
    """
    import webbrowser  # here, for other commands open none

    try:
        from motionmind.codecache import is_all_compiled
        from motionmind.studio.serving import Server
        from motionmind.studio.studio import Studio
        from motionmind.studio.token import Keys
    except ImportError as error:
        raise MotionMindError(f'the studio needs an extra: pip install "motionmind[studio]" ({error})') from None

    with listen(host, port) as listening:
        url, is_open = address_of(listening)
        project = _project(file, corpus, home)
        try:
            if given_option(context, ["corpus"]) and project.state.corpus != corpus:
                from motionmind.studio.edits import SetCorpus

                project.edit(_TERMINAL_WINDOW, SetCorpus(corpus))
            project.tell(url)
            for words in (*project.words, *project.missing):
                note(words)
            if is_open:
                note(
                    f"whoever has the URL below and reaches {url.removeprefix('http://')} can work on this project, "
                    "and whoever is on the way can read along: nothing is encrypted"
                )
            if is_cold := not is_all_compiled():
                note(_COMPILING_NOTE)
            work, keys = Studio(project, home, first=prepare_in_steps() if is_cold else None), Keys()
            with suppress(MotionMindError):  # which is missing, and said to be
                work.engine(project.state.corpus)
            entry = f"{url}/#token={keys.token}"

            def ready() -> None:
                click.echo(f"{displayed_path(project.path)} is open at {entry} (Ctrl-C ends)")
                if not no_browser:
                    webbrowser.open(entry)

            Server(work, keys, host, listening.getsockname()[1], ready).run(sockets=[listening])
        finally:
            project.close()


def _project(file: Path | None, corpus: str, home: Path | None) -> Project:
    """Open the project of a file, or make it."""
    from motionmind.cli.sources import parse_movement, read_movements
    from motionmind.studio.edits import Insert, Several
    from motionmind.studio.journal import SUFFIX
    from motionmind.studio.project import Project
    from motionmind.variation.variation_json import is_variation

    if file is None:
        return Project.create(_new(home), corpus, home)
    place = file if file.suffix == SUFFIX else file.with_suffix(SUFFIX)
    if place.exists():
        if place != file:
            note(f"going on with {displayed_path(place)}")
        return Project.open(place, home)
    if place == file:
        return Project.create(place, corpus, home)
    if is_variation(file):
        from motionmind.studio.beginning import corpus_of, take_in
        from motionmind.variation.variation_json import read_variation

        variation = read_variation(file)
        if variation.piece.composed:
            raise MotionMindError(
                f"{displayed_path(file)}: the studio arranges stretches of a piece, and quadrants leave none of it"
            )
        judge = corpus_of(variation)
        project = Project.create(place, judge if judge and _is_here(judge, home) else corpus, home)
        take_in(project, variation, _TERMINAL_WINDOW)
        return project
    source = parse_movement(str(file), home).source
    motions = read_movements(source, (), home, joints=None, unit=None, asf=None, source_fps=None, up=None)
    project = Project.create(place, corpus, home)
    keys = [project.movements.keep(motion) for motion in motions]
    blocks = [
        Insert(f"b{number}", key, 0, len(motion) - 1)
        for number, (key, motion) in enumerate(zip(keys, motions, strict=True), start=1)
    ]
    project.edit(_TERMINAL_WINDOW, Several(tuple(blocks), f"begin with {displayed(file.name)}"))
    return project


def _is_here(corpus: str, home: Path | None) -> bool:
    from motionmind.corpus import store

    try:
        store.locate(corpus, home)
    except MotionMindError:
        return False
    return True


def _new(home: Path | None) -> Path:
    """Return the file of a new project in the user's data folder; name those that are there."""
    from motionmind.corpus import store
    from motionmind.files import make_folder
    from motionmind.studio.journal import SUFFIX

    folder = store.home(home) / "projects"
    try:
        make_folder(folder)
        known = sorted(folder.glob(f"*{SUFFIX}"), key=lambda path: path.stat().st_mtime, reverse=True)
    except OSError as error:
        raise MotionMindError(f"{folder}: cannot be made: {error.strerror or error}") from error
    for path in known[:_N_PROJECTS_LISTED]:
        note(f"an earlier project: {displayed_path(path)}")
    taken = {path.stem for path in known}
    number = next(number for number in range(1, len(taken) + 2) if f"piece-{number}" not in taken)
    return folder / f"piece-{number}{SUFFIX}"
