"""Checks of a built corpus's arrays, which compiled code indexes without looking: types, shapes, ranges and pointers.

Letters are sizes: N postures, M moves, J joints, L chains, G states in all, H = N + M moments, S = 2 M steps, E
transitions, B bridges, V pair rows and Q pairs of the coordination, K frames of detail between postures, P pairs of
limbs, D nodes of the trees over moments, C clips and F faults, whose entries have so many bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind._typing import Floats, Ints
from motionmind.body.capsules import capsules_of
from motionmind.body.limbs import limbs_of, parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.corpus.corpus import Corpus, Facing
from motionmind.corpus.entries import Columns
from motionmind.discretize.states import StateSpace
from motionmind.files import give_back
from motionmind.learned.neighbours import node_bounds
from motionmind.learned.peaks import PEAK_WINDOWS_S
from motionmind.learned.plausibility import MEASURES, MIN_FOOT_SPEED_LIMIT
from motionmind.learned.sampled import SAMPLED_FPS
from motionmind.learned.trust import DISTANCE_RATIOS

_MOST = 1e6  # metres, seconds, rad/s, nats: far beyond any movement, and far below where sums overflow
_SMALL, _TINY = 1e-9, 1e-300
_PART = 1 << 22  # bytes of an array that are checked at a time
_UNIT = 1e-5  # by which the square of a unit quaternion's length may differ from 1


class _Form(NamedTuple):
    """The type of an array, its shape, and the range of its numbers; they may be NaN only if `or_nan`."""

    kind: str
    shape: str
    low: float = -_MOST
    high: float = _MOST
    or_nan: bool = False


FORMS = {
    "rotations": _Form("f8", "N J 4", -2.0, 2.0),
    "root": _Form("f8", "N 3"),
    "times": _Form("f8", "N"),
    "detail": _Form("f2", "N K J 3", -4.0, 4.0),
    "states": _Form("i4", "N L"),
    "centres": _Form("f8", "G 4", -2.0, 2.0),
    "clips.text": _Form("u1", "clip_bytes"),
    "clips.lines": _Form("i8", "C+1"),
    "clips.starts": _Form("i8", "C+1"),
    "clips.weights": _Form("f8", "C 2", 0.0, 1e15),
    "clips.order": _Form("i4", "C"),
    "faults.text": _Form("u1", "fault_bytes"),
    "faults.lines": _Form("i8", "F+1"),
    "transitions.starts": _Form("i8", "L+1"),
    "transitions.indptr": _Form("i8", "G+1"),
    "transitions.targets": _Form("i4", "E"),
    "transitions.counts": _Form("f8", "E", _TINY, 1e15),
    "transitions.visits": _Form("f8", "G", _TINY, 1e15),
    "transitions.attests": _Form("i4", "E"),
    "transitions.arrives": _Form("i4", "E"),
    "transitions.seconds": _Form("f8", "E", _SMALL),
    "bridges.indptr": _Form("i8", "G+1"),
    "bridges.targets": _Form("i4", "B"),
    "bridges.degrees": _Form("f8", "B", 0.0, 180.0),
    "coordination.parents": _Form("i8", "L"),
    "coordination.pair_starts": _Form("i8", "L+1"),
    "coordination.pair_ptr": _Form("i8", "V+1"),
    "coordination.pair_states": _Form("i4", "Q"),
    "coordination.pair_costs": _Form("f8", "Q"),
    "coordination.child_costs": _Form("f8", "G"),
    "coordination.parent_costs": _Form("f8", "V"),
    "carriage.orientations": _Form("f8", "H L 4", -2.0, 2.0),
    "carriage.weights": _Form("f8", "H", _TINY, 1.0),
    "carriage.begins": _Form("i8", "S"),
    "carriage.ends": _Form("i8", "S"),
    "carriage.shares": _Form("f8", "S", _TINY, 1.0 + _SMALL),
    "carriage.clusters": _Form("i4", "H parts"),
    "carriage.turn": _Form("f8", "M"),
    "carriage.travel": _Form("f8", "M 3"),
    "carriage.clearance": _Form("f8", "H", 0.0),
    "carriage.stands": _Form("f8", "H limbs+1", 0.0, 1.0 + _SMALL),
    "carriage.aloft": _Form("f8", "H", 0.0, 1.0),
    "carriage.overhang": _Form("f8", "1"),
    "carriage.loose": _Form("b1", "J"),
    "carriage.touches": _Form("f8", "P", 0.0),
    "pace.usual": _Form("f8", "3", _SMALL),
    "pace.fastest": _Form("f8", "J+2", _SMALL),
    "pace.greatest": _Form("f8", "J+2", _SMALL),
    "pace.slowest": _Form("f8", "1", 0.0),
    "pace.peaks": _Form("f8", f"{len(PEAK_WINDOWS_S)} J+4", 0.0),
    "pace.lulls": _Form("f8", "N", 0.0),
    "pace.law": _Form("f8", "4", -100.0, 100.0),
    "gauge.starts": _Form("i8", "C+1 3"),
    "gauge.steps": _Form("f4", "steps J+6"),
    "gauge.stills": _Form("f8", "stills 2"),
    "gauge.windows": _Form("f8", "windows 6"),
    "plausibility.fastest": _Form("f8", "J+2", _SMALL),
    "plausibility.most": _Form("f8", f"{len(MEASURES)}", or_nan=True),
    "plausibility.slides": _Form("f8", "1", MIN_FOOT_SPEED_LIMIT, or_nan=True),
}

TREES = {  # of a corpus of many moments, in versions that have them
    "neighbours.order": _Form("i4", "parts H"),
    "neighbours.ranks": _Form("i4", "parts H"),
    "neighbours.bounds": _Form("i4", "D 2"),
    "neighbours.centres": _Form("f4", "D joints 4", -2.0, 2.0),
    "neighbours.radii": _Form("f8", "parts D", 0.0),
    "neighbours.weights": _Form("f8", "parts D", 0.0, 1e15),
    "neighbours.codes": _Form("i1", "codes"),
}

TRUST = {  # in versions that have it
    "trust.table": _Form("f8", f"{len(DISTANCE_RATIOS)}", 0.0, 1.0),
    "trust.lasts": _Form("f8", "1", _SMALL, 10.0),
    "trust.spread": _Form("f8", "parts", _SMALL),
}

MOVEMENT = [name for name in FORMS if "." not in name]  # from these, and the clips, all the others can be learned
GAUGE = [name for name in FORMS if name.startswith("gauge.")]  # that earlier versions did not keep
ENTRIES = [name for name in FORMS if name.startswith(("clips.", "faults."))]  # listed in the manifest of early versions


def check_forms(arrays: Mapping[str, NDArray[Any]], skeleton: Skeleton, facing: Facing) -> None:
    """Check the type, shape and range of each array; ValueError names the first that is wrong.

    Args:
        arrays: all arrays of `FORMS` or those of `MOVEMENT`, by name, each with or without those of `ENTRIES`.
        skeleton: the body.
        facing: whether the body's turn is a chain.
    """
    sizes = {"J": len(skeleton), "L": len(skeleton) + (facing == "free"), "P": len(capsules_of(skeleton).pairs())}
    sizes |= {"parts": len(parts_of(skeleton)), "limbs": len(limbs_of(skeleton))}
    sizes["joints"] = sum(map(len, parts_of(skeleton)))
    for name, form in (FORMS | TREES | TRUST).items():
        if name not in arrays:
            continue
        array = arrays[name]
        if array.dtype != np.dtype(form.kind):
            raise ValueError(f"{name} is of {array.dtype}, not of {np.dtype(form.kind)}")
        words = form.shape.split()
        if array.ndim == len(words):
            # A size that is not known yet is that of the first array that has it.
            for word, size in zip(words, array.shape, strict=True):
                letter, _, more = word.partition("+")
                sizes.setdefault(letter, size - int(more or 0))
        shape = [_size(word, sizes) for word in words]
        if list(array.shape) != shape:
            raise ValueError(f"{name} is of the shape {list(array.shape)}, not {shape}")
        if form.kind.startswith("f") and not _is_all(array, partial(_is_in_range, form)):
            raise ValueError(f"{name} holds a number that is not from {form.low:g} to {form.high:g}")


def check_entries(arrays: Mapping[str, NDArray[Any]]) -> None:
    """Check where the entries of clips and faults begin, and the clips' postures; ValueError names what is wrong.

    Args:
        arrays: as for `check_forms`, with those of `ENTRIES`.
    """
    for name, last in (
        ("clips.lines", len(arrays["clips.text"])),
        ("faults.lines", len(arrays["faults.text"])),
        ("clips.starts", len(arrays["rotations"])),
    ):
        starts = arrays[name]
        if starts[0] != 0 or starts[-1] != last or (np.diff(starts) <= 0).any():
            raise ValueError(f"{name} does not rise from 0 to {last}")
    _check_range("clips.order", arrays, len(arrays["clips.order"]))


def _is_in_range(form: _Form, part: NDArray[Any]) -> bool:
    numbers = part[~np.isnan(part)] if form.or_nan else part
    return bool(((numbers >= form.low) & (numbers <= form.high)).all())


def _is_all(array: NDArray[Any], test: Callable[[NDArray[Any]], bool]) -> bool:
    """Return whether all parts of an array pass a test; of one that is mapped, memory holds a part at a time."""
    rows = max(_PART // max(array[:1].nbytes, 1), 1)
    for start in range(0, len(array), rows):
        if not test(array[start : start + rows]):
            return False
        give_back(array)
    return True


def _size(word: str, sizes: Mapping[str, int]) -> int:
    """Return the size that a word of a shape stands for, as 5, "J" or "J+2"; -1 if it is not known."""
    letter, _, more = word.partition("+")
    return (int(letter) if letter.isdecimal() else sizes.get(letter, -1)) + int(more or 0)


def check_values(arrays: Mapping[str, NDArray[Any]], corpus: Corpus, space: StateSpace) -> None:
    """Check what arrays of valid forms point to, and how they fit the corpus; ValueError names the first that is wrong.

    Args:
        arrays: as for `check_forms`.
        corpus: the corpus.
        space: the states of each chain.
    """
    _check_clips(corpus)
    moves = corpus.moves
    _check_units("rotations", arrays)
    later = (corpus.times[moves.ends] - corpus.times[moves.begins]) * np.sign(moves.ends - moves.begins)
    if not (later > 0.0).all():
        raise ValueError("times does not rise within a clip")
    _check_range("states", arrays, space.sizes)
    if FORMS.keys() - {*ENTRIES, *GAUGE} <= arrays.keys():
        _check_grammar(arrays, corpus, space, later)
        _check_carriage(arrays, len(corpus), len(later))
    if TREES.keys() & arrays.keys():
        _check_trees(arrays)
    if (own := TRUST.keys() & arrays.keys()) and len(own) < len(TRUST):
        raise ValueError(f"lists no array {min(TRUST.keys() - own)}")
    if arrays.keys() >= set(GAUGE):
        _check_gauge(arrays, corpus)


def _check_clips(corpus: Corpus) -> None:
    """Check that each clip and fault can be read, and that the columns are those of the clips."""
    for name in ("clips", "faults"):
        try:
            for _ in getattr(corpus, name):
                pass
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{name}.text holds what is no entry: {error}") from error
    corpus.check_clips()
    found = Columns.of(corpus.clips)
    for name in Columns._fields:
        if not np.array_equal(getattr(corpus.columns, name), getattr(found, name)):
            raise ValueError(f"clips.{name} is not what clips.text says")


def _check_grammar(arrays: Mapping[str, NDArray[Any]], corpus: Corpus, space: StateSpace, later: Floats) -> None:
    """Check joint graphs, bridges and coordination; `later` are the durations of the corpus's moves [M], seconds."""
    if not np.array_equal(arrays["transitions.starts"], space.starts):
        raise ValueError("transitions.starts is not where the manifest's chains start")
    of_row = np.repeat(space.sizes, space.sizes)  # the number of states in the chain of each state
    _check_rows("transitions.indptr", "transitions.targets", arrays, of_row)
    _check_rows("bridges.indptr", "bridges.targets", arrays, of_row)
    _check_range("transitions.attests", arrays, len(corpus))
    _check_range("transitions.arrives", arrays, len(corpus))
    seconds = arrays["transitions.seconds"]
    if len(seconds) and not (later.min() - _SMALL <= seconds.min() and seconds.max() <= later.max() + _SMALL):
        raise ValueError("transitions.seconds holds a duration that no move has")
    _check_coordination(arrays, corpus.chain_parents, space.sizes)


