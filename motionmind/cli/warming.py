"""Compile the inner loops: with the warm command, or in the background of the first run.

Several processes run different parts of the program on real data, so that every loop is compiled for the types of its
arguments. They share compiled code on disk. One process at a time, which holds a lock, starts and ends them: the
command, or a background process that outlives the first run.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING

import click

from motionmind.cli.options import Section, command, option
from motionmind.display import displayed_path
from motionmind.errors import MotionMindError
from motionmind.files import lock_alone

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.learned.posture_statistics import PostureStatistics
    from motionmind.search.problem import Problem
    from motionmind.tween.engine import Engine

FIRST_RUN_NOTE = "first run: preparing in the background, this one may take a minute (`motionmind warm --stop` ends it)"
STILL_COMPILING_NOTE = (
    "still preparing in the background ({done} of {total} functions are compiled): this run is slower"
)
_LAST_COMPILED = "search/astar.search"  # calls most compiled functions of a search, and is saved after them
_MIN_FREE_BYTES = 200e6  # free disk space needed to compile in the background; the code takes 15 MB


@command("motionmind warm")
@option(
    "--stop",
    "is_stopping",
    section=Section.OUTPUT,
    is_flag=True,
    help="Stop the background process that the first run started.",
)
def warm(is_stopping: bool) -> None:
    """Compile the inner loops ahead of time, so that no search or film waits for them.

    The first run starts this in the background. It takes one or two minutes, once per version of MotionMind and Python.
    The code is stored in the user's cache directory, or in NUMBA_CACHE_DIR.
    """
    from motionmind.codecache import compiled_names, decorated_names, is_all_compiled, place_of_code

    if (place := place_of_code()) is None:
        raise MotionMindError("cannot store compiled code: make the cache directory or NUMBA_CACHE_DIR writable")
    if is_stopping:
        click.echo("stopped preparing" if _stop(place) else "nothing is preparing in the background")
        return
    if is_all_compiled():
        click.echo(f"nothing to do: all {len(compiled_names())} functions are compiled")
        return
    began = monotonic()
    _wait_or_compile(place)
    if missing := decorated_names() - compiled_names():
        stored = f"{len(missing)} of {len(decorated_names())} functions could not be compiled and stored"
        raise MotionMindError(f"{displayed_path(place)}: {stored}; is the disk full? run it again")
    click.echo(f"compiled {len(compiled_names())} functions in {monotonic() - began:.0f} s; the next search needs none")


def prepare() -> None:
    """Start to compile the inner loops in the background, unless they are compiled, and print a note.

    Start nothing if compiled code cannot be stored: each run then compiles the functions that it calls.
    """
    from motionmind.codecache import compiled_names, decorated_names, is_all_compiled, place_of_code

    if is_all_compiled() or (place := place_of_code()) is None:
        return
    if _is_running(place):
        click.echo(STILL_COMPILING_NOTE.format(done=len(compiled_names()), total=len(decorated_names())), err=True)
    elif shutil.disk_usage(place).free > _MIN_FREE_BYTES:
        click.echo(FIRST_RUN_NOTE, err=True)
        _start([[compile_beside_search]], in_background=True)


@contextmanager
def preparing() -> Iterator[None]:
    """Call `prepare`; on a terminal, show the number of compiled functions within the context."""
    from motionmind.codecache import is_all_compiled

    prepare()
    if is_all_compiled() or not sys.stderr.isatty():
        yield
        return
    has_ended = threading.Event()
    shower = threading.Thread(target=_show_progress, args=(lambda: not has_ended.is_set(),), kwargs={"hidden": False})
    shower.start()
    try:
        yield
    finally:
        has_ended.set()
        shower.join()


def prepare_in_steps() -> Generator[tuple[int, int, bool]]:
    """Start to compile the inner loops in the background like `prepare`, without a note, and yield the progress.

    Each item is the number of compiled functions, the number of all, and whether the search is compiled, so that
    searches may begin. Closing the iterator does not stop the compilation.
    """
    from motionmind.codecache import compiled_names, decorated_names, place_of_code

    if (place := place_of_code()) is None or shutil.disk_usage(place).free < _MIN_FREE_BYTES:
        return
    if not _is_running(place):
        _start([[compile_before_searches]], in_background=True)
    began = monotonic()
    while _is_running(place) or monotonic() < began + 5.0:  # seconds to start
        names = compiled_names()
        yield len(names), len(decorated_names()), _LAST_COMPILED in names


def compile_beside_search() -> None:
    """Compile all functions beside a command that learns a corpus, searches, synthesises and draws; run by `prepare`.

    Processes that run in step would compile the same functions. So this one begins with work that needs no learned
    corpus, until the command has learned and saved one, and then synthesises while the command searches.
    """
    _compile_in_background([turn, film, synthesise, seek, draw, learn, search], max(_processors() - 1, 1))


def compile_before_searches() -> None:
    """Compile all functions, those of searches first; run by `prepare_in_steps`."""
    _compile_in_background([turn, search, synthesise, film, learn, draw, seek], _processors())


def _compile_in_background(works: Sequence[Callable[[], None]], processes: int) -> None:
    """Compile the functions that `works` call, unless another process does; SIGTERM ends it."""
    from motionmind.codecache import place_of_code

    place = place_of_code()
    assert place is not None
    with suppress(OSError), _alone(place) as is_alone:
        if is_alone:
            signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # exits through the code that ends the workers
            _compile(works, processes, hidden=True)


def _wait_or_compile(place: Path) -> None:
    """Wait for a process that compiles, if any, then compile the rest; with a progress bar on a terminal."""
    from motionmind.codecache import is_all_compiled

    hidden = not sys.stderr.isatty()
    while not is_all_compiled():
        with _alone(place) as is_alone:
            if is_alone:
                _compile([turn, search, synthesise, film, learn, draw, seek], _processors(), hidden=hidden)
                return
        _show_progress(lambda: _is_running(place), hidden=hidden)


def _compile(works: Sequence[Callable[[], None]], processes: int, *, hidden: bool) -> None:
    """Compile the functions that `works` call, with at most three processes and a progress bar unless hidden.

    Ignore workers that fail: the next run compiles their part.
    """
    from motionmind.codecache import compiled_names, decorated_names, note_all_compiled

    side_by_side = min(processes, 3)
    programs = [works[first::side_by_side] for first in range(side_by_side)]
    workers = _start(programs)
    try:
        _show_progress(lambda: any(worker.poll() is None for worker in workers), hidden=hidden)
    finally:
        for worker in workers:
            with suppress(OSError):
                worker.kill()
            worker.wait()
    if decorated_names() <= compiled_names():
        note_all_compiled()


def _show_progress(is_running: Callable[[], bool], *, hidden: bool) -> None:
    """Show the progress of the compilation until it ends, unless hidden."""
    from motionmind.codecache import compiled_names, decorated_names

    total, known = len(decorated_names()), 0
    with click.progressbar(length=total, label="compiling", file=sys.stderr, hidden=hidden, show_pos=True) as bar:
        while is_running():
            now = len(compiled_names())
            bar.update(now - known)
            known = now
            sleep(0.2)


def _start(
    programs: Sequence[Sequence[Callable[[], None]]], *, in_background: bool = False
) -> list[subprocess.Popen[bytes]]:
    """Start a process for each program, with this package on its path, and without the working directory.

    Args:
        programs: for each process, the functions of this module to call in turn.
        in_background: whether the processes outlive this one, at low priority.
    """
    root = str(Path(__file__).parents[2])
    # Compiling makes many lasting objects: rarer collections save a tenth of the time for a sixth more memory.
    begin = f"import gc, sys; gc.set_threshold(100_000); sys.path.insert(0, {root!r}); import os"
    begin += "; os.nice(10)" * (in_background and hasattr(os, "nice"))
    begin += "; from motionmind.cli import warming"
    begin += f"; warming.end_with({os.getpid()})" * (not in_background)
    calls = ["; ".join(f"warming.{work.__name__}()" for work in works) for works in programs]
    workers = [
        subprocess.Popen(
            [sys.executable, "-P", "-c", f"{begin}; {call}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=in_background,
        )
        for call in calls
    ]
    if in_background:
        _started.extend(workers)
    return workers


def end_with(parent: int) -> None:
    """End this process after its parent has ended, even if killed."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    if os.name == "posix":
        threading.Thread(target=watch, daemon=True).start()


