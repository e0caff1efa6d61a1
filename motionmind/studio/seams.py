"""Judge and smooth the seams of a piece in the background: after each edit, the newest seams first.

The project keeps each finding under the hash of its question, so undo and redo never repeat a search.
"""

from __future__ import annotations

import asyncio
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple
from weakref import WeakKeyDictionary

import msgspec
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.motion import Motion
from motionmind.display import displayed
from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError, SkeletonError, enumerated
from motionmind.studio import api
from motionmind.studio.alternatives import MAX_ALTERNATIVES, account, find, usual_likelihoods
from motionmind.studio.asks import Ask
from motionmind.studio.findings import Finding, Found
from motionmind.studio.neighbours import Seam
from motionmind.studio.sides import Sides, options_of, sides_of
from motionmind.studio.worker_loop import engine_of
from motionmind.studio.workers import JobCancelledError, WorkerLostError
from motionmind.variation.seams import AbruptJoint, TransitionTest

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio
    from motionmind.studio.workers import Job, Report

_MAX_JOINTS_NAMED = 3
_RETRY_S = 5.0  # after an error


class Question(NamedTuple):
    """A question about a seam, with all that a worker needs to answer it.

    Attributes:
        name: its hash (`question_of`).
        sides: the movement on both sides.
        options: the user's request, as options of the engine.
        wished: whether movement is to be inserted even where the transition is not abrupt.
    """

    name: str
    sides: Sides
    options: dict[str, Any]
    wished: bool


def judge(report: Report, corpus: str, questions: Sequence[Question]) -> list[Finding]:
    """Judge transitions against a corpus.

    `Finding.insertions` is None for a transition that needs an insertion.

    Args:
        report: called with the progress.
        corpus: name of the corpus.
        questions: the questions.
    """
    report(0, len(questions), "checking the seams")
    test = TransitionTest(engine_of(corpus))
    findings = []
    for question in questions:
        a, b, _, _, seconds = question.sides
        try:
            joints = test.abrupt_joints(a, b, seconds)
        except SkeletonError:
            words = f"{displayed(corpus)} and the piece have different bodies: nothing can be inserted"
            findings.append(Finding(question.name, True, words, ()))
            continue
        except MotionMindError as error:
            findings.append(Finding(question.name, True, f"cannot be checked: {_line(error)}", ()))
            continue
        searched = None if joints or question.wished else ()
        findings.append(Finding(question.name, bool(joints), why_abrupt(joints, corpus), searched))
    return findings


def smooth(report: Report, corpus: str, question: Question) -> tuple[list[tuple[Motion, str]], str]:
    """Find movement for a seam.

    Args:
        report: called with the number of alternatives found.
        corpus: name of the corpus.
        question: the question.

    Returns:
        The alternatives with their descriptions, the best first; and the reason if there are none, otherwise "".
    """
    engine = engine_of(corpus)
    a, b, before, after, _ = question.sides
    own = usual_likelihoods(engine)
    distinct: dict[bytes, tuple[Motion, str]] = {}
    first: Motion | None = None
    report(0, MAX_ALTERNATIVES, "smoothing a seam")
    warnings.simplefilter("ignore", MotionMindWarning)  # the description says what goes beyond the corpus
    try:
        tweens = find(engine, a, b, MAX_ALTERNATIVES, before=before, after=after, **question.options)
        for number, tween in enumerate(tweens, start=1):
            if tween.path.tobytes() not in distinct:
                distinct[tween.path.tobytes()] = tween.motion, account(tween, engine.corpus, own, first).line()
                first = first or tween.motion
            report(number, MAX_ALTERNATIVES, "smoothing a seam")
    except MotionMindError as error:
        wished = isinstance(error, NoPathError) and question.options.keys() - {"duration"}
        impossible = "no movement meets all wishes: drop a posture, a hand or a foot"
        return [], impossible if wished else f"no movement found: {_line(error)}"
    return list(distinct.values()), ""


