"""Measure how well a corpus knows a posture, joint by joint, and find the nearest posture that it knows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from motionmind._typing import Floats, Ints
from motionmind.body.contact import contact_points
from motionmind.body.motion import Posture
from motionmind.discretize.states import nearest
from motionmind.geometry import rotations as rot
from motionmind.studio.reach import drag, plant, position_of, standing_soles

if TYPE_CHECKING:
    from motionmind.learned.learning import Learned

Known = Literal["seen", "near", "unseen"]


class Memory:
    """The orientations of each joint that occur in a corpus."""

    def __init__(self, learned: Learned) -> None:
        self.corpus, self.space = learned.corpus, learned.space
        chains = len(learned.corpus.skeleton)
        recorded = learned.corpus.to_chains(learned.corpus.rotations)
        self._orientations = []
        for chain in range(chains):
            centres = self.space.of(chain)[np.unique(np.asarray(learned.states[:, chain]))]
            # A user's own state library need not cover everything that was recorded.
            _, cosines = nearest(recorded[:, chain], centres)
            lacking = cosines < np.cos(0.5 * np.radians(self.space.tolerances[chain]))
            self._orientations.append(np.concatenate([centres, recorded[lacking, chain]]))

    def fits(self, posture: Posture) -> bool:
        """Return whether the corpus has the posture's joints."""
        return self.corpus.skeleton.difference(posture.skeleton) is None

    def known(self, posture: Posture) -> list[Known]:
        """Return how well the corpus knows each joint's orientation [J].

        It is "seen" within the tolerance of a recorded orientation, "near" within twice that.
        """
        degrees, _ = self._nearest(posture.rotations)
        limits = self.space.tolerances[: len(degrees)] + 1e-9  # degrees of rounding error
        return [
            "seen" if off <= limit else "near" if off <= 2.0 * limit else "unseen"
            for off, limit in zip(degrees, limits, strict=True)
        ]

    def bring_joints(self, posture: Posture, kept: str | None = None) -> Posture:
        """Return the posture with each joint that is not "seen" turned to its nearest seen orientation.

        Standing feet return to their places, and `kept` to its own, as long as no joint becomes "unseen".

        Args:
            posture: the posture.
            kept: a joint or a heel that keeps its place if possible.
        """
        _, numbers = self._nearest(posture.rotations)
        chains = self.corpus.to_chains(posture.rotations).copy()
        for joint, known in enumerate(self.known(posture)):
            if known != "seen":
                chains[joint] = self._orientations[joint][numbers[joint]]
        found = settle(Posture(posture.skeleton, rot.normalise(self.corpus.from_chains(chains)), posture.root), posture)
        planted = plant(found, posture)
        held = planted
        if kept is not None:
            held = drag(planted, kept, position_of(posture, kept))
        return next((one for one in (held, planted) if "unseen" not in self.known(one)), found)

    def bring_whole(self, posture: Posture) -> tuple[Posture, str, float]:
        """Return the corpus's nearest posture, placed and facing like this one, its clip, and seconds into the clip."""
        corpus, count = self.corpus, len(self.corpus.skeleton)
        mine, theirs = corpus.to_chains(posture.rotations)[:count], corpus.to_chains(corpus.rotations)[:, :count]
        number = int(np.argmin(np.sum(rot.angle(theirs, mine) ** 2, axis=1)))
        rotations = np.array(corpus.rotations[number])
        turn = rot.heading(posture.rotations[0]) - rot.heading(rotations[0])
        rotations[0] = rot.mul(rot.about_vertical(turn), rotations[0])
        clip = corpus.clip_of(number)
        seconds = float(corpus.times[number] - corpus.times[clip.start])
        return settle(Posture(posture.skeleton, rot.normalise(rotations), posture.root), posture), clip.label, seconds

    def _nearest(self, rotations: Floats) -> tuple[Floats, Ints]:
        """Return the degrees to each joint's nearest seen orientation [J], and that orientation's index [J]."""
        chains = self.corpus.to_chains(rotations)
        cosines = np.empty(len(self._orientations))
        numbers = np.empty(len(self._orientations), dtype=np.int64)
        for joint, orientations in enumerate(self._orientations):
            close = np.abs(orientations @ chains[joint])
            numbers[joint] = close.argmax()
            cosines[joint] = close[numbers[joint]]
        return np.degrees(2.0 * np.arccos(np.minimum(cosines, 1.0))), numbers


def settle(posture: Posture, before: Posture) -> Posture:
    """Move a posture to where another one stands: its soles to the place and height of the other's standing soles.

    Without standing soles, the root stays.
    """
    soles = standing_soles(before)
    if len(soles) == 0:
        return posture
    was, _ = contact_points(before.skeleton, before.rotations, before.root)
    now, _ = contact_points(posture.skeleton, posture.rotations, posture.root)
    shift = (was[soles] - now[soles]).mean(axis=0)
    shift[1] = min(0.0, float(was[soles, 1].min())) - now[:, 1].min()
    return Posture(posture.skeleton, posture.rotations, posture.root + shift)
