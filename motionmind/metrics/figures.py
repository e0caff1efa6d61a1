"""All measures of one movement at once, each beside the range of the corpus's own movement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, States
from motionmind.arguments import check_type
from motionmind.body.contact import RATE, find_feet, find_floor, foot_slide, skating
from motionmind.body.motion import Motion
from motionmind.body.plausibility import at_rate
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.learned.model import LearnedCorpus
from motionmind.learned.plausibility import MEASURES, UNITS_AND_MEANINGS, summarise_shown
from motionmind.metrics.paths import Habits, arrival_spread, learn_habits
from motionmind.metrics.smoothness import angular_jerk, angular_speed, sparc
from motionmind.metrics.style import WINDOW, Styles, features, learn_styles
from motionmind.metrics.verbatim import LONGEST, Phrasebook, learn_phrases
from motionmind.realise.timeline import usual
from motionmind.retarget.retarget import own_skeleton

RANGE = 5.0, 95.0  # percentiles of the corpus's own movement
_SHORTEST = 4  # frames; a jerk needs as many
_MOST = 100  # pieces of the corpus that are measured
_PARTS = 10  # pieces that the corpus is cut into, at least
_KEYED = 2.0  # frames in the time of a move; fewer are keyframes
_HUMAN = 1.0  # metres; the limits of skating are for bodies at least as tall


@dataclass(frozen=True)
class Figure:
    """One measure of a movement.

    Attributes:
        value: the measure; NaN where it has no meaning, as the smoothness of rest.
        low: 5th percentile over pieces of the corpus's own movement; NaN where that has no value.
        high: 95th percentile, likewise.
        unit: the unit of all three; "" for counts and shares.
        about: a description in words.

    >>> from motionmind import Engine
    >>> from motionmind.metrics import measure
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> measure(motion, engine)["speed"].unit
    'rad/s'
    """

    value: float
    low: float
    high: float
    unit: str
    about: str


class FigureReport(msgspec.Struct, frozen=True):
    """A `Figure` for JSON, which has no NaN: None (null) stands for it."""

    value: float | None
    low: float | None
    high: float | None
    unit: str
    about: str


class MeasureReport(msgspec.Struct, frozen=True):
    """All measures of a movement for JSON.

    Attributes:
        corpus: the name of the corpus.
        frames: the movement's number of frames.
        figures: the measures, by name.
    """

    corpus: str
    frames: int
    figures: dict[str, FigureReport]

    @classmethod
    def of(cls, corpus: str, frames: int, figures: Mapping[str, Figure]) -> MeasureReport:
        """Make the report of the figures that `measure` returns."""
        return cls(
            corpus,
            frames,
            {
                name: FigureReport(_or_none(one.value), _or_none(one.low), _or_none(one.high), one.unit, one.about)
                for name, one in figures.items()
            },
        )


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


_ABOUT: Mapping[str, tuple[str, str]] = {
    "speed": ("rad/s", "mean angular speed of the joints"),
    "jerk": ("rad/s^3", "mean angular jerk of the joints"),
    "sparc": ("", "smoothness of the speed: the closer to 0 the smoother"),
    "style": ("", "how far from how the corpus's joints move: squared Mahalanobis distance"),
    "skating": ("", "share of frames in which a foot that is low moves far"),
    "slide": ("cm", "how far a foot near the floor slides, a frame"),
    **UNITS_AND_MEANINGS,
    "moves": ("", "number of moves"),
    "arrival_spread": ("moves", "how far apart joints arrive for good"),
    "attested": ("", "share of the joints' transitions that were seen in the corpus"),
    "log_likelihood": ("nats", "of each attested transition of a joint"),
    "cliche_rate": ("", "share of joints' moves, where there is a choice, that are the likeliest"),
    "frequency": ("", "percentile of how often the corpus makes the joints' moves"),
    "longest_run": ("postures", "longest run of whole postures from one clip"),
    "mean_run": ("postures", "mean of such runs"),
} | {
    f"copied_{size}_{n}": ("", f"share of what a {size} does in {n} posture{'s' * (n != 1)} that the corpus has")
    for size in ("joint", "limb", "body")
    for n in range(1, LONGEST + 1)
}


def measure(motion: Motion, learned: LearnedCorpus, path: States | None = None) -> dict[str, Figure]:
    """Measure a movement beside a corpus.

    Kinematics are measured at 30 frames a second, with keyframes joined by splines as in tweens. States are taken at
    the corpus's own rate of postures; of keyframes as they are, and of the engine's movement at the times of its moves.
    The corpus's range is over its own clips, in pieces as long as the movement, or as the clip or a tenth of the corpus
    if that is shorter. A clip's own copies are counted from the other clips.

    Args:
        motion: on the corpus's skeleton, or on one that maps to it.
        learned: the corpus.
        path: states of the movement [T + 1, L], if the engine's report has them.

    Returns:
        The measures, by name.

    Raises:
        SkeletonError: the movement is on other joints.
        MotionMindError: the movement is too short to measure, or the path is of another corpus.

    >>> from motionmind import Engine
    >>> from motionmind.metrics import measure
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> figures = measure(motion, engine)
    >>> figures["attested"].value
    1.0
    """
    check_type("motion", motion, Motion)
    check_type("learned", learned, LearnedCorpus, wanted="an Engine")
    check_type("path", path, np.ndarray, wanted="an array of states", or_none=True)
    corpus = learned.corpus
    motion = _on(corpus.skeleton, motion)
    step = 1.0 / corpus.rate if corpus.rate else usual(learned.grammar.transitions)
    sampled = at_rate(motion)
    if path is None:
        path = _path(motion, learned, step)
    elif path.ndim != 2 or path.shape[1] != len(corpus.chains):
        raise MotionMindError(f"a path through {corpus.name} has {len(corpus.chains)} chains, not {path.shape[1:]}")
    if len(sampled) < _SHORTEST or len(path) < 2:
        raise MotionMindError(
            f"{motion.name or 'the movement'} is too short to be measured: it takes {_SHORTEST} frames at {RATE:g} a "
            f"second, and two postures, {step:.2f} s apart"
        )
    habits, phrases = learn_habits(learned.grammar), learn_phrases(corpus, np.asarray(learned.states))
    clips = [at_rate(corpus.recording(clip)) for clip in corpus.clips]
    seen = [features(clip.rotations) for clip in clips]
    fastest = learned.plausibility.fastest
    own = _motion_figures(sampled, _style(seen, None), fastest) | _path_figures(path, habits, phrases, None)
    frames = min(len(sampled), max(sum(map(len, clips)) // _PARTS, _SHORTEST))
    postures = min(len(path), max(len(corpus) // _PARTS, 2))
    rows = [*_usual_motion(clips, seen, frames, fastest), *_usual_paths(learned, postures, habits, phrases)]
    return _beside_range(own, rows)


def _beside_range(own: Mapping[str, float], rows: Sequence[Mapping[str, float]]) -> dict[str, Figure]:
    """Measures beside their range over the `rows` of pieces of a corpus."""
    figures = {}
    for name, value in own.items():
        usual_values = np.array([row[name] for row in rows if name in row])
        known = usual_values[np.isfinite(usual_values)]
        low, high = np.percentile(known, RANGE) if len(known) else (np.nan, np.nan)
        figures[name] = Figure(value, float(low), float(high), *_ABOUT[name])
    return figures


def _on(skeleton: Skeleton, motion: Motion) -> Motion:
    """The movement on the corpus's joints; SkeletonError names the difference if it has others."""
    if skeleton.difference(motion.skeleton) is not None:
        motion = own_skeleton(motion)
    difference = skeleton.difference(motion.skeleton)
    if difference is not None:
        raise SkeletonError(f"{motion.name or 'the movement'} is on another skeleton than the corpus: {difference}")
    return motion


