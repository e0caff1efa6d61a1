"""The answer: a motion, what it is made of, and how good it provably is."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from motionmind._typing import Floats, Int32s
from motionmind.body.motion import Motion
from motionmind.search.cfn import cfn
from motionmind.search.problem import Problem, Via
from motionmind.search.solve import Status
from motionmind.tween.certificate import Bridge, CostBreakdown, Source, Wait


@dataclass(frozen=True, eq=False)
class Tween:
    """A tween from posture A to posture B, with its certificate and provenance.

    Attributes:
        motion: the movement; its first and last frames are A and B, and its one insertion leads from one to the other.
        joints: the chains [L]: the skeleton's joints, then "facing" where that is a chain of its own.
        path: states of the chains [moves + 1, L].
        status: "optimal" where the cost is proven least to 1e-6 nats, else "bounded", or "interrupted" if the search
            was ended before its time, or "sampled" if the path was drawn at random.
        cost: of the path, nats.
        lower_bound: no path within the rules that were asked for costs less, nats.
        attested: share of the joints' moves that the corpus attests.
        bridges: the moves that it does not, but for waits.
        waits: moves spent waiting at the goal.
        shared: how many moves of joints it shares with the tweens that it was to differ from, counted for each of them.
        passed: the moves at which it passes the postures that it was to pass through.
        snap_degrees: angle between A's (row 0) and B's (row 1) orientations and their states [2, L].
        path_degrees: angle between the motion's orientations at each move and the states of the path [moves + 1, L].
        via_degrees: angle to their states for the postures that it was to pass through [K, L].
        sources: for each move and chain one place in the corpus that attests it, None where none does.
        detail: where the movement's fine detail was recorded, a place for each even part of its time; empty where the
            corpus has none to give.
        expansions: of A*.
        peak_nodes: the greatest number of nodes that A* held.
        node_budget: the number that it might hold.
        account: what each joint's moves cost, and how likely they are.
        seconds: spent on "load", "problem", "bound", "search" and "realise"; measured, so it differs from run to run.
        posed: the problem that was solved.
        asked: what was asked for, as plain values.
    """

    motion: Motion
    joints: tuple[str, ...]
    path: Int32s
    status: Status
    cost: float
    lower_bound: float
    attested: float
    bridges: tuple[Bridge, ...]
    waits: tuple[Wait, ...]
    shared: int
    passed: tuple[int, ...]
    snap_degrees: Floats
    path_degrees: Floats
    via_degrees: Floats
    sources: tuple[tuple[Source | None, ...], ...]
    detail: tuple[Source, ...]
    expansions: int
    peak_nodes: int
    node_budget: int
    account: CostBreakdown
    seconds: dict[str, float]
    posed: Problem
    asked: dict[str, Any]

    @property
    def moves(self) -> int:
        """Number of moves T; the path has T + 1 postures."""
        return len(self.path) - 1

    @property
    def gap(self) -> float:
        """(cost - lower bound) / cost: 0 is proven optimal."""
        return gap_of(self.cost, self.lower_bound)

    def report(self) -> dict[str, Any]:
        """All but the movement itself, as plain values for JSON.

        Lists of rows are by move or posture, then by joint. The `costs` add up to the cost: those of all joints' moves,
        of how they coordinate, and `per_move` for each move.
        """
        account, off = self.account, self.path_degrees[1:-1]
        return {
            "asked": self.asked,
            "status": self.status,
            "cost": self.cost,
            "lower_bound": self.lower_bound,
            "gap": self.gap,
            "moves": self.moves,
            "expansions": self.expansions,
            "peak_nodes": self.peak_nodes,
            "node_budget": self.node_budget,
            "seconds": self.seconds,
            "joints": list(self.joints),
            "path": self.path.tolist(),
            "attested": self.attested,
            "bridges": [
                {"joint": b.joint, "move": b.move, "degrees": b.degrees, "price": b.price} for b in self.bridges
            ],
            "waits": [{"joint": w.joint, "move": w.move, "price": w.price} for w in self.waits],
            "shared": self.shared,
            "vias": [
                {"move": move, "snap_degrees": dict(zip(self.joints, map(float, row), strict=True))}
                for move, row in zip(self.passed, self.via_degrees, strict=True)
            ],
            "snap_degrees": {
                end: dict(zip(self.joints, map(float, row), strict=True))
                for end, row in zip("AB", self.snap_degrees, strict=True)
            },
            "path_degrees": {"mean": float(off.mean()), "most": float(off.max())} if off.size else {},
            "sources": [[None if source is None else asdict(source) for source in row] for row in self.sources],
            "detail": [asdict(source) for source in self.detail],
            "times": self.motion.insertions[0].times.tolist(),
            "names": [list(row) for row in account.names],
            "degrees": account.degrees.tolist(),
            "likelihood": account.likelihood.tolist(),
            "costs": {
                "moves": account.moves.tolist(),
                "coordination": account.coordination.tolist(),
                "per_move": account.per_move,
            },
        }

    def problem(self) -> str:
        """The problem of this number of moves in toulbar2's cfn format; its optimum should be `cost`.

        Postures to pass through are passed there at the moves at which this tween passes them.
        """
        posed = self.posed
        vias = [Via(via.states, move) for via, move in zip(posed.vias, self.passed, strict=True)]
        return cfn(replace(posed, vias=vias), self.moves, self.joints)


def gap_of(cost: float, lower_bound: float) -> float:
    """How much of a cost in nats is not proven to be needed, as a share of it: 0 where the bound meets it."""
    return 0.0 if cost <= lower_bound else (cost - lower_bound) / abs(cost)
