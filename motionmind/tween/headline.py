"""Summarise a tween in one line, and list its visible flaws."""

from __future__ import annotations

import math
from collections import Counter

from motionmind.body.contact import feet_that_stay, find_feet
from motionmind.body.motion import Motion
from motionmind.body.noticeable import NOTICEABLE_BRIDGE_DEG
from motionmind.body.plausibility import at_rate, floor_of
from motionmind.display import displayed
from motionmind.errors import enumerated
from motionmind.learned.plausibility import Sighting
from motionmind.tween.certificate import Bridge
from motionmind.tween.result import Tween

# By measure: a message with the movement's greatest value, the corpus's limit and the body part; the format of both
# values, fine enough to show a noticeable difference; and their factor.
_MEASURE_WORDS = {
    "balance": ("leans {0} cm beyond its support, at most {1} cm in the corpus", ".0f", 100.0),
    "bounce": ("bounces: the centre of mass accelerates at {0} m/s^2, at most {1} in the corpus", ".0f", 1.0),
    "flight": ("floats: {0} of gravity is missing in the air, at most {1} in the corpus", ".0%", 1.0),
    "crossed_limbs": ("limbs intersect by {0} cm, at most {1} cm in the corpus", ".0f", 100.0),
    "sliding": ("feet slide: one moves near the floor for {0} of a second, at most {1} in the corpus", ".0%", 1.0),
    "pace": ("{2} is {0}x as fast as fast movement of the corpus, at most {1}x in the corpus", ".2f", 1.0),
}
# Messages for residuals of the solve, and the thresholds of visibility in centimetres and degrees.
_RESIDUAL_WORDS = {
    "Contacts": ("a support is {0:.0f} cm off its place at {1:.1f} s", 4.0),
    "Floor": ("a body part is {0:.0f} cm under the floor at {1:.1f} s", 2.0),
    "Limits": ("a joint is {0:.0f} degrees beyond its limit at {1:.1f} s", 8.0),
}


def headline(tween: Tween) -> str:
    """Summarise a tween in a line: length, proof of the path, how much of it the motion follows, and what is attested.

    The path and the motion have separate sentences: a proof holds for the path alone.

    >>> from motionmind import Engine
    >>> from motionmind.tween.headline import headline
    >>> engine = Engine.load("ballet")
    >>> motion = engine.corpus.motion(engine.corpus.clips[0])
    >>> for sentence in headline(engine.tween(motion.posture(0), motion.posture(3))).split(". "):
    ...     print(sentence)
    5 moves, 2.0 s
    Path proven optimal, all from ballet
    Motion reaches 85% of the path's joint states; 97% of the motion's transitions occur in ballet
    """
    if tween.moves == 0:
        return "no move: A and B are the same posture"
    length = f"{_count(tween.moves, 'move')}, {tween.motion.times[-1]:.1f} s"
    reached = f"Motion reaches {reached_share(tween):.0%} of the path's joint states"
    return f"{length}. {_proof(tween)}, {_origin(tween)}. {reached}; {attestation(tween)}"


def reached_share(tween: Tween) -> float:
    """Return the share of joint states between A and B, which are exact, that the motion comes near; 1 for none."""
    return float(tween.followed[1:-1].mean()) if tween.moves > 1 else 1.0