def _check_carriage(arrays: Mapping[str, NDArray[Any]], postures: int, moves: int) -> None:
    """Check the carriage of a corpus of so many postures and moves."""
    _check_units("carriage.orientations", arrays)
    moments = postures + moves
    for name, size in (("turn", moves), ("begins", 2 * moves), ("weights", moments)):
        if len(arrays[f"carriage.{name}"]) != size:
            raise ValueError(f"carriage.{name} has not {size} entries, as the corpus's moves make")
    for name in ("carriage.begins", "carriage.ends", "carriage.clusters"):
        _check_range(name, arrays, moments)


def _check_trees(arrays: Mapping[str, NDArray[Any]]) -> None:
    """Check the trees over a corpus's moments."""
    codes = "neighbours.codes"  # which the first versions that had trees did not keep
    if missing := next((name for name in TREES if name not in arrays and name != codes), None):
        raise ValueError(f"lists no array {missing}")
    order, ranks = arrays["neighbours.order"], arrays["neighbours.ranks"]
    count = order.shape[1]
    numbers = 4 * count * arrays["neighbours.centres"].shape[1]
    if codes in arrays and len(arrays[codes]) != numbers:
        raise ValueError(f"{codes} is of the shape {[len(arrays[codes])]}, not {[numbers]}")
    for name in ("neighbours.order", "neighbours.ranks"):
        _check_range(name, arrays, count)
    if any((rank[own] != np.arange(count)).any() for rank, own in zip(ranks, order, strict=True)):
        raise ValueError("neighbours.ranks is not where the moments are in neighbours.order")
    if not np.array_equal(arrays["neighbours.bounds"], node_bounds(count)):
        raise ValueError(f"neighbours.bounds is not that of {count} moments")


