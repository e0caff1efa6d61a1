"""Retarget between the body of an order and the corpus's: postures to the corpus, movement back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.motion import Motion, Posture
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Corpus
from motionmind.errors import SkeletonError
from motionmind.retarget.armature import from_human23
from motionmind.retarget.joint_mapping import joint_mapping
from motionmind.retarget.retarget import to_human23

_MAX_COMPARED = 4000  # postures of a corpus to find the nearest among


class Rig:
    """A body and the corpus that moves it.

    Raises:
        SkeletonError: its joints are neither the corpus's nor known, or its zero pose does not stand.
    """

    def __init__(self, skeleton: Skeleton, corpus: Corpus) -> None:
        self.skeleton, self._corpus = skeleton, corpus
        difference = corpus.skeleton.difference(skeleton)
        self._is_same = difference is None
        if difference is None:
            return
        if human23().difference(corpus.skeleton) is not None:
            raise SkeletonError(f"the corpus only moves the skeleton {corpus.skeleton.name}: {difference}")
        if joint_mapping(skeleton) is None:
            own = corpus.skeleton.name
            raise SkeletonError(f"the joints fit neither {own} nor a known rig: {difference}")
        at_rest = np.tile([0.0, 0.0, 0.0, 1.0], (len(skeleton), 1))
        self.to_corpus(Posture(skeleton, at_rest, np.zeros(3)))  # raises if it cannot be retargeted

    def to_corpus(self, posture: Posture) -> Posture:
        """Retarget a posture of the rig to the corpus's joints, with the rig's proportions."""
        return posture if self._is_same else to_human23(posture, up="y")

    def from_corpus(self, motion: Motion, like: Posture) -> Motion:
        """Retarget a motion of the corpus's joints to the rig; joints that the corpus lacks stay as in `like`."""
        return replace(motion, insertions=()) if self._is_same else from_human23(motion, like)

    def nearest(self, like: Posture, given: Floats) -> Floats:
        """Return the rotations [J, 4] of the corpus's posture nearest to `like`, joints weighted by `given` [J]."""
        every = max(1, -(-len(self._corpus.rotations) // _MAX_COMPARED))
        rotations = self._corpus.rotations[::every]
        times = np.arange(len(rotations), dtype=np.float64)
        skeleton = self._corpus.skeleton if self._is_same else self.to_corpus(like).skeleton
        known = Motion(skeleton, rotations, np.zeros((len(rotations), 3)), times)
        turned = self.from_corpus(known, like).rotations
        cosines = np.abs(np.sum(turned * like.rotations, axis=-1))
        apart = np.arccos(np.clip(cosines, 0.0, 1.0)) ** 2 @ given
        return np.asarray(turned[int(apart.argmin())])
