"""Find alternatives from one posture to another while the user waits, and describe each in plain words.

A description says how close to optimal the alternative is, how usual its moves are in the corpus, and where the corpus
shows each joint's movement.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal

import msgspec
import numpy as np

from motionmind._typing import Floats
from motionmind.body.motion import Motion, Posture
from motionmind.corpus.corpus import Corpus
from motionmind.display import displayed
from motionmind.errors import NoPathError
from motionmind.geometry import rotations as rot
from motionmind.tween.certificate import Source
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond, feet_staying, seen_in
from motionmind.tween.result import Tween

COUNT = 4
# Proving the last percent takes most of a search's time: four alternatives within 6 % of the best take one or two
# seconds for a length that people wait for; with proofs they would take six.
WITHIN = 0.06
_MOVES = 2000  # moves of the corpus, at most, that define usual and rare
_TELLING = 10.0  # degrees: a smaller difference in a joint is hardly another movement
_NAMED = 2  # joints, at most, that a description of a difference names
_USUAL, _RARE = 25.0, 5.0  # percentiles of the corpus's own moves: below them movement is less usual, or rare

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
        differs: difference from the first alternative; "" for the first.
        sure: how close to optimal it is proven to be.
        usual: how usual the movement is.
        beyond: flaws that a viewer may notice, a line each.
        joints: stretches of each joint, by the joint's name in words.
    """

    words: str
    differs: str
    sure: str
    usual: str
    beyond: list[str]
    joints: dict[str, list[Stretch]]


def find(engine: Engine, a: Posture, b: Posture, count: int = COUNT, **options: Any) -> Iterator[Tween]:
    """Find distinct movements from `a` to `b`, the best first, each proven within `WITHIN` of the best of its kind.

    Args:
        engine: the engine of the corpus.
        a: start posture.
        b: end posture.
        count: how many to find; there are fewer if no other movement differs enough.
        options: further arguments of `Engine.tween`.

    Raises:
        NoPathError: nothing joins the postures.
        MotionMindError: an option is out of its range.
    """
    found = 0
    try:
        for tween in engine.alternatives(a, b, count, within=WITHIN, **options):
            found += 1
            yield tween
            if tween.moves < 2:
                return  # a single move cannot differ
    except NoPathError:
        if not found:
            raise


def account(tween: Tween, corpus: Corpus, own: Floats, first: Motion | None = None) -> Account:
    """Describe an alternative.

    Args:
        tween: the alternative.
        corpus: the corpus of its engine.
        own: `usual_likelihoods` of the corpus [101].
        first: the movement that was found first; None if it is this alternative.
    """
    if tween.moves == 0:
        return Account("no movement: both postures are the same", "", "nothing is better", "", [], {})
    seconds = float(tween.motion.times[-1] - tween.motion.times[0])
    words = "; ".join([f"{seconds:.1f} s", *feet_staying(tween.motion)])
    differs = "" if first is None else _differs(tween.motion, first)
    said = [line.replace("_", " ") for line in beyond(tween)]
    return Account(words, differs, _sure(tween), _usual(tween, own), said, _stretches(tween, corpus))


def usual_likelihoods(engine: Engine) -> Floats:
    """Return percentiles [101] of the corpus's own moves' likelihood: the mean ln P over the joints that move."""
    moves, graph = engine.corpus.moves, engine.grammar.transitions
    chosen = np.unique(np.linspace(0, len(moves) - 1, _MOVES).astype(int))
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


def _differs(motion: Motion, first: Motion) -> str:
    """Describe in which joints a movement differs most from the first, by how much, and when."""
    as_far = np.rint(np.linspace(0.0, len(first) - 1, len(motion))).astype(np.intp)
    degrees = np.degrees(rot.angle(motion.rotations, first.rotations[as_far]))
    frame = int(degrees.max(axis=1).argmax())
    most = [int(joint) for joint in np.argsort(-degrees[frame], kind="stable")[:_NAMED]]
    named = [
        f"{displayed(motion.skeleton.names[joint]).replace('_', ' ')} by {degrees[frame, joint]:.0f}°"
        for joint in most
        if degrees[frame, joint] >= _TELLING
    ]
    if not named:
        return "hardly unlike the first"
    return f"unlike the first: {' and '.join(named)}, at {motion.times[frame] - motion.times[0]:.1f} s"


def _sure(tween: Tween) -> str:
    """Describe how close to optimal an alternative is proven to be."""
    kind = "so different" if tween.differs else "of its kind"
    if tween.status == "optimal":
        return f"nothing {kind} is better"
    percent = max(1, math.ceil(100.0 * (tween.cost / tween.lower_bound - 1.0) - 1e-6)) if tween.lower_bound > 0 else 100
    return f"at most {percent}% from the best that is {kind}" if percent < 100 else "not known to be near the best"


def _usual(tween: Tween, own: Floats) -> str:
    """Describe how usual the movement is among the corpus's own moves, and whether the corpus shows all of it."""
    moved = (tween.path[1:] != tween.path[:-1]) & (tween.costs.likelihood > 0.0)
    seen = seen_in(tween).replace("every one", "every move").replace("_", " ")
    if not moved.any():
        return seen
    mean = float(np.log(tween.costs.likelihood[moved]).mean())
    word = "usual" if mean >= own[int(_USUAL)] else "less usual" if mean >= own[int(_RARE)] else "rare"
    return f"{word}; {seen}"


def _stretches(tween: Tween, corpus: Corpus) -> dict[str, list[Stretch]]:
    """Return the stretches of each joint; moves that are consecutive in one clip make one stretch."""
    bridges = {(bridge.joint, bridge.move) for bridge in tween.bridges}
    waits = {(wait.joint, wait.move) for wait in tween.waits}
    times, degrees = tween.motion.insertions[0].times, tween.costs.degrees
    out: dict[str, list[Stretch]] = {}
    for chain, joint in enumerate(tween.joints):
        ways: list[Stretch] = []
        last: Source | None = None
        for move in range(tween.moves):
            source = tween.sources[move][chain]
            how: How = "seen" if source else "between"
            if (joint, move) in bridges:
                how = "new"
            elif (joint, move) in waits:
                how, source = "waits", None
            turned = float(degrees[move, chain])
            if ways and how == ways[-1].how and (source is None or (last is not None and _goes_on(last, source))):
                ways[-1] = msgspec.structs.replace(
                    ways[-1], ends=float(times[move + 1]), degrees=ways[-1].degrees + turned
                )
            else:
                where = f"{_clip(source, corpus)} at {clock(source.seconds)}" if source else ""
                key, at = (key_of(source, corpus), source.seconds) if source else ("", 0.0)
                ways.append(Stretch(float(times[move]), float(times[move + 1]), how, where, key, at, turned))
            last = source
        out[displayed(joint).replace("_", " ")] = ways
    return out


def _goes_on(one: Source, other: Source) -> bool:
    """Return whether one source directly follows another in the same clip."""
    same = (one.clip, one.corpus, one.mirrored, one.reversed) == (
        other.clip,
        other.corpus,
        other.mirrored,
        other.reversed,
    )
    return same and other.posture - one.posture == (-1 if one.reversed else 1)
