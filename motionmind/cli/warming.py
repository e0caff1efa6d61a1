"""The command that compiles the inner loops ahead of time, and what a first search says and does about it.

Compiling all in one process takes a minute and a half. Separate processes begin with different parts of the program, on
real work, so that every loop is compiled for the arguments that it gets; each finds on disk what another has compiled
by the time it comes there.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep
from typing import TYPE_CHECKING

import click

from motionmind.cli.options import command
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from motionmind.body.motion import Motion
    from motionmind.learned.carriage import Carriage
    from motionmind.search.problem import Problem
    from motionmind.tween.engine import Engine

NOTICE = "compiling inner loops, once, which takes a minute or more (`motionmind warm` does it)"
_LAST = "search/astar.search"  # calls most of what is compiled for a search, and is there only once all of that is
_SEARCHES = ("body/", "footing/", "geometry/", "realise/", "search/", "walks/")  # what a search needs, by folder
_LATER = (  # of which it needs little, or nothing
    "body/support._overhang",
    *("walks/sparse", "walks/steps", "search/pair_chain", "search/sample"),
)
_LOOK = 0.2  # seconds between two looks at what is compiled
_AT_ONCE = 3  # processes at most that share the work
_BACK = 10  # by which processes that stand back are nicer than others


@command("motionmind warm")
def warm() -> None:
    """Compile the inner loops, so that no search or film has to wait for it.

    The first search does what it needs of this on its own. It takes one or two minutes, once for each version of
    MotionMind and Python. What is compiled is kept in the user's cache directory, or in NUMBA_CACHE_DIR.
    """
    from motionmind.jit import compiled_names, is_all_compiled, place_of_code

    if place_of_code() is None:
        raise MotionMindError("compiled code can be kept neither in the user's cache directory nor in NUMBA_CACHE_DIR")
    if is_all_compiled():
        click.echo(f"nothing to do: all {len(compiled_names())} functions are compiled")
        return
    began = monotonic()
    _compile()
    click.echo(f"compiled {len(compiled_names())} functions in {monotonic() - began:.0f} s; the next search needs none")


def warm_once() -> None:
    """Compile all, unless a search is compiled; say so, with a bar on a terminal, else in a line.

    Nothing is done where compiled code cannot be kept: whatever needs it then compiles it.
    """
    if is_cold():
        _say()
        _compile()


def is_cold() -> bool:
    """Return whether a search is yet to be compiled, if only its rest, and compiled code can be kept."""
    from motionmind.jit import compiled_names, place_of_code

    return _LAST not in compiled_names() and place_of_code() is not None


def compile_in_steps() -> Generator[tuple[int, int, bool]]:
    """Compile all beside other work, what a search needs first; to close the iterator ends it.

    Yields the number of functions that are compiled, that of all, and whether those of a search are among them; until
    they are, functions that no search calls are not counted.
    """
    from motionmind.jit import compiled_names, decorated_names, note_all_compiled

    failed = 0
    for is_ready, programs in ((False, [[search], [realise, seek]]), (True, [[draw, learn]])):
        counted = decorated_names() if is_ready else _first_names()
        workers = _start(programs, stands_back=True)
        try:
            while any(worker.poll() is None for worker in workers):
                yield len(compiled_names() & counted), len(counted), is_ready
        finally:
            _end(workers)
        failed += sum(worker.returncode != 0 for worker in workers)
    if not failed:
        note_all_compiled()


def _first_names() -> frozenset[str]:
    """Return the functions that a search needs, but for a few."""
    from motionmind.jit import decorated_names

    return frozenset(name for name in decorated_names() if name.startswith(_SEARCHES) and not name.startswith(_LATER))


def announce_first_search() -> None:
    """Say that the first search takes longer, if it is yet to come."""
    from motionmind.jit import compiled_names

    if _LAST not in compiled_names():
        _say()


def help_first_search() -> None:
    """Compile, beside a search that is the first, what it comes to last; the corpus is learned, for all to load.

    What is still running when the command ends is ended with it.
    """
    if is_cold() and _processors() > 1:
        helpers = _start([[realise, seek], [draw]])
        click.get_current_context().call_on_close(lambda: _end(helpers))


def _say() -> None:
    click.echo(NOTICE, err=True)


def _compile() -> None:
    """Compile all that the workers come by, with a bar on a terminal; side by side, where there are processors.

    A worker that fails leaves its part to whoever needs it: its errors are not of interest here.
    """
    from motionmind.jit import compiled_names, decorated_names, note_all_compiled

    total, known = len(decorated_names()), 0
    works = [search, realise, draw, learn, seek]
    side_by_side = min(_processors(), _AT_ONCE)
    programs = [works[first::side_by_side] for first in range(side_by_side)]
    with click.progressbar(length=total, label="compiling", file=sys.stderr, hidden=not sys.stderr.isatty()) as bar:
        workers = _start(programs)
        try:
            while any(worker.poll() is None for worker in workers):
                now = len(compiled_names())
                bar.update(now - known)
                known = now
                sleep(_LOOK)
        finally:
            _end(workers)
    if all(worker.returncode == 0 for worker in workers):
        note_all_compiled()


def _start(
    programs: Sequence[Sequence[Callable[[], None]]], *, stands_back: bool = False
) -> list[subprocess.Popen[bytes]]:
    """Start a process for each program, with this package on its path, and without the working directory.

    Args:
        programs: functions of this module to call in turn, for each process.
        stands_back: whether other processes go first where there are too few processors.
    """
    root = str(Path(__file__).parents[2])
    # Compiling makes many objects that stay: with rarer collections it takes a tenth less time and a sixth more memory.
    begin = f"import gc, sys; gc.set_threshold(100_000); sys.path.insert(0, {root!r})"
    begin += "; from motionmind.cli import warming"
    begin += f"; import os; os.nice({_BACK})" * (stands_back and hasattr(os, "nice"))
    calls = ["; ".join(f"warming.{work.__name__}()" for work in works) for works in programs]
    return [
        subprocess.Popen(
            [sys.executable, "-P", "-c", f"{begin}; {call}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for call in calls
    ]


def _end(workers: Sequence[subprocess.Popen[bytes]]) -> None:
    """End processes that still run."""
    for worker in workers:
        with suppress(OSError):
            worker.kill()
        worker.wait()


def _processors() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def search() -> None:
    """Find a movement between two postures, and another one that differs."""
    from motionmind.tween.engine import Engine

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    for _ in engine.alternatives(clip.posture(0), clip.posture(9), 2):
        pass


def realise() -> None:
    """Realise moves of the corpus, which no search has to find, see how deep limbs are in each other, reach, and slow a
    knee down, as few movements have to."""
    import numpy as np

    from motionmind.body.capsules import penetration
    from motionmind.footing.knees import slow_down
    from motionmind.footing.legs import find_legs, reach
    from motionmind.tween.engine import Engine

    engine = Engine.load("ballet")
    _realise(engine, engine.carriage)
    skeleton, rotations = engine.corpus.skeleton, engine.corpus.rotations[:2]
    penetration(skeleton, rotations)
    leg = find_legs(skeleton)[1][0][0][:3]
    places = skeleton.positions(rotations, engine.corpus.root[:2])[:, leg]
    reach(skeleton.global_rotations(rotations)[:, leg[0]], places, places[:, 2])
    stands = np.arange(4) % 2 == 0
    slow_down(np.linspace(0.0, 2.0, 4), stands, stands, 1.0, 30.0)


def seek() -> None:
    """Search by A* alone, which a search comes to last."""
    import numpy as np

    from motionmind.search import astar, trws
    from motionmind.search.heuristic import Heuristic
    from motionmind.search.pieces import Pieces
    from motionmind.search.segments import Piece

    problem = _problem()
    trellis = Pieces(problem).trellis(Piece(0, 0, problem.rules.longest), np.inf)
    chosen = np.zeros(len(trellis.dom_ptr) - 1, dtype=np.int64)
    bound = Heuristic.of_messages(trws.no_messages(trellis))
    astar.search(trellis, bound, np.inf, astar.SAME, chosen, 1000, 1, np.zeros(1, dtype=np.bool_))


def learn() -> None:
    """Learn a clip anew, find its moves in the corpus, realise them by few of its moments; sample a path; read it."""
    from motionmind.discretize import make_discretization
    from motionmind.learned.neighbours import build_neighbours
    from motionmind.search.sample import sample_path
    from motionmind.search.solve import solve
    from motionmind.tween.engine import Engine
    from motionmind.walks.detail import likest_moves, moves_near

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    moves = engine.corpus.moves
    trees = build_neighbours(engine.corpus.skeleton, engine.carriage.orientations, engine.carriage.weights)
    of_few = replace(engine.carriage, trees=trees)
    _realise(engine, of_few)
    for among in (None, moves_near(moves, of_few, clip.rotations)):
        likest_moves(moves, engine.corpus.rotations, clip.rotations, among)
    Engine.fit([clip], discretization=make_discretization("codebook", 15.0)).check()
    problem = _problem()
    sample_path(problem, solve(problem), 0)
    _read(clip)


def _read(clip: Motion) -> None:
    """Read a clip from a file, as it would have been recorded, and turn the way of one that lasts minutes."""
    import numpy as np

    from motionmind.body.plausibility import at_rate
    from motionmind.formats import read_motion, write_motion
    from motionmind.geometry import rotations as rot

    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        path = Path(folder) / "clip.bvh"
        write_motion(path, at_rate(clip))
        read_motion(path)
    rot.mul_vec(rot.IDENTITY, np.zeros((5000, 3)))


def _realise(engine: Engine, carriage: Carriage) -> None:
    """Realise a clip's moves by what the corpus knows of how bodies carry themselves."""
    import numpy as np

    from motionmind.body.motion import Velocity
    from motionmind.realise.realise import realise as realise_path

    clip = engine.corpus.motion(engine.corpus.clips[0])
    none = np.zeros(len(engine.space), dtype=np.bool_)
    realise_path(
        engine.space.assign(engine.corpus.to_chains(clip.rotations)),
        clip.posture(0),
        clip.posture(len(clip) - 1),
        engine.corpus,
        engine.grammar,
        carriage,
        np.radians(engine.space.tolerances),
        none,
        none,
        30.0,
        leaving=Velocity.at_start(clip),
        fastest=engine.pace.fastest,
        peaks=engine.pace.peaks_in,
        slides=float(engine.plausibility.slides[0]),
    )


def draw() -> None:
    """Draw a clip in all ways; bound paths by pair chains alone, which a search comes to late."""
    from motionmind.plots.attractor import write_attractor
    from motionmind.render.pictures import write_picture
    from motionmind.search.solve import solve
    from motionmind.tween.engine import Engine
    from motionmind.variation.variation import vary

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    with tempfile.TemporaryDirectory(prefix="motionmind-") as folder:
        write_picture(Path(folder) / "clip.gif", clip.slice(0, 2))
        write_picture(Path(folder) / "clip.svg", clip.slice(0, 2))
        write_attractor(Path(folder) / "attractor.png", vary(clip, stretch=4))
    problem = _problem()
    moves = problem.rules.longest
    solve(replace(problem, rules=replace(problem.rules, shortest=moves, sweeps=0), tolls=None))


def _problem() -> Problem:
    """Return the problem of a movement between two postures of a bundled corpus."""
    from motionmind.tween.engine import Engine
    from motionmind.tween.formulate import formulate
    from motionmind.tween.request import TweenRequest

    engine = Engine.load("ballet")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    return formulate(engine, clip.posture(0), clip.posture(9), TweenRequest()).searched
