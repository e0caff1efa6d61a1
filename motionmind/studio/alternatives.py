"""Find alternatives from one posture to another while the user waits, and describe each in plain words.

A description says how close to optimal the alternative is, how usual its moves are in the corpus, and where the corpus
shows each joint's movement.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any, Literal

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.corpus.corpus import Corpus
from motionmind.display import displayed
from motionmind.errors import MotionMindError
from motionmind.studio.differences import describe_difference, describe_joints
from motionmind.tween.certificate import Source
from motionmind.tween.engine import Engine
from motionmind.tween.headline import attestation, beyond, feet_staying
from motionmind.tween.result import Tween

MAX_ALTERNATIVES = 4
# Proving the last percent takes most of a search's time: four alternatives within 6 % of the best take one or two
# seconds for a typical duration; with proofs they would take six.
COST_GAP_RATIO = 0.06

# Least share of states in which alternatives differ. On ten pairs of ballet's postures, the two most alike of four
# differ by 2.3 degrees in a joint's mean if all follow the best passage, by 8.2 if each follows another one, and by 9.6
# with FAR_SHARE; each pair of postures gives the same order.
FAR_SHARE = 0.8

Spread = Literal["near", "usual", "far"]
How = Literal["seen", "waits", "new", "between"]


class Stretch(msgspec.Struct, frozen=True):
    """A joint's movement for some consecutive moves, from one source.

    Attributes:
        begins: seconds from the beginning of the movement.
        ends: seconds from the beginning.
        how: "seen" if the corpus shows the moves, "waits" if the joint waits, "new" if no clip shows them, "between" if
            the movement does not follow them closely enough to count as seen.
        where: the source in words, such as "adagio at 0:12"; "" without a source.
        key: key of the source movement; "" without a source.
        at: seconds in that movement.
        degrees: angle by which the joint turns.
    """

    begins: float
    ends: float
    how: How
    where: str
    key: str
    at: float
    degrees: float


class Account(msgspec.Struct, frozen=True):
    """An alternative in words.

    Attributes:
        words: summary in one line.
        differs: difference from the first alternative in a dancer's words; "" for the first.
        details: joints in which it differs most, in degrees; "" for the first, or if no difference is visible.
        sure: how close to optimal it is proven to be.
        usual: how usual the movement is.
        beyond: flaws that a viewer may notice, a line each.
        joints: stretches of each joint, by the joint's name in words.
    """

    words: str
    differs: str
    details: str
    sure: str
    usual: str
    beyond: list[str]
    joints: dict[str, list[Stretch]]

    def line(self) -> str:
        """Return the summary, the difference, how usual it is, and the flaws in one line."""
        return "; ".join(part for part in (self.words, self.differs, self.usual, *self.beyond) if part)


def find(
    engine: Engine,
    a: Posture,
    b: Posture,
    count: int = MAX_ALTERNATIVES,
    spread: Spread = "usual",
    **options: Any,
) -> Iterator[Tween]:
    """Find distinct movements from `a` to `b`, the best first, each within `COST_GAP_RATIO` of the best of its kind.

    Args:
        engine: the engine of the corpus.
        a: start posture.
        b: end posture.
        count: how many to find; there are fewer if no other movement differs enough and lasts until the last reach.
        spread: how far the others go from the best: "near" are variants of it, "usual" ones follow other passages of
            the corpus, and "far" ones also differ in `FAR_SHARE` of their states.
        options: further arguments of `Engine.tween`.

    Raises:
        NoPathError: nothing joins the postures.
        MotionMindError: an option is out of its range.
    """
    found = 0
    options = {"within": COST_GAP_RATIO} | ({"differ": FAR_SHARE} if spread == "far" else {}) | options
    try:
        for tween in (partial(_variants, engine) if spread == "near" else engine.alternatives)(a, b, count, **options):
            found += 1
            yield tween
            if tween.moves < 2:
                return  # a single move cannot differ
    except MotionMindError:
        if not found:
            raise


def _variants(engine: Engine, a: Posture, b: Posture, count: int, **options: Any) -> Iterator[Tween]:
    """Find the best movement and variants of it, which follow no other passage; see `find`."""
    found: list[Tween] = []
    while len(found) < count:
        found.append(engine.tween(a, b, unlike=tuple(found), **options))
        yield found[-1]


def account(tween: Tween, corpus: Corpus, own: Floats, first: Motion | None = None) -> Account:
    """Describe an alternative.

    Args:
        tween: the alternative.
        corpus: the corpus of its engine.
        own: `usual_likelihoods` of the corpus [101].
        first: the movement that was found first; None if it is this alternative.
    """
    if tween.moves == 0:
        return Account("no movement: both postures are the same", "", "", "proven the best", "", [], {})
    seconds = float(tween.motion.times[-1] - tween.motion.times[0])
    asked = [*_describe_reaches(tween), *_describe_travel(tween)]
    words = "; ".join([f"{seconds:.1f} s", *asked, *feet_staying(tween.motion)])
    differs, details = "", ""
    if first is not None:
        details = describe_joints(tween.motion, first)
        differs = describe_difference(tween.motion, first) or (
            "much like the first" if details else "almost the same as the first"
        )
    flaws = [line.replace("_", " ") for line in beyond(tween)]
    return Account(
        words,
        differs,
        details,
        _describe_optimality(tween, first is not None),
        _describe_usualness(tween, own),
        flaws,
        _stretches(tween, corpus),
    )


def usual_likelihoods(engine: Engine) -> Floats:
    """Return percentiles [101] of the log-likelihood of the corpus's moves, each the mean over the joints that move."""
    moves, graph = engine.corpus.moves, engine.grammar.transitions
    chosen = np.unique(np.linspace(0, len(moves) - 1, 2000).astype(int))
    states = np.asarray(engine.states)
    before, after = states[moves.begins[chosen]], states[moves.ends[chosen]]
    logs = -graph.weights("conditional")
    means = []
    for row, other in zip(before, after, strict=True):
        edges = [graph.edge(int(chain), int(row[chain]), int(other[chain])) for chain in np.flatnonzero(row != other)]
        if edges:
            means.append(float(np.mean(logs[edges])))
    return np.percentile(means, np.arange(101)) if means else np.zeros(101)