def why_abrupt(joints: tuple[AbruptJoint, ...], corpus: str) -> str:
    """Describe, for a choreographer, what makes a transition abrupt."""
    if not joints:
        return f"seen in {displayed(corpus)}"
    worst = sorted(joints, key=lambda one: -one.degrees)
    fast = [one.joint.replace("_", " ") for one in worst if one.fast]
    unseen = [one.joint.replace("_", " ") for one in worst if not one.fast]
    said = [f"too fast: {enumerated(fast, _MAX_JOINTS_NAMED)}"] if fast else []
    return "; ".join(
        said + ([f"not seen in {displayed(corpus)}: {enumerated(unseen, _MAX_JOINTS_NAMED)}"] if unseen else [])
    )


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def _reason(error: Exception) -> str:
    """Return an error of the background work in a line."""
    if isinstance(error, MotionMindError):
        return _line(error).removeprefix("not done: ")
    if isinstance(error, MemoryError):
        return "not enough memory"
    return f"{type(error).__name__}: {_line(error)}"


class Smoother:
    """Keeps a project's seams judged and smoothed.

    Args:
        studio: the studio that owns the project.
    """

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._changed = asyncio.Event()
        self._changed.set()
        self._state = studio.project.state
        self._seen: dict[str, int] = {}  # when each question first came up
        self._lost: set[str] = set()  # questions on which a worker process died
        self._job: Job | None = None
        self._trouble = ""  # the notice of what is wrong
        studio.project.subscribe(self._look)

    def _look(self) -> None:
        """Note an edit; a new finding is not an edit."""
        if self._studio.project.state is not self._state:
            self._state = self._studio.project.state
            self.go_on()

    def go_on(self) -> None:
        """Resume judging and smoothing."""
        self._studio.tell_of_smoothing(has_stopped=False)
        self._changed.set()

    def stop(self) -> None:
        """Stop until the next edit; findings stay."""
        self._studio.tell_of_smoothing(has_stopped=True)
        if self._job is not None:
            self._job.cancel()

    async def run(self) -> None:
        """Judge and smooth after each edit, forever."""
        while True:
            await self._changed.wait()
            while self._changed.is_set():
                self._changed.clear()
                await asyncio.sleep(0.15)  # until no edit follows
            try:
                is_busy = True
                while is_busy and not self._studio.has_stopped:
                    is_busy = await self._step()
                    if not self._studio.has_stopped:
                        self._report("")
            except JobCancelledError:
                pass
            except Exception as error:  # whatever it is, smoothing goes on
                await self._wait(error)
                self._changed.set()

    async def _step(self) -> bool:
        """Judge all new seams of one corpus, or else smooth the newest abrupt one; return whether there was any."""
        project = self._studio.project
        open_seams: dict[str, tuple[Seam, Finding | None]] = {}
        for seam in project.state.seams:
            if seam.goes_on or project.lacks(seam):
                continue
            if (finding := project.finding(seam)) is None or finding.insertions is None:
                open_seams[project.question(seam)] = seam, finding
        for name in open_seams:
            self._seen.setdefault(name, len(self._seen))
        new = {name: seam for name, (seam, finding) in open_seams.items() if finding is None}
        if new:
            corpus = project.corpus_at(next(iter(new.values())))
            await self._judge(corpus, {name: seam for name, seam in new.items() if project.corpus_at(seam) == corpus})
            return True
        if not open_seams:
            return False
        newest = max(open_seams, key=self._seen.__getitem__)
        seam, judged = open_seams[newest]
        assert judged is not None
        await self._smooth(project.corpus_at(seam), self._asked(newest, seam), judged)
        return True

    async def _judge(self, corpus: str, seams: dict[str, Seam]) -> None:
        questions = []
        for name, seam in seams.items():
            try:
                questions.append(self._asked(name, seam))
            except MotionMindError as error:  # different bodies, or an unknown joint
                self._studio.project.keep_finding(Finding(name, True, f"cannot be joined: {_line(error)}", ()))
        if not questions:
            return
        try:
            findings = await self._result("seams", judge, corpus, questions)
        except JobCancelledError:
            raise
        except MotionMindError as error:
            if isinstance(error, WorkerLostError) and not self._lost.issuperset(seams):  # try them once more
                self._lost.update(seams)
                return
            self._studio.tell_of_smoothing(has_stopped=True)
            self._report(f"the seams cannot be checked: {_line(error)}")
            return
        for finding in findings:
            await self._kept(partial(self._studio.project.keep_finding, finding))

    async def _smooth(self, corpus: str, question: Question, judged: Finding) -> None:
        try:
            alternatives, failure = await self._result("seam", smooth, corpus, question)
        except JobCancelledError:
            raise
        except WorkerLostError as error:
            if question.name not in self._lost:  # the seam may not be at fault: try it once more
                self._lost.add(question.name)
                return
            alternatives, failure = [], _line(error)
        except MotionMindError as error:
            alternatives, failure = [], _line(error)

        def keep() -> None:
            found = tuple(
                Found(self._studio.movements.keep(motion), float(motion.times[-1] - motion.times[0]), words)
                for motion, words in alternatives
            )
            finding = msgspec.structs.replace(judged, insertions=found, words=failure or judged.words)
            self._studio.project.keep_finding(finding)

        await self._kept(keep)

    async def _kept(self, write: Callable[[], object]) -> None:
        """Write results; while that fails, as on a full disk, try again, instead of searching again."""
        while not self._studio.has_stopped:
            try:
                write()
                return
            except Exception as error:
                await self._wait(error)
        raise JobCancelledError("smoothing was stopped")

    async def _wait(self, error: Exception) -> None:
        """Report an error, and wait until the next try."""
        self._report(f"smoothing waits, and tries again every {_RETRY_S:g} s: {_reason(error)}")
        await asyncio.sleep(_RETRY_S)

    def _report(self, trouble: str) -> None:
        """Show what is wrong, in place of what was; "" if nothing is."""
        if trouble != self._trouble:
            self._studio.project.withdraw(self._trouble)
            self._trouble = trouble
            if trouble:
                self._studio.project.notice(trouble)

    def _asked(self, name: str, seam: Seam) -> Question:
        movement, ask = self._studio.movements.get, seam.verdict.ask
        sides = sides_of(seam.ends, movement, self._studio.movements.facing(self._studio.project.corpus_at(seam)))
        skeleton = sides.a.skeleton
        return Question(name, sides, options_of(ask, skeleton, movement), ask != Ask())

    async def _result(self, kind: str, function: Callable[..., Any], *arguments: Any) -> Any:
        """Return the result of a job; raise JobCancelledError if it was cancelled, MotionMindError if it failed."""
        self._job = self._studio.workers.submit(kind, function, *arguments)
        try:
            return await self._job.result()
        finally:
            self._job = None


_smoothers: WeakKeyDictionary[Studio, Smoother] = WeakKeyDictionary()


def smoother_of(studio: Studio) -> Smoother:
    """Return the smoother of a studio's project."""
    if studio not in _smoothers:
        _smoothers[studio] = Smoother(studio)
    return _smoothers[studio]


async def keep_smooth(studio: Studio) -> None:
    """Keep the seams of a studio's project judged and smoothed, forever."""
    await smoother_of(studio).run()


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes that stop and resume smoothing."""

    async def go_on(_: Request) -> Response:
        smoother_of(studio).go_on()
        return api.json({})

    async def stop(_: Request) -> Response:
        smoother_of(studio).stop()
        return api.json({})

    return [Route("/api/seams", go_on, methods=["POST"]), Route("/api/seams", stop, methods=["DELETE"])]
