"""The answer: a motion, its path, and the proof of its quality."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from motionmind._cells import html_of
from motionmind._typing import Bools, Floats, States
from motionmind.body.motion import Motion
from motionmind.credits.credit import Credit
from motionmind.credits.ledger import ledger_of
from motionmind.learned.plausibility import Plausibility, Sighting
from motionmind.search.cfn import Ingredients, cfn
from motionmind.search.length import LengthChoice
from motionmind.search.problem import Problem, Via
from motionmind.search.solve import Status
from motionmind.solver.residual import Residual
from motionmind.tween.accents import Accented
from motionmind.tween.certificate import Bridge, CostBreakdown, Source, Wait, gap_of
from motionmind.tween.changes import name_parts
from motionmind.tween.pacing import Tempo, UsualTime
from motionmind.tween.reaches import Reached, Stayed
from motionmind.tween.report import PassedPosture, ReportedCosts, TweenReport, plain
from motionmind.tween.request import TweenRequest
from motionmind.tween.travel import Travelled
from motionmind.tween.what_if import WhatIf


@dataclass(frozen=True, eq=False)
class Tween:
    """A tween from posture A to posture B, with its certificate and provenance.

    Attributes:
        motion: the movement; its first and last frames are A and B, and its one insertion leads from one to the other.
        joints: names of the joint chains [L]: the skeleton's joints, then "facing" where that is a chain of its own.
        path: states of the chains [moves + 1, L].
        status: "optimal" if the cost is proven least to 1e-6 nats, else "bounded"; "interrupted" if the caller ended
            the search, "sampled" if the path was sampled.
        cost: cost of the path, nats.
        lower_bound: no path that fulfils the request costs less, nats.
        attested: share of the path's moves of joints that the corpus attests.
        motion_attested: share of the motion's own transitions that the corpus attests, between the joints' states at
            the times of the moves, as `motionmind.metrics.measure` counts them; None if nothing moves.
        bridges: the moves that the corpus does not attest, except waits.
        waits: moves spent waiting at the goal.
        differs: share of the joints' states between A and B that differ from each tween in `unlike` [K].
        what_if: cost of each restriction, if requested.
        passed: the moves at which the path passes the postures to pass through [K].
        snap_degrees: angle between A's (row 0) and B's (row 1) orientations and their states [2, L].
        path_degrees: angle between the motion's orientations at each move and the states of the path [moves + 1, L].
        followed: whether that angle is within the chain's tolerance [moves + 1, L].
        via_degrees: angle between the orientations of the postures to pass through and their states [K, L].
        sources: a place in the corpus that attests each chain's move; None if there is none, or the motion is not
            within the tolerance of both states [moves][L].
        detail: places in the corpus of the passage that the motion follows, one for each tenth of a second; empty if it
            follows none.
        left_out: approximate share of the corpus walks that begin or end in postures represented by others, for the
            body part where it is greatest; 0 for a small corpus, where every posture counts.
        gave: the largest residual of each term of the synthesis (balance, gravity, joint limits...).
        reached: how near the motion comes to each requested place.
        accented: how far each accent is from its count.
        travelled: how near it keeps to the requested path and place of B; None if none was requested.
        stayed: how far each joint that stays in its place drifts.
        expansions: nodes that A* expanded.
        peak_nodes: greatest number of nodes that A* held.
        costs: the cost, joint by joint and move by move.
        seconds: measured seconds for "load", "problem", "bound", "search" and "realise"; they vary from run to run.
        search_problem: the problem that was searched.
        ingredients: returns the ingredients of its costs.
        request: the request.
        length: how the number of moves was chosen; None if it was given, or there was no guide.
        times: the corpus's usual time from each exactly passed posture to the next.
        tempo: comparison of the tween's timing with the corpus's.
        before: seconds of movement given before A to show its velocity; None if A was given alone.
        after: seconds of movement given after B to show its velocity; None if B was given alone.
        plausibility: the greatest values of each plausibility measure in the corpus.

    >>> from motionmind import Engine
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> tween = engine.tween(motion.posture(0), motion.posture(3), moves=3)
    >>> round(tween.gap, 6), tween.path.shape == (4, len(tween.joints))
    (0.0, True)
    """

    motion: Motion
    joints: tuple[str, ...]
    path: States
    status: Status
    cost: float
    lower_bound: float
    attested: float
    motion_attested: float | None
    bridges: tuple[Bridge, ...]
    waits: tuple[Wait, ...]
    differs: tuple[float, ...]
    what_if: tuple[WhatIf, ...]
    passed: tuple[int, ...]
    snap_degrees: Floats
    path_degrees: Floats
    followed: Bools
    via_degrees: Floats
    sources: tuple[tuple[Source | None, ...], ...]
    detail: tuple[Source, ...]
    left_out: float
    gave: tuple[Residual, ...]
    reached: tuple[Reached, ...]
    accented: tuple[Accented, ...]
    travelled: Travelled | None
    stayed: tuple[Stayed, ...]
    expansions: int
    peak_nodes: int
    costs: CostBreakdown
    seconds: dict[str, float]
    search_problem: Problem
    ingredients: Callable[[], Ingredients]
    request: TweenRequest
    length: LengthChoice | None
    times: tuple[UsualTime, ...]
    tempo: Tempo
    before: float | None
    after: float | None
    plausibility: Plausibility

    def __repr__(self) -> str:
        return (
            f"<Tween: moves {self.moves}, {self.status} at {self.cost:.3f} nats, at least {self.lower_bound:.3f}\n"
            f" attested {self.attested:.1%}, bridges {len(self.bridges)}, waits {len(self.waits)}\n"
            f" {self.motion!r}>"
        )

    def _repr_html_(self) -> str:
        return html_of(self)

    @property
    def moves(self) -> int:
        """Number of moves T; the path has T + 1 postures."""
        return len(self.path) - 1

    @cached_property
    def shown(self) -> dict[str, Sighting]:
        """The motion's greatest value of each of `learned.plausibility.MEASURES`, beside the corpus's."""
        return self.plausibility.shown(self.motion)

    @property
    def gap(self) -> float:
        """(cost - lower bound) / cost; 0 means proven optimal."""
        return gap_of(self.cost, self.lower_bound)

    @property
    def credits(self) -> tuple[Credit, ...]:
        """Shares of its time by clip, the largest first; empty where nothing moves."""
        return self.motion.credits

    @property
    def node_budget(self) -> int:
        """Number of nodes that A* was allowed to hold."""
        return self.request.search.nodes(len(self.joints))

    @property
    def asked(self) -> dict[str, Any]:
        """The request as plain values for JSON (see `TweenRequest.plain`), with `before` and `after`."""
        return self.request.plain(len(self.joints)) | {"before": self.before, "after": self.after}

    def report(self) -> dict[str, Any]:
        """Return everything except the movement as plain values for JSON: the fields of `TweenReport`."""
        return plain(report_of(self))

    def problem(self) -> str:
        """Return the problem with this number of moves in toulbar2's cfn format; its optimum should be `cost`.

        Each ingredient of the cost has its own functions, named in docs/formats.md. Postures to pass through keep the
        moves at which this tween passes them. The format omits two conditions, so the optimum may be lower: that an
        alternative differs from other tweens, and that a `whole_body` one keeps to whole postures.
        """
        vias = [Via(via.states, move) for via, move in zip(self.search_problem.vias, self.passed, strict=True)]
        problem = replace(self.search_problem, vias=tuple(vias))
        return cfn(problem, self.moves, self.joints, self.ingredients())


def report_of(tween: Tween, motion_sha256: str | None = None) -> TweenReport:
    """Return the report of a tween; `motion_sha256` is the hash of the movement's file."""
    costs, inner = tween.costs, tween.path_degrees[1:-1]

    def by_joint(row: Sequence[float]) -> dict[str, float]:
        return dict(zip(tween.joints, map(float, row), strict=True))

    return TweenReport(
        asked=tween.asked,
        status=tween.status,
        cost=tween.cost,
        lower_bound=tween.lower_bound,
        gap=tween.gap,
        moves=tween.moves,
        length=tween.length,
        tempo=tween.tempo,
        expansions=tween.expansions,
        peak_nodes=tween.peak_nodes,
        node_budget=tween.node_budget,
        seconds=tween.seconds,
        joints=list(tween.joints),
        parts=list(name_parts(tween.motion.skeleton, tween.joints)),
        path=tween.path.tolist(),
        attested=tween.attested,
        motion_attested=tween.motion_attested,
        bridges=list(tween.bridges),
        waits=list(tween.waits),
        differs=list(tween.differs),
        what_if=list(tween.what_if),
        vias=[PassedPosture(move, by_joint(row)) for move, row in zip(tween.passed, tween.via_degrees, strict=True)],
        snap_degrees={end: by_joint(row) for end, row in zip("AB", tween.snap_degrees, strict=True)},
        path_degrees={"mean": float(inner.mean()), "most": float(inner.max())} if inner.size else {},
        followed=tween.followed.tolist(),
        sources=[list(row) for row in tween.sources],
        detail=list(tween.detail),
        gave=list(tween.gave),
        reached=list(tween.reached),
        accented=list(tween.accented),
        travelled=tween.travelled,
        stayed=list(tween.stayed),
        left_out=tween.left_out,
        shown=tween.shown,
        times=tween.motion.insertions[0].times.tolist(),
        names=[list(row) for row in costs.names],
        degrees=costs.degrees.tolist(),
        changes=[list(row) for row in costs.changes],
        likelihood=costs.likelihood.tolist(),
        costs=ReportedCosts(costs.moves.tolist(), costs.coordination.tolist(), costs.per_move, costs.guide.tolist()),
        credits=ledger_of(tween.credits),
        motion_sha256=motion_sha256,
    )
