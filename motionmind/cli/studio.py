"""The studio command: open the page to compose, vary and pose movement."""

from __future__ import annotations

import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import click

from motionmind.cli import completion
from motionmind.cli.launcher import install
from motionmind.cli.listening import address_of, listen
from motionmind.cli.options import HOME, Section, command, given_option, option
from motionmind.cli.printing import note
from motionmind.cli.types import FILE, PORT
from motionmind.cli.warming import prepare_in_steps
from motionmind.clip_names import split_clip
from motionmind.display import displayed, displayed_path
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.studio.project import Project

_TERMINAL_WINDOW = "terminal"  # the window of edits by this command


@command("motionmind studio dance.motionmind --corpus ballet")
@click.argument("file", type=FILE, required=False)
@option(
    "--corpus",
    section=Section.CORPORA,
    default="ballet",
    metavar="NAME",
    help="Corpus by which to judge and smooth, by name or folder.",
    shell_complete=completion.corpora,
)
@option(
    "--host",
    section=Section.OUTPUT,
    default="127.0.0.1",
    metavar="ADDRESS",
    help="Address to listen on; unless it is this computer's own, anyone with the whole URL can edit the project, "
    "and the connection is not encrypted.",
)
@option(
    "--port",
    section=Section.OUTPUT,
    type=PORT,
    metavar="N",
    default=0,
    show_default="any that is free",
    help="Port to listen on.",
)
@option("--no-browser", section=Section.OUTPUT, is_flag=True, help="Print the URL, without opening a browser.")
@option(
    "--until-closed",
    section=Section.OUTPUT,
    is_flag=True,
    help="End once no window has been open for ten minutes, as when started without a terminal.",
)
@option(
    "--install-launcher",
    section=Section.OUTPUT,
    is_flag=True,
    help="Add the studio to the applications of the desktop, and exit.",
)
@HOME
@click.pass_context
def studio(
    context: click.Context,
    file: Path | None,
    corpus: str,
    host: str,
    port: int,
    no_browser: bool,
    until_closed: bool,
    install_launcher: bool,
    home: Path | None,
) -> None:
    """Open the studio, a page in the browser to compose, vary and pose movement, until Ctrl-C.

    FILE is a project (.motionmind), created if missing, or movement, an ensemble or a variation to start from, whose
    project is created beside it. Without FILE, the command creates a project in the user's data folder. Requires an
    extra: pip install "motionmind[studio]".
    """
    import webbrowser  # here, since other commands do not need it

    try:
        from motionmind.codecache import is_all_compiled
        from motionmind.corpus import store
        from motionmind.studio.handover import reach
        from motionmind.studio.journal import OpenElsewhereError
        from motionmind.studio.renewal import Link, Renewal
        from motionmind.studio.serving import Server
        from motionmind.studio.studio import Studio
        from motionmind.studio.token import Keys
    except ImportError as error:
        raise MotionMindError(f'the studio needs an extra: pip install "motionmind[studio]" ({error})') from None

    if install_launcher:
        click.echo(f"installed {displayed_path(install(home))}")
        return
    place, folder = _place(file), store.home(home)
    with _ending_cleanly(), _listen_again(host, port, place, folder) as listening:
        url, is_open = address_of(listening)
        try:
            project = _project(file, corpus, home)
        except OpenElsewhereError:
            if place is None or (reached := reach(place, folder)) is None:
                raise
            click.echo(f"{displayed_path(place)} is open already, at {reached.url}")
            if not no_browser:
                webbrowser.open(reached.visit)
            return
        try:
            if given_option(context, ["corpus"]) and project.state.corpus != corpus:
                from motionmind.studio.settings import SetCorpus

                project.edit(_TERMINAL_WINDOW, SetCorpus(corpus))
            for words in (*project.words, *project.missing):
                note(words)
            if is_open:
                note(
                    f"anyone with the URL below who can reach {url.removeprefix('http://')} can edit this project "
                    "(by the second one, only look and comment); the connection is not encrypted"
                )
            if is_cold := not is_all_compiled():
                note(
                    "first run: preparing in the background; searches wait for it, up to a minute "
                    "(`motionmind warm --stop` ends it)"
                )
            work = Studio(project, home, first=prepare_in_steps() if is_cold else None, is_shared=is_open)
            keys = Keys(link=Link(project.path, url, folder)) if is_open else Keys(Renewal(project.path, url, folder))
            if not is_cold:  # otherwise it would compile what others compile, before the page opens
                with suppress(MotionMindError):  # it is missing, which a note above says
                    work.engine(project.state.corpus)

            def ready() -> None:
                link = f"\nto look and comment only: {keys.link.address}" if keys.link else ""
                click.echo(f"{displayed_path(project.path)} is open at {url}/#token={keys.token} (Ctrl-C ends){link}")
                if not no_browser:
                    webbrowser.open(f"{url}/#token={keys.visit()}")  # other users can see a program's arguments

            number = listening.getsockname()[1]
            Server(work, keys, host, number, ready, until_closed=until_closed).run(sockets=[listening])
        finally:
            project.close()


