"""Explain a report move by move: each joint's states, likelihood, source and cost."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from itertools import groupby
from typing import Any, Literal

import msgspec

from motionmind.arguments import check_type
from motionmind.body.noticeable import NOTICEABLE_DEG
from motionmind.display import displayed
from motionmind.tween.certificate import Source
from motionmind.tween.report import TweenReport
from motionmind.tween.result import Tween, report_of

_PAGE_ROWS, _MAX_PARTS = 30, 3  # rows of a page for all moves, and for one


class JointStep(msgspec.Struct, frozen=True):
    """One joint's part in one move.

    Attributes:
        joint: the joint's name.
        part: its body part, such as "left arm".
        before: name of the state before the move.
        after: name of the state after it.
        moved: whether the two states differ.
        degrees: angle between them.
        change: the move in words: "to second" by the new state's name, "toward flexion" without one; "" if still.
        how: whether the corpus attests the move, or it is a wait at the goal, or a bridge.
        likelihood: P(next state | state), as counted in the corpus; 0 if it attests no such move.
        cost: cost of the move, nats.
        coordination: cost of the new state given its parent's, nats.
        guide: cost of the new state's departure from the orientation that corpus walks expect, nats.
        followed: whether the motion is within the tolerance of both states.
        source: a place in the corpus that attests the move; None if there is none, or the motion does not follow.
    """

    joint: str
    part: str
    before: str
    after: str
    moved: bool
    degrees: float
    change: str
    how: Literal["attested", "wait", "bridge"]
    likelihood: float
    cost: float
    coordination: float
    guide: float
    followed: bool
    source: Source | None


class ExplainedMove(msgspec.Struct, frozen=True):
    """One move.

    Attributes:
        move: its number, from 1.
        begins: start of the move, seconds from the beginning.
        ends: end of the move, seconds from the beginning.
        cost: its cost, nats.
        joints: every joint's part in it [L].
    """

    move: int
    begins: float
    ends: float
    cost: float
    joints: list[JointStep]


class Explanation(msgspec.Struct, frozen=True):
    """A tween move by move, with the parts that add up to its cost.

    Attributes:
        status: status of the search, as in the report.
        cost: cost of the path, nats.
        lower_bound: proven lower bound of the cost, nats.
        gap: gap between the two, as a share of the cost.
        followed: share of the joints' states between A and B that the motion reaches within the tolerance.
        motion_attested: share of the motion's own transitions that the corpus attests; None if nothing moves.
        seconds: length of the motion.
        moved: part of the cost for the joints' moves, nats.
        coordinated: part of the cost for the coordination of joints, nats.
        guided: part of the cost for departures from the corpus walks, nats.
        tolls: part of the cost for the number of moves, nats.
        moves: the moves.

    >>> from motionmind import Engine, explain
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> explanation = explain(engine.tween(motion.posture(0), motion.posture(3), moves=3))
    >>> str(explanation).splitlines()[0].startswith("3 moves in ")
    True
    """

    status: str
    cost: float
    lower_bound: float
    gap: float
    followed: float
    motion_attested: float | None
    seconds: float
    moved: float
    coordinated: float
    guided: float
    tolls: float
    moves: list[ExplainedMove]

    def plain(self) -> dict[str, Any]:
        """Return the explanation as plain values for JSON."""
        values: dict[str, Any] = msgspec.to_builtins(self)
        return values

    def __str__(self) -> str:
        """Return the explanation as a page of text: for each move, the body parts that turn farthest, and how."""
        return "\n".join(_page(self))

    def details(self) -> str:
        """Return all of the explanation as text: for each move, every joint, its likelihood, cost and source."""
        return "\n".join(_lines(self))


def explain(tween: Tween | TweenReport) -> Explanation:
    """Explain a tween, or its report, move by move.

    >>> from motionmind import Engine, explain
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> explanation = explain(engine.tween(motion.posture(0), motion.posture(3), moves=3))
    >>> len(explanation.moves), explanation.moves[0].joints[0].joint
    (3, 'pelvis')
    """
    check_type("tween", tween, Tween, TweenReport)
    report = tween if isinstance(tween, TweenReport) else report_of(tween)
    costs = report.costs
    moves = []
    for t in range(len(report.path) - 1):
        steps = [_step(report, t, j) for j in range(len(report.joints))]
        cost = sum(step.cost + step.coordination + step.guide for step in steps) + costs.per_move
        moves.append(ExplainedMove(t + 1, report.times[t], report.times[t + 1], cost, steps))
    return Explanation(
        report.status,
        report.cost,
        report.lower_bound,
        report.gap,
        _share_followed(report),
        report.motion_attested,
        report.times[-1] - report.times[0],
        sum(map(sum, costs.moves)),
        sum(map(sum, costs.coordination)),
        sum(map(sum, costs.guide)),
        costs.per_move * len(moves),
        moves,
    )


def _share_followed(report: TweenReport) -> float:
    """Return the share of states between A and B, which are exact, that the motion follows; 1 if there are none."""
    inner = [is_near for row in report.followed[1:-1] for is_near in row]
    return sum(inner) / len(inner) if inner else 1.0


def _step(report: TweenReport, t: int, j: int) -> JointStep:
    """Return joint j's part in move t."""
    joint = report.joints[j]
    is_bridge = any((bridge.joint, bridge.move) == (joint, t) for bridge in report.bridges)
    is_wait = any((wait.joint, wait.move) == (joint, t) for wait in report.waits)
    return JointStep(
        joint,
        report.parts[j],
        report.names[t][j],
        report.names[t + 1][j],
        report.path[t][j] != report.path[t + 1][j],
        report.degrees[t][j],
        report.changes[t][j],
        "bridge" if is_bridge else "wait" if is_wait else "attested",
        report.likelihood[t][j],
        report.costs.moves[t][j],
        report.costs.coordination[t][j],
        report.costs.guide[t][j] if report.costs.guide else 0.0,
        report.followed[t][j] and report.followed[t + 1][j] if report.followed else True,
        report.sources[t][j],
    )


