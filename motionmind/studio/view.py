"""The page's view of a piece, as plain values for JSON."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import msgspec

from motionmind.studio.asks import Ask
from motionmind.studio.findings import Finding, Found
from motionmind.studio.neighbours import Seam, key_of
from motionmind.studio.piece import State
from motionmind.studio.placement import Layout, Marks, Part, lay_out

SeamState = Literal["smooth", "abrupt", "waiting", "inserted", "discarded", "none found"]
Findings = Callable[[Seam], Finding | None]  # returns the finding at a seam; None if there is none yet
Standing = Callable[[Seam], Found | None]  # returns the insertion from before a seam's latest request


def state_of(seam: Seam, finding: Finding | None) -> SeamState:
    """Return the state of a seam."""
    if seam.goes_on:
        return "smooth"
    if finding is None:
        return "waiting"
    if finding.insertions:
        return "discarded" if seam.verdict.decision == "discarded" else "inserted"
    if finding.insertions is None:
        return "abrupt" if finding.abrupt else "waiting"
    return "none found" if finding.abrupt or seam.verdict.ask != Ask() else "smooth"


def chosen_at(seam: Seam, finding: Finding | None) -> Found | None:
    """Return the insertion at a seam; None if there is none."""
    if finding is None or not finding.insertions or state_of(seam, finding) != "inserted":
        return None
    return finding.insertions[min(seam.verdict.chosen, len(finding.insertions)) - 1]


def layout_of(state: State, findings: Findings, marks: Marks, standing: Standing = lambda _: None) -> Layout:
    """Place a piece's parts by the findings at its seams; an earlier insertion stays until a request is answered."""

    def insertion(seam: Seam) -> str | None:
        finding = findings(seam)
        is_sought = state_of(seam, finding) in ("waiting", "abrupt")
        found = standing(seam) if is_sought else chosen_at(seam, finding)
        return found.key if found else None

    return lay_out(state, insertion, marks)


def view_of(
    state: State,
    findings: Findings,
    marks: Marks,
    title: Callable[[str], str],
    standing: Standing = lambda _: None,
) -> dict[str, Any]:
    """Return `piece` of the project's JSON: its duration, parts, blocks, seams and notes.

    Args:
        state: the piece.
        findings: returns the finding at a seam.
        marks: marks of the movements.
        title: returns a movement's title by its key.
        standing: returns the insertion that stays at a seam until its request is answered.
    """
    layout = layout_of(state, findings, marks, standing)
    notes = noted(state, layout, marks)
    blocks = [
        msgspec.structs.asdict(block)
        | {
            "key": key_of(block),
            "title": title(block.source),
            "frames": marks.length(key_of(block)) if (here := marks.has(key_of(block), block.last)) else block.last + 1,
            "missing": not here,
            "at": part.at,
            "once": part.seconds,
            "seconds": end - part.at,
        }
        for block, part, end in zip(state.blocks, layout.blocks, layout.ends, strict=True)
    ]
    seams = [
        _seam_view(seam, number, findings(seam), insertion, gap)
        for number, (seam, insertion, gap) in enumerate(
            zip(state.seams, layout.insertions, layout.gaps, strict=True), start=1
        )
    ]
    parts = [msgspec.to_builtins(part) for part in layout.parts if marks.has(part.key, part.last)]
    return {"seconds": layout.seconds, "parts": parts, "blocks": blocks, "seams": seams, "notes": notes}


def noted(state: State, layout: Layout, marks: Marks) -> list[dict[str, Any]]:
    """Return the notes in order of time: their fields, `at` in the piece and `seconds`, for which a section lasts."""
    ends = [*(part.at for part in layout.blocks[1:]), layout.seconds]
    places = {block.id: place for place, block in enumerate(state.blocks)}
    found = []
    for note in state.notes.values():
        at = 0.0
        if (place := places.get(note.block)) is not None:
            block, part = state.blocks[place], layout.blocks[place]
            if block.first <= note.frame <= block.last:
                own = [marks.at(key_of(block), frame).time for frame in (block.first, note.frame)]
                at = min(part.at + own[1] - own[0] + note.after, ends[place])
            else:  # trimmed away
                at = part.at + (part.seconds if note.frame > block.last else 0.0)
        found.append(msgspec.structs.asdict(note) | {"at": at, "seconds": 0.0})
    found.sort(key=lambda note: (note["at"], note["id"]))
    end = layout.seconds
    for note in reversed(found):
        if note["kind"] == "section":
            note["seconds"], end = max(end - note["at"], 0.0), note["at"]
    return found


def _seam_view(
    seam: Seam, number: int, finding: Finding | None, insertion: Part | None, gap: tuple[float, float]
) -> dict[str, Any]:
    begin, end = gap
    found = finding.insertions if finding is not None else None
    return {
        "left": seam.left.id,
        "right": seam.right.id,
        "number": number,
        "state": state_of(seam, finding),
        "words": "continues as recorded" if seam.goes_on else finding.words if finding is not None else "",
        "chosen": min(seam.verdict.chosen, len(found)) if found else seam.verdict.chosen,
        "alternatives": [msgspec.to_builtins(one) for one in found or ()],
        "decision": seam.verdict.decision,
        "ask": msgspec.to_builtins(seam.verdict.ask),
        "at": begin,
        "stands": insertion is not None,
        "seconds": insertion.seconds if insertion else end - begin,
    }