def _listen_again(host: str, port: int, place: Path | None, folder: Path) -> socket.socket:
    """Listen at a port, or, if it is 0, at that of the project's studio before, where its pages wait, if it is free."""
    from motionmind.studio.renewal import last_url

    if not port and place and (before := last_url(place, folder)):
        with suppress(MotionMindError, ValueError):
            return listen(host, urlsplit(before).port or 0)
    return listen(host, port)


@contextmanager
def _ending_cleanly() -> Iterator[None]:
    """Let SIGTERM, and the end of the terminal, exit through the code that removes uploads and closes the project."""
    before = {signal.SIGTERM: signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))}
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # as nohup sets it
        # The server handles SIGTERM while it runs, but not SIGHUP.
        before[signal.SIGHUP] = signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _project(file: Path | None, corpus: str, home: Path | None) -> Project:
    """Open the project of a file, or create it."""
    from motionmind.cli.sources import parse_movement, read_movements
    from motionmind.studio.edits import Insert, Several
    from motionmind.studio.opening import open_project
    from motionmind.studio.project import Project
    from motionmind.variation.variation_json import is_variation

    place = _place(file)
    if file is None or place is None:
        return Project.create(_new(home), corpus, home)
    if place.exists():
        if place != file:
            note(f"opening {displayed_path(place)}")
        return open_project(place, corpus, home)
    if place == file:
        return Project.create(place, corpus, home)
    if is_variation(file):
        from motionmind.studio.beginning import corpus_of, take_in
        from motionmind.variation.variation_json import read_variation

        variation = read_variation(file)
        if variation.piece.composed:
            raise MotionMindError(
                f"{displayed_path(file)}: the studio arranges whole postures, which --by quadrants does not keep"
            )
        judge = corpus_of(variation)
        project = Project.create(place, judge if judge and _is_here(judge, home) else corpus, home)
        take_in(project, variation, _TERMINAL_WINDOW)
        return project
    if file.suffix.lower() == ".toml":
        from motionmind.cli.ensembles import open_ensemble
        from motionmind.studio.casting import check_tempo, take_in_ensemble

        options = dict.fromkeys(("joints", "unit", "asf", "source_fps", "up"))
        ensemble = open_ensemble(str(file), [], (), home, [], **options)
        check_tempo(ensemble)
        project = Project.create(place, corpus, home)
        take_in_ensemble(project, ensemble, _TERMINAL_WINDOW)
        return project
    source = parse_movement(str(file), home).source
    motions = read_movements(source, (), home, whole=True, joints=None, unit=None, asf=None, source_fps=None, up=None)
    project = Project.create(place, corpus, home)
    keys = [project.movements.keep(motion) for motion in motions]
    blocks = [
        Insert(f"b{number}", key, 0, len(motion) - 1)
        for number, (key, motion) in enumerate(zip(keys, motions, strict=True), start=1)
    ]
    project.edit(_TERMINAL_WINDOW, Several(tuple(blocks), f"begin with {displayed(file.name)}"))
    return project


def _place(file: Path | None) -> Path | None:
    """Return the project's file of a command; None for a new one in the user's data folder."""
    from motionmind.studio.journal import SUFFIX

    if file is None:
        return None
    return file if file.suffix == SUFFIX else Path(split_clip(file)[0]).with_suffix(SUFFIX)


def _is_here(corpus: str, home: Path | None) -> bool:
    from motionmind.corpus import store

    try:
        store.locate(corpus, home)
    except MotionMindError:
        return False
    return True


def _new(home: Path | None) -> Path:
    """Return the file of a new project in the user's data folder; note the latest projects there."""
    from motionmind.corpus import store
    from motionmind.files import make_folder
    from motionmind.studio.journal import SUFFIX

    folder = store.home(home) / "projects"
    try:
        make_folder(folder)
        known = sorted(folder.glob(f"*{SUFFIX}"), key=lambda path: path.stat().st_mtime, reverse=True)
    except OSError as error:
        raise MotionMindError(f"{folder}: cannot be made: {error.strerror or error}") from error
    for path in known[:5]:
        note(f"earlier project: {displayed_path(path)}")
    taken = {path.stem for path in known}
    number = next(number for number in range(1, len(taken) + 2) if f"piece-{number}" not in taken)
    return folder / f"piece-{number}{SUFFIX}"