def _page(explanation: Explanation) -> Iterator[str]:
    """Yield the lines of a page: a summary, and for each move the body parts that turn farthest."""
    count = len(explanation.moves)
    proof = "optimal" if explanation.status == "optimal" else f"{explanation.status}, gap {explanation.gap:.1%}"
    line = f"{count} move{'s' * (count != 1)} in {explanation.seconds:.2f} s; path {proof}"
    if explanation.motion_attested is not None:
        line += f"; motion reaches {explanation.followed:.0%} of the path's joint states; "
        line += f"{explanation.motion_attested:.0%} of the motion's transitions attested"
    yield line
    most = max(1, min(_MAX_PARTS, _PAGE_ROWS // max(count, 1)))
    found = [(move, _part_rows(move, most)) for move in explanation.moves]
    width = max([len(part) for _, rows in found for part, _ in rows], default=0)
    for is_still, moves in groupby(found, key=lambda one: not one[1]):
        spans = list(moves)
        if is_still:
            spans = [(msgspec.structs.replace(spans[0][0], ends=spans[-1][0].ends), [("still", "")])]
        for move, rows in spans:
            time = f"{move.begins:.2f} to {move.ends:.2f} s"
            for row, (part, words) in enumerate(rows):
                yield f"{'' if row else time:{len(time)}}  {part:{width}}  {words}".rstrip()


def _part_rows(move: ExplainedMove, most: int) -> list[tuple[str, str]]:
    """Return `most` body parts of a move and the turns of their joints in words, farthest first; then the others."""
    parts: dict[str, list[JointStep]] = {}
    for step in sorted(move.joints, key=lambda step: -step.degrees):
        if step.moved and step.degrees >= NOTICEABLE_DEG:
            parts.setdefault(step.part, []).append(step)
    rows = [(displayed(part), _describe_part(part, steps)) for part, steps in list(parts.items())[:most]]
    return rows + ([("also", ", ".join(map(displayed, list(parts)[most:])))] if len(parts) > most else [])


def _describe_part(part: str, steps: list[JointStep]) -> str:
    """Describe a body part's turns: "elbow 34 degrees to ajar (plies, 2.9 s); shoulder 22"."""
    side = part.partition(" ")[0]
    names = [displayed(step.joint.removeprefix(f"{side}_")) for step in steps]
    first, *others = (f"{name} {step.degrees:.0f}" for name, step in zip(names, steps, strict=True))
    words = f"{first} degrees {displayed(steps[0].change)}".rstrip() + f" ({_evidence(steps[0])})"
    return "; ".join([words, ", ".join(others)]) if others else words


def _evidence(step: JointStep) -> str:
    """Return where a step was recorded, or why it has no source."""
    if step.source is None:
        return "in no clip" if step.how == "bridge" else "not reached in the motion"
    return f"{displayed(step.source.clip)}, {step.source.seconds:.1f} s"


def _lines(explanation: Explanation) -> Iterator[str]:
    count = len(explanation.moves)
    yield (
        f"{count} move{'s' * (count != 1)} in {explanation.seconds:.2f} s, {explanation.status}, "
        f"gap {explanation.gap:.2%}"
    )
    yield (
        f"{explanation.cost:.3f} nats: {explanation.moved:.3f} for the joints' moves, {explanation.coordinated:.3f} "
        f"for their coordination, {explanation.guided:.3f} for departures from the corpus's walks, "
        f"{explanation.tolls:.3f} for the number of moves"
    )
    for move in explanation.moves:
        yield ""
        yield f"move {move.move}, {move.begins:.2f} to {move.ends:.2f} s, {move.cost:.3f} nats"
        yield from _joint_lines(move)


def _joint_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield a line for each moving joint, and lines that list still, waiting and unusually coordinated joints."""
    moving = sorted((step for step in move.joints if step.moved), key=lambda step: -step.degrees)
    still = [step for step in move.joints if not step.moved]
    cells = [
        (
            displayed(step.joint),
            f"{displayed(step.before)} -> {displayed(step.after)}",
            f"{step.degrees:.0f} degrees",
            _likelihood(step),
            _place(step),
        )
        for step in moving
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for row in cells:
        yield "  " + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
    for word, waits in (("still", False), ("waiting", True)):
        joints = [displayed(step.joint) for step in still if (step.how == "wait") == waits]
        if joints:
            yield f"  {word}: {', '.join(joints)}"
    clips = Counter(_clip(step.source) for step in move.joints if step.source)
    if len(clips) > 1:
        most, times = clips.most_common(1)[0]
        yield f"  mostly from {most} ({times} of {len(move.joints)} joints), {len(clips)} clips in all"
    rarest = max(move.joints, key=lambda step: step.coordination, default=None)
    if rarest and rarest.coordination > 0.0:
        yield f"  least expected beside its parent: {displayed(rarest.joint)} ({rarest.coordination:.2f} nats)"


def _likelihood(step: JointStep) -> str:
    """Return the likelihood and the cost of a move."""
    likely = f"{step.likelihood:.0%}" if step.likelihood >= 0.005 else f"{step.likelihood:.1g}"
    return f"{likely if step.likelihood else 'never seen'}, {step.cost:.2f} nats"


def _place(step: JointStep) -> str:
    """Return the place where a move was recorded."""
    if step.source is None:
        return "bridge" if step.how == "bridge" else "wait" if step.how == "wait" else "not reached in the motion"
    mended = ", reconstructed" * step.source.reconstructed
    return f"{_clip(step.source)}, posture {step.source.posture} ({step.source.seconds:.2f} s{mended})"


def _clip(source: Source) -> str:
    """Return the corpus and name of a clip: "ballet: jump (mirrored, reversed)"."""
    changes = ", ".join(["mirrored"] * source.mirrored + ["reversed"] * source.reversed)
    return f"{displayed(source.corpus)}: {displayed(source.clip)}" + (f" ({changes})" if changes else "")
