"""The mean of all corpus walks between given postures: the movement's postures at the ends and middles of moves."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import reduce
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from motionmind._typing import Floats, Int32s, Ints
from motionmind.body.limbs import parts_of
from motionmind.body.skeleton import Skeleton
from motionmind.executors.here import Here
from motionmind.geometry import rotations as rot
from motionmind.geometry.distances import squared_distance
from motionmind.jit import jit, read_only
from motionmind.learned.posture_statistics import PostureStatistics
from motionmind.learned.trust import Trust
from motionmind.walks.likelihood import (
    BODY_PART_WEIGHTS,
    END_TRAVEL_SD_MPS,
    END_TURN_SD_RADPS,
    END_VELOCITY_SD_RADPS,
    arrange_by_step,
    divide_by_variances,
    end_variance,
    likelihoods,
    nearest_distances,
    part_distances,
    share_left_out,
    squared_distances,
    squared_rate_differences,
)
from motionmind.walks.marginals import posterior_marginals
from motionmind.walks.means import mean_of_parts, mean_rotations, nonnegligible, scale_weights
from motionmind.walks.minimal import departure, minimal_movement
from motionmind.walks.sparse import Chosen, all_samples, choose, steps_from
from motionmind.walks.stops import Rates, Stop

N_THREADS = min(4, os.cpu_count() or 1)  # one body part each at a time; results do not depend on the number
MIN_SAMPLES_PER_THREAD = 4000  # with fewer, another thread costs more than it saves

_Item = TypeVar("_Item")
_Made = TypeVar("_Made")


class MeanWalk(NamedTuple):
    """The mean of walks through a corpus at the ends and middles of T moves: the half steps.

    Attributes:
        poses: orientations of the joints [2 T + 1, J, 4].
        samples: probabilities of the corpus's samples [2 T + 1, n].
        of: indices of these samples [n]; all of them in a small corpus.
        trust: trust in the walks per joint and half step [2 T, J], from 0 to 1 (`motionmind.learned.trust`).
        left_out: approximate share of walks that begin or end in samples represented by others, in the body part
            where it is greatest; 0 in a small corpus.
    """

    poses: Floats
    samples: Floats
    of: Ints | slice
    trust: Floats
    left_out: float


def mean_walk(
    skeleton: Skeleton,
    statistics: PostureStatistics,
    rates: Callable[[Ints | slice], Rates] | None,
    stops: Mapping[int, Stop],
    half_steps: Floats,
    path: Floats | None,
) -> MeanWalk:
    """Return the mean over walks from each stop to the next, and the probabilities of the corpus's samples.

    Walks of a limb weigh as much as those of both larger parts together. The probabilities of samples, which decide
    travel and support, come from walks of the whole body and of the part that carries it. The mean is expressed as a
    departure from the minimal movement between the stops (`motionmind.walks.minimal`), scaled by the trust that the
    corpus has earned (`motionmind.learned.trust`). It passes near the stops, not through them: its offsets there are
    subtracted along the walk, in proportion to time, and those of its velocities with `departure`.

    Args:
        skeleton: the body.
        statistics: the corpus's N samples and the steps between them.
        rates: returns the velocities in samples; None where no stop has a velocity.
        stops: postures to pass, keyed by the number of moves before each; increasing, first and last included.
        half_steps: times of the ends and middles of the moves [2 T + 1], seconds.
        path: orientations to follow at the moves [T + 1, J, 4], or None.
    """
    joints, parts = len(skeleton), parts_of(skeleton)
    poses, trusted = np.empty((len(half_steps), joints, 4)), np.empty((len(half_steps) - 1, joints))
    segments = {}
    for start, end in pairwise(stops):
        here, ends = slice(2 * start, 2 * end + 1), (stops[start], stops[end])
        between = path[start + 1 : end] if path is not None and end > start + 1 else None
        walk = walk_between(parts, statistics, rates, ends, half_steps[here], between)
        share = walk.trusted(statistics.trust)
        poses[here] = rot.mul(walk.minimal, rot.exp(share[:, None] * walk.departs))
        trusted[2 * start : 2 * end], segments[start] = share, walk
    for move, stop in stops.items():
        poses[2 * move] = stop.chains[:joints]
    left_out = max(walk.left_out for walk in segments.values())
    return MeanWalk(poses, *_join_segments(segments, len(half_steps), len(statistics.weights)), trusted, left_out)


class Walk(NamedTuple):
    """The mean over the walks from one stop to the next in S steps.

    Attributes:
        minimal: the minimal movement, orientations [S + 1, J, 4].
        departs: departure of the mean from it [S + 1, J, 3]: rotation vectors, radians, 0 at both stops.
        members: the body part of each of the three sizes that each joint belongs to [J, 3].
        nearest: distance of each stop from the nearest sample, by body part [P, 2], radians per joint.
        displacements: displacement of each part [P], radians per joint (`_displacement`).
        samples: probabilities of samples [S + 1, n] and the indices of these samples, in walks of the whole body and
            of the part that carries it.
        left_out: as in `MeanWalk`.
    """

    minimal: Floats
    departs: Floats
    members: Ints
    nearest: Floats
    displacements: Floats
    samples: tuple[tuple[Floats, Ints | slice], ...]
    left_out: float

    def trusted(self, trust: Trust) -> Floats:
        """Return the share of the departure that each joint keeps [J], from 0 to 1."""
        return np.asarray(
            trust.shares(self.nearest.mean(axis=1), self.displacements)[self.members] @ np.array(BODY_PART_WEIGHTS)
        )


class _PartWalk(NamedTuple):
    """The walks of one body part from one stop to the next in S steps.

    Attributes:
        chosen: the n samples in the sum over walks.
        shown: orientations of the part in these samples [n, p, 4]; without trees, all joint chains in all samples.
        marginals: probabilities of the samples [S + 1, n].
        kept_samples: with trees, the samples whose probability is not negligible in a mean.
        weights: their probabilities times the weight of the part's size, as `mean_of_parts` takes them.
        left_out: as in `MeanWalk`.
    """

    chosen: Chosen
    shown: Floats
    marginals: Floats
    kept_samples: Ints
    weights: Floats
    left_out: float


def _join_segments(segments: Mapping[int, Walk], count: int, samples: int) -> tuple[Floats, Ints | slice]:
    """Return the probabilities of samples at each half step [2 T + 1, n], and the indices of these samples.

    Args:
        segments: walks, keyed by the number of moves before their first stop.
        count: 2 T + 1.
        samples: N, the number of samples in the corpus.
    """
    kept = [of for walk in segments.values() for _, of in walk.samples if not isinstance(of, slice)]
    chosen = reduce(np.union1d, kept) if kept else slice(None)
    out = np.zeros((count, samples if isinstance(chosen, slice) else len(chosen)))
    for start, walk in segments.items():
        rows = out[2 * start : 2 * start + len(walk.minimal)]
        rows[0] = 0.0  # written by the previous segment
        for share, of in walk.samples:
            if isinstance(of, slice) or isinstance(chosen, slice):
                rows += 0.5 * share
            else:
                _add_half(rows, np.searchsorted(chosen, of), share)
    return out, chosen


@jit
def _add_half(rows: Floats, columns: Ints, shares: Floats) -> None:
    """Add half of shares [S, n] to the given columns [n] of rows."""
    for t in range(len(rows)):
        for k in range(len(columns)):
            rows[t, columns[k]] += 0.5 * shares[t, k]


def walk_between(
    parts: tuple[Ints, ...],
    statistics: PostureStatistics,
    rates: Callable[[Ints | slice], Rates] | None,
    ends: tuple[Stop, Stop],
    times: Floats,
    path: Floats | None,
) -> Walk:
    """Return the mean over walks from one stop to the next.

    Args:
        parts: of the body, as in `parts_of`.
        statistics: the corpus's N samples and the steps between them.
        rates: returns the velocities in samples; or None.
        ends: both stops.
        times: of the steps' ends [S + 1], seconds.
        path: orientations to follow at every second step end between the stops [S / 2 - 1, J, 4], or None.
    """
    joints = max(int(part.max()) for part in parts) + 1
    orientations = np.stack([stop.chains[:joints] for stop in ends])
    leaving, arriving = (None if stop.rates is None else stop.rates.joints for stop in ends)
    decay = float(statistics.trust.lasts[0])
    minimal = minimal_movement(orientations, times, leaving, arriving, decay)
    poses, nearest = np.empty_like(minimal), np.empty((len(parts), 2))

    members, groups = _members(parts, joints)
    displacements = [_displacement(part, ends, float(times[-1] - times[0]), decay) for part in parts]
    shown, trees = read_only(statistics.orientations), statistics.trees

    def off(postures: Floats) -> Floats:
        return squared_distances(shown, members, len(parts), postures)

    threads = min(N_THREADS, 1 + len(statistics.weights) // MIN_SAMPLES_PER_THREAD)
    with ThreadPoolExecutor(threads - 1) if threads > 1 else Here() as pool:
        distances = []
        if trees is None:
            passed = orientations if path is None else np.concatenate([orientations, path])
            distances = _map_in_threads(off, np.array_split(passed, threads), pool, threads)

        def walk(number: int) -> _PartWalk:
            part, here = parts[number], shown
            if trees is None:
                chosen = all_samples(statistics, number)
                own = distances[0][number] if threads == 1 else np.concatenate([of[number] for of in distances])
            else:
                chosen, seen, own = choose(statistics, number, orientations, len(times) - 1)
                here = seen.transpose(1, 0, 2)
                if path is not None:
                    own = np.concatenate([own, part_distances(seen, np.ascontiguousarray(path[:, part]))])
            likely, nearest[number], left_out = _likelihoods(part, chosen, rates, ends, own)
            begins, goals, shares = steps_from(chosen, likely[0])
            steps = read_only(begins), read_only(goals), read_only(shares), chosen.clusters, read_only(chosen.weights)
            size = float(np.dot((members == number).any(axis=0), BODY_PART_WEIGHTS))
            found = _marginals(*steps, likely, len(times), size, trees is not None)
            return _PartWalk(chosen, here, *found, left_out)

        larger, limbs = {number for numbers in groups for number in numbers[:-1]}, {numbers[-1] for numbers in groups}
        # Without trees, arrays run over all samples and may be large: those of limbs are used at once, not kept.
        kept = sorted(larger if trees is None else larger | limbs)
        walks = dict(zip(kept, _map_in_threads(walk, kept, pool, threads), strict=True))

        def move(number: int) -> float:
            mine = walks[number] if number in walks else walk(number)
            for numbers, here in groups.items():
                if numbers[-1] != number:
                    continue
                own, about = [*(walks[n] for n in numbers[:-1]), mine], np.ascontiguousarray(minimal[:, here])
                if trees is None:
                    weights = _mix_sizes(*(one.marginals for one in own))
                    poses[:, here] = mean_rotations(weights, shown, np.array(here), about)
                else:
                    poses[:, here] = _mean_of_few(own, [parts[n] for n in numbers], here, about)
            return mine.left_out

        lost = _map_in_threads(move, sorted(limbs), pool, threads)
    departs = rot.log(rot.inv_mul(minimal, poses))
    departs = _without_ends(departs, times, leaving is not None, arriving is not None, decay)
    samples = tuple((one.marginals, one.chosen.samples) for one in (walks[0], walks[1]))
    left_out = max(*lost, *(one.left_out for one in walks.values()))
    return Walk(minimal, departs, members, nearest, np.array(displacements), samples, left_out)


def _map_in_threads(
    work: Callable[[_Item], _Made], items: Sequence[_Item], pool: Executor, threads: int
) -> list[_Made]:
    """Map `work` over items in this thread and those of a pool, which share one queue.

    Body parts are independent, and compiled loops release the interpreter lock. Starting a thread and waiting for it
    costs as much as one part, so the calling thread works too.
    """
    left, made = iter(range(len(items))), dict[int, _Made]()

    def take() -> None:
        for at in left:
            made[at] = work(items[at])

    others = [pool.submit(take) for _ in range(threads - 1)]
    take()
    for other in others:
        other.result()
    return [made[at] for at in range(len(items))]


def _members(parts: tuple[Ints, ...], joints: int) -> tuple[Ints, dict[tuple[int, ...], list[int]]]:
    """Return the part of each size that each joint belongs to [J, 3], and the joints grouped by these three parts."""
    inside = np.zeros((joints, len(parts)), dtype=np.bool_)
    for number, part in enumerate(parts):
        inside[part, number] = True
    members = np.nonzero(inside)[1].reshape(joints, len(BODY_PART_WEIGHTS))
    groups: dict[tuple[int, ...], list[int]] = {}
    for joint, numbers in enumerate(members.tolist()):
        groups.setdefault(tuple(numbers), []).append(joint)
    return members, groups


def _without_ends(off: Floats, times: Floats, leaving: bool, arriving: bool, decay: float) -> Floats:
    """Make departures [S + 1, m, 3] zero at both ends, and their rates too where velocities are given."""
    share = ((times - times[0]) / (times[-1] - times[0]))[:, None, None]
    off = off - (1.0 - share) * off[0] - share * off[-1]
    first = (off[1] - off[0]) / (times[1] - times[0]) if leaving else None
    last = (off[-1] - off[-2]) / (times[-1] - times[-2]) if arriving else None
    return np.asarray(off - departure(times, first, last, decay=decay))


def _likelihoods(
    part: Ints,
    chosen: Chosen,
    rates: Callable[[Ints | slice], Rates] | None,
    ends: tuple[Stop, Stop],
    off: Floats,
) -> tuple[Floats, tuple[float, float], float]:
    """Return the likelihoods of samples for one body part [K, n], the distance of the nearest from each end, radians
    per joint, and the share of walks that begin or end in samples represented by others.

    Arguments are those of `walk_between`, except `chosen`, the samples, and `off`, their squared distances in the part
    from the two ends and then from the postures of the path, if any [K, n], radians^2.
    """
    nearest = nearest_distances(off)
    squares = divide_by_variances(off, *map(end_variance, nearest))
    known = None if rates is None else rates(chosen.samples)
    for k, stop in enumerate(ends):
        for differences in _rate_terms(part, known, stop):
            squares[k] += differences
    likely = likelihoods(squares)
    left_out = 0.0 if chosen.near is None else share_left_out(likely, chosen.near, chosen.weights)
    return likely, nearest, left_out


@jit
def _marginals(
    begins: Ints,
    goals: Ints,
    shares: Floats,
    clusters: Int32s,
    weights: Floats,
    likely: Floats,
    count: int,
    size: float,
    few: bool,
) -> tuple[Floats, Ints, Floats]:
    """Return the posterior marginals [S + 1, n] of one body part's walks, the samples that are not negligible in a
    mean, and their weights there, from `scale_weights`.

    Args:
        begins, goals, shares, clusters, weights: of `posterior_marginals`.
        likely: likelihoods of the samples, in the form that `arrange_by_step` takes.
        count: S + 1.
        size: weight of the part.
        few: whether to compute the last two results.
    """
    marginals = posterior_marginals(begins, goals, shares, clusters, weights, arrange_by_step(likely, count))
    kept_samples = nonnegligible(marginals) if few else np.empty(0, np.int64)
    return marginals, kept_samples, scale_weights(size, marginals, kept_samples)


def _displacement(part: Ints, ends: tuple[Stop, Stop], seconds: float, decay: float) -> float:
    """Return the displacement of a body part, RMS radians per joint.

    It is the root of the sum of three squares:

    - the turn from one end to the other;
    - the distance that the end speed covers while it decays as (1 - t / decay)^2, faster in a shorter movement;
    - the travel, at 0.5 radians per body height (chosen on cmu-05 and cmu-16).

    So a cycle back to its first posture has a displacement if the body moves or travels.
    """
    turn = squared_distance(ends[0].chains[part], ends[1].chains[part]) / len(part)
    rates = [stop.rates.joints[part] for stop in ends if stop.rates is not None]
    speed = float(np.mean([np.sum(rate**2, axis=-1).mean() for rate in rates])) if rates else 0.0
    travel = float(np.sum((ends[1].place - ends[0].place) ** 2))
    return float(np.sqrt(turn + (min(seconds, decay) / 3.0) ** 2 * speed + 0.5**2 * travel))


def _rate_terms(part: Ints, rates: Rates | None, stop: Stop) -> list[Floats]:
    """Return squared differences between the samples' velocities and a stop's [N], in units of their variances.

    Parts that include the root also compare the body's turning rate and travel.
    """
    if rates is None or stop.rates is None:
        return []
    joints = squared_rate_differences(np.ascontiguousarray(rates.joints[:, part]), stop.rates.joints[part])
    terms = [joints / END_VELOCITY_SD_RADPS**2]
    if part[0] == 0:
        terms.append((rates.turn - stop.rates.turn) ** 2 / END_TURN_SD_RADPS**2)
        terms.append(np.sum((rates.travel - stop.rates.travel) ** 2, axis=1) / END_TRAVEL_SD_MPS**2)
    return terms


def _mean_of_few(walks: Sequence[_PartWalk], parts: Sequence[Ints], joints: Sequence[int], about: Floats) -> Floats:
    """Return `mean_rotations` of joints [m] over the walks of the three parts that they belong to."""
    weights, kept, shown = zip(*((one.weights, one.kept_samples, one.shown) for one in walks), strict=True)
    columns = np.array([[np.flatnonzero(part == joint)[0] for joint in joints] for part in parts])
    return mean_of_parts(weights, kept, shown, columns, about)


@jit
def _mix_sizes(whole: Floats, half: Floats, limb: Floats) -> Floats:
    """Mix the probabilities of samples over walks of the three sizes [S + 1, N]."""
    out = np.empty_like(limb)
    for t in range(len(out)):
        for i in range(out.shape[1]):
            out[t, i] = BODY_PART_WEIGHTS[2] * limb[t, i] + (
                BODY_PART_WEIGHTS[0] * whole[t, i] + BODY_PART_WEIGHTS[1] * half[t, i]
            )
    return out