def _path(motion: Motion, learned: LearnedCorpus, step: float) -> States:
    """The states of a movement [T + 1, L]: at each move of the engine's movement, at the keyframes of keyed movement,
    else every `step` seconds."""
    whole = [one for one in motion.insertions if one.times[0] <= motion.times[0] and one.times[-1] >= motion.times[-1]]
    postures = motion
    if whole:
        postures = motion.at(whole[0].times)
    elif motion.fps * step >= _KEYED:
        postures = motion.resample(1.0 / step)
    return learned.space.assign(learned.corpus.to_chains(postures.rotations))


def _motion_figures(motion: Motion, style: Styles | None, fastest: Floats) -> dict[str, float]:
    """Measures of movement at 30 frames a second, its distance from a style, its pace beside `fastest` [J + 2]."""
    body, rotations, root = motion.skeleton, motion.rotations, motion.root
    speed = angular_speed(rotations, RATE)
    out = {
        "speed": float(speed.mean()),
        "jerk": float(angular_jerk(rotations, RATE).mean()),
        "sparc": sparc(speed.mean(axis=1), RATE),
    }
    if style is not None and len(motion) >= WINDOW:
        out["style"] = float(style.distances(rotations)[0])
    lowest = find_floor(body, rotations, root, heels=True)
    out |= zip(MEASURES, summarise_shown(motion, fastest, lowest).tolist(), strict=True)
    if body.height >= _HUMAN and find_feet(body):
        floor = find_floor(body, rotations, root)
        out["skating"] = skating(body, rotations, root, floor)
        out["slide"] = foot_slide(body, rotations, root, floor)
    return out


