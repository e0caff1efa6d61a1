"""The report of a tween: one schema for writing and reading."""

from __future__ import annotations

import json
import os
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from motionmind.arguments import check_path
from motionmind.credits.ledger import Ledger
from motionmind.errors import FormatError
from motionmind.files import FilePath, read_bytes
from motionmind.learned.plausibility import Sighting
from motionmind.search.length import LengthChoice
from motionmind.solver.residual import Residual
from motionmind.tween.accents import Accented
from motionmind.tween.certificate import Bridge, Source, Wait
from motionmind.tween.pacing import Tempo
from motionmind.tween.reaches import Reached, Stayed
from motionmind.tween.travel import Travelled
from motionmind.tween.what_if import WhatIf


class PassedPosture(msgspec.Struct, frozen=True):
    """A posture to pass through: the move at which the path passes it, and each joint's angle to its state, degrees."""

    move: int
    snap_degrees: dict[str, float]


class ReportedCosts(msgspec.Struct, frozen=True):
    """The parts of the cost, nats: each joint's moves [T][L], its coordination [T][L], the price of a move, and each
    joint's departure from the corpus walks [T][L]."""

    moves: list[list[float]]
    coordination: list[list[float]]
    per_move: float
    guide: list[list[float]]


class TweenReport(msgspec.Struct, frozen=True, kw_only=True):
    """Everything about a tween except its movement. Rows are by move or posture, then by joint.

    Attributes:
        asked: the request, see `TweenRequest`; `before` and `after` are the seconds of movement given before A and
            after B, or null.
        status: "optimal", "bounded", "interrupted" or "sampled".
        cost: cost of the path, nats; the `costs` add up to it.
        lower_bound: no path that fulfils the request costs less, nats.
        gap: (cost - lower bound) / cost.
        moves: number of moves T.
        length: how that number was chosen, from the costs of paths without the guide; null if it was given.
        tempo: comparison of the timing with the corpus's.
        expansions: nodes that A* expanded.
        peak_nodes: greatest number of nodes that A* held.
        node_budget: number of nodes that A* was allowed to hold.
        seconds: measured seconds for each step.
        joints: names of the joint chains [L].
        parts: body part of each joint chain, such as "left arm" [L].
        path: states [T + 1][L].
        attested: share of the path's moves of joints that the corpus attests.
        motion_attested: share of the motion's own transitions that the corpus attests, between the joints' states at
            the times of the moves, as `measure` counts them; null if nothing moves.
        bridges: moves that the corpus does not attest.
        waits: moves spent waiting at the goal.
        differs: share of the joints' states between A and B that differ from each tween in `unlike`.
        what_if: cost of each restriction, if requested.
        vias: postures to pass through.
        snap_degrees: angle of each joint to its state in A and in B.
        path_degrees: "mean" and "most" angle between the motion and the path's states between A and B; empty if there
            are none.
        followed: whether the motion is within the tolerance of each joint's state at each move [T + 1][L].
        sources: a place in the corpus that attests each joint's move; null if there is none, or the motion is not
            within the tolerance of both states [T][L].
        detail: places in the corpus of the passage that the motion follows, one for each tenth of a second.
        left_out: approximate share of the corpus walks that begin or end in postures represented by others; 0 for a
            small corpus.
        gave: the largest residual of each term of the synthesis (balance, gravity, joint limits...), with its unit and
            its time in seconds.
        reached: how near the motion comes to each requested place.
        accented: how far each accent is from its count.
        travelled: how near it keeps to the requested path and place of B; null if none was requested.
        stayed: how far each joint that stays in its place drifts.
        shown: the motion's greatest "balance", "bounce", "flight", "crossed_limbs" and "pace" beside the corpus's.
        times: times of the moves [T + 1], seconds.
        names: names of the states [T + 1][L].
        degrees: angle of each joint's move [T][L].
        changes: each joint's move in words: "to second" by the new state's name, "toward flexion" without one; "" if
            still [T][L].
        likelihood: P(next state | state) of each joint's move; 0 if unattested [T][L].
        costs: the parts of the cost.
        credits: the sources of the movement, by share.
        motion_sha256: hash of the movement's file, written with the report; null if there is none.

    >>> from motionmind import Engine, read_report
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> import json
    >>> from pathlib import Path
    >>> tween = engine.tween(motion.posture(0), motion.posture(3), moves=3)
    >>> _ = Path("report.json").write_text(json.dumps(tween.report()))
    >>> read_report("report.json").moves
    3
    """

    asked: dict[str, Any] = {}
    status: str
    cost: float
    lower_bound: float
    gap: float
    moves: int
    length: LengthChoice | None
    tempo: Tempo
    expansions: int
    peak_nodes: int
    node_budget: int
    seconds: dict[str, float]
    joints: list[str]
    parts: list[str]
    path: list[list[int]]
    attested: float
    motion_attested: float | None
    bridges: list[Bridge]
    waits: list[Wait]
    differs: list[float]
    what_if: list[WhatIf]
    vias: list[PassedPosture]
    snap_degrees: dict[str, dict[str, float]]
    path_degrees: dict[str, float]
    followed: list[list[bool]]
    sources: list[list[Source | None]]
    detail: list[Source]
    left_out: float
    gave: list[Residual]
    reached: list[Reached] = []
    accented: list[Accented] = []
    travelled: Travelled | None = None
    stayed: list[Stayed] = []
    shown: dict[str, Sighting]
    times: list[float]
    names: list[list[str]]
    degrees: list[list[float]]
    changes: list[list[str]]
    likelihood: list[list[float]]
    costs: ReportedCosts
    credits: Ledger
    motion_sha256: str | None

    def __post_init__(self) -> None:
        """Check that every table has one row per move or posture, and every row one entry per joint."""
        moves, joints = len(self.path) - 1, len(self.joints)
        tables: list[tuple[Sequence[Sequence[object]], int]] = [(self.path, moves + 1), (self.names, moves + 1)]
        tables.append((self.followed, moves + 1))
        costs = (self.costs.moves, self.costs.coordination, self.costs.guide)
        tables += [(table, moves) for table in (self.sources, self.degrees, self.changes, self.likelihood, *costs)]
        tables.append(([self.parts], 1))
        if any(len(table) != rows or any(len(row) != joints for row in table) for table, rows in tables):
            raise ValueError(f"its tables are not of {moves} moves of {joints} joints")
        if moves < 0 or len(self.times) != moves + 1:
            raise ValueError(f"it has {len(self.path)} postures and {len(self.times)} times")


