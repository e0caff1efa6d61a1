"""All measures of a movement, each beside the range of the corpus's own movement."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, States
from motionmind.arguments import check_type
from motionmind.body.contact import CONTACT_FPS, find_feet, find_floor, foot_slide, skating
from motionmind.body.motion import Motion
from motionmind.body.plausibility import at_rate
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.grammar.grammar import Grammar
from motionmind.learned.model import LearnedCorpus
from motionmind.learned.plausibility import MEASURES, UNITS_AND_MEANINGS, summarise_shown
from motionmind.metrics.effort import EFFORT, effort_of
from motionmind.metrics.paths import Habits, arrival_spread, attested_share, learn_habits
from motionmind.metrics.smoothness import angular_jerk, angular_speed, sparc
from motionmind.metrics.style import WINDOW_FRAMES, Styles, features, learn_styles
from motionmind.metrics.verbatim import MAX_NGRAM, Phrasebook, learn_phrases
from motionmind.retarget.retarget import own_skeleton
from motionmind.synthesis.timeline import usual

# What a viewer notices first: how fast and smooth the movement is, how much it is like the corpus, feet that skate,
# bodies that lean, bounce, float or intersect, and moves that the corpus never shows. The other figures explain these.
MAIN_FIGURES = (
    *("speed", "pace", "jerk", "style", "skating", "balance", "bounce", "flight", "crossed_limbs", "attested"),
)
_MIN_FRAMES = 4  # a jerk needs as many


@dataclass(frozen=True)
class Figure:
    """One measure of a movement.

    Attributes:
        value: the measure; NaN where it is undefined, such as the smoothness of rest.
        low: 5th percentile over pieces of the corpus's own movement; NaN where undefined.
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
                name: FigureReport(
                    _finite_or_none(one.value), _finite_or_none(one.low), _finite_or_none(one.high), one.unit, one.about
                )
                for name, one in figures.items()
            },
        )


def _finite_or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


_ABOUT: Mapping[str, tuple[str, str]] = {
    "speed": ("rad/s", "mean angular speed of the joints"),
    "jerk": ("rad/s^3", "mean angular jerk of the joints"),
    "sparc": ("", "smoothness of the speed: the closer to 0 the smoother"),
    "style": ("", "how far from how the corpus's joints move: squared Mahalanobis distance"),
    "skating": ("", "share of frames in which a foot that is low moves far"),
    "slide": ("cm", "how far a foot near the floor slides, a frame"),
    **UNITS_AND_MEANINGS,
    **EFFORT,
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
    for n in range(1, MAX_NGRAM + 1)
}


def measure(motion: Motion, learned: LearnedCorpus, path: States | None = None) -> dict[str, Figure]:
    """Measure a movement beside a corpus.

    Kinematics are measured at 30 frames a second, with keyframes joined by splines as in tweens. States are sampled at
    the corpus's rate of postures, at keyframes, or at the moves of the engine's movement. The corpus's range is over
    pieces of its clips, as long as the movement, or as the clip or a tenth of the corpus if that is shorter. Copies
    in a clip count only if they come from other clips.

    Args:
        motion: on the corpus's skeleton, or on one that maps to it.
        learned: the corpus.
        path: states of the movement [T + 1, L], such as those in the engine's report.

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
    motion = _map_to(corpus.skeleton, motion)
    step = usual_step(learned)
    sampled = at_rate(motion)
    if path is None:
        path = assign_states(motion, learned)
    elif path.ndim != 2 or path.shape[1] != len(corpus.chains):
        raise MotionMindError(f"a path through {corpus.name} has {len(corpus.chains)} chains, not {path.shape[1:]}")
    if len(sampled) < _MIN_FRAMES or len(path) < 2:
        raise MotionMindError(
            f"{motion.name or 'the movement'} is too short to measure, which takes {_MIN_FRAMES} frames at "
            f"{CONTACT_FPS:g} a second, and two postures {step:.2f} s apart"
        )
    habits, phrases = learn_habits(learned.grammar), learn_phrases(corpus, np.asarray(learned.states))
    clips = [at_rate(corpus.recording(clip)) for clip in corpus.clips]
    seen = [features(clip.rotations) for clip in clips]
    fastest = learned.plausibility.fastest
    own = _measure_motion(sampled, _learn_style(seen, None), fastest)
    own |= _measure_path(path, learned.grammar, habits, phrases, None)
    frames = min(len(sampled), max(sum(map(len, clips)) // 10, _MIN_FRAMES))
    postures = min(len(path), max(len(corpus) // 10, 2))
    rows = [*_measure_clips(clips, seen, frames, fastest), *_measure_clip_paths(learned, postures, habits, phrases)]
    return _beside_range(own, rows)


def _beside_range(own: Mapping[str, float], rows: Sequence[Mapping[str, float]]) -> dict[str, Figure]:
    """Put measures beside their 5th and 95th percentile over the `rows` of pieces of a corpus."""
    figures = {}
    for name, value in own.items():
        usual_values = np.array([row[name] for row in rows if name in row])
        known = usual_values[np.isfinite(usual_values)]
        low, high = np.percentile(known, (5.0, 95.0)) if len(known) else (np.nan, np.nan)
        figures[name] = Figure(value, float(low), float(high), *_ABOUT[name])
    return figures


def _map_to(skeleton: Skeleton, motion: Motion) -> Motion:
    """Map a movement to the corpus's skeleton; SkeletonError names the difference if it has other joints."""
    if skeleton.difference(motion.skeleton) is not None:
        motion = own_skeleton(motion)
    difference = skeleton.difference(motion.skeleton)
    if difference is not None:
        raise SkeletonError(f"{motion.name or 'the movement'} is on another skeleton than the corpus: {difference}")
    return motion