def beyond(tween: Tween) -> list[str]:
    """List, one per line, the ways in which a tween exceeds everything in the corpus and makes a viewer wince."""
    flaws = [shown_beyond(name, one) for name, one in tween.shown.items() if one.is_beyond]
    flaws += [
        _RESIDUAL_WORDS[one.term][0].format(one.most, one.at)
        for one in tween.gave
        if one.most > _RESIDUAL_WORDS.get(one.term, ("", math.inf))[1]
    ]
    flaws += [str(one) for one in tween.reached if not one.is_met]
    flaws += [str(one) for one in tween.accented if not one.is_met]
    flaws += [f"travels {tween.travelled}"] if tween.travelled and not tween.travelled.is_met else []
    flaws += [str(one) for one in tween.stayed if not one.is_met]
    followed = [bridge for bridge in tween.bridges if _is_followed(tween, bridge)]
    far = max(followed, key=lambda bridge: bridge.degrees, default=None)
    if far is not None and far.degrees >= NOTICEABLE_BRIDGE_DEG:
        seconds = tween.motion.insertions[0].times[far.move] - tween.motion.times[0]
        flaws.append(f"{displayed(far.joint)} turns by {far.degrees:.0f} degrees at {seconds:.1f} s, as in no clip")
    return flaws


def _is_followed(tween: Tween, bridge: Bridge) -> bool:
    """Return whether the motion follows a bridge of the path: only then does a viewer see it."""
    chain = tween.joints.index(bridge.joint)
    return bool(tween.followed[bridge.move : bridge.move + 2, chain].all())


def shown_beyond(name: str, one: Sighting) -> str:
    """Describe a measure that noticeably exceeds the corpus's limit.

    Args:
        name: name of the measure, one of `motionmind.learned.plausibility.MEASURES`.
        one: the movement's value, which is beyond the limit.
    """
    words, form, factor = _MEASURE_WORDS[name]
    value, most = (format(factor * (number or 0.0), form) for number in (one.value, one.most))
    return words.format(value, most, displayed(one.part))


def attestation(tween: Tween) -> str:
    """Describe how much of the motion the corpus attests: "90% of the motion's transitions occur in ballet"."""
    if tween.motion_attested is None:
        return "nothing moves"
    return f"{tween.motion_attested:.0%} of the motion's transitions occur in {_corpora(tween)}"


def _origin(tween: Tween) -> str:
    """Describe where the path's transitions come from: "all from ballet except 2 transitions of neck"."""
    origin = f"all from {_corpora(tween)}"
    if not tween.bridges:
        return origin
    joints = enumerated(dict.fromkeys(displayed(bridge.joint) for bridge in tween.bridges), 3)
    return f"{origin} except {_count(len(tween.bridges), 'transition')} of {joints}"


def _corpora(tween: Tween) -> str:
    """Name the corpora that attest the path, the most frequent first."""
    times = Counter(source.corpus for row in tween.sources for source in row if source is not None)
    return enumerated((displayed(name) for name, _ in times.most_common()), 3) or "the corpus"


def _proof(tween: Tween) -> str:
    """Describe the proof of the cost."""
    rivals = " among paths that differ this much" * bool(tween.differs)
    if tween.status == "sampled":
        return "Path sampled"
    if tween.status == "optimal":
        return f"Path proven optimal{rivals}"
    ended = " (interrupted)" * (tween.status == "interrupted")
    if tween.lower_bound <= 0.0:
        return f"Path without a proven bound{ended}"
    percent = math.ceil(100.0 * (tween.cost / tween.lower_bound - 1.0) - 1e-6)
    return f"Path at most {percent}% above the optimum{rivals}{ended}"


def feet_staying(motion: Motion) -> list[str]:
    """List the feet that stay in place, if any."""
    feet = [motion.skeleton.names[joint] for joint in find_feet(motion.skeleton)]
    if len(motion) < 2 or not feet:
        return []
    sampled = at_rate(motion)
    where = sampled.skeleton, sampled.rotations, sampled.root
    staying = [foot for foot, stays in zip(feet, feet_that_stay(*where, floor_of(*where)), strict=True) if stays]
    if not staying:
        return []
    if len(staying) == len(feet):
        return [f"{'both' if len(feet) == 2 else f'all {len(feet)}'} feet stay in place"]
    side = staying[0].partition("_")[0]
    if len(feet) == 2 and side in ("left", "right"):
        return [f"the {side} foot stays in place"]
    return [f"{len(staying)} of {len(feet)} feet stay in place"]


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
