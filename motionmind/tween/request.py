"""The request: everything that a tween depends on besides its two postures, validated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, Protocol, TypedDict, Unpack

from motionmind.arguments import check_options, check_type
from motionmind.errors import MotionMindError
from motionmind.footing.corrections import Correction
from motionmind.grammar.schemes import Scheme, Weights
from motionmind.tween.options import OPTIONS, SearchOptions, take_options

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
    pace: float
    pin: Mapping[str, str]
    hold: Sequence[str]
    avoid: Sequence[tuple[str, int | str]]
    via: Sequence[Posture | tuple[Posture, int]]
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
        pace: factor on the motion's natural speed, where `duration` is open: 1.2 takes 1/1.2 of the time for the same
            moves.
        pin: joints pinned to an end: "A" keeps A's state until the last move, "B" has B's from the first move on.
        hold: joints that keep their state from A to B, such as a standing leg; A and B must agree there.
        avoid: joints, each with a state to avoid between A and B, by number or name.
        via: postures to pass through in this order, each after any move, or after a given one as (posture, move); the
            first move is 1.
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
    pace: float = 1.0
    pin: Mapping[str, str] = field(default_factory=dict)
    hold: Sequence[str] = ()
    avoid: Sequence[tuple[str, int | str]] = ()
    via: Sequence[Posture | tuple[Posture, int]] = ()
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
        if self.duration is not None and self.pace != 1.0:
            raise MotionMindError("a duration says how fast to move; leave out pace")
        if self.unlike:
            self._check_unlike()
        narrowed = self.pin or self.hold or self.avoid or self.via or self.unlike or self.search.sample or self.passage
        if self.search.whole_body and narrowed:
            raise MotionMindError(
                "whole_body moves whole postures alone: no pin, hold, avoid, via, unlike, sample or passage"
            )

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
        return self.moves is not None or self.duration is not None

    @property
    def paced(self) -> bool:
        """Whether the corpus's pace helps to choose the number of moves; not in a search of whole postures."""
        return not self.search.whole_body and "pace" not in self.without

    @property
    def vias(self) -> list[tuple[Posture, int | None]]:
        """The postures to pass through, each with its move or None."""
        return [given if isinstance(given, tuple) else (given, None) for given in self.via]

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
            "without": list(self.without),
            "avoid": [list(pair) for pair in self.avoid],
            "via": [None if move is None else int(move) for _, move in self.vias],
            "unlike": len(self.unlike),
            "node_budget": self.search.nodes(chains),
        }
        return {name.rstrip("_"): values[name] for name in OPTIONS}