_started = list[subprocess.Popen[bytes]]()  # keeps a reference, or Python would warn that they still run


@contextmanager
def _alone(place: Path) -> Iterator[bool]:
    """Hold the lock of the one process that compiles, and store its id; yield False if another process has it."""
    descriptor = os.open(place / "preparing", os.O_RDWR | os.O_CREAT, 0o600)
    try:
        if is_alone := lock_alone(descriptor):
            os.ftruncate(descriptor, 0)
            os.write(descriptor, str(os.getpid()).encode())
        yield is_alone
    finally:
        os.close(descriptor)


def _is_running(place: Path) -> bool:
    """Return whether a process compiles."""
    try:
        descriptor = os.open(place / "preparing", os.O_RDWR)
    except OSError:
        return False
    try:
        return not lock_alone(descriptor)
    finally:
        os.close(descriptor)


def _stop(place: Path) -> bool:
    """End the process that compiles, if any, and its workers; return whether there was one."""
    if not _is_running(place):
        return False
    try:
        os.kill(int((place / "preparing").read_bytes()), signal.SIGTERM)
    except (OSError, ValueError):  # it has just ended
        return False
    return True


def _processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def turn() -> None:
    """Take means of rotations and a spline through some, the last step of learning; needs no learned corpus."""
    import numpy as np

    from motionmind.geometry import rotations as rot
    from motionmind.geometry.splines import rotation_spline
    from motionmind.jit import read_only
    from motionmind.walks.means import mean_rotations

    poses = np.tile(rot.IDENTITY, (3, 2, 1))
    mean_rotations(np.ones((3, 3)), read_only(poses), np.arange(2), poses)
    rotation_spline(np.arange(3.0), poses, np.array([0.5]))