def key_of(source: Source, corpus: Corpus) -> str:
    """Return the key of a source's movement."""
    origin = f"{source.corpus}: " * (source.corpus != corpus.name)
    return f"{corpus.name}/{origin}{source.clip}{' (mirrored)' * source.mirrored}"


def clock(seconds: float) -> str:
    """Return a time as minutes and seconds: 12.4 is "0:12"."""
    minutes, rest = divmod(int(seconds), 60)
    return f"{minutes}:{rest:02}"


def _clip(source: Source, corpus: Corpus) -> str:
    changes = ", ".join(["mirrored"] * source.mirrored + ["backwards"] * source.reversed)
    origin = f"{displayed(source.corpus)}: " * (source.corpus != corpus.name)
    return f"{origin}{displayed(source.clip)}" + (f" ({changes})" if changes else "")


def _describe_reaches(tween: Tween) -> list[str]:
    """Describe how many of the places of hands and feet are met, and how closely; `beyond` lists the others."""
    met, count = [100.0 * one.distance for one in tween.reached if one.is_met], len(tween.reached)
    if not met:
        return []
    which = "the place" if count == 1 else f"{len(met)} of {count} places"
    return [f"reaches {which} to {max(*met, 0.1):.1f} cm"]


def _describe_travel(tween: Tween) -> list[str]:
    """Describe how far it travels, and how far off the drawn path, if within the tolerance; `beyond` has the others."""
    travelled = tween.travelled
    if travelled is None or not travelled.is_met:
        return []
    off = "" if travelled.off is None else f", up to {100.0 * travelled.off:.0f} cm off the path"
    return [f"travels {travelled.length:.1f} m{off}"]


def _describe_optimality(tween: Tween, is_other: bool) -> str:
    """Describe how close to optimal an alternative is proven to be."""
    best = "the best that differs this much" if tween.differs else "the best of its kind" if is_other else "the best"
    if tween.status == "optimal":
        return f"proven {best}"
    percent = max(1, math.ceil(100.0 * (tween.cost / tween.lower_bound - 1.0) - 1e-6)) if tween.lower_bound > 0 else 100
    return f"at most {percent}% worse than {best}" if percent < 100 else "may be far from the best"


def _describe_usualness(tween: Tween, own: Floats) -> str:
    """Describe how usual the path is among the corpus's own moves, and how much of the motion the corpus shows."""
    moved = (tween.path[1:] != tween.path[:-1]) & (tween.costs.likelihood > 0.0)
    seen = attestation(tween).replace("_", " ")
    if not moved.any():
        return seen
    mean = float(np.log(tween.costs.likelihood[moved]).mean())
    word = "usual" if mean >= own[25] else "less usual" if mean >= own[5] else "rare"
    return f"{word}; {seen}"


def _stretches(tween: Tween, corpus: Corpus) -> dict[str, list[Stretch]]:
    """Return the stretches of each joint; moves that are consecutive in one clip make one stretch."""
    bridges = {(bridge.joint, bridge.move) for bridge in tween.bridges}
    waits = {(wait.joint, wait.move) for wait in tween.waits}
    times, degrees = tween.motion.insertions[0].times, tween.costs.degrees
    out: dict[str, list[Stretch]] = {}
    for chain, joint in enumerate(tween.joints):
        stretches: list[Stretch] = []
        last: Source | None = None
        for move in range(tween.moves):
            source = tween.sources[move][chain]
            how: How = "seen" if source else "between"
            if (joint, move) in bridges:
                how = "new"
            elif (joint, move) in waits:
                how, source = "waits", None
            turned = float(degrees[move, chain])
            if (
                stretches
                and how == stretches[-1].how
                and (source is None or (last is not None and _continues(last, source)))
            ):
                stretches[-1] = msgspec.structs.replace(
                    stretches[-1], ends=float(times[move + 1]), degrees=stretches[-1].degrees + turned
                )
            else:
                where = f"{_clip(source, corpus)} at {clock(source.seconds)}" if source else ""
                key, at = (key_of(source, corpus), source.seconds) if source else ("", 0.0)
                stretches.append(Stretch(float(times[move]), float(times[move + 1]), how, where, key, at, turned))
            last = source
        out[displayed(joint).replace("_", " ")] = stretches
    return out


def _continues(one: Source, other: Source) -> bool:
    """Return whether one source directly follows another in the same clip."""
    same = (one.clip, one.corpus, one.mirrored, one.reversed) == (
        other.clip,
        other.corpus,
        other.mirrored,
        other.reversed,
    )
    return same and other.posture - one.posture == (-1 if one.reversed else 1)