def usual_step(learned: LearnedCorpus) -> float:
    """Return the usual time between two postures of a corpus, seconds."""
    rate = learned.corpus.rate
    return 1.0 / rate if rate else usual(learned.grammar.transitions)


def assign_states(motion: Motion, learned: LearnedCorpus) -> States:
    """Return the states of a movement [T + 1, L].

    They are those at the times of the engine's moves, at the keyframes of keyed movement, else at the corpus's rate.
    """
    step = usual_step(learned)
    whole = [one for one in motion.insertions if one.times[0] <= motion.times[0] and one.times[-1] >= motion.times[-1]]
    postures = motion
    if whole:
        postures = motion.at(whole[0].times)
    elif motion.fps * step >= 2.0:  # fewer frames in the time of a move are keyframes
        postures = motion.resample(1.0 / step)
    return learned.space.assign(learned.corpus.to_chains(postures.rotations))


def _measure_motion(motion: Motion, style: Styles | None, fastest: Floats) -> dict[str, float]:
    """Measure movement at 30 frames a second, its distance from a style, and its pace beside `fastest` [J + 2]."""
    body, rotations, root = motion.skeleton, motion.rotations, motion.root
    speed = angular_speed(rotations, CONTACT_FPS)
    out = {
        "speed": float(speed.mean()),
        "jerk": float(angular_jerk(rotations, CONTACT_FPS).mean()),
        "sparc": sparc(speed.mean(axis=1), CONTACT_FPS),
    }
    if style is not None and len(motion) >= WINDOW_FRAMES:
        out["style"] = float(style.distances(rotations)[0])
    lowest = find_floor(body, rotations, root, heels=True)
    out |= zip(MEASURES, summarise_shown(motion, fastest, lowest).tolist(), strict=True)
    return out | measure_feet(motion) | effort_of(motion)


def measure_feet(motion: Motion) -> dict[str, float]:
    """Return how feet skate and slide in movement at 30 frames a second; nothing for other bodies than people's."""
    body, rotations, root = motion.skeleton, motion.rotations, motion.root
    if body.height < 1.0 or not find_feet(body):  # metres: the limits of skating are for people
        return {}
    floor = find_floor(body, rotations, root)
    return {
        "skating": skating(body, rotations, root, floor),
        "slide": foot_slide(body, rotations, root, floor),
    }


def _measure_path(
    path: States, grammar: Grammar, habits: Habits, phrases: Phrasebook, clip: int | None
) -> dict[str, float]:
    """Measure a path of states; `clip` is the clip of the corpus that it comes from, if any."""
    runs = phrases.runs(path, clip) or [0]
    return {
        "moves": float(len(path) - 1),
        "arrival_spread": arrival_spread(path),
        "attested": attested_share(path, grammar),
        "log_likelihood": _mean(habits.log_likelihoods(path)),
        "cliche_rate": _mean(habits.cliches(path)),
        "frequency": _mean(habits.percentiles(path)),
        "longest_run": float(max(runs)),
        "mean_run": _mean(np.array(runs)),
    } | {
        f"copied_{size}_{n}": phrases.copied(path, size, n, clip)
        for size in phrases.groups
        for n in range(1, MAX_NGRAM + 1)
    }


def _learn_style(seen: Sequence[Floats], besides: int | None) -> Styles | None:
    """Learn the style of clips from the `features` of all but one; None if nothing is left to learn from."""
    rows = [one for number, one in enumerate(seen) if number != besides and len(one)]
    return learn_styles({"own": np.concatenate(rows)}) if rows else None


def _measure_clips(
    clips: Sequence[Motion], seen: Sequence[Floats], frames: int, fastest: Floats
) -> Iterator[dict[str, float]]:
    """Yield kinematic measures of pieces of clips at 30 frames a second; their style is that of the other clips."""
    pieces = _pieces([len(clip) for clip in clips], frames, _MIN_FRAMES)
    styles = {number: _learn_style(seen, number) for number, _ in pieces}
    for number, start in pieces:
        yield _measure_motion(clips[number].slice(start, start + frames), styles[number], fastest)


def _measure_clip_paths(
    learned: LearnedCorpus, postures: int, habits: Habits, phrases: Phrasebook
) -> Iterator[dict[str, float]]:
    """Yield the measures of the states of pieces of a corpus's clips."""
    states, clips = np.asarray(learned.states), learned.corpus.clips
    for number, start in _pieces([len(clip) for clip in clips], postures, 2):
        path = states[clips[number].start : clips[number].stop][start : start + postures]
        found = _measure_path(path, learned.grammar, habits, phrases, number)
        del found["moves"]  # the piece's length was chosen, not measured
        if len(clips) == 1:  # no other clip to copy from
            found = {name: value for name, value in found.items() if not name.endswith("run") and "copied" not in name}
        yield found


def _pieces(lengths: Sequence[int], size: int, least: int) -> list[tuple[int, int]]:
    """Cut clips into pieces of `size`; return the clip and the start of each, 100 at most, evenly spread.

    A shorter clip is one piece if its length is `least` or more.
    """
    found = [
        (number, start)
        for number, length in enumerate(lengths)
        if length >= least
        for start in range(0, max(length - size, 0) + 1, size)
    ]
    return [found[k] for k in np.unique(np.linspace(0, len(found) - 1, min(len(found), 100)).astype(int))]


def _mean(values: NDArray[Any]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")