def _path_figures(path: States, habits: Habits, phrases: Phrasebook, clip: int | None) -> dict[str, float]:
    """Measures of states; `clip` is the clip of the corpus that they come from, if any."""
    runs = phrases.runs(path, clip) or [0]
    return {
        "moves": float(len(path) - 1),
        "arrival_spread": arrival_spread(path),
        "attested": _mean(habits.attested(path)),
        "log_likelihood": _mean(habits.log_likelihoods(path)),
        "cliche_rate": _mean(habits.cliches(path)),
        "frequency": _mean(habits.percentiles(path)),
        "longest_run": float(max(runs)),
        "mean_run": _mean(np.array(runs)),
    } | {
        f"copied_{size}_{n}": phrases.copied(path, size, n, clip)
        for size in phrases.groups
        for n in range(1, LONGEST + 1)
    }


def _style(seen: Sequence[Floats], besides: int | None) -> Styles | None:
    """The style of clips, by the `features` of all but one; None if nothing is left to learn from."""
    rows = [one for number, one in enumerate(seen) if number != besides and len(one)]
    return learn_styles({"own": np.concatenate(rows)}) if rows else None


def _usual_motion(
    clips: Sequence[Motion], seen: Sequence[Floats], frames: int, fastest: Floats
) -> Iterator[dict[str, float]]:
    """Kinematic measures of pieces of a corpus's clips at 30 frames a second, the style beside the other clips."""
    pieces = _pieces([len(clip) for clip in clips], frames, _SHORTEST)
    styles = {number: _style(seen, number) for number, _ in pieces}
    for number, start in pieces:
        yield _motion_figures(clips[number].slice(start, start + frames), styles[number], fastest)


def _usual_paths(
    learned: LearnedCorpus, postures: int, habits: Habits, phrases: Phrasebook
) -> Iterator[dict[str, float]]:
    """Measures of the states of pieces of a corpus's clips."""
    states, clips = np.asarray(learned.states), learned.corpus.clips
    for number, start in _pieces([len(clip) for clip in clips], postures, 2):
        path = states[clips[number].start : clips[number].stop][start : start + postures]
        found = _path_figures(path, habits, phrases, number)
        del found["moves"]  # it is only the length that was chosen for the piece
        if len(clips) == 1:  # there is no other to copy from
            found = {name: value for name, value in found.items() if not name.endswith("run") and "copied" not in name}
        yield found


def _pieces(lengths: Sequence[int], size: int, least: int) -> list[tuple[int, int]]:
    """The clip and the beginning of each piece of a `size`; a shorter clip is one piece if it has `least` at least.

    Of many pieces some are chosen, evenly spread."""
    found = [
        (number, start)
        for number, length in enumerate(lengths)
        if length >= least
        for start in range(0, max(length - size, 0) + 1, size)
    ]
    return [found[k] for k in np.unique(np.linspace(0, len(found) - 1, min(len(found), _MOST)).astype(int))]


def _mean(values: NDArray[Any]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")
