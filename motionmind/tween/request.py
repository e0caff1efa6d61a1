"""The request: everything that a tween depends on besides its two postures, validated.

The command line's options, the report's `asked` and the options that `vary` accepts are derived from its fields.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from numbers import Integral, Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Protocol, get_args

from motionmind.arguments import (
    check_flag,
    check_integer,
    check_items,
    check_mapping,
    check_real,
    check_text,
    check_type,
    described,
)
from motionmind.body.rates import FASTEST
from motionmind.errors import MotionMindError, WrongTypeError, did_you_mean
from motionmind.footing.corrections import Correction
from motionmind.grammar.schemes import Scheme, Weights

if TYPE_CHECKING:
    from motionmind._typing import States
    from motionmind.body.motion import Posture

MOST_MOVES = 10_000  # more is a typing error, and exceeds memory
MOST_NODES = 1_000_000_000
MOST_MEMORY = 1 << 50  # bytes
MOST_NATS = 1e6  # greatest factor or price: larger sums lose the other costs to rounding, and then overflow
SLOWEST = 0.01  # frames per second
PACES = 0.05, 20.0  # least and greatest multiple of the corpus's pace


class HasPath(Protocol):
    """Any object with the path of a tween."""

    @property
    def path(self) -> States:
        """States of the joint chains [moves + 1, L]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class TweenRequest:
    """A request for a tween from posture A to posture B.

    Attributes:
        moves: number of moves, or the least and the greatest number; None lets the search find the best number.
        max_moves: greatest number of moves that the search may find.
        duration: exact length of the motion in seconds; if `moves` is None it also fixes the number of moves, each of
            the corpus's usual length.
        pace: factor on the motion's natural speed, where `duration` is open: 1.2 takes 1/1.2 of the time for the same
            moves.
        pin: joints pinned to an end: "A" keeps A's state until the last move, "B" has B's from the first move on.
        hold: joints that keep their state from A to B, such as a standing leg; A and B must agree there.
        avoid: joints, each with a state to avoid between A and B, by number or name.
        via: postures to pass through in this order, each at any move, or at a given move as (posture, move).
        unlike: tweens to differ from; all have the same number of moves, as does this one.
        differ: least share of the joints' states between A and B that must differ from each tween in `unlike`, compared
            move by move, from 0 to 1.
        within: share by which the cost of a tween that differs from others may exceed the proven lower bound; 0 finds
            the best.
        what_if: search again without each pin, held joint, state to avoid and via, and without the given length, and
            report the cost of each.
        sample: sample a path with probability proportional to exp(-cost) instead of finding the best one; it has as
            many moves as the best. See `motionmind.search.sample` for the accuracy of the distribution.
        seed: seed of the sample, at least 0.
        strict: forbid bridges: every move of every joint is attested, or a wait at its goal.
        posturewise: search whole postures of the corpus in their recorded order, from the one nearest to A to the one
            nearest to B: the search of 1998, as a baseline.
        node_budget: nodes that the search may hold at once; it also stops after this many expansions.
        memory: bytes for these nodes, instead of `node_budget`.
        weights: cost of a transition: "conditional", -log P(next state | state), or "printed", as in the papers.
        novelty: from 0 (frequent moves are cheap) to 1 (all moves attested from a state cost the same).
        coordination: model of a joint's coordination: "posture", P(joint's state | parent's state); "progression",
            P(joint's next state | its state, parent's state and next state), as in [C98]; or "none".
        lambda_: factor of the coordination's -log P.
        beta: nats for each move that a joint waits at its goal.
        tau: nats for each move.
        bridge_price: nats for each degree of an unattested move.
        guide: kappa, nats for a joint that is one tolerance away from the corpus walks for 0.2 s; 0 turns the guide
            off. It shrinks as novelty grows; a search of whole postures has no guide.
        liveliness: from 0 (the motion is the mean of the corpus walks for this displacement) to 1 (one passage of the
            corpus, adapted to lead from A to B); between them, slow movement comes from the mean and quick movement
            from the passage.
        passage: a passage of the corpus to follow instead of the mean, by its clip and start time: "adagio@3.2s"; None
            for the mean.
        without: parts of the synthesis to leave out: see `motionmind.footing.corrections`.
        fps: frames per second of the motion.

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
    max_moves: int = 60
    duration: float | None = None
    pace: float = 1.0
    pin: Mapping[str, str] = field(default_factory=dict)
    hold: Sequence[str] = ()
    avoid: Sequence[tuple[str, int | str]] = ()
    via: Sequence[Posture | tuple[Posture, int]] = ()
    unlike: Sequence[HasPath] = ()
    differ: float = 0.2
    within: float = 0.0
    what_if: bool = False
    sample: bool = False
    seed: int = 0
    strict: bool = False
    posturewise: bool = False
    node_budget: int = 200_000
    memory: int | None = None
    weights: Weights = "conditional"
    novelty: float = 0.0
    coordination: Scheme = "posture"
    lambda_: float = 1.0
    beta: float = 1.0
    tau: float = 1.0
    bridge_price: float = 1.0
    guide: float = 1.0
    liveliness: float = 0.5
    passage: str | None = None
    without: Sequence[Correction] = ()
    fps: float = 30.0

    def __post_init__(self) -> None:
        self._check_types()
        # Copy, so that the request stays the same when the caller's lists change.
        object.__setattr__(self, "pin", MappingProxyType(dict(self.pin)))
        for name in ("hold", "avoid", "via", "unlike", "without"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        self._check_combinations()
        _check_count("max_moves", self.max_moves, MOST_MOVES)
        least, most = self.move_range
        _check_count("moves", least, MOST_MOVES)
        _check_count("moves", most, MOST_MOVES)
        if least > most:
            raise MotionMindError(f"moves must be a range from the least to the greatest, not from {least} to {most}")
        _check_count("node_budget", self.node_budget, MOST_NODES)
        if self.memory is not None:
            _check_count("memory", self.memory, MOST_MEMORY)
        _check_choice("coordination", self.coordination, get_args(Scheme))
        _check_choice("weights", self.weights, get_args(Weights))
        for correction in self.without:
            _check_choice("without", correction, get_args(Correction))
        if not _is_whole(self.seed, 0, math.inf):
            raise MotionMindError(f"seed must be a whole number of at least 0, not {self.seed}")
        if not SLOWEST <= self.fps <= FASTEST:
            raise MotionMindError(
                f"fps must be a number of frames a second from {SLOWEST:g} to {FASTEST:g}, not {self.fps}"
            )
        if not PACES[0] <= self.pace <= PACES[1]:
            slowest, fastest = PACES
            raise MotionMindError(f"pace must be a factor of the speed from {slowest} to {fastest:g}, not {self.pace}")
        if self.duration is not None and self.pace != 1.0:
            raise MotionMindError("a duration says how fast to move; leave out pace")
        for name in ("novelty", "differ", "within", "liveliness"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise MotionMindError(f"{name} must be a number from 0 to 1, not {getattr(self, name)}")
        for name in ("lambda_", "beta", "tau", "bridge_price", "guide"):
            nats = getattr(self, name)
            if not 0.0 <= nats <= MOST_NATS:
                option = name.rstrip("_")
                raise MotionMindError(f"{option} must be a number of nats from 0 to {MOST_NATS:g}, not {nats}")
        for number, (_, move) in enumerate(self.vias, start=1):
            if move is not None and not _is_whole(move, 1, MOST_MOVES - 1):
                raise MotionMindError(f"via {number}: the move must be a whole number from 1, not {move}")

    def _check_types(self) -> None:
        check_type("moves", self.moves, Real, tuple, wanted="a whole number, or a pair of them", or_none=True)
        if isinstance(self.moves, tuple) and len(self.moves) != 2:
            raise WrongTypeError(f"moves must be a whole number, or a pair of them, not {len(self.moves)} of them")
        check_integer("memory", self.memory, or_none=True)
        check_integer("seed", self.seed)
        check_real("duration", self.duration, or_none=True)
        for name in (
            "pace",
            "differ",
            "within",
            "novelty",
            "lambda_",
            "beta",
            "tau",
            "bridge_price",
            "guide",
            "fps",
        ):
            check_real(name.rstrip("_"), getattr(self, name))
        check_real("liveliness", self.liveliness)
        check_text("passage", self.passage, or_none=True)
        for name in ("what_if", "sample", "strict", "posturewise"):
            check_flag(name, getattr(self, name))
        for name in ("weights", "coordination"):
            check_text(name, getattr(self, name))
        check_mapping("pin", self.pin)
        check_items("hold", self.hold, "joints' names", str)
        check_items("without", self.without, "corrections' names", str)
        check_items("avoid", self.avoid, "pairs of a joint's name and a state", tuple, list)
        check_items("via", self.via, "postures, or pairs of a posture and a move")
        check_items("unlike", self.unlike, "tweens")

    def _check_combinations(self) -> None:
        if self.unlike:
            self._check_unlike()
        if not self.posturewise:
            return
        if self.pin or self.hold or self.avoid or self.via or self.unlike or self.sample or self.passage:
            raise MotionMindError(
                "posturewise knows whole postures alone: no pin, hold, avoid, via, unlike, sample or passage"
            )
        if self.coordination == "progression":
            raise MotionMindError("posturewise: coordination can be posture or none, not progression")

    def _check_unlike(self) -> None:
        if self.what_if:
            raise MotionMindError("what_if: what restrictions cost is asked of the best tween; leave out unlike")
        if self.sample:
            raise MotionMindError("unlike: samples differ by their seeds; leave out sample")
        every, (least, most) = sorted({len(other.path) - 1 for other in self.unlike}), self.move_range
        if len(every) > 1:
            raise MotionMindError(f"unlike: the tweens must have one number of moves, not {every[0]} and {every[-1]}")
        if self.moves is not None and not least <= every[0] <= most:
            raise MotionMindError(f"unlike: the tweens have {every[0]} moves, which moves={self.moves} rules out")

    @classmethod
    def of(cls, request: TweenRequest | None = None, **options: Any) -> TweenRequest:
        """Return `request` (the default one if None) with some options changed.

        Raises:
            WrongTypeError: an option does not exist, or `request` is not a TweenRequest.
            MotionMindError: as for the constructor.
        """
        check_type("request", request, TweenRequest, or_none=True)
        known = [one.name for one in fields(cls)]
        for name in options:
            if name not in known:
                raise WrongTypeError(f"a tween has no option {name!r}{did_you_mean(name, known)}")
        return replace(request, **options) if request is not None else cls(**options)

    @property
    def move_range(self) -> tuple[int, int]:
        """Least and greatest number of moves, before a duration narrows them."""
        if self.moves is None:
            return 1, self.max_moves
        return self.moves if isinstance(self.moves, tuple) else (self.moves, self.moves)

    @property
    def fixes_length(self) -> bool:
        """Whether the number of moves or the duration is given, so that the body moves even if A equals B."""
        return self.moves is not None or self.duration is not None

    @property
    def paced(self) -> bool:
        """Whether the corpus's pace helps to choose the number of moves; not in a search of whole postures."""
        return not self.posturewise and "pace" not in self.without

    @property
    def vias(self) -> list[tuple[Posture, int | None]]:
        """The postures to pass through, each with its move or None."""
        return [given if isinstance(given, tuple) else (given, None) for given in self.via]

    @property
    def takes_passages(self) -> bool:
        """Whether alternatives may follow other passages: the request names none, and the search has a guide."""
        return self.kappa > 0.0 and self.passage is None and not self.sample

    @property
    def kappa(self) -> float:
        """Factor of the guide: shrinks as novelty grows, since corpus walks are habits; 0 for whole postures."""
        return 0.0 if self.posturewise else self.guide * (1.0 - self.novelty)

    @property
    def coordination_factor(self) -> float:
        """Factor of the coordination's -log P: lambda, or 0 if joints move independently."""
        return 0.0 if self.coordination == "none" else self.lambda_

    def nodes(self, chains: int) -> int:
        """Return the number of nodes that the search may hold, for a body with this many joint chains."""
        check_integer("chains", chains)
        if self.memory is None:
            return self.node_budget
        from motionmind.search.astar import nodes_in  # numba is slow to import

        nodes = nodes_in(int(self.memory), chains)
        if nodes < 1:
            raise MotionMindError(f"memory of {self.memory} bytes holds not one node; give some megabytes")
        return min(nodes, MOST_NODES)

    def plain(self, chains: int) -> dict[str, Any]:
        """Return the request as plain values for JSON, as in a report's `asked`.

        Fill in the node budget for a body with this many joint chains. Give postures to pass through by their moves,
        and the tweens in `unlike` by their number.
        """
        values = {one.name.rstrip("_"): getattr(self, one.name) for one in fields(self)}
        return values | {
            "moves": list(self.moves) if isinstance(self.moves, tuple) else self.moves,
            "pin": dict(self.pin),
            "hold": list(self.hold),
            "without": list(self.without),
            "avoid": [list(pair) for pair in self.avoid],
            "via": [None if move is None else int(move) for _, move in self.vias],
            "unlike": len(self.unlike),
            "node_budget": self.nodes(chains),
        }


def _check_count(name: str, value: object, most: int) -> None:
    if not _is_whole(value, 1, most):
        error = MotionMindError if isinstance(value, Integral) else WrongTypeError
        raise error(f"{name} must be a whole number from 1 to {most}, not {described(value)}")


def _check_choice(name: str, value: str, choices: Sequence[str]) -> None:
    if value not in choices:
        listed = f"{', '.join(map(repr, choices[:-1]))} or {choices[-1]!r}"
        raise MotionMindError(f"{name} must be {listed}, not {value!r}")


def _is_whole(value: object, least: int, most: float) -> bool:
    """Return whether a value is an integer in a range; NumPy's integers count."""
    return isinstance(value, Integral) and least <= int(value) <= most
