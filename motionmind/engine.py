"""The one door: learn from clips, save and load what was learned, and find the tween between two postures."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind import survey
from motionmind.corpus import store
from motionmind.corpus.corpus import FACING, Corpus, Facing
from motionmind.corpus.gather import FLIP_DEGREES, Flips, gather
from motionmind.corpus.manifest import BuiltManifest, SourceManifest, parse_manifest
from motionmind.discretize import Codebook, Discretization, StateSpace, from_spec
from motionmind.errors import FormatError, MotionMindError, NoPathError, SkeletonError
from motionmind.formats import read_motion
from motionmind.grammar.bridges import Bridges
from motionmind.grammar.coordination import Coordination, fit_network
from motionmind.grammar.grammar import Grammar, learn
from motionmind.grammar.transitions import Transitions, Weights
from motionmind.motion import FASTEST, Motion, Posture
from motionmind.realise.realise import realise
from motionmind.realise.root import Carriage, learn_carriage
from motionmind.retarget import joint_mapping, to_human23
from motionmind.search.costs import price
from motionmind.search.problem import Model
from motionmind.search.solve import Certificate, Rules, solve
from motionmind.skeleton import Skeleton, human23
from motionmind.tween import Posed, Tween, diagnose, explain

if TYPE_CHECKING:
    import networkx as nx
    from pgmpy.models import DiscreteBayesianNetwork

States = NDArray[np.int32]
_Movement = TypeVar("_Movement", Motion, Posture)
_Part = TypeVar("_Part", Transitions, Bridges, Coordination, Carriage)

NODE_BUDGET = 200_000
MAX_MOVES = 60
MOST_MOVES = 10_000  # what is asked for beyond these is a slip of the keyboard, and more than memory holds
MOST_NODES = 1_000_000_000
SLOWEST = 0.01  # frames a second


def own_skeleton(movement: _Movement, joints: Mapping[str, str] | None = None) -> _Movement:
    """The movement on human23 where its joints map there, by `joints` or by known names; as it is where they do not."""
    mapped = joints is not None or joint_mapping(movement.skeleton) is not None
    return to_human23(movement, joints) if mapped else movement


@dataclass(frozen=True, eq=False)
class Engine:
    """What was learned from a corpus, ready to answer.

    Attributes:
        corpus: the movement that was learned from.
        space: the states of each lane.
        states: of the corpus's postures [N, L].
        grammar: joint graphs, bridges and coordination.
        carriage: how the corpus's bodies travel and stand.
        load_seconds: time that loading took.
    """

    corpus: Corpus
    space: StateSpace
    states: States
    grammar: Grammar
    carriage: Carriage
    load_seconds: float = 0.0
    _priced: dict[tuple[Weights, float, float | None], Model] = field(default_factory=dict, repr=False)

    # --- learning ---------------------------------------------------------------------------------------------------

    @classmethod
    def fit(
        cls,
        clips: Iterable[Motion],
        *,
        name: str = "corpus",
        rate: float | None = None,
        skip: int = 0,
        facing: Facing = "free",
        discretization: Discretization | None = None,
        flips: Flips = "split",
        flip_degrees: float = FLIP_DEGREES,
        title: str = "",
        author: str = "",
        source: str = "",
        licence: str = "",
    ) -> Engine:
        """Learn from clips, all on the same joints (`own_skeleton` brings known rigs together).

        Args:
            clips: the movement; names tell where a move comes from.
            name: of the corpus.
            rate: postures a second; None keeps every frame with its own time.
            skip: frames to drop at each clip's start, such as an added T-pose.
            facing: "free" takes the turn about the vertical out of the root's state, to be a lane of its own; "stage"
                leaves it there, so that what faces the wall is another state than what faces the public.
            discretization: how orientations become states; a learned codebook of 15 degrees by default.
            flips: what becomes of clips in which a joint jumps: `split` there, `keep`, or `drop` the clip.
            flip_degrees: what counts as a jump from one frame to the next.
            title: a line on what the corpus is.
            author: who made it.
            source: where it comes from.
            licence: under which it may be used.

        Raises:
            CorpusError: nothing to learn from, or clips on different joints.
        """
        corpus = gather(
            name,
            clips,
            rate=rate,
            skip=skip,
            facing=facing,
            flips=flips,
            flip_degrees=flip_degrees,
            title=title,
            author=author,
            source=source,
            licence=licence,
        )
        return cls.learn(corpus, discretization or Codebook(15.0))

    @classmethod
    def learn(cls, corpus: Corpus, discretization: Discretization) -> Engine:
        """Learn from a corpus."""
        orientations = corpus.to_lanes(corpus.rotations)
        joints = corpus.skeleton.names
        space = discretization.fit(joints, orientations[:, : len(joints)])
        space, states = _seen(space, space.assign(orientations[:, : len(joints)]))
        if corpus.facing == "free":
            space, facing = _with_facing(space, orientations[:, -1])
            states = np.concatenate([states, facing[:, None]], axis=1)
        grammar = learn(
            corpus.lanes, corpus.lane_parents, space.centres, states, space.sizes, corpus.begins, corpus.seconds
        )
        return cls(corpus, space, states, grammar, learn_carriage(corpus, states, grammar.transitions))

    # --- saving and loading -----------------------------------------------------------------------------------------

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Write all that was learned to a folder, whole or not at all."""
        corpus, space = self.corpus, self.space
        arrays: dict[str, NDArray[Any]] = {
            "rotations": corpus.rotations,
            "root": corpus.root,
            "times": corpus.times,
            "states": self.states,
            "centres": space.centres,
        }
        for name, kind in _PARTS.items():
            part = self.carriage if kind is Carriage else getattr(self.grammar, name)
            arrays |= {f"{name}.{field.name}": getattr(part, field.name) for field in fields(kind)}
        skeleton = corpus.skeleton
        manifest = {
            **{key: getattr(corpus, key) for key in _CORPUS_KEYS},
            "skeleton": {
                "name": skeleton.name,
                "names": skeleton.names,
                "parents": skeleton.parents,
                "offsets": skeleton.offsets.tolist(),
                "tips": skeleton.tips.tolist(),
            },
            "clips": [asdict(clip) for clip in corpus.clips],
            "faults": [asdict(fault) for fault in corpus.faults],
            "space": {
                "kind": space.kind,
                "starts": space.starts.tolist(),
                "tolerances": space.tolerances.tolist(),
                "labels": space.labels,
            },
        }
        store.save(Path(folder), manifest, arrays)

    @classmethod
    def load(cls, name: str, home: str | os.PathLike[str] | None = None) -> Engine:
        """The engine of a corpus, by its name or folder: one that was built, or a bundled one.

        A bundled corpus is learned on first use and kept in the platform's cache directory.

        Raises:
            CorpusError: there is no such corpus; the message names those there are.
            FormatError: it cannot be read.
        """
        began = perf_counter()
        folder = store.locate(name, home)
        if store.read_manifest(folder)["format"] == store.BUILT:
            return cls._open(folder, began)
        manifest = parse_manifest(store.read_manifest(folder), SourceManifest, folder / store.MANIFEST)
        files = [folder / store.MANIFEST, *(folder / clip.file for clip in manifest.clips)]
        built = store.cache() / f"{folder.name}-{store.fingerprint(files)}"
        try:
            return cls._open(built, began)
        except MotionMindError:  # it is not there yet, or is damaged
            engine = cls.learn(*_source(folder, manifest))
        with suppress(MotionMindError):  # nowhere to keep it: it is learned again next time
            engine.save(built)
        return replace(engine, load_seconds=perf_counter() - began)

    @classmethod
    def _open(cls, folder: Path, began: float) -> Engine:
        saved, arrays = store.load(folder)
        path = folder / store.MANIFEST
        manifest = parse_manifest(saved, BuiltManifest, path)
        missing = [name for name in _ARRAYS if name not in arrays]
        if missing:
            raise FormatError(f"lists no array {missing[0]}; build the corpus again", path=path)
        body, states = manifest.skeleton, manifest.space
        corpus = Corpus(
            skeleton=Skeleton(body.name, body.names, body.parents, np.array(body.offsets), np.array(body.tips)),
            clips=manifest.clips,
            rotations=arrays["rotations"],
            root=arrays["root"],
            times=arrays["times"],
            faults=manifest.faults,
            **{key: getattr(manifest, key) for key in _CORPUS_KEYS},
        )
        space = StateSpace(
            corpus.lanes,
            arrays["centres"],
            np.array(states.starts),
            states.kind,
            np.array(states.tolerances),
            states.labels,
        )
        grammar = Grammar(
            corpus.lanes,
            arrays["centres"],
            _part(Transitions, "transitions", arrays),
            _part(Bridges, "bridges", arrays),
            _part(Coordination, "coordination", arrays),
        )
        carriage = _part(Carriage, "carriage", arrays)
        return cls(corpus, space, arrays["states"], grammar, carriage, perf_counter() - began)

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
        return Tween(
            motion=motion,
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
        if human23().difference(skeleton) is None:
            posture = own_skeleton(posture)
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
        return fit_network(self.corpus.skeleton.names, parents, np.asarray(self.states[:, :joints]), sizes)

    def info(self) -> dict[str, Any]:
        """What the corpus is and how large: see `survey.info`."""
        return survey.info(self.corpus, self.grammar)

    def check(self, pairs: int = 2000, seed: int = 0) -> dict[str, Any]:
        """How well the corpus hangs together: see `survey.check`."""
        return survey.check(self.corpus, self.grammar, self.states, pairs, seed)


_CORPUS_KEYS = ("name", "title", "author", "source", "licence", "facing", "rate")
_PARTS = {"transitions": Transitions, "bridges": Bridges, "coordination": Coordination, "carriage": Carriage}
_ARRAYS = (
    *("rotations", "root", "times", "states", "centres"),
    *(f"{name}.{field.name}" for name, kind in _PARTS.items() for field in fields(kind)),
)


def _part(kind: type[_Part], name: str, arrays: Mapping[str, NDArray[Any]]) -> _Part:
    return kind(**{field.name: arrays[f"{name}.{field.name}"] for field in fields(kind)})


def _seen(space: StateSpace, states: States) -> tuple[StateSpace, States]:
    """The state space without states that no posture is in, for nothing is known of them; and the states in it."""
    kept = [np.unique(column) for column in states.T]
    labels = [[named[s] for s in seen] if named else [] for named, seen in zip(space.labels, kept, strict=True)]
    centres = [space.of(joint)[seen] for joint, seen in enumerate(kept)]
    smaller = StateSpace.of_joints(space.names, centres, kind=space.kind, tolerances=space.tolerances, labels=labels)
    renamed = [np.searchsorted(seen, column) for seen, column in zip(kept, states.T, strict=True)]
    return smaller, np.stack(renamed, axis=1).astype(np.int32)


def _with_facing(space: StateSpace, turns: NDArray[np.float64]) -> tuple[StateSpace, States]:
    """The state space with a lane for the facing, whose states are equal steps of a circle as wide as the root's
    tolerance, and the states [N] of the corpus's turns [N, 4] in it."""
    count = max(8, round(360.0 / float(space.tolerances[0])))
    ring = rot.canonical(rot.about_vertical(np.arange(count) * 2.0 * np.pi / count))
    wider = StateSpace.of_joints(
        (*space.names, FACING),
        [*(space.of(joint) for joint in range(len(space))), ring],
        kind=space.kind,
        tolerances=np.append(space.tolerances, 360.0 / count),
        labels=(*space.labels, ()),
    )
    steps = np.round(rot.heading(turns) / (2.0 * np.pi / count)).astype(np.int32) % count
    return wider, steps


def _source(folder: Path, manifest: SourceManifest) -> tuple[Corpus, Discretization]:
    """A corpus that people wrote: its clips, and the discretization that its manifest names."""
    try:
        discretization = from_spec(manifest.discretization)
    except FormatError as error:
        raise FormatError(str(error), path=folder / store.MANIFEST) from error
    motions = [replace(read_motion(folder / clip.file), name=clip.name) for clip in manifest.clips]
    corpus = gather(
        motions=[own_skeleton(motion) for motion in motions],
        flips="keep",
        about={clip.name: clip.about for clip in manifest.clips},
        **{key: getattr(manifest, key) for key in _CORPUS_KEYS},
    )
    return corpus, discretization


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
