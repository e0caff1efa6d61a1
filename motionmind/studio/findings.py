"""Findings of the engine at a seam: facts, which undo never removes."""

from __future__ import annotations

import msgspec


class Found(msgspec.Struct, frozen=True):
    """A movement that was found for a seam.

    Attributes:
        key: key of the movement.
        seconds: its duration.
        words: a description for choreographers.
    """

    key: str
    seconds: float
    words: str


class Finding(msgspec.Struct, frozen=True):
    """The engine's answer at a seam.

    Attributes:
        finding: the hash of its question (`question_of`).
        abrupt: whether the transition is abrupt for the corpus.
        words: the reason, or the reason why nothing was found.
        insertions: movements to insert, the best first; None before the search.
    """

    finding: str
    abrupt: bool
    words: str
    insertions: tuple[Found, ...] | None

    def after(self, earlier: Finding | None) -> Finding:
        """Return this finding as it adds to an earlier one of the same question: insertions keep their places.

        Args:
            earlier: the earlier finding; None if there is none.
        """
        if earlier is None or not earlier.insertions:
            return self
        known = {one.key for one in earlier.insertions}
        new = tuple(one for one in self.insertions or () if one.key not in known)
        return msgspec.structs.replace(earlier, insertions=earlier.insertions + new)