class NoPathReport(msgspec.Struct, frozen=True):
    """The report of a request without a path: the reason in words, and as plain values if joints move independently."""

    status: Literal["no path"]
    message: str
    diagnosis: dict[str, Any] | None


def plain(report: TweenReport) -> dict[str, Any]:
    """Return a report as plain values for JSON, in the order of its fields."""
    values: dict[str, Any] = msgspec.to_builtins(report, enc_hook=np.generic.item)
    return values


def encode_report(report: TweenReport) -> bytes:
    """Return a report as the JSON of its file."""
    return f"{json.dumps(plain(report))}\n".encode()


def read_report(path: FilePath) -> TweenReport:
    """Read the report of a tween.

    Raises:
        FormatError: the file does not exist or is not the report of a tween; the message gives the reason.

    >>> from motionmind import Engine, read_report
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> import json
    >>> from pathlib import Path
    >>> tween = engine.tween(motion.posture(0), motion.posture(3), moves=3)
    >>> _ = Path("report.json").write_text(json.dumps(tween.report()))
    >>> read_report("report.json").status
    'optimal'
    """
    found = read_any_report(path)
    if isinstance(found, NoPathReport):
        raise FormatError("is no report of a tween: it says why none was found", path=path)
    return found


def read_any_report(path: FilePath) -> TweenReport | NoPathReport:
    """Read the report of a tween, or of a request without a path; arguments and errors as for `read_report`."""
    check_path("path", path)
    text = read_bytes(path)
    try:
        return msgspec.json.decode(text, type=NoPathReport)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        pass  # the usual case
    try:
        return msgspec.json.decode(text, type=TweenReport)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise FormatError(_fault(error, Path(os.fsdecode(path))), path=path) from error


def _fault(error: Exception, path: Path) -> str:
    """Describe the fault of a report, and how to write one without overwriting a file that is not a report."""
    lacks = "Object missing required field"
    fault = str(error)
    if not fault.startswith(lacks):
        return f"is no report of a tween: {fault}"
    if "`status`" in fault:  # as movement does
        what = f"is no report of a tween: {fault.replace(lacks, 'there is no key')}; tween writes one"
        path = path.with_name(f"{path.stem}-report.json")
    else:
        what = "a tween report of an earlier version; make it again"
    return f"{what}: motionmind tween A B --corpus NAME --report {shlex.quote(os.fspath(path))}"
