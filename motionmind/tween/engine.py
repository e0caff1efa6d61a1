"""The one door: what was learned, asked for the tween between two postures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import perf_counter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from motionmind._typing import Floats, States
from motionmind.body.human import human23
from motionmind.body.motion import FASTEST, Motion, Posture
from motionmind.corpus.corpus import FACING
from motionmind.errors import MotionMindError, NoPathError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.grammar.coordination import Coordination, fit_network
from motionmind.grammar.progression import fit_progression
from motionmind.grammar.transitions import Weights
from motionmind.learned import summary as survey
from motionmind.learned.model import LearnedCorpus
from motionmind.realise.realise import realise
from motionmind.realise.timeline import usual
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23
from motionmind.search.astar import nodes_in
from motionmind.search.problem import Model, Problem, Rules, Via, places, with_waits
from motionmind.search.sample import sample_path
from motionmind.search.solve import MOST_STATES_OF_CHAIN, Certificate, Watch, solve
from motionmind.tween.certificate import break_down_cost, source_of, trace_path
from motionmind.tween.constraints import Constraint, constraints_of, find_conflicts, restrict
from motionmind.tween.nearest_body import diagnose_posturewise, nearest_posture
from motionmind.tween.problem import build_model, penalise, shared_moves
from motionmind.tween.progression import lift_to_moves
from motionmind.tween.result import Tween
from motionmind.tween.whole_body import Bodies, find_bodies, solve_posturewise

if TYPE_CHECKING:
    import networkx as nx
    from pgmpy.models import DiscreteBayesianNetwork

NODE_BUDGET = 200_000
MAX_MOVES = 60
DIVERSITY = 2.0  # nats
MOST_MOVES = 10_000  # what is asked for beyond these is a slip of the keyboard, and more than memory holds
MOST_NODES = 1_000_000_000
MOST_MEMORY = 1 << 50  # bytes
MOST_GIVEN = 3  # states of the parent that a joint graph names beside a state
SLOWEST = 0.01  # frames a second
Scheme = Literal["posture", "progression", "none"]  # of coordination


@dataclass(frozen=True, eq=False)
class Engine(LearnedCorpus):
    """What was learned from a corpus (see Learned), ready to answer."""

    _priced: dict[tuple[Weights, float, float | None, float], Model] = field(default_factory=dict, repr=False)

    # --- asking -----------------------------------------------------------------------------------------------------

    def tween(
        self,
        a: Posture,
        b: Posture,
        *,
        moves: int | tuple[int, int] | None = None,
        max_moves: int = MAX_MOVES,
        duration: float | None = None,
        pin: Mapping[str, str] = MappingProxyType({}),
        hold: Sequence[str] = (),
        avoid: Sequence[tuple[str, int | str]] = (),
        via: Sequence[Posture | tuple[Posture, int]] = (),
        unlike: Sequence[Tween] = (),
        diversity: float = DIVERSITY,
        sample: bool = False,
        seed: int = 0,
        strict: bool = False,
        posturewise: bool = False,
        node_budget: int = NODE_BUDGET,
        memory: int | None = None,
        weights: Weights = "conditional",
        novelty: float = 0.0,
        coordination: Scheme = "posture",
        lambda_: float = 1.0,
        beta: float = 1.0,
        tau: float = 1.0,
        bridge_price: float = 1.0,
        fps: float = 30.0,
        follow: bool | None = None,
        watch: Watch | None = None,
    ) -> Tween:
        """The best movement from posture `a` to posture `b` in the style of the corpus.

        Args:
            a: where it starts, exactly.
            b: where it ends, exactly.
            moves: how many moves, or the least and the greatest number; None lets the search find the best number.
            max_moves: the greatest number that it may find.
            duration: seconds that the motion lasts, exactly; where `moves` is None they tell how many moves, each as
                long as the corpus's usual.
            pin: joints that are in A's state until the last move ("A"), or in B's from the first move on ("B").
            hold: joints that stay in their state all the way, where A and B agree; a standing segment, say.
            avoid: joints, each with a state, by its number or name, that it is not in on the way from A to B.
            via: postures to pass through on the way, in this order; at any move, or as (posture, move) at that one.
            unlike: tweens that it is to differ from.
            diversity: nats for each move of a joint from one state to another that one of `unlike` makes, for each.
            sample: draw a path at random instead of the best, with a probability of nearly exp(-cost) over the sum of
                that, among those with as many moves as the best; `motionmind.search.sample` says how nearly.
            seed: what it is drawn by: a whole number of at least 0.
            strict: no bridges: every move of every joint is attested, or a wait at its goal.
            posturewise: only whole postures of the corpus, in the order in which they followed, from the one nearest to
                `a` to the one nearest to `b`: what the search of 1998 finds, at best, as a baseline.
            node_budget: nodes that the search may hold at once; it stops after as many expansions.
            memory: bytes that those nodes may take; instead of `node_budget`.
            weights: "conditional", -log P(next state | state), or "printed", as the papers print it.
            novelty: from 0, where what is frequent in the corpus is cheap, to 1, where all moves that it attests from a
                state cost the same.
            coordination: what a joint goes with: "posture", P(joint's state | parent's state); "progression",
                P(joint's next state | its state, parent's state and next state), as in [C98]; or "none", for joints
                that move each on its own, as with a `lambda_` of 0.
            lambda_: factor of the -log P of that, summed over joints and postures.
            beta: nats for each move that a joint waits at its goal.
            tau: nats for each move.
            bridge_price: nats for each degree of an unattested move.
            fps: frames a second of the motion.
            follow: whether the motion keeps to the path, each joint in its state at each move; or is the mean of all
                the ways that the corpus knows from A to B in as many moves, which held-out movement is nearer to. None
                for the mean where nothing is asked of the path but its length, else for the path.
            watch: called between pieces of work with how far the search is; where it returns True, the best path so
                far is the answer, with what is proven by then.

        Raises:
            NoPathError: nothing joins them under these rules; the message is the diagnosis.
            SkeletonError: a posture is on another skeleton than the corpus, or has no such joint.
            MotionMindError: an option is out of its range, or asks for what cannot be.
        """
        if posturewise and (pin or hold or avoid or via or unlike or sample):
            raise MotionMindError("posturewise knows whole postures alone: no pin, hold, avoid, via, unlike or sample")
        if posturewise and coordination == "progression":
            raise MotionMindError("posturewise: coordination can be posture or none, not progression")
        least, most = _range(moves, max_moves)
        _check_options(
            node_budget, fps, weights, coordination, novelty, seed, lambda_, beta, tau, bridge_price, diversity
        )
        if memory is not None:
            node_budget = _nodes(memory, len(self.space))
        if duration is not None:
            least, most = self._moves_in(duration, fps, moves, least, most)
        fixed = moves is not None or duration is not None
        follow = follow if follow is not None else any((pin, hold, avoid, via, unlike, sample, posturewise, novelty))
        a, b = self._on_skeleton(a, "posture A"), self._on_skeleton(b, "posture B")
        postures, at = self._vias(via)
        began = perf_counter()
        stops = self.corpus.to_chains(np.stack([end.rotations for end in (a, *postures, b)]))
        states, near = self.space.assign(stops), None
        if posturewise:
            near = nearest_posture(self.corpus, a.rotations), nearest_posture(self.corpus, b.rotations)
            states[:, : len(a.skeleton)] = self.states[list(near), : len(a.skeleton)]
        snap = self.space.distance(stops, states)
        start, *passing, goal = states.astype(np.int64)
        asked = constraints_of(self.space, start, goal, pin, hold, avoid)
        factor = 0.0 if coordination == "none" else lambda_
        of_postures = 0.0 if coordination == "progression" else factor
        model = self._model(weights, of_postures, None if strict else bridge_price, novelty)
        if unlike:
            model = penalise(model, [other.path for other in unlike], diversity)
        posed = Problem(
            restrict(model, asked),
            start,
            goal,
            Rules(beta, tau, least, most, node_budget),
            tuple(Via(through, move) for through, move in zip(passing, at, strict=True)),
        )
        searched, net = posed, self.grammar.coordination
        if coordination == "progression":
            searched, net = self._of_moves(posed, factor)
        posing = perf_counter() - began
        if not fixed and not via and _same(a, b):
            certificate = _stay(states[:1])
        else:
            certificate = self._answer(model, posed, searched, near, asked, strict, watch)
        if sample and len(certificate.path) > 1:
            certificate = sample_path(searched.model, start, goal, searched.rules, posed.vias, certificate, seed)
        spent = break_down_cost(
            certificate.path, searched.model, goal, searched.rules, self.grammar, self.space, net, factor
        )
        certificate = replace(certificate, path=places(searched.model, certificate.path))
        attested, bridges, waits, sources = trace_path(
            certificate,
            self.grammar,
            self.corpus,
            self.grammar.transitions.weights(weights, novelty),
            beta,
            bridge_price,
        )
        began = perf_counter()
        motion, detailed = realise(
            certificate.path,
            a,
            b,
            self.corpus,
            self.grammar,
            self.carriage,
            fps,
            duration,
            dict(zip(certificate.passed, postures, strict=True)),
            np.radians(self.space.tolerances[: len(a.skeleton)]) if follow else None,
        )
        realising = perf_counter() - began
        (insertion,) = motion.insertions
        # A facing that is bridged shows at the root, which turns with it.
        named = ((a.skeleton.names[0] if bridge.joint == FACING else bridge.joint, bridge.move) for bridge in bridges)
        bridged = tuple(dict.fromkeys(named))
        return Tween(
            motion=replace(motion, insertions=(replace(insertion, bridged=bridged),)),
            joints=self.corpus.chains,
            path=certificate.path,
            status=certificate.status,
            cost=certificate.cost,
            lower_bound=certificate.lower_bound,
            attested=attested,
            bridges=bridges,
            waits=waits,
            shared=shared_moves(certificate.path, [other.path for other in unlike]),
            passed=certificate.passed,
            snap_degrees=snap[[0, -1]],
            path_degrees=self._off(motion, certificate.path),
            via_degrees=snap[1:-1],
            sources=sources,
            detail=tuple(
                source_of(self.corpus, int(moves.begins[move]), int(moves.ends[move]))
                for moves in [self.corpus.moves]
                for move in detailed
            ),
            expansions=certificate.expansions,
            peak_nodes=certificate.peak_nodes,
            node_budget=node_budget,
            account=spent,
            seconds={
                "load": self.load_seconds,
                "problem": posing + certificate.seconds["problem"],
                "bound": certificate.seconds["bound"],
                "search": certificate.seconds["search"],
                "realise": realising,
            },
            posed=searched,
            asked={
                "moves": list(moves) if isinstance(moves, tuple) else moves,
                "max_moves": max_moves,
                "duration": duration,
                "pin": dict(pin),
                "hold": list(hold),
                "avoid": [list(one) for one in avoid],
                "via": list(at),
                "unlike": len(unlike),
                "diversity": diversity,
                "sample": sample,
                "seed": seed,
                "strict": strict,
                "node_budget": node_budget,
                "memory": memory,
                "weights": weights,
                "novelty": novelty,
                "coordination": coordination,
                "lambda": lambda_,
                "beta": beta,
                "tau": tau,
                "bridge_price": bridge_price,
                "fps": fps,
                "follow": follow,
            },
        )

    def _off(self, motion: Motion, path: States) -> Floats:
        """Degrees [T + 1, L] between the motion's orientations at its moves and the states of a path."""
        return self.space.distance(self.corpus.to_chains(motion.at(motion.insertions[0].times).rotations), path)

    def _answer(
        self,
        model: Model,
        posed: Problem,
        searched: Problem,
        near: tuple[int, int] | None,
        asked: Sequence[Constraint],
        strict: bool,
        watch: Watch | None,
    ) -> Certificate:
        """The best path of a problem, which is searched as `searched`; NoPathError says why there is none.

        `model` has the costs before any restriction in `asked`, and `near` the corpus's postures that a search of whole
        postures leads between.
        """
        start, goal, rules = posed.start, posed.goal, posed.rules
        if near is not None:
            whole = solve_posturewise(model, self._bodies, start, goal, rules)
            if whole is None:
                raise NoPathError(diagnose_posturewise(self.corpus, self._bodies, near, rules))
            return whole
        certificate = solve(searched.model, start, goal, searched.rules, posed.vias, watch)
        if certificate is None:
            if faults := find_conflicts(self.grammar.chains, model, posed, asked):
                raise NoPathError(faults, {"restrictions": faults})
            # Imported here, for SciPy's graphs are slow to import.
            from motionmind.tween.diagnosis import diagnose

            found = diagnose(model, self.grammar, self.corpus, self.space, start, goal, rules, strict)
            raise NoPathError(str(found), found.plain())
        return certificate

    def _vias(self, via: Sequence[Posture | tuple[Posture, int]]) -> tuple[list[Posture], list[int | None]]:
        """The postures to pass through, and the move at which each is, or None."""
        postures, at = [], []
        for number, given in enumerate(via, start=1):
            posture, move = given if isinstance(given, tuple) else (given, None)
            if move is not None and not (isinstance(move, int | np.integer) and 1 <= move < MOST_MOVES):
                raise MotionMindError(f"via {number}: the move must be a whole number from 1, not {move}")
            postures.append(self._on_skeleton(posture, f"via {number}"))
            at.append(None if move is None else int(move))
        return postures, at

    def _moves_in(
        self, duration: float, fps: float, moves: int | tuple[int, int] | None, least: int, most: int
    ) -> tuple[int, int]:
        """The least and greatest number of moves of a motion that lasts `duration` seconds: the nearest number of
        moves of the corpus's usual length, unless `moves` says otherwise."""
        seconds = usual(self.grammar.transitions)
        longest = MOST_MOVES * seconds
        if not 1.0 / fps <= duration <= longest:
            raise MotionMindError(
                f"duration must be a number of seconds from a frame's {1.0 / fps:g} to {longest:g}, not {duration}"
            )
        if moves is not None:
            return least, most
        nearest = max(1, round(duration / seconds))
        return nearest, nearest

    def _model(self, weights: Weights, coordination: float, bridge_price: float | None, novelty: float) -> Model:
        """The costs of the grammar, kept from one question to the next as long as they are asked for alike."""
        asked = (weights, coordination, bridge_price, novelty)
        if asked not in self._priced:
            self._priced.clear()
            self._priced[asked] = build_model(self.grammar, *asked)
        return self._priced[asked]

    def _of_moves(self, posed: Problem, lambda_: float) -> tuple[Problem, Coordination]:
        """The same problem with moves for states, and how these go together."""
        held = with_waits(posed.model, posed.goal, posed.rules.wait)
        count = np.diff(held.starts) + np.diff(held.indptr[held.starts])  # of each chain's states
        if count.max() > MOST_STATES_OF_CHAIN:
            joint = self.grammar.chains[int(count.argmax())]
            raise MotionMindError(
                f"coordination progression: {joint} has {count.max()} states and moves, and the search takes up to "
                f"{MOST_STATES_OF_CHAIN}; build the corpus with a coarser tolerance for it, or ask for strict"
            )
        moves = self.corpus.moves
        net = fit_progression(
            self.grammar.coordination.parents,
            held.starts,
            held.indptr,
            held.targets,
            self.states,
            moves.begins,
            moves.ends,
            moves.weights,
        )
        rules = replace(posed.rules, wait=np.inf)  # those at the goal are moves by now
        return replace(posed, model=lift_to_moves(held, net, lambda_), rules=rules), net

    @cached_property
    def _bodies(self) -> Bodies:
        """The corpus's whole postures, but for where they face."""
        moves, joints = self.corpus.moves, len(self.corpus.skeleton)
        return find_bodies(np.asarray(self.states[:, :joints]), moves.begins, moves.ends)

    def _on_skeleton(self, posture: Posture, which: str) -> Posture:
        """The posture on the corpus's joints; SkeletonError names the difference."""
        skeleton = self.corpus.skeleton
        if human23().difference(skeleton) is None and joint_mapping(posture.skeleton) is not None:
            posture = to_human23(posture)
        difference = skeleton.difference(posture.skeleton)
        if difference is not None:
            raise SkeletonError(f"{which} is on another skeleton than corpus {self.corpus.name!r}: {difference}")
        return posture

    # --- looking ----------------------------------------------------------------------------------------------------

    def joint_graph(self, joint: str) -> nx.DiGraph:
        """The joint graph of a joint (or "facing") as a networkx graph.

        Nodes are states, with `orientation` (x, y, z, w), `visits`, `label` and `given`: the states of the parent joint
        that make it likeliest, each with P(state | parent's state), of those seen with it. Edges are attested
        transitions, with `count`, `weight` (-log P(next | state), nats) and `seconds`. The graph knows its `corpus`,
        `joint` and `parent`, None where it has none.
        """
        import networkx as nx

        graph, chain = self.grammar.transitions, self.space.index(joint)
        first, last = graph.starts[chain], graph.starts[chain + 1]
        weights = graph.weights("conditional")
        parent = int(self.grammar.coordination.parents[chain])
        out = nx.DiGraph(
            corpus=self.corpus.name, joint=joint, parent=self.corpus.chains[parent] if parent >= 0 else None
        )
        given = self._given(chain, parent)
        for state, row in enumerate(range(first, last)):
            out.add_node(
                state,
                orientation=tuple(map(float, self.space.centres[row])),
                visits=float(graph.visits[row]),
                label=self.space.label(chain, state),
                given=given[state],
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

    def _given(self, chain: int, parent: int) -> list[tuple[tuple[str, float], ...]]:
        """For each state of a chain the parent's states that it goes with best, each with P(state | parent's state)."""
        if parent < 0:
            return [()] * int(self.space.sizes[chain])
        likely = np.exp(-self.grammar.coordination.table(chain, self.grammar.transitions.starts))
        seen = np.zeros(likely.shape, dtype=bool)
        seen[self.states[:, parent], self.states[:, chain]] = True
        best = np.argsort(-np.where(seen, likely, 0.0), axis=0, kind="stable")[:MOST_GIVEN]
        return [
            tuple((self.space.label(parent, int(p)), float(likely[p, state])) for p in column if seen[p, state])
            for state, column in enumerate(best.T)
        ]

    def network(self) -> DiscreteBayesianNetwork:
        """The coordination net as a pgmpy network over the joints: what the search's costs were compiled from."""
        joints = len(self.corpus.skeleton)
        parents, sizes = self.corpus.chain_parents[:joints], self.space.sizes[:joints]
        states, weights = np.asarray(self.states[:, :joints]), self.corpus.weights
        return fit_network(self.corpus.skeleton.names, parents, states, sizes, weights)

    def info(self) -> dict[str, Any]:
        """Summarise the corpus, as plain values: see `motionmind.learned.summary.CorpusSummary`."""
        return survey.to_plain(survey.summarise(self.corpus, self.grammar))

    def check(self, pairs: int = 2000, seed: int = 0) -> dict[str, Any]:
        """Measure how well the corpus hangs together, as plain values: see `motionmind.learned.summary.CorpusCheck`."""
        return survey.to_plain(survey.check_corpus(self.corpus, self.grammar, self.states, pairs, seed))


def _stay(path: States) -> Certificate:
    """That no move at all is best, with a path of one posture [1, L]."""
    return Certificate(path, 0.0, 0.0, "optimal", 0, 0, {"problem": 0.0, "bound": 0.0, "search": 0.0})


def _same(a: Posture, b: Posture) -> bool:
    """Whether two postures are one, to within rounding."""
    return bool(np.all(rot.angle(a.rotations, b.rotations) < 1e-6) and np.all(np.abs(a.root - b.root) < 1e-6))


def _range(moves: int | tuple[int, int] | None, max_moves: int) -> tuple[int, int]:
    """The least and the greatest number of moves."""
    _check_count("max_moves", max_moves, MOST_MOVES)
    if moves is None:
        return 1, max_moves
    least, most = moves if isinstance(moves, tuple) else (moves, moves)
    _check_count("moves", least, MOST_MOVES)
    _check_count("moves", most, MOST_MOVES)
    if least > most:
        raise MotionMindError(f"moves must be a range from the least to the greatest, not from {least} to {most}")
    return int(least), int(most)


def _nodes(memory: int, chains: int) -> int:
    """How many nodes there may be in `memory` bytes."""
    _check_count("memory", memory, MOST_MEMORY)
    nodes = nodes_in(int(memory), chains)
    if nodes < 1:
        raise MotionMindError(f"memory of {memory} bytes holds not one node; give some megabytes")
    return min(nodes, MOST_NODES)


def _check_count(name: str, value: int, most: int) -> None:
    if not (isinstance(value, int | np.integer) and 1 <= value <= most):
        raise MotionMindError(f"{name} must be a whole number from 1 to {most}, not {value}")


def _check_options(
    node_budget: int, fps: float, weights: str, coordination: str, novelty: float, seed: int, *prices: float
) -> None:
    _check_count("node_budget", node_budget, MOST_NODES)
    if coordination not in ("posture", "progression", "none"):
        raise MotionMindError(f"coordination must be 'posture', 'progression' or 'none', not {coordination!r}")
    if not (isinstance(seed, int | np.integer) and seed >= 0):
        raise MotionMindError(f"seed must be a whole number of at least 0, not {seed}")
    if not SLOWEST <= fps <= FASTEST:
        raise MotionMindError(f"fps must be a number of frames a second from {SLOWEST:g} to {FASTEST:g}, not {fps}")
    if weights not in ("conditional", "printed"):
        raise MotionMindError(f"weights must be 'conditional' or 'printed', not {weights!r}")
    if not 0.0 <= novelty <= 1.0:
        raise MotionMindError(f"novelty must be a number from 0 to 1, not {novelty}")
    for name, price_ in zip(("lambda", "beta", "tau", "bridge_price", "diversity"), prices, strict=True):
        if not (np.isfinite(price_) and price_ >= 0.0):
            raise MotionMindError(f"{name} must be a number of nats of at least 0, not {price_}")
