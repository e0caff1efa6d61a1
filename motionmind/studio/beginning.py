"""Begin a project from a variation, with the insertions and decisions at its seams."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from motionmind.display import displayed
from motionmind.studio.edits import Arrange, Block, Decide, Decision, Several
from motionmind.studio.findings import Finding, Found
from motionmind.studio.project import Project
from motionmind.studio.seams import why_abrupt
from motionmind.variation.seams import Candidate
from motionmind.variation.variation import Variation


def corpus_of(variation: Variation) -> str | None:
    """Return the name of the corpus that judged a variation's seams; None if it was not one corpus."""
    names = {transition.corpus for transition in variation.transitions}
    return names.pop() if len(names) == 1 else None


def take_in(project: Project, variation: Variation, window: str) -> None:
    """Make a variation the piece of a project: its stretches, insertions and decisions.

    Insertions are the variation's own, to the bit, if the project's corpus judged them; the project finds others anew.
    All of it is one edit, which one undo takes back.

    Args:
        project: a project without a piece.
        variation: the variation.
        window: the window that makes the edit.

    Raises:
        MotionMindError: it cannot be written.
    """
    key = project.movements.keep(variation.piece.motion)
    cuts = np.flatnonzero(np.diff(variation.postures) != 1) + 1
    frames = variation.piece.frames[variation.postures]
    runs = list(pairwise([0, *cuts.tolist(), len(frames)]))
    blocks = tuple(
        Block(f"b{number}", key, int(frames[start]), int(frames[stop - 1]))
        for number, (start, stop) in enumerate(runs, start=1)
    )
    ends = {stop - 1: number for number, (_, stop) in enumerate(runs)}  # number of each run, by its last posture
    met = {(blocks[ends[seam.at]].id, blocks[ends[seam.at] + 1].id): seam for seam in variation.seams}
    words = f"start from {displayed(variation.piece.motion.name or 'a variation')}"
    decisions: dict[str, Decision] = {"approved": "locked", "discarded": "discarded"}
    decided = [
        Decide(*pair, decisions[seam.decision])
        for pair, seam in met.items()
        if seam.decision in decisions and seam.transition is not None and seam.transition.candidates
    ]
    project.edit(window, Several((Arrange(blocks, {"words": words}), *decided), words))
    for seam in project.state.seams:
        if (judged := met.get(seam.pair)) is None or (transition := judged.transition) is None:
            continue
        if transition.corpus == project.state.corpus and not (transition.is_abrupt and not transition.candidates):
            # The chosen candidate comes first, because the project inserts the first.
            first = judged.chosen - 1
            candidates = transition.candidates
            order = [*candidates[first : first + 1], *candidates[:first], *candidates[first + 1 :]]
            found = tuple(_found(project, one, transition.corpus) for one in order)
            why = why_abrupt(transition.abrupt_joints, transition.corpus)
            project.keep_finding(Finding(project.question(seam), transition.is_abrupt, why, found))


def _found(project: Project, candidate: Candidate, corpus: str) -> Found:
    seconds = float(candidate.motion.times[-1] - candidate.motion.times[0])
    unseen = len({bridge.joint for bridge in candidate.bridges})
    words = f"{f'{unseen} joints move as never' if unseen else 'every move'} seen in {displayed(corpus)}"
    return Found(project.movements.keep(candidate.motion), seconds, words)
