"""In-betweening held-out clips: how near the truth, how smooth and how steady on its feet a tween is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from experiments.harness import Row, Setting
from experiments.inbetween.genmm import Examples, between
from experiments.inbetween.rivals import Ends, Made, Segments, at_rest, hermite, slerp
from experiments.inbetween.tables import chart, tell
from experiments.material import FPS, RECORDED, families, learned, movement, recorded, take_of
from motionmind import Engine, Motion, NoPathError
from motionmind._typing import Floats
from motionmind.body.contact import find_floor, foot_slide, skating
from motionmind.corpus.corpus import Corpus
from motionmind.metrics.inbetween import l2p, l2q, npss, position_spread, seen
from motionmind.metrics.smoothness import angular_jerk
from motionmind.metrics.style import StyleClassifier, fit_style_classifier

__all__ = ["chart", "jobs", "tell", "work"]

DANCERS = ("cmu-05", "indian", "cmu-16", "cmu-135")
TUNED_ON = ("cmu-05",)  # constants are chosen on its windows alone (--tuning --out FOLDER), and must serve all
GAPS = (0.6, 1.2, 2.0, 4.0)  # seconds
STRIDE = 6  # frames from one window to the next, 0.2 s
FOREIGN_STRIDE = 18  # frames, where other dancers are learned from
MOVING_EVERY = 2  # of the windows, where frames beyond their ends are known
PAST = 9  # frames before A that are known, where A moves; LaFAN1's ten with A itself
LONGEST = 60  # moves
BUDGET = 2_000
USUAL = (0.05, 0.95)  # quantiles of the jerk of movement that is learned from
INNER = np.s_[:, 1:-1]  # the frames of windows that are not given
JUDGED = ("cmu-05", "cmu-135", "bandai", "indian", "cmu-16")  # whom the classifier tells apart
GIVEN = ("two postures", "past frames", "moving ends")


def jobs(setting: Setting) -> list[dict[str, Any]]:
    """Return a job for each family of takes: first learned from the dancer's other takes, then from other dancers."""
    data = str(setting.data) if setting.data else None
    names = recorded(data, *(TUNED_ON if setting.tuning else DANCERS)) or ["karate"]
    gaps, stride = (GAPS[:2], 5 * FPS) if setting.quick else (GAPS, STRIDE)
    out = []
    for name in names:
        others = [other for other in recorded(data, *DANCERS) if other != name]
        for takes in families(data, name):
            job = {"data": data, "name": name, "takes": list(takes), "gaps": list(gaps)}
            if not windows_of(data, name, takes, round(gaps[0] * FPS), stride):
                continue
            out.append(job | {"teachers": [name], "stride": stride})
            if others and not setting.tuning:
                out.append(job | {"teachers": others, "stride": FOREIGN_STRIDE})
    return sorted(out, key=lambda job: job["teachers"] != [job["name"]])


def windows_of(
    data: str | None, name: str, takes: Iterable[str], frames: int, stride: int
) -> list[tuple[str, int, int]]:
    """Return the take, the piece of it and the start of each window of so many frames."""
    pieces = movement(data, name, frames)
    return [
        (take, number, start)
        for take in takes
        for number, piece in enumerate(pieces.get(take, ()))
        for start in range(0, len(piece) - frames, stride)
    ]


def disjoint(places: Iterable[tuple[int, int]], frames: int) -> int:
    """Return how many windows of so many frames do not overlap, at most; of each its piece and its start."""
    ends: dict[int, int] = {}
    count = 0
    for piece, start in sorted(places):
        if start >= ends.get(piece, 0):
            ends[piece] = start + frames
            count += 1
    return count


def work(
    data: str | None, name: str, takes: list[str], gaps: list[float], teachers: list[str], stride: int
) -> list[Row]:
    """Fill the windows of one family of takes with what was learned without it, and measure each method's results."""
    lesson = lesson_of(data, tuple(teachers), tuple(takes))
    keep_apart(lesson.engine.corpus, takes)
    own = teachers == [name]
    out = []
    for seconds in gaps:
        frames = round(seconds * FPS)
        places = windows_of(data, name, takes, frames, stride)
        who = judge(data, name, frames)
        for take in dict.fromkeys(take for take, _, _ in places):
            pieces = movement(data, name, frames)[take]
            apart = disjoint([(number, start) for at, number, start in places if at == take], frames)
            for given in GIVEN if own else GIVEN[:1]:
                windows = [Window(pieces[number], start, frames) for at, number, start in places if at == take]
                if given != GIVEN[0]:
                    windows = [window for window in windows[::MOVING_EVERY] if window.surrounded]
                if not windows:
                    continue
                truth = Ruled(windows, lesson.ruler(frames))
                about = {
                    "corpus": name,
                    "tuned": int(name in TUNED_ON),
                    "teachers": "+".join(teachers),
                    "given": given,
                    "family": takes[0],
                    "take": take,
                    "seconds": seconds,
                    "disjoint": apart,
                }
                for kind, way in ways(lesson, given, own, seconds).items():
                    if found := tried(windows, way, given):
                        accepted = [who.takes(made[0][:frames], name, takes[0]) for _, made, _ in found]
                        measured = truth.measured(found) | {"taken": np.mean(accepted)}
                        out.append(about | {"kind": kind} | measured)
    return out


