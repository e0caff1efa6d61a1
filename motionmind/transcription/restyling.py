"""Restyle movement: keep key postures and their times, and find the movement between them in the style of a corpus.

Each two neighbouring postures are joined by a tween of their own, which begins at the velocity that the one before
ended with. So both stand exactly where they stood, and the work grows with the length of the dance. A single tween with
all postures as vias chooses its own places on the floor for those in between.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Unpack

import msgspec
import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.arguments import check_function, check_type
from motionmind.body.motion import Insertion, Motion
from motionmind.body.plausibility import at_rate
from motionmind.body.rates import FILM_FPS
from motionmind.credits.credit import Credit, add_up
from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError
from motionmind.geometry import rotations as rot
from motionmind.metrics.figures import assign_states, measure_feet
from motionmind.metrics.paths import attested_share
from motionmind.search.solve import Status, Watch
from motionmind.transcription.following import Following, check_fineness
from motionmind.transcription.recorded import prepare, to_even_human23
from motionmind.tween.engine import Engine
from motionmind.tween.request import TweenOptions, TweenRequest


class Link(msgspec.Struct, frozen=True):
    """The movement from one key posture to the next.

    Attributes:
        start: time of the first, seconds from the beginning.
        end: time of the second.
        moves: number of moves.
        status: whether its cost is proven least, as of a tween.
        cost: its cost, nats.
        lower_bound: no movement between them costs less, nats.
        attested: share of the moves of joints that the corpus attests.
        faster: body parts that move faster than anything in the corpus.
    """

    start: float
    end: float
    moves: int
    status: Status
    cost: float
    lower_bound: float
    attested: float
    faster: list[str]


@dataclass(frozen=True, eq=False)
class Restyled:
    """Movement between kept postures in the style of a corpus.

    Attributes:
        motion: the movement.
        keys: frames of the kept postures in `motion` [K].
        source: the movement that the postures are from, on the same frames.
        links: the movement between each two neighbouring postures [K - 1].
        figures: measures of the source and of the movement, by name (`motionmind.metrics.measure`): the share of
            attested transitions, and how feet slide.
    """

    motion: Motion
    keys: Ints
    source: Motion
    links: tuple[Link, ...]
    figures: dict[str, tuple[float, float]]

    @property
    def degrees(self) -> Floats:
        """The mean angle of the joints between the source and the movement, in each frame [T]."""
        return np.asarray(np.degrees(rot.angle(self.source.rotations, self.motion.rotations)).mean(axis=1))

    @property
    def centimetres(self) -> Floats:
        """The distance on the floor between the pelvis in the source and in the movement, in each frame [T]."""
        return np.asarray(100.0 * rot.norm((self.source.root - self.motion.root)[:, [0, 2]]))

    @property
    def cost(self) -> float:
        """The total cost, nats."""
        return sum(link.cost for link in self.links)

    def report(self) -> bytes:
        """Return the links, the measures and the distances from the source in each frame as JSON."""
        figures = {
            name: [value if np.isfinite(value) else None for value in pair] for name, pair in self.figures.items()
        }
        return msgspec.json.encode(
            {
                "keys": self.keys.tolist(),
                "frames_per_second": round(self.motion.fps, 6),
                "links": self.links,
                "figures": figures,
                "degrees": np.round(self.degrees, 2).tolist(),
                "centimetres": np.round(self.centimetres, 2).tolist(),
            }
        )


def restyle(
    motion: Motion,
    engine: Engine,
    tolerance: float = 12.0,
    *,
    shortest: float = 0.5,
    watch: Watch | None = None,
    on_progress: Callable[[int, int], object] | None = None,
    **options: Unpack[TweenOptions],
) -> Restyled:
    """Dance a recording in the style of a corpus: keep its key postures, and search the movement between them.

    The key postures are those of `transcribe`, as they were recorded, at their times and places.

    Args:
        motion: the recording of a person.
        engine: the corpus.
        tolerance: degrees, as for `transcribe`; a greater one keeps fewer postures.
        shortest: least seconds from posture to posture; the corpus has little to say in less time than its moves take.
        watch: as for `Engine.tween`.
        on_progress: called before each search with the numbers of finished searches and of all.
        options: other options of the tweens, as for `Engine.tween`.

    Raises:
        NoPathError: no path joins two of the postures.
        SkeletonError: the movement is not of a person, or the corpus has another skeleton.
        MotionMindError: the tolerance or the time is out of range, or the recording is too long or a single frame.

    >>> import numpy as np
    >>> from motionmind import Engine
    >>> from motionmind.transcription import restyle
    >>> engine = Engine.load("ballet")
    >>> clip = engine.corpus.motion(engine.corpus.clips[0]).resample(30.0).slice(0, 31)
    >>> found = restyle(clip, engine, 30.0)
    >>> bool(np.all(found.degrees[found.keys] < 0.001)), len(found.motion)
    (True, 31)
    """
    check_type("motion", motion, Motion)
    check_fineness(tolerance, shortest)
    recorded = prepare(motion, tolerance)
    person = to_even_human23(motion)
    keys = Following(recorded, tolerance, shortest).fewest_keys(0, len(recorded.root))
    postures = replace(
        person, rotations=person.rotations[keys], root=person.root[keys], times=person.times[keys], keyframed=True
    )
    request = TweenRequest.of(**options)
    if len(person) > 1 and person.fps >= FILM_FPS:  # else keyframes
        request = replace(request, fps=person.fps)
    return pass_through(postures, engine, request, source=person, watch=watch, on_progress=on_progress)


def pass_through(
    postures: Motion,
    engine: Engine,
    request: TweenRequest | None = None,
    *,
    source: Motion | None = None,
    watch: Watch | None = None,
    on_progress: Callable[[int, int], object] | None = None,
) -> Restyled:
    """Find the movement through postures at their times in the style of a corpus, such as those of a composed score.

    Times are rounded to frames.

    Args:
        postures: the postures, where and when they are passed.
        engine: the corpus.
        request: other options of the tweens, and their frames per second; None for the defaults.
        source: the movement to compare with; None for the postures joined evenly.
        watch: as for `Engine.tween`.
        on_progress: as for `restyle`.

    Raises:
        NoPathError: no path joins two of the postures.
        SkeletonError: the postures are on another skeleton than the corpus.
        MotionMindError: there is a single posture, or two are less than a frame apart.

    >>> from motionmind import Engine
    >>> from motionmind.transcription import pass_through
    >>> engine = Engine.load("ballet")
    >>> clip = engine.corpus.motion(engine.corpus.clips[0]).slice(0, 3)
    >>> len(pass_through(clip, engine).links)
    2
    """
    check_type("postures", postures, Motion)
    check_type("engine", engine, Engine)
    check_type("source", source, Motion, or_none=True)
    check_function("on_progress", on_progress, or_none=True)
    request = TweenRequest.of(request)
    name = postures.name or "the movement"
    if len(postures) < 2:
        raise MotionMindError(f"{name}: is a single posture; to move there must be two")
    seconds = postures.times - postures.times[0]
    keys = np.round(seconds * request.fps).astype(np.int64)
    if np.any(np.diff(keys) < 1):
        at = int(np.diff(keys).argmin())
        raise MotionMindError(
            f"{name}: the postures at {seconds[at]:.3f} s and {seconds[at + 1]:.3f} s are less than a frame apart"
        )
    parts, links = list[Motion](), list[Link]()
    for number, (start, end) in enumerate(zip(keys[:-1] / request.fps, keys[1:] / request.fps, strict=True)):
        if on_progress:
            on_progress(number, len(keys) - 1)
        part, link = _join(postures, number, (float(start), float(end)), engine, request, parts, watch)
        parts.append(part)
        links.append(link)
    motion = _chained(parts, request.fps, postures)
    source = (source or postures).at(postures.times[0] + motion.times)
    source = replace(source, times=motion.times)
    return Restyled(motion, keys, source, tuple(links), _figures(source, motion, engine))


def _join(
    postures: Motion,
    number: int,
    times: tuple[float, float],
    engine: Engine,
    request: TweenRequest,
    parts: list[Motion],
    watch: Watch | None,
) -> tuple[Motion, Link]:
    """Return the movement from a posture to the next one, after the `parts` that lead there."""
    start, end = times
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MotionMindWarning)  # of speed, which the link reports
            tween = engine.tween(
                postures.posture(number),
                postures.posture(number + 1),
                request,
                before=parts[-1] if parts else None,
                duration=round((end - start) * request.fps) / request.fps,  # at least a frame, exactly
                watch=watch,
            )
    except NoPathError as error:
        raise NoPathError(f"from {start:.2f} to {end:.2f} s: {error}", error.diagnosis) from error
    faster = [one.part for one in tween.tempo.faster]
    return tween.motion, Link(
        round(start, 6), round(end, 6), tween.moves, tween.status, tween.cost, tween.lower_bound, tween.attested, faster
    )


def _chained(parts: list[Motion], fps: float, postures: Motion) -> Motion:
    """Return movements one after another; each begins in the last frame of the one before.

    Of each movement one frame is credited to the source of the postures: the one that is kept.
    """
    begins = np.cumsum([0.0, *(part.times[-1] - part.times[0] for part in parts)])
    rotations = np.concatenate([parts[0].rotations, *(part.rotations[1:] for part in parts[1:])])
    kept = [replace(credit, share=credit.share / fps) for credit in postures.own_credits]
    return replace(
        parts[0],
        rotations=rotations,
        root=np.concatenate([parts[0].root, *(part.root[1:] for part in parts[1:])]),
        times=np.arange(len(rotations)) / fps,
        insertions=tuple(
            replace(
                one,
                times=one.times - part.times[0] + begin,
                credits=add_up([*kept, *_seconds_by_credit(one, float(part.times[-1] - part.times[0]) - 1.0 / fps)]),
            )
            for begin, part in zip(begins, parts, strict=False)
            for one in part.insertions
        ),
        name=postures.name,
    )


def _seconds_by_credit(insertion: Insertion, seconds: float) -> list[Credit]:
    """Return an insertion's credits with shares in seconds."""
    return [replace(credit, share=credit.share * max(seconds, 0.0)) for credit in insertion.credits or (Credit(1.0),)]


def _figures(source: Motion, motion: Motion, engine: Engine) -> dict[str, tuple[float, float]]:
    """Return the measures of the source and of the movement, sampled alike."""
    before, after = (measured(one, engine) for one in (source, motion))
    return {name: (value, after[name]) for name, value in before.items()}


def measured(motion: Motion, engine: Engine) -> dict[str, float]:
    """Return measures of movement as `motionmind.metrics.measure` takes them, without the corpus's range."""
    attested = attested_share(assign_states(motion, engine), engine.grammar)
    return {"attested": attested} | measure_feet(at_rate(motion))
