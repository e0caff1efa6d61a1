"""A report in words: what each joint does in each move, how likely that is, where it was seen, what it costs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import msgspec

from motionmind.errors import FormatError
from motionmind.files import FilePath, read_bytes


class Seen(msgspec.Struct, frozen=True):
    """Where a move was seen; attributes as of `tween.Source`."""

    clip: str
    posture: int
    corpus: str
    mirrored: bool
    reversed: bool
    seconds: float


class At(msgspec.Struct, frozen=True):
    """A joint's move, of those that no corpus attests or that wait."""

    joint: str
    move: int


class Costs(msgspec.Struct, frozen=True):
    """What was paid for, nats; attributes as of `account.Account`."""

    moves: list[list[float]]
    coordination: list[list[float]]
    per_move: float


class Report(msgspec.Struct, frozen=True):
    """What of a tween's report is told; attributes as of `tween.Tween` and `account.Account`."""

    status: str
    cost: float
    lower_bound: float
    gap: float
    joints: list[str]
    path: list[list[int]]
    bridges: list[At]
    waits: list[At]
    sources: list[list[Seen | None]]
    times: list[float]
    names: list[list[str]]
    degrees: list[list[float]]
    likelihood: list[list[float]]
    costs: Costs

    def __post_init__(self) -> None:
        """Every table has a row a move or a posture, every row an entry a joint."""
        moves, joints = len(self.path) - 1, len(self.joints)
        tables: list[tuple[Sequence[Sequence[object]], int]] = [(self.path, moves + 1), (self.names, moves + 1)]
        costs = (self.costs.moves, self.costs.coordination)
        tables += [(table, moves) for table in (self.sources, self.degrees, self.likelihood, *costs)]
        if any(len(table) != rows or any(len(row) != joints for row in table) for table, rows in tables):
            raise ValueError(f"its tables are not of {moves} moves of {joints} joints")
        if moves < 0 or len(self.times) != moves + 1:
            raise ValueError(f"it has {len(self.path)} postures and {len(self.times)} times")


class Step(msgspec.Struct, frozen=True):
    """What one joint does in one move.

    Attributes:
        joint: its name.
        before: what the state that it leaves is called.
        after: what the state that it arrives in is called.
        moved: whether they differ.
        degrees: the angle between them.
        how: whether the corpus attests it, it waits at its goal, or it is a bridge.
        likelihood: P(state arrived in | state left), as the corpus counts it; 0 where it attests no such move.
        cost: nats for it.
        coordination: nats for the state arrived in beside its parent's.
        source: where it was seen.
    """

    joint: str
    before: str
    after: str
    moved: bool
    degrees: float
    how: Literal["attested", "wait", "bridge"]
    likelihood: float
    cost: float
    coordination: float
    source: Seen | None


class Move(msgspec.Struct, frozen=True):
    """One move: from when to when, seconds; what it costs, nats; and every joint's part in it."""

    move: int
    begins: float
    ends: float
    cost: float
    joints: list[Step]


class Explanation(msgspec.Struct, frozen=True):
    """A tween, move by move; `moved`, `coordinated` and `tolls` are what of the cost goes to joints' moves, to how they
    stand together, and to the number of moves."""

    status: str
    cost: float
    lower_bound: float
    gap: float
    seconds: float
    moved: float
    coordinated: float
    tolls: float
    moves: list[Move]


def read_report(path: FilePath) -> Report:
    """The report of a tween that lies at `path`; FormatError where it is none."""
    try:
        return msgspec.json.decode(read_bytes(path), type=Report)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        fault = str(error).replace("Object missing required field", "there is no key")
        raise FormatError(f"is no report of a tween: {fault}", path=path) from error


