"""The one door: what was learned, asked for the tween between two postures."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from motionmind import rotations as rot
from motionmind import survey
from motionmind.corpus.corpus import FACING
from motionmind.errors import MotionMindError, NoPathError, SkeletonError
from motionmind.grammar.coordination import fit_network
from motionmind.grammar.transitions import Weights
from motionmind.learned import Learned
from motionmind.mapping import joint_mapping
from motionmind.motion import FASTEST, Posture
from motionmind.realise.realise import realise
from motionmind.retarget import to_human23
from motionmind.search.costs import price
from motionmind.search.problem import Model
from motionmind.search.solve import Certificate, Rules, solve
from motionmind.skeleton import human23
from motionmind.tween import Posed, Tween, diagnose, explain

if TYPE_CHECKING:
    import networkx as nx
    from pgmpy.models import DiscreteBayesianNetwork

NODE_BUDGET = 200_000
MAX_MOVES = 60
MOST_MOVES = 10_000  # what is asked for beyond these is a slip of the keyboard, and more than memory holds
MOST_NODES = 1_000_000_000
SLOWEST = 0.01  # frames a second


@dataclass(frozen=True, eq=False)
class Engine(Learned):
    """What was learned from a corpus (see Learned), ready to answer."""

    _priced: dict[tuple[Weights, float, float | None], Model] = field(default_factory=dict, repr=False)

    # --- asking -----------------------------------------------------------------------------------------------------

    def tween(
        self,
        a: Posture,
        b: Posture,
        *,
        moves: int | None = None,
        max_moves: int = MAX_MOVES,
        strict: bool = False,
        node_budget: int = NODE_BUDGET,
        weights: Weights = "conditional",
        lambda_: float = 1.0,
        beta: float = 1.0,
        tau: float = 1.0,
        bridge_price: float = 1.0,
        fps: float = 30.0,
    ) -> Tween:
        """The best movement from posture `a` to posture `b` in the style of the corpus.

        Args:
            a: where it starts, exactly.
            b: where it ends, exactly.
            moves: how many moves; None lets the search find the best number.
            max_moves: the greatest number that it may find.
            strict: no bridges: every move of every joint is attested, or a wait at its goal.
            node_budget: nodes that the search may hold at once; it stops after as many expansions.
            weights: "conditional", -log P(next state | state), or "printed", as the papers print it.
            lambda_: factor of the network's -log P(joint's state | parent's state), summed over joints and postures.
            beta: nats for each move that a joint waits at its goal.
            tau: nats for each move.
            bridge_price: nats for each degree of an unattested move.
            fps: frames a second of the motion.

        Raises:
            NoPathError: nothing joins them under these rules; the message is the diagnosis.
            SkeletonError: a posture is on another skeleton than the corpus.
            MotionMindError: an option is out of its range.
        """
        _check_options(moves, max_moves, node_budget, fps, weights, lambda_, beta, tau, bridge_price)
        a, b = self._on_skeleton(a, "A"), self._on_skeleton(b, "B")
        began = perf_counter()
        ends = self.corpus.to_lanes(np.stack([a.rotations, b.rotations]))
        states = self.space.assign(ends)
        snap = self.space.distance(ends, states)
        start, goal = states.astype(np.int64)
        model = self._model(weights, lambda_, None if strict else bridge_price)
        rules = Rules(beta, tau, moves or 1, moves or max_moves, node_budget)
        posing = perf_counter() - began
        if moves is None and _same(a, b):
            stay = states[:1]
            certificate: Certificate | None = Certificate(
                stay, 0.0, 0.0, "optimal", 0, 0, {"problem": 0.0, "bound": 0.0, "search": 0.0}
            )
        else:
            certificate = solve(model, start, goal, rules)
        if certificate is None:
            raise NoPathError(diagnose(model, self.grammar, start, goal, rules, strict))
        attested, bridges, waits, sources = explain(
            certificate, self.grammar, self.corpus, self.grammar.transitions.weights(weights), beta, bridge_price
        )
        began = perf_counter()
        motion = realise(certificate.path, a, b, self.corpus, self.states, self.grammar, self.carriage, fps)
        spent = certificate.seconds
        (insertion,) = motion.insertions
        # A facing that is bridged shows at the root, which turns with it.
        named = ((a.skeleton.names[0] if bridge.joint == FACING else bridge.joint, bridge.move) for bridge in bridges)
        bridged = tuple(dict.fromkeys(named))
        return Tween(
            motion=replace(motion, insertions=(replace(insertion, bridged=bridged),)),
            joints=self.corpus.lanes,
            path=certificate.path,
            status=certificate.status,
            cost=certificate.cost,
            lower_bound=certificate.lower_bound,
            attested=attested,
            bridges=bridges,
            waits=waits,
            snap_degrees=snap,
            sources=sources,
            expansions=certificate.expansions,
            peak_nodes=certificate.peak_nodes,
            node_budget=node_budget,
            seconds={
                "load": self.load_seconds,
                "problem": posing + spent["problem"],
                "bound": spent["bound"],
                "search": spent["search"],
                "realise": perf_counter() - began,
            },
            posed=Posed(model, start, goal, rules),
        )

    def _model(self, weights: Weights, coordination: float, bridge_price: float | None) -> Model:
        """The costs of the grammar, kept from one question to the next as long as they are asked for alike."""
        asked = (weights, coordination, bridge_price)
        if asked not in self._priced:
            self._priced.clear()
            self._priced[asked] = price(self.grammar, *asked)
        return self._priced[asked]

    def _on_skeleton(self, posture: Posture, which: str) -> Posture:
        """The posture on the corpus's joints; SkeletonError names the difference."""
        skeleton = self.corpus.skeleton
        if human23().difference(skeleton) is None and joint_mapping(posture.skeleton) is not None:
            posture = to_human23(posture)
        difference = skeleton.difference(posture.skeleton)
        if difference is not None:
            raise SkeletonError(
                f"posture {which} is on another skeleton than corpus {self.corpus.name!r}: {difference}"
            )
        return posture

    # --- looking ----------------------------------------------------------------------------------------------------

    def joint_graph(self, joint: str) -> nx.DiGraph:
        """The joint graph of a joint (or "facing") as a networkx graph.

        Nodes are states, with `orientation` (x, y, z, w), `visits` and `label`; edges are attested transitions, with
        `count`, `weight` (-log P(next | state), nats) and `seconds`.
        """
        import networkx as nx

        graph, lane = self.grammar.transitions, self.space.index(joint)
        first, last = graph.starts[lane], graph.starts[lane + 1]
        weights = graph.weights("conditional")
        out = nx.DiGraph(joint=joint)
        for state, row in enumerate(range(first, last)):
            out.add_node(
                state,
                orientation=tuple(map(float, self.space.centres[row])),
                visits=float(graph.visits[row]),
                label=self.space.label(lane, state),
            )
        for row in range(first, last):
            for edge in range(graph.indptr[row], graph.indptr[row + 1]):
                out.add_edge(
                    row - int(first),
                    int(graph.targets[edge]),
                    count=float(graph.counts[edge]),
                    weight=float(weights[edge]),
                    seconds=float(graph.seconds[edge]),
                )
        return out

    def network(self) -> DiscreteBayesianNetwork:
        """The coordination net as a pgmpy network over the joints: what the search's costs were compiled from."""
        joints = len(self.corpus.skeleton)
        parents, sizes = self.corpus.lane_parents[:joints], self.space.sizes[:joints]
        states, weights = np.asarray(self.states[:, :joints]), self.corpus.weights
        return fit_network(self.corpus.skeleton.names, parents, states, sizes, weights)

    def info(self) -> dict[str, Any]:
        """What the corpus is and how large: see `survey.info`."""
        return survey.info(self.corpus, self.grammar)

    def check(self, pairs: int = 2000, seed: int = 0) -> dict[str, Any]:
        """How well the corpus hangs together: see `survey.check`."""
        return survey.check(self.corpus, self.grammar, self.states, pairs, seed)