def search() -> None:
    """Find a movement between two postures, and an alternative."""
    from motionmind.tween.engine import Engine

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    for _ in engine.alternatives(clip.posture(0), clip.posture(9), 2):
        pass


def synthesise() -> None:
    """Realise moves of the corpus, without a search."""
    from motionmind.tween.engine import Engine

    engine = Engine.load("ballet")
    _synthesise(engine, engine.statistics)


def seek() -> None:
    """Search by A* alone, the last step of a search, and bound paths by pair chains alone."""
    import numpy as np

    from motionmind.search import astar, trws
    from motionmind.search.heuristic import Heuristic
    from motionmind.search.pieces import Pieces
    from motionmind.search.segments import Piece
    from motionmind.search.solve import solve
    from motionmind.search.tolerances import SAME_COST_NATS

    problem = _problem()
    trellis = Pieces(problem).trellis(Piece(0, 0, problem.rules.longest), np.inf)
    chosen = np.zeros(len(trellis.dom_ptr) - 1, dtype=np.int64)
    bound = Heuristic.of_messages(trws.no_messages(trellis))
    astar.search(trellis, bound, np.inf, SAME_COST_NATS, chosen, 1000, 1, np.zeros(1, dtype=np.bool_))
    moves = problem.rules.longest
    solve(replace(problem, rules=replace(problem.rules, shortest=moves, sweeps=0), tolls=None))


def learn() -> None:
    """Learn a clip anew, synthesise its moves from few of its samples; sample a path; read it."""
    from motionmind.discretize import make_discretization
    from motionmind.learned.neighbours import build_neighbours
    from motionmind.search.sample import sample_path
    from motionmind.search.solve import solve
    from motionmind.tween.engine import Engine

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    trees = build_neighbours(engine.corpus.skeleton, engine.statistics.orientations, engine.statistics.weights)
    of_few = replace(engine.statistics, trees=trees)
    _synthesise(engine, of_few)
    Engine.fit([clip], discretization=make_discretization("codebook", 15.0)).check()
    problem = _problem()
    sample_path(problem, solve(problem), 0)
    _read(clip)


def _read(clip: Motion) -> None:
    """Read a clip from a file like a recording."""
    from motionmind.body.plausibility import at_rate
    from motionmind.formats import read_motion, write_motion

    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        path = Path(folder) / "clip.bvh"
        write_motion(path, at_rate(clip))
        read_motion(path)


def _synthesise(engine: Engine, statistics: PostureStatistics) -> None:
    """Realise a clip's moves by what the corpus knows of how bodies carry themselves."""
    import numpy as np

    from motionmind.body.motion import Velocity
    from motionmind.synthesis.synthesise import synthesise as synthesise_path
    from motionmind.synthesis.wishes import Style, Wishes

    clip = engine.corpus.motion(engine.corpus.clips[0])
    none = np.zeros(len(engine.space), dtype=np.bool_)
    slides = float(engine.plausibility.slides[0])
    speeds = engine.pace.fastest, engine.pace.peaks_in, slides
    style = Style(engine.corpus, engine.grammar, statistics, np.radians(engine.space.tolerances), *speeds)
    ends = clip.posture(0), clip.posture(len(clip) - 1)
    path = engine.space.assign(engine.corpus.to_chains(clip.rotations))
    synthesise_path(path, style, Wishes(*ends, none, none, 30.0, leaving=Velocity.at_start(clip)))


def film() -> None:
    """Film a posture, the last step of a command; needs no learned corpus."""
    from motionmind.names.finding import find_motion
    from motionmind.names.spelling import parse_source
    from motionmind.render.pictures import draw_picture

    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        draw_picture(Path(folder) / "posture.gif", find_motion(parse_source("ballet/arabesque"), as_clip=False))


def draw() -> None:
    """Draw a clip in all other formats, and keep two dancers of it apart."""
    from motionmind.ensemble.dancers import Dancer, Ensemble
    from motionmind.ensemble.keeping import keep_apart
    from motionmind.plots.attractor import draw_attractor
    from motionmind.render.pictures import draw_picture
    from motionmind.tween.engine import Engine
    from motionmind.variation.variation import vary

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        draw_picture(Path(folder) / "clip.svg", clip.slice(0, 2))
        draw_attractor(Path(folder) / "attractor.png", vary(clip, stretch=4))
    pair = (Dancer(name, clip.slice(0, 2), (place, 0.0)) for name, place in (("a", 0.0), ("b", 0.3)))
    keep_apart(Ensemble("pair", tuple(pair)), 0.6)


def _problem() -> Problem:
    """Return the problem of a movement between two postures of a bundled corpus."""
    from motionmind.tween.ends import bring_ends
    from motionmind.tween.engine import Engine
    from motionmind.tween.formulate import formulate
    from motionmind.tween.request import TweenRequest

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    ends = bring_ends(engine.corpus, clip.posture(0), clip.posture(9))
    return formulate(engine, ends, TweenRequest()).searched
