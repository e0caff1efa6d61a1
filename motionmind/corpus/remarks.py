"""Remarks on recordings that a corpus is gathered from: what was assumed, and what a person may want to set right."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from motionmind.corpus.recordings import FLOOR_OFFSET_M, Recording, usually_added
from motionmind.display import displayed, one_line
from motionmind.errors import enumerated
from motionmind.retarget.joint_mapping import describe_unknown_rig, known_rig

_log = logging.getLogger(__name__)


def remark(name: str, own: Sequence[Recording], *, is_rate_given: bool, skip: int = 0) -> None:
    """Log what is assumed of the recordings of a corpus (logger "motionmind.corpus.remarks", level INFO).

    Args:
        name: the corpus's.
        own: its recordings.
        is_rate_given: whether somebody chose the postures a second that are taken of them.
        skip: frames that were dropped at the start of each.
    """
    recorded = [one for one in own if one.rate is not None]
    if recorded and not is_rate_given:
        rate = max(one.rate or 0.0 for one in recorded)
        text = "corpus %s: %g postures a second of each recording (--rate, or rate=, for more or fewer)"
        _log.info(text, name, rate)
    is_known = bool(recorded) and known_rig(recorded[0].body) is not None
    if recorded and not is_known:
        body, why = recorded[0].body, describe_unknown_rig(recorded[0].body)
        _log.info(
            "corpus %s: stays on the recordings' own %d joints: %s (--joints maps them)", name, len(body), one_line(why)
        )
    if added := usually_added(own):
        frames = "a frame" if added == 1 else f"{added} frames"
        text = (
            "corpus %s: most recordings begin with %s of another posture (a T-pose?): built with --skip %d (or skip=) "
        )
        _log.info(text + "it is without", name, frames, skip + added)
    if made := [displayed(one.name) for one in own if one.is_made]:
        text = "corpus %s: %d of %d recordings hold movement that the engine made, learned as if it were recorded: %s"
        _log.info(text, name, len(made), len(own), enumerated(made, 6))
    off = sorted((one for one in recorded if abs(one.floor) > FLOOR_OFFSET_M), key=lambda one: -abs(one.floor))
    if off and is_known:
        where = [
            f"{displayed(one.name)} by {100.0 * abs(one.floor):.0f} cm {'over' if one.floor > 0.0 else 'under'}"
            for one in off
        ]
        text = "corpus %s: feet stand off 0 in %d of %d recordings, whose floor is taken there: %s"
        _log.info(text, name, len(off), len(own), enumerated(where, 3))
