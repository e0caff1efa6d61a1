"""The engine: a learned corpus that answers requests for tweens."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice
from time import perf_counter
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from motionmind.arguments import check_function, check_integer, check_text, check_type
from motionmind.body.motion import Motion, Posture
from motionmind.display import displayed
from motionmind.errors import InfeasibleError, MotionMindWarning, NoPathError
from motionmind.geometry.splines import rotation_spline
from motionmind.learned import graphs, summary
from motionmind.learned.model import LearnedCorpus
from motionmind.metrics.paths import attested_share
from motionmind.search.diverse import TooSimilarError, difference, solve_diverse
from motionmind.search.problem import places
from motionmind.search.sample import sample_path
from motionmind.search.solve import Certificate, Watch, solve
from motionmind.synthesis.synthesise import Synthesised, synthesise
from motionmind.synthesis.wishes import Style, Wishes
from motionmind.tween.accents import find_accented
from motionmind.tween.certificate import (
    break_down_cost,
    credit_tween,
    mark_motion,
    sources_followed,
    sources_of,
    trace_path,
)
from motionmind.tween.constraints import find_conflicts
from motionmind.tween.ends import bring_ends
from motionmind.tween.formulate import Formulation, formulate
from motionmind.tween.modes import Modes
from motionmind.tween.pacing import tempo_of, worded
from motionmind.tween.problem import ingredients_of
from motionmind.tween.reaches import find_reached, find_stayed, resolve_reaches, resolve_stays
from motionmind.tween.request import TweenOptions, TweenRequest
from motionmind.tween.result import Tween
from motionmind.tween.travel import destination, find_travelled
from motionmind.tween.what_if import Answer, WhatIf, find_what_if
from motionmind.tween.whole_body import Bodies, diagnose_whole_body, find_bodies, solve_whole_body

FOLLOWED_SLACK_DEG = 0.1  # slack for comparing frames with a tolerance that the synthesis has met

if TYPE_CHECKING:
    import networkx as nx
    from pgmpy.models import DiscreteBayesianNetwork


@dataclass(frozen=True, eq=False)
class Engine(LearnedCorpus):
    """A learned corpus that answers requests; `Engine.fit` learns one, `Engine.load` opens one.

    Attributes:
        corpus: the movement learned from.
        space: the states of each joint chain.
        states: the states of the corpus's postures [N, L].
        load_seconds: loading time, seconds; 0 if it was not loaded.

    >>> from motionmind import Engine
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> tween = engine.tween(motion.posture(0), motion.posture(3), moves=3)
    >>> tween.status, tween.moves
    ('optimal', 3)
    """

    def __repr__(self) -> str:
        corpus = self.corpus
        name, body = displayed(corpus.name), displayed(corpus.skeleton.name)
        return f"<Engine of {name} on {body}: postures {len(corpus)}, clips {len(corpus.clips)}>"

    def tween(
        self,
        a: Posture,
        b: Posture,
        request: TweenRequest | None = None,
        *,
        before: Motion | None = None,
        after: Motion | None = None,
        watch: Watch | None = None,
        **options: Unpack[TweenOptions],
    ) -> Tween:
        """Find the best movement from posture `a` to posture `b` in the style of the corpus.

        Args:
            a: the exact first posture; `find_posture` finds one by name.
            b: the exact last posture.
            request: everything else in the request; None for the defaults.
            before: frames that lead up to `a` and show the body's velocity there. The last frame is `a`, wherever it
                stands. Frames before a flip (a badly recorded joint) do not count. None if unknown.
            after: frames that follow `b`, in the same form; the first frame is `b`.
            watch: called from time to time with the search's progress; return True to end the search and get the best
                path and bound so far.
            options: fields of `TweenRequest` and `SearchOptions`, as in `engine.tween(a, b, duration=2.0, tau=0.5)`.

        Raises:
            NoPathError: no path joins the postures under these rules; the message is the diagnosis.
            SkeletonError: a posture or movement has another skeleton than the corpus, or lacks a joint.
            MotionMindError: an option is out of range or impossible; `before` does not end in `a`, `after` does not
                begin in `b`, or one of them has a single frame.
            WrongTypeError: an argument has the wrong type, or an option does not exist.
        """
        request = TweenRequest.of(request, **options)
        search = request.search
        for name, end in (("a", a), ("b", b)):
            check_type(name, end, Posture, wanted="a Posture (find_posture finds one by name)")
        check_type("before", before, Motion, or_none=True)
        check_type("after", after, Motion, or_none=True)
        check_function("watch", watch, or_none=True)
        began = perf_counter()
        ends = bring_ends(self.corpus, a, b, before, after, destination(request.to, request.along))
        formulation = formulate(self, ends, request)
        formulated = perf_counter()
        certificate = self._find_path(formulation, watch)
        what_if: tuple[WhatIf, ...] = ()
        if request.what_if:

            def answer(other: TweenRequest) -> Answer:
                freed = formulate(self, ends, other)
                return Answer(other, freed.searched, self._find_path(freed, watch))

            what_if = find_what_if(Answer(request, formulation.searched, certificate), answer)
        if search.sample and len(certificate.path) > 1:
            certificate = sample_path(formulation.searched, certificate, search.seed)
        synthesising = perf_counter()
        synthesised = self._synthesise(formulation, certificate)
        seconds = {
            "load": self.load_seconds,
            "problem": formulated - began + certificate.seconds["problem"],
            "bound": certificate.seconds["bound"],
            "search": certificate.seconds["search"],
            "realise": perf_counter() - synthesising,
        }
        return self._account_for(formulation, certificate, synthesised, seconds, what_if)

    def posture(self, name: str) -> Posture:
        """Return a posture by name, such as "arabesque", "adagio@23", "karate/yoi" or "clip.bvh@240".

        A name without a slash or a dot belongs to this engine's corpus, found by its name, unless a file or a corpus
        has that name. Other names, and errors, are as for `find_posture`.

        >>> from motionmind import Engine
        >>> engine = Engine.load("ballet")
        >>> engine.tween(engine.posture("arabesque"), engine.posture("fifth")).moves
        7
        """
        from motionmind.names.postures import find_posture  # scores are slow to import
        from motionmind.names.spelling import is_file, parse_posture

        check_text("name", name)
        own, source = f"{self.corpus.name}/{name}", parse_posture(name).source
        is_bare = source.kind == "file" and not {"/", "."} & set(source.place) and not is_file(source.place)
        return find_posture(own if is_bare and parse_posture(own).source.kind == "corpus" else name).posture

    def alternatives(
        self,
        a: Posture,
        b: Posture,
        count: int,
        request: TweenRequest | None = None,
        *,
        before: Motion | None = None,
        after: Motion | None = None,
        watch: Watch | None = None,
        **options: Unpack[TweenOptions],
    ) -> Iterator[Tween]:
        """Find the best movement, then others with as many moves, each at least `differ` from all earlier ones.

        Each of the others follows a different passage of the corpus from A to B, named in its `request.passage`. Its
        path follows that passage, so do not compare its cost with the best one's. If the corpus has no other passage,
        the others are the next best paths. Samples (`sample`) differ by seed instead: the given seed and its
        successors. Only the first tween reports the cost of restrictions (`what_if`).

        Args:
            a: the exact first posture.
            b: the exact last posture.
            count: number of movements to find.
            request: see `tween`, also for the errors.
            before: see `tween`.
            after: see `tween`.
            watch: see `tween`.
            options: see `tween`.

        Yields:
            The tweens. Each has the least cost, within its gap, of all that follow the same passage and differ enough
            from the earlier tweens.

        Raises:
            NoPathError: no path joins the postures, or, after the first tween, no other path differs enough.

        >>> from motionmind import Engine
        >>> engine = Engine.load("ballet")
        >>> motion = engine.corpus.motion(engine.corpus.clips[0])
        >>> best, other = engine.alternatives(motion.posture(0), motion.posture(9), 2)
        >>> other.moves == best.moves, min(other.differs) >= 0.2, other.request.passage
        (True, True, 'sautes@6.467s')
        """
        check_integer("count", count)
        request = TweenRequest.of(request, **options)
        found: list[Tween] = []
        modes: Modes | None = None
        passages: Iterator[str] = iter(())

        def find(**other: Unpack[TweenOptions]) -> Tween:
            if request.search.sample:
                other["seed"] = request.search.seed + len(found)
            else:
                other["unlike"] = (*request.unlike, *found)
            if found:
                other["what_if"] = False
            return self.tween(a, b, request, before=before, after=after, watch=watch, **other)

        while len(found) < count:
            tween = None
            for passage in islice(passages, 2):  # then fall back on a variant of the best movement
                with suppress(NoPathError):
                    tween = find(passage=passage)
                    break
            found.append(tween or find())
            if modes is not None:
                modes.know(found[-1].motion)
            elif request.takes_passages and found[-1].moves > 1:
                modes = Modes(self, found[-1].motion, found[-1].before is not None, found[-1].after is not None)
                passages = iter(modes)
            yield found[-1]

    def _find_path(self, formulation: Formulation, watch: Watch | None) -> Certificate:
        """Find the best path of a formulated request; a NoPathError explains why there is none."""
        problem, searched = formulation.problem, formulation.searched
        if formulation.stays:
            still = {"problem": 0.0, "bound": 0.0, "search": 0.0}
            return Certificate(problem.start.astype(np.int32)[None], 0.0, 0.0, "optimal", 0, 0, still)
        if formulation.nearest is not None:
            unconstrained = replace(problem, model=formulation.model)
            try:
                return solve_whole_body(unconstrained, self._bodies)
            except InfeasibleError as error:
                reason = diagnose_whole_body(self.corpus, self._bodies, formulation.nearest, problem.rules)
                raise NoPathError(reason) from error
        request = formulation.request
        try:
            if request.unlike:
                known = [other.path for other in request.unlike]
                return solve_diverse(searched, known, request.differ, watch, request.search.within)
            return solve(searched, watch)
        except TooSimilarError as error:
            raise _no_other_path(request, error.most) from error
        except InfeasibleError as error:
            raise self._no_path(formulation) from error

    def _no_path(self, formulation: Formulation) -> NoPathError:
        """Return the error that explains why a formulated request has no path: its constraints, or the corpus."""
        model, problem = formulation.model, formulation.problem
        if conflicts := find_conflicts(self.grammar.chains, model, problem, formulation.constraints):
            return NoPathError(conflicts, {"restrictions": conflicts})
        # Imported here because SciPy's graphs are slow to import.
        from motionmind.tween.diagnosis import diagnose

        strict = formulation.request.search.strict
        found = diagnose(
            model, self.grammar, self.corpus, self.space, problem.start, problem.goal, problem.rules, strict
        )
        return NoPathError(str(found), found.plain())

    def _synthesise(self, formulation: Formulation, certificate: Certificate) -> Synthesised:
        """Synthesise the motion of a path."""
        request, ends = formulation.request, formulation.ends
        paced = request.paced and request.moves is None
        return synthesise(
            places(formulation.searched.model, certificate.path),
            Style(
                self.corpus,
                self.grammar,
                self.statistics,
                np.radians(self.space.tolerances),
                self.pace.fastest if paced else None,
                self.pace.peaks_in if request.paced else None,
                float(self.plausibility.slides[0]) if paced else np.inf,
            ),
            Wishes(
                ends.a,
                ends.b,
                formulation.wished,
                formulation.constrained,
                request.fps,
                request.length,
                dict(zip(certificate.passed, formulation.through, strict=True)),
                ends.leaving,
                ends.arriving,
                request.without,
                request.pace,
                request.moves is None,
                0.0 if request.search.whole_body else request.liveliness,
                formulation.place,
                {
                    move: seconds
                    for move, (_, _, seconds) in zip(certificate.passed, request.vias, strict=True)
                    if seconds is not None
                },
                resolve_reaches(self.corpus.skeleton, request.reach),
                formulation.route,
                resolve_stays(self.corpus.skeleton, request.stay),
                request.accents,
                formulation.course,
            ),
        )

    def _account_for(
        self,
        formulation: Formulation,
        certificate: Certificate,
        synthesised: Synthesised,
        seconds: dict[str, float],
        what_if: tuple[WhatIf, ...],
    ) -> Tween:
        """Assemble the answer: a path and its motion with their certificate, costs and provenance."""
        request, searched = formulation.request, formulation.searched
        search = request.search
        path = places(searched.model, certificate.path)
        attested, bridges, waits, sources = trace_path(
            path,
            self.grammar,
            self.corpus,
            self.grammar.transitions.weights(search.weights, request.novelty),
            search.beta,
            search.bridge_price,
        )
        costs = break_down_cost(
            certificate.path,
            searched,
            self.grammar,
            self.space,
            self.corpus.skeleton,
            formulation.coordination,
            search.coordination_factor,
        )
        motion = synthesised.motion
        tempo = tempo_of(self, formulation.times, formulation.usual_moves, formulation.detours, motion)
        if tempo.faster and (request.fixes_length or request.pace > 1.0):
            warnings.warn(
                f"faster than anything in the corpus: {worded(tempo.faster)}", MotionMindWarning, stacklevel=3
            )
        begins = np.zeros(0, dtype=np.int64) if synthesised.danced is None else synthesised.danced.passage.postures
        last = self.corpus.columns.starts[np.searchsorted(self.corpus.columns.starts, begins, side="right")] - 1
        # Use a spline: a move may fall between two frames, and the arc between them cuts the corner.
        reached = rotation_spline(motion.times, motion.rotations, motion.insertions[0].times)
        path_degrees = self.space.distance(self.corpus.to_chains(reached), path)
        moved = self.space.assign(self.corpus.to_chains(motion.at(motion.insertions[0].times).rotations))
        followed = path_degrees <= self.space.tolerances + FOLLOWED_SLACK_DEG
        shown = sources_followed(sources, followed)
        found = tuple(sources_of(self.corpus, begins, np.minimum(begins + 1, last), [""] * len(begins)))
        return Tween(
            motion=mark_motion(motion, bridges, credit_tween(self.corpus, shown, found, motion.insertions[0].times)),
            joints=self.corpus.chains,
            path=path,
            status=certificate.status,
            cost=certificate.cost,
            lower_bound=certificate.lower_bound,
            attested=attested,
            motion_attested=attested_share(moved, self.grammar) if len(moved) > 1 else None,
            bridges=bridges,
            waits=waits,
            differs=tuple(difference(path, other.path) for other in request.unlike),
            what_if=what_if,
            passed=certificate.passed,
            snap_degrees=formulation.snap_degrees[[0, -1]],
            path_degrees=path_degrees,
            followed=followed,
            via_degrees=formulation.snap_degrees[1:-1],
            sources=shown,
            detail=found,
            left_out=synthesised.left_out,
            gave=synthesised.residuals,
            reached=find_reached(motion, request.reach),
            accented=find_accented(motion, request),
            travelled=find_travelled(motion, request.to, request.along, formulation.route),
            stayed=find_stayed(motion, request.stay),
            expansions=certificate.expansions,
            peak_nodes=certificate.peak_nodes,
            costs=costs,
            seconds=seconds,
            search_problem=searched,
            ingredients=partial(
                ingredients_of,
                searched,
                self.grammar,
                search.weights,
                formulation.coordination,
                search.coordination_factor,
                search.beta,
                request.novelty,
            ),
            request=request,
            length=certificate.length,
            times=formulation.times,
            tempo=tempo,
            before=formulation.ends.before,
            after=formulation.ends.after,
            plausibility=self.plausibility,
        )

    @cached_property
    def _bodies(self) -> Bodies:
        """The corpus's whole postures, without their facing."""
        moves, joints = self.corpus.moves, len(self.corpus.skeleton)
        return find_bodies(np.asarray(self.states[:, :joints]), moves.begins, moves.ends)

    def joint_graph(self, joint: str) -> nx.DiGraph:
        """Return the joint graph of a joint (or "facing") as a networkx graph: see `learned.graphs.joint_graph`."""
        return graphs.joint_graph(self, joint)

    def network(self) -> DiscreteBayesianNetwork:
        """Return the coordination network as a pgmpy network; its tables agree with the costs."""
        return graphs.network(self)

    def info(self) -> dict[str, Any]:
        """Summarise the corpus, as plain values: see `motionmind.learned.summary.CorpusSummary`."""
        return summary.to_plain(summary.summarise(self.corpus, self.grammar))

    def check(self, pairs: int = 2000, seed: int = 0) -> dict[str, Any]:
        """Measure how well connected the corpus is, as plain values: see `motionmind.learned.summary.CorpusCheck`."""
        return summary.to_plain(summary.check_corpus(self.corpus, self.grammar, self.states, pairs, seed))


def _no_other_path(request: TweenRequest, most: float) -> NoPathError:
    """Return the error for a request where no path differs enough from the tweens in `unlike`."""
    count, moves = len(request.unlike), len(request.unlike[0].path) - 1
    diagnosis = {"differ": request.differ, "most": most}
    if moves < 2:
        return NoPathError(
            f"in {moves} move{'s' * (moves != 1)} nothing on the way can differ; ask for more", diagnosis
        )
    others = "the earlier one" if count == 1 else f"each of {count} earlier ones"
    found = f"no path of {moves} moves was found that differs by {request.differ:.1%} from {others}"
    return NoPathError(f"{found}; none can by more than {most:.1%}", diagnosis)
