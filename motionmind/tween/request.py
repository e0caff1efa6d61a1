"""The request: everything that a tween depends on besides its two postures, validated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Protocol, TypedDict, Unpack

from motionmind.arguments import check_options, check_type
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.footing.corrections import Correction
from motionmind.grammar.schemes import Scheme, Weights
from motionmind.synthesis.accent_times import AccentKind, Accents
from motionmind.tween.counts import SAME_TIME_S, counts_to_seconds, parse_time, seconds_to_count
from motionmind.tween.options import OPTIONS, ReachOption, SearchOptions, StayOption, check_time, is_timed, take_options

if TYPE_CHECKING:
    from motionmind._typing import States
    from motionmind.body.motion import Posture


class HasPath(Protocol):
    """Any object with the path of a tween."""

    @property
    def path(self) -> States:
        """States of the joint chains [moves + 1, L]."""


class SeamOptions(TypedDict, total=False):
    """Options of the tweens that smooth a variation: fields of `TweenRequest` and `SearchOptions`, with their types."""

    moves: int | tuple[int, int] | None
    duration: float | None
    tempo: float | None
    counts: float | None
    pace: float
    accent: Sequence[float | str]
    accent_kind: AccentKind
    pin: Mapping[str, str]
    hold: Sequence[str]
    avoid: Sequence[tuple[str, int | str]]
    via: Sequence[Posture | tuple[Posture, int | str]]
    differ: float
    novelty: float
    liveliness: float
    passage: str | None
    without: Sequence[Correction]
    fps: float
    search: SearchOptions
    max_moves: int
    within: float
    sample: bool
    strict: bool
    node_budget: int
    memory: int | None
    weights: Weights
    coordination: Scheme
    lambda_: float
    beta: float
    tau: float
    bridge_price: float
    guide: float


class SmoothOptions(SeamOptions, total=False):
    """Options of `Variation.smooth`; `vary` has a seed of its own."""

    seed: int


class TweenOptions(SmoothOptions, total=False):
    """All options of a tween."""

    reach: Sequence[ReachOption]
    to: Sequence[float] | None
    along: Sequence[Sequence[float]] | None
    stay: Sequence[StayOption]
    unlike: Sequence[HasPath]
    what_if: bool
    whole_body: bool


@dataclass(frozen=True, eq=False, kw_only=True)
class TweenRequest:
    """A request for a tween from posture A to posture B.

    Attributes:
        moves: number of moves, or the least and the greatest number; None lets the search find the best number.
        duration: exact length of the motion in seconds; if `moves` is None it also fixes the number of moves, each of
            the corpus's usual length.
        tempo: counts a minute, for `counts` and for the times of `via`.
        counts: exact length of the motion in counts, in place of `duration`.
        pace: factor on the motion's natural speed, where `duration` is open: 1.2 takes 1/1.2 of the time for the same
            moves.
        accent: counts, with a tempo and a length, on which the movement has its accents: peaks of speed or moments of
            rest; or times such as "1.5s", with a length. The path's movement is retimed for it, within the corpus's
            pace; the report says how far each is off.
        accent_kind: "fast" for the greatest speed, "still" for the least.
        pin: joints pinned to an end: "A" keeps A's state until the last move, "B" has B's from the first move on.
        hold: joints that keep their state from A to B, such as a standing leg; A and B must agree there.
        avoid: joints, each with a state to avoid between A and B, by number or name.
        via: postures to pass through in this order, each after any move, or after a given one as (posture, move), from
            1 on, or at a time as (posture, "1.5s") or (posture, "count 4"). Count 1 is A. A time needs a duration or
            counts, and the motion passes the posture on the frame nearest to it.
        reach: joints, each with a place [3], metres in the space where A and B stand, and a time, seconds from A:
            ("right_wrist", (0.3, 1.4, 0.5), 1.2). The motion is there to 1 cm, or reports the distance.
        to: where B stands: x and z on the floor, metres, as in a floor plan, and its facing, degrees to the left of the
            audience; (x, z) keeps B's own facing. None leaves B where it stands.
        along: points x, z of a path over the floor, metres, that the body follows from A to B; without `to`, B stands
            at the last. The motion keeps to it within 10 cm, or reports the distance. With a duration, points may be
            (x, z, seconds, facing): the body is there, and faces so, at that time; B then stands where it is.
        stay: joints, each with the shares of the duration between which it keeps its place in the room, and does not
            turn: ("left_wrist", 0.25, 0.5). One that stays until the end, but not from the start, keeps its place in
            B; one that stays from start to end leaves just in time for B.
        unlike: tweens to differ from; all have the same number of moves, as does this one.
        differ: least share of the joints' states between A and B that must differ from each tween in `unlike`, compared
            move by move, from 0 to 1.
        what_if: search again without each pin, held joint, state to avoid and via, and without the given length, and
            report the cost of each.
        novelty: from 0 (frequent moves are cheap) to 1 (all moves attested from a state cost the same).
        liveliness: from 0 (the motion is the mean of the corpus walks for this displacement) to 1 (one passage of the
            corpus, adapted to lead from A to B); between them, slow movement comes from the mean and quick movement
            from the passage.
        passage: a passage of the corpus to follow instead of the mean, by its clip and start time: "adagio@3.2s"; None
            for the mean.
        without: parts of the synthesis to leave out: see `motionmind.footing.corrections`.
        fps: frames per second of the motion.
        search: how to search for the path.

    Raises:
        WrongTypeError: a value has the wrong type.
        MotionMindError: a value is out of range, or two values contradict each other.

    >>> from motionmind import TweenRequest
    >>> TweenRequest(duration=2.0, hold=["left_ankle"]).duration
    2.0
    >>> TweenRequest(novelty=2.0)
    Traceback (most recent call last):
    motionmind.errors.MotionMindError: novelty must be a number from 0 to 1, not 2.0
    """

    moves: int | tuple[int, int] | None = None
    duration: float | None = None
    tempo: float | None = None
    counts: float | None = None
    pace: float = 1.0
    accent: Sequence[float | str] = ()
    accent_kind: AccentKind = "fast"
    pin: Mapping[str, str] = field(default_factory=dict)
    hold: Sequence[str] = ()
    avoid: Sequence[tuple[str, int | str]] = ()
    via: Sequence[Posture | tuple[Posture, int | str]] = ()
    reach: Sequence[ReachOption] = ()
    to: Sequence[float] | None = None
    along: Sequence[Sequence[float]] | None = None
    stay: Sequence[StayOption] = ()
    unlike: Sequence[HasPath] = ()
    differ: float = 0.2
    what_if: bool = False
    novelty: float = 0.0
    liveliness: float = 0.5
    passage: str | None = None
    without: Sequence[Correction] = ()
    fps: float = 30.0
    search: SearchOptions = SearchOptions()  # noqa: RUF009 - it is frozen

    def __post_init__(self) -> None:
        take_options(self)
        check_type("search", self.search, SearchOptions)
        self._check_time()
        self._check_accents()
        for joint, _, seconds in self.reach if self.length is not None else ():
            check_time(joint, seconds, float(self.length or 0.0))
        self._check_path()
        if self.unlike:
            self._check_unlike()
        narrowed = self.pin or self.hold or self.avoid or self.via or self.unlike or self.search.sample or self.passage
        if self.search.whole_body and narrowed:
            raise MotionMindError(
                "whole_body moves whole postures alone: no pin, hold, avoid, via, unlike, sample or passage"
            )

    def _check_time(self) -> None:
        if self.counts is not None and (self.tempo is None or self.duration is not None):
            raise MotionMindError("counts need a tempo, and take the place of a duration")
        if self.length is not None and self.pace != 1.0:
            raise MotionMindError("a duration says how fast to move; leave out pace")
        times = [seconds for _, _, seconds in self.vias if seconds is not None]
        if not times:
            return
        if self.length is None or self.moves is not None:
            raise MotionMindError("a via at a time needs a duration or counts, and no number of moves")
        for before, after in pairwise([0.0, *times, self.length]):
            if after < before + 1.0 / self.fps:
                raise MotionMindError(
                    f"via: the times {', '.join(f'{time:g}' for time in times)} s must increase by a frame or more, "
                    f"from 0 to the duration of {self.length:g} s"
                )

    @property
    def accents(self) -> Accents | None:
        """The accents, with their times; None for none."""
        if not self.accent:
            return None
        return Accents(tuple(map(self._seconds_of_accent, self.accent)), self.accent_kind)

    def _seconds_of_accent(self, accent: float | str) -> float:
        if isinstance(accent, str):
            return parse_time("accent", accent, self.tempo)
        assert self.tempo is not None
        return counts_to_seconds(accent - 1.0, self.tempo)

    def _check_accents(self) -> None:
        if not self.accent:
            return
        lacks_tempo = self.tempo is None and not all(isinstance(one, str) for one in self.accent)
        if lacks_tempo or self.length is None or self.moves is not None:
            raise MotionMindError("accents on counts need a tempo, a duration or counts, and no number of moves")
        times = [self._seconds_of_accent(one) for one in self.accent]
        for one, seconds in zip(self.accent, times, strict=True):
            if not 0.0 <= seconds <= self.length + SAME_TIME_S:
                if isinstance(one, str):
                    raise MotionMindError(f"accent: {displayed(one)} is not between A, 0 s, and B, {self.length:g} s")
                assert self.tempo is not None
                last = seconds_to_count(self.length, self.tempo)
                raise MotionMindError(f"accent: count {one:g} is not between A, count 1, and B, count {last:g}")
        if sorted(set(times)) != times:
            words = ", ".join(one if isinstance(one, str) else f"{one:g}" for one in self.accent)
            raise MotionMindError(f"accent: the counts {displayed(words)} must increase")

    def _check_path(self) -> None:
        if self.along is None or not is_timed(self.along):
            return
        if self.length is None:
            raise MotionMindError("along: points at times need a duration or counts")
        times = [point[2] for point in self.along]
        if not all(before < after for before, after in pairwise([0.0, *times, self.length])):
            shown = ", ".join(f"{time:g}" for time in times[:8]) + ", ..." * (len(times) > 8)
            raise MotionMindError(f"along: the times {shown} s must increase, from 0 to the {self.length:g} s")

    def _check_unlike(self) -> None:
        if self.what_if:
            raise MotionMindError("what_if prices the restrictions of the best tween; leave out unlike")
        if self.search.sample:
            raise MotionMindError("unlike: samples differ by their seeds; leave out sample")
        every, (least, most) = sorted({len(other.path) - 1 for other in self.unlike}), self.move_range
        if len(every) > 1:
            raise MotionMindError(f"unlike: the tweens must have one number of moves, not {every[0]} and {every[-1]}")
        if self.moves is not None and not least <= every[0] <= most:
            raise MotionMindError(f"unlike: the tweens have {every[0]} moves, which moves={self.moves} rules out")

    @classmethod
    def of(cls, request: TweenRequest | None = None, **options: Unpack[TweenOptions]) -> TweenRequest:
        """Return `request` (the default one if None) with some options changed, its own or those of its search.

        Args:
            request: the request.
            options: see `Engine.tween`.

        Raises:
            WrongTypeError: an option does not exist, or `request` is not a TweenRequest.
            MotionMindError: as for the constructor.

        >>> from motionmind import TweenRequest
        >>> TweenRequest.of(duration=2.0, tau=0.5).search.tau
        0.5
        """
        check_type("request", request, TweenRequest, or_none=True)
        check_options("a tween", options, TweenOptions)
        request = cls() if request is None else request
        own: dict[str, Any] = dict(options)
        inner = {one.name: own.pop(one.name) for one in fields(SearchOptions) if one.name in own}
        search = own.pop("search", request.search)
        return replace(request, **own, search=replace(search, **inner) if inner else search)

    @property
    def move_range(self) -> tuple[int, int]:
        """Least and greatest number of moves, before a duration narrows them."""
        if self.moves is None:
            return 1, self.search.max_moves
        return self.moves if isinstance(self.moves, tuple) else (self.moves, self.moves)

    @property
    def fixes_length(self) -> bool:
        """Whether the number of moves or the duration is given, so that the body moves even if A equals B."""
        return self.moves is not None or self.length is not None

    @property
    def length(self) -> float | None:
        """Length of the motion, seconds; None if it is open."""
        if self.counts is None or self.tempo is None:
            return self.duration
        return counts_to_seconds(self.counts, self.tempo)

    @property
    def paced(self) -> bool:
        """Whether the corpus's pace helps to choose the number of moves; not in a search of whole postures."""
        return not self.search.whole_body and "pace" not in self.without

    @property
    def vias(self) -> list[tuple[Posture, int | None, float | None]]:
        """The postures to pass through, each with its move and its time in seconds, or None."""
        out: list[tuple[Posture, int | None, float | None]] = []
        for number, given in enumerate(self.via, start=1):
            posture, place = given if isinstance(given, tuple) else (given, None)
            if isinstance(place, str):
                out.append((posture, None, parse_time(f"via {number}", place, self.tempo)))
            else:
                out.append((posture, place if place is None else int(place), None))
        return out

    @property
    def takes_passages(self) -> bool:
        """Whether alternatives may follow other passages: the request names none, and the search has a guide."""
        return self.kappa > 0.0 and self.passage is None and not self.search.sample

    @property
    def kappa(self) -> float:
        """Factor of the guide: shrinks as novelty grows, since corpus walks are habits; 0 for whole postures."""
        return 0.0 if self.search.whole_body else self.search.guide * (1.0 - self.novelty)

    def plain(self, chains: int) -> dict[str, Any]:
        """Return all options as plain values for JSON, as in a report's `asked`.

        Fill in the node budget for a body with this many joint chains. Give postures to pass through by their moves,
        and the tweens in `unlike` by their number.
        """
        values = vars(self.search) | vars(self)
        values |= {
            "moves": list(self.moves) if isinstance(self.moves, tuple) else self.moves,
            "pin": dict(self.pin),
            "hold": list(self.hold),
            "accent": [one if isinstance(one, str) else float(one) for one in self.accent],
            "without": list(self.without),
            "avoid": [list(pair) for pair in self.avoid],
            "via": [move if seconds is None else f"{seconds:g}s" for _, move, seconds in self.vias],
            "reach": [[joint, list(map(float, place)), float(seconds)] for joint, place, seconds in self.reach],
            "to": None if self.to is None else list(map(float, self.to)),
            "along": None if self.along is None else [list(map(float, point)) for point in self.along],
            "stay": [list(one) for one in self.stay],
            "unlike": len(self.unlike),
            "node_budget": self.search.nodes(chains),
        }
        return {name.rstrip("_"): values[name] for name in OPTIONS}