def _check_gauge(arrays: Mapping[str, NDArray[Any]], corpus: Corpus) -> None:
    """Check that each clip has as many steps as it lasts, and a still moment if it has any."""
    starts, bounds = arrays["gauge.starts"], corpus.columns.starts
    counts, last = np.diff(starts, axis=0), [len(arrays[f"gauge.{name}"]) for name in ("steps", "stills", "windows")]
    if starts[0].any() or starts[-1].tolist() != last or (counts < 0).any():
        raise ValueError(f"gauge.starts does not rise from 0 to {last}")
    steps = np.floor((corpus.times[bounds[1:] - 1] - corpus.times[bounds[:-1]]) * SAMPLED_FPS + 1e-3)
    if (counts[:, 0] != steps).any() or (np.minimum(counts[:, 0], 1) > counts[:, 1]).any():
        raise ValueError("gauge.starts has not the steps and still moments that the corpus's clips have")


def _check_units(name: str, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Check that an array holds unit quaternions."""
    # Written so that a NaN fails too.
    if not _is_all(arrays[name], lambda part: bool((np.abs(_squares(part) - 1.0) <= _UNIT).all())):
        raise ValueError(f"{name} holds a quaternion that is not of unit length")


def _squares(quaternions: Floats) -> Floats:
    return np.asarray(np.einsum("...i,...i", quaternions, quaternions))


def _check_range(name: str, arrays: Mapping[str, NDArray[Any]], size: int | Ints) -> None:
    """Check that all of an array are indices of what has this size, or these sizes by column."""
    if not _is_all(arrays[name], lambda part: bool(((part >= 0) & (part < size)).all())):
        raise ValueError(f"{name} holds an index of what is not there")


def _check_rows(pointers: str, entries: str, arrays: Mapping[str, NDArray[Any]], sizes: Ints) -> None:
    """Check rows of indices: where each starts, and that its entries rise and are less than the row's size [rows]."""
    starts, found = arrays[pointers], arrays[entries]
    lengths = np.diff(starts)
    if starts[0] != 0 or starts[-1] != len(found) or (lengths < 0).any():
        raise ValueError(f"{pointers} does not rise from 0 to {len(found)}")
    if not ((found >= 0) & (found < np.repeat(sizes, lengths))).all():
        raise ValueError(f"{entries} holds an index of what is not there")
    row = np.repeat(np.arange(len(lengths)), lengths)
    if ((np.diff(found) <= 0) & (np.diff(row) == 0)).any():
        raise ValueError(f"{entries} does not rise within a row")


def _check_coordination(arrays: Mapping[str, NDArray[Any]], parents: Ints, sizes: Ints) -> None:
    """Check the coordination of chains with these parents [L] and numbers of states [L]."""
    above = arrays["coordination.parents"]
    if not ((above == parents) | (above == -1)).all():
        raise ValueError("coordination.parents is not the tree of the manifest's joints")
    rows = np.where(above >= 0, sizes[above], 0)
    starts = np.concatenate([[0], np.cumsum(rows)])
    if not np.array_equal(arrays["coordination.pair_starts"], starts) or starts[-1] != len(
        arrays["coordination.parent_costs"]
    ):
        raise ValueError("coordination.pair_starts has not a row for each state of a chain's parent")
    _check_rows("coordination.pair_ptr", "coordination.pair_states", arrays, np.repeat(sizes, rows))