def explain(report: Report) -> Explanation:
    """What the report says of each move, with what adds up to the cost."""
    bridged = {(at.joint, at.move) for at in report.bridges}
    waiting = {(at.joint, at.move) for at in report.waits}
    costs, moves = report.costs, []
    for t in range(len(report.path) - 1):
        steps = [
            Step(
                joint,
                report.names[t][j],
                report.names[t + 1][j],
                report.path[t][j] != report.path[t + 1][j],
                report.degrees[t][j],
                "bridge" if (joint, t) in bridged else "wait" if (joint, t) in waiting else "attested",
                report.likelihood[t][j],
                costs.moves[t][j],
                costs.coordination[t][j],
                report.sources[t][j],
            )
            for j, joint in enumerate(report.joints)
        ]
        cost = sum(step.cost + step.coordination for step in steps) + costs.per_move
        moves.append(Move(t + 1, report.times[t], report.times[t + 1], cost, steps))
    return Explanation(
        report.status,
        report.cost,
        report.lower_bound,
        report.gap,
        report.times[-1] - report.times[0],
        sum(map(sum, costs.moves)),
        sum(map(sum, costs.coordination)),
        costs.per_move * len(moves),
        moves,
    )


def plain(explanation: Explanation) -> dict[str, Any]:
    """As plain values for JSON."""
    found: dict[str, Any] = msgspec.to_builtins(explanation)
    return found


def lines(explanation: Explanation) -> Iterator[str]:
    """The explanation as people read it: for each move the joints that move, the farthest first."""
    said = explanation
    count = len(said.moves)
    yield f"{count} move{'s' * (count != 1)} in {said.seconds:.2f} s, {said.status}, gap {said.gap:.2%}"
    yield (
        f"{said.cost:.3f} nats: {said.moved:.3f} for how each joint moves, {said.coordinated:.3f} for how joints stand "
        f"together, {said.tolls:.3f} for the number of moves"
    )
    for move in said.moves:
        yield ""
        yield f"move {move.move}, {move.begins:.2f} to {move.ends:.2f} s, {move.cost:.3f} nats"
        yield from _joints(move)


def _joints(move: Move) -> Iterator[str]:
    """A line for each joint that moves, and one for those that are still, wait, or stand unlikely together."""
    moving = sorted((step for step in move.joints if step.moved), key=lambda step: -step.degrees)
    still = [step for step in move.joints if not step.moved]
    cells = [
        (
            step.joint,
            f"{step.before} -> {step.after}",
            f"{step.degrees:.0f} degrees",
            _chance(step),
            _where(step),
        )
        for step in moving
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    for row in cells:
        yield "  " + "  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip()
    for word, waits in (("still", False), ("waiting", True)):
        joints = [step.joint for step in still if (step.how == "wait") == waits]
        if joints:
            yield f"  {word}: {', '.join(joints)}"
    clips = Counter(_clip(step.source) for step in move.joints if step.source)
    if len(clips) > 1:
        most, times = clips.most_common(1)[0]
        yield f"  most of it from {most} ({times} of {len(move.joints)} joints), {len(clips)} clips in all"
    rarest = max(move.joints, key=lambda step: step.coordination, default=None)
    if rarest and rarest.coordination > 0.0:
        yield f"  least expected beside its parent: {rarest.joint} ({rarest.coordination:.2f} nats)"


def _chance(step: Step) -> str:
    """How likely a move is, and what it costs."""
    likely = f"{step.likelihood:.0%}" if step.likelihood >= 0.005 else f"{step.likelihood:.1g}"
    return f"{likely if step.source else 'never seen'}, {step.cost:.2f} nats"


def _where(step: Step) -> str:
    if step.source is None:
        return "bridge"
    seen = step.source
    return f"{_clip(seen)}, posture {seen.posture} ({seen.seconds:.2f} s)"


def _clip(seen: Seen) -> str:
    """A clip by its corpus and name: "ballet: jump (mirrored, reversed)"."""
    changes = ", ".join(["mirrored"] * seen.mirrored + ["reversed"] * seen.reversed)
    return f"{seen.corpus}: {seen.clip}" + (f" ({changes})" if changes else "")