def _same(a: Posture, b: Posture) -> bool:
    """Whether two postures are one, to within rounding."""
    return bool(np.all(rot.angle(a.rotations, b.rotations) < 1e-6) and np.all(np.abs(a.root - b.root) < 1e-6))


def _check_options(
    moves: int | None, max_moves: int, node_budget: int, fps: float, weights: str, *prices: float
) -> None:
    for name, value, most in (
        ("moves", moves, MOST_MOVES),
        ("max_moves", max_moves, MOST_MOVES),
        ("node_budget", node_budget, MOST_NODES),
    ):
        if value is not None and not (isinstance(value, int | np.integer) and 1 <= value <= most):
            raise MotionMindError(f"{name} must be a whole number from 1 to {most}, not {value}")
    if not SLOWEST <= fps <= FASTEST:
        raise MotionMindError(f"fps must be a number of frames a second from {SLOWEST:g} to {FASTEST:g}, not {fps}")
    if weights not in ("conditional", "printed"):
        raise MotionMindError(f"weights must be 'conditional' or 'printed', not {weights!r}")
    for name, price_ in zip(("lambda", "beta", "tau", "bridge_price"), prices, strict=True):
        if not (np.isfinite(price_) and price_ >= 0.0):
            raise MotionMindError(f"{name} must be a number of nats of at least 0, not {price_}")