# --- what is learned from ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Lesson:
    """Movement that is learned from: an engine of it, and the movement itself, 30 frames a second.

    Attributes:
        engine: an engine of it.
        pieces: its unbroken pieces.
    """

    engine: Engine
    pieces: list[Motion]
    _known: dict[tuple[str, float], Any] = field(default_factory=dict)

    def segments(self, frames: int) -> Segments:
        return self._once("segments", frames, lambda: Segments(self.pieces, frames))

    def patches(self, scale: float) -> Floats:
        examples = self._once("examples", 1.0, lambda: Examples.of(self.pieces))
        return self._once("patches", scale, lambda: examples.patches(scale))

    def ruler(self, frames: int) -> Ruler:
        """The units of measures: how the movement's own windows, half their length apart, vary."""
        return self._once("ruler", frames, lambda: ruler_of(self.pieces, frames))

    def _once(self, what: str, size: float, make: Callable[[], Any]) -> Any:
        if (what, size) not in self._known:
            self._known[what, size] = make()
        return self._known[what, size]


def ruler_of(pieces: Sequence[Motion], frames: int) -> Ruler:
    parts = [
        piece.slice(start, start + frames + 1)
        for piece in pieces
        for start in range(0, len(piece) - frames, frames // 2)
    ]
    rotations, root = np.stack([part.rotations for part in parts]), np.stack([part.root for part in parts])
    _, places = seen(parts[0].skeleton, rotations, root, rotations, root)
    jerk = angular_jerk(rotations, FPS).mean(axis=(1, 2))
    # A coordinate that hardly changes, as across the hips of a body seen from its root, counts as a millimetre.
    return Ruler(np.maximum(position_spread(places), 1e-3), *np.quantile(jerk, USUAL))


@dataclass(frozen=True)
class Ruler:
    """Units of measures: the spread of positions [J, 3], metres, and the usual range of jerk, rad/s^3."""

    spread: Floats
    low: float
    high: float


@lru_cache(maxsize=1)
def lesson_of(data: str | None, names: tuple[str, ...], left_out: tuple[str, ...]) -> Lesson:
    """Learn from takes of corpora but for those left out."""
    pieces = [
        piece
        for name in names
        for take, found in movement(data, name, 1).items()
        if take not in left_out
        for piece in found
    ]
    return Lesson(learned(data, names, left_out), pieces)


def keep_apart(corpus: Corpus, takes: Sequence[str]) -> None:
    """Raise ValueError if a corpus holds one of the takes, or its mirror image, or it backwards."""
    if known := {take_of(clip.name) for clip in corpus.clips} & set(takes):
        raise ValueError(f"what is held out was learned from: {', '.join(sorted(known))}")


@lru_cache(maxsize=4)
def judge(data: str | None, name: str, frames: int) -> StyleClassifier:
    """Return a classifier that tells the corpus from others by windows of its movement, a family left out at a time."""
    names = [name, *recorded(data, *(other for other in JUDGED if other != name))] if name in RECORDED else []
    corpora = {}
    for one in names or ["karate", "ballet"]:
        pieces = movement(data, one, frames)
        together = {
            takes[0]: [piece.rotations for take in takes for piece in pieces.get(take, ())]
            for takes in families(data, one)
        }
        corpora[one] = {take: found for take, found in together.items() if any(len(x) > frames for x in found)}
    return fit_style_classifier(corpora, frames)


# --- ways from A to B -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Window:
    """A window of a recording.

    Attributes:
        piece: the unbroken piece that it is in.
        start: its first frame.
        frames: steps from its first frame to its last.
    """

    piece: Motion
    start: int
    frames: int

    @cached_property
    def real(self) -> Motion:
        return self.piece.slice(self.start, self.start + self.frames + 1)

    @property
    def surrounded(self) -> bool:
        """Whether there are frames enough before and after it."""
        return PAST <= self.start < len(self.piece) - self.frames - PAST

    @cached_property
    def floor(self) -> float:
        return find_floor(self.piece.skeleton, self.piece.rotations, self.piece.root)

    def ends(self, given: str) -> Ends:
        """What is given of it."""
        end, whole = self.start + self.frames, self.piece
        before = whole.slice(self.start - PAST, self.start + 1) if given != GIVEN[0] else None
        after = whole.slice(end, end + PAST + 1) if given == GIVEN[2] else None
        return Ends(self.real.posture(0), self.real.posture(-1), self.frames, before, after)


Way = Callable[[Window, Ends], tuple[Made, dict[str, float]]]


def ways(lesson: Lesson, given: str, own: bool, seconds: float) -> dict[str, Way]:
    """Return the methods to compare, by name; the first is the truth."""
    frames = round(seconds * FPS)
    out: dict[str, Way] = {"danced": lambda window, ends: ((window.real.rotations, window.real.root), {})}
    plain: dict[str, Callable[[Ends], Made]] = {"slerp": slerp}
    if given == GIVEN[0]:
        plain["spline"] = at_rest
        segments = lesson.segments(frames)
        if len(segments.starts):
            plain["nearest segment"] = lambda ends: segments.nearest(ends, 1)
            plain["mean of eight"] = lambda ends: segments.nearest(ends, 8)
        if own:
            plain["GenMM"] = lambda ends: between(ends, lesson.patches)
    else:
        plain["hermite"] = hermite
    out |= {kind: lambda window, ends, make=make: (make(ends), {}) for kind, make in plain.items()}
    if given == GIVEN[0] and own:
        bodies = {"moves": (1, LONGEST), "whole_body": True}
        out["whole bodies"] = lambda window, ends: tween(lesson.engine, ends, seconds, **bodies)
        out["no guide"] = lambda window, ends: tween(lesson.engine, ends, seconds, guide=0.0)
    out["motionmind"] = lambda window, ends: tween(lesson.engine, ends, seconds)
    return out


def tween(engine: Engine, ends: Ends, seconds: float, **options: Any) -> tuple[Made, dict[str, float]]:
    """Return the engine's motion, how many degrees it is off its path, and the share of joints' moves that follow it.

    The path is of the usual number of moves or, if there is none, of as few as it needs.
    """
    options = {
        "duration": seconds,
        "node_budget": BUDGET,
        "fps": FPS,
        "before": ends.before,
        "after": ends.after,
    } | options
    try:
        found = engine.tween(ends.a, ends.b, **options)
    except NoPathError:
        if "moves" in options:
            raise
        found = engine.tween(ends.a, ends.b, moves=(max(1, round(5.0 * seconds)), LONGEST), **options)
    off = found.path_degrees[1:-1]
    near = off <= np.asarray(engine.space.tolerances)
    path = {"off_path": float(off.mean()), "followed": float(near.mean())} if off.size else {}
    return (found.motion.rotations, found.motion.root), path


def tried(windows: Sequence[Window], way: Way, given: str) -> list[tuple[Window, Made, dict[str, float]]]:
    """Return what a method makes of windows; those that it finds no way through are left out."""
    out = []
    for window in windows:
        try:
            out.append((window, *way(window, window.ends(given))))
        except NoPathError:
            continue
    return out


# --- measures ---------------------------------------------------------------------------------------------------------


class Ruled:
    """The truth in windows, to measure by."""

    def __init__(self, windows: Sequence[Window], ruler: Ruler) -> None:
        self._ruler, self._skeleton = ruler, windows[0].real.skeleton
        self._row = {id(window): row for row, window in enumerate(windows)}
        real = [window.real for window in windows]
        self._real = np.stack([one.rotations for one in real]), np.stack([one.root for one in real])
        self._turned, self._places = seen(self._skeleton, *self._real, *self._real)
        straight, lines = zip(*(slerp(window.ends(GIVEN[0])) for window in windows), strict=True)
        turned, _ = seen(self._skeleton, np.stack(straight), np.stack(lines), *self._real)
        self._slerp = l2q(self._turned[INNER], turned[INNER])

    def measured(self, found: Sequence[tuple[Window, Made, dict[str, float]]]) -> Row:
        """Return the mean measures of what a method made, and SLERP's L2Q in the same windows."""
        rows = [self._row[id(window)] for window, _, _ in found]
        truth, places = self._turned[rows][INNER], self._places[rows][INNER]
        rotations, root = np.stack([one for _, (one, _), _ in found]), np.stack([one for _, (_, one), _ in found])
        turned, put = seen(self._skeleton, rotations, root, *(one[rows] for one in self._real))
        jerk = angular_jerk(rotations, FPS).mean(axis=(1, 2))
        feet = [(self._skeleton, *made, window.floor) for window, made, _ in found]
        paths = [path for _, _, path in found if path]
        return {
            "windows": len(found),
            "l2q": l2q(truth, turned[INNER]).mean(),
            "slerp": self._slerp[rows].mean(),
            "l2p": l2p(places, put[INNER], self._ruler.spread).mean(),
            "npss": npss(truth, turned[INNER]),
            "power": power(truth),
            "jerk": jerk.mean(),
            "usual": np.mean((jerk >= self._ruler.low) & (jerk <= self._ruler.high)),
            "skating": np.mean([skating(*foot) for foot in feet]),
            "slide": np.mean([foot_slide(*foot) for foot in feet]),
            "off_path": np.mean([path["off_path"] for path in paths]) if paths else np.nan,
            "followed": np.mean([path["followed"] for path in paths]) if paths else np.nan,
        }


def power(rotations: Floats) -> float:
    """Return the weight of windows [B, T, J, 4] in NPSS: the sum of squares of all Fourier coefficients' real parts."""
    flips = np.sum(rotations[:, 1:] * rotations[:, :-1], axis=-1, keepdims=True) < 0.0
    sign = np.cumprod(np.where(flips, -1.0, 1.0), axis=1)
    steady = np.concatenate([rotations[:, :1], rotations[:, 1:] * sign], axis=1)
    return float(np.sum(np.fft.fft(steady, axis=1).real ** 2))
