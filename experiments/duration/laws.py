"""What two postures say of how long it took from one to the other: laws learned without a family, asked of its windows.

    python experiments/duration/laws.py [--of indian] [--data PATH/TO/shared/data]

Windows are those of `experiments.duration`, and as many of each family; laws are learned from all windows of the
others. Intervals (95 %) come from 4,000 draws of families.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import spearmanr
from sklearn.decomposition import PCA
from sklearn.ensemble import ExtraTreesRegressor
from sklearn.linear_model import Ridge
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from experiments.duration.run import RECORDINGS, windows_of
from experiments.harness import HERE, markdown
from experiments.material import families
from motionmind import Motion
from motionmind._typing import Floats, Ints
from motionmind.geometry import rotations as rot
from motionmind.learned.pace import SPEED_SMOOTHING_S, way_of, ways
from motionmind.learned.sampled import SAMPLED_FPS

MOST = 12  # windows of a family that are asked
LEARNED = 20_000  # windows that are learned from at most
MAIN = 12  # main components of the joints' places
DRAWS = 4000
LAWS = ("ridge: way", "trees: way", "neighbours: postures", "trees: way, postures", "trees: these, speeds as danced")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--of", nargs="+", default=["ballet", *RECORDINGS], help="dancers")
    parser.add_argument("--data", default=str(HERE.parent.parent / "shared" / "data"), help="recorded movement")
    asked = parser.parse_args()
    rows = []
    for by in asked.of:
        shown = [one for n in range(len(families(asked.data, by))) for one in _shown_by(asked.data, by, n)]
        rows.append({"windows of": by, "learned from": len(shown), **_agreement(_joined(shown))})
    print(markdown({column: lambda row, column=column: row[column] for column in rows[0]}, rows))


class Shown(NamedTuple):
    """What windows show [W, ...].

    Attributes:
        way: logarithms of the joints' mean turn and of the travel, the largest turn, the body's turn, and where the
            root goes, as seen by the body [W, 7].
        turns: turns of the joints, radians, and heights of the root at both ends, metres [W, J + 2].
        places: of the joints at both ends, as seen by the body [W, 2, 3 J], metres.
        speeds: logarithms of the mean joint's speed at both ends [W, 2].
        seconds: logarithms of durations [W].
        family: the number of each one's family [W].
    """

    way: Floats
    turns: Floats
    places: Floats
    speeds: Floats
    seconds: Floats
    family: Ints


def _shown_by(data: str, by: str, family: int) -> Iterator[Shown]:
    speeds: dict[int, Floats] = {}
    for clip, i, k in windows_of(data, by, family):
        if id(clip) not in speeds:
            speeds[id(clip)] = _smoothed_speeds(clip)
        yield _shown(clip, speeds[id(clip)], i, k, family)


def _smoothed_speeds(clip: Motion) -> Floats:
    """Return the speed of the mean joint from each frame to the next, by which still moments are found."""
    steps, window = way_of(clip).joints.mean(axis=1), np.hanning(round(SPEED_SMOOTHING_S * SAMPLED_FPS) + 2)[1:-1]
    around = np.pad(steps, len(window) // 2, mode="edge")
    return SAMPLED_FPS * np.convolve(around, window / window.sum(), "same")[len(window) // 2 :][: len(steps)]


def _shown(clip: Motion, speeds: Floats, i: int, k: int, family: int) -> Shown:
    ends = clip.slice(i, i + 1), clip.slice(k, k + 1)
    way = ways(clip.skeleton, (ends[0].rotations, ends[1].rotations), (ends[0].root, ends[1].root))
    headings = [rot.heading(end.rotations[:, 0]) for end in ends]
    moved = rot.mul_vec(rot.about_vertical(-headings[0]), ends[1].root - ends[0].root)[0]
    places = []
    for end, heading in zip(ends, headings, strict=True):
        rotations = end.rotations.copy()
        rotations[:, 0] = rot.mul(rot.about_vertical(-heading), rotations[:, 0])
        places.append(clip.skeleton.positions(rotations, np.zeros((1, 3))).ravel())
    joints = way.joints[0]
    return Shown(
        np.array([*np.log(0.05 + np.array([joints.mean(), way.travel[0]])), joints.max(), way.turn[0], *moved]),
        np.array([*joints, ends[0].root[0, 1], ends[1].root[0, 1]]),
        np.array(places),
        np.log(0.02 + speeds[[i, min(k, len(speeds) - 1)]]),
        np.log(clip.times[k] - clip.times[i]),
        np.int64(family),
    )


def _joined(shown: list[Shown]) -> Shown:
    return Shown(*(np.array(part) for part in zip(*shown, strict=True)))


def _agreement(shown: Shown) -> dict[str, str]:
    """Return the rank correlation of each law's durations with those of windows that it has not seen."""
    chosen, told = [], []
    for family in range(int(shown.family.max()) + 1):
        mine = np.flatnonzero(shown.family == family)
        asked = mine[np.random.default_rng([0, family]).permutation(len(mine))[:MOST]]
        others = np.flatnonzero(shown.family != family)
        chosen.append(asked)
        told.append(_told(shown, np.random.default_rng(0).permutation(others)[:LEARNED], asked))
    all_told, where = np.concatenate(told), np.concatenate(chosen)
    out = {}
    draws = np.random.default_rng(0).integers(len(chosen), size=(DRAWS, len(chosen)))
    for law, name in enumerate(LAWS):
        found = [(of[:, law], shown.seconds[here]) for of, here in zip(told, chosen, strict=True)]
        drawn = [
            float(spearmanr(*(np.concatenate(part) for part in zip(*(found[n] for n in draw), strict=True)))[0])
            for draw in draws
        ]
        least, most = np.percentile(drawn, [2.5, 97.5])
        own = float(spearmanr(all_told[:, law], shown.seconds[where])[0])
        out[name] = f"{own:.2f} ({least:.2f} to {most:.2f})"
    return {"windows": str(len(where)), **out}


def _told(shown: Shown, learned: Ints, asked: Ints) -> Floats:
    """Return the logarithms of durations that each of LAWS, learned from some windows, tells of others [n, laws]."""
    if not len(asked):
        return np.zeros((0, len(LAWS)))
    main = PCA(min(MAIN, shown.places.shape[-1])).fit(shown.places[learned].reshape(2 * len(learned), -1))
    postures = main.transform(shown.places.reshape(2 * len(shown.places), -1)).reshape(len(shown.places), -1)
    of_all = np.hstack([shown.way, shown.turns, postures])
    near = np.hstack([postures / postures[learned].std(), 2.0 * shown.way[:, -3:]])

    def trees() -> ExtraTreesRegressor:
        return ExtraTreesRegressor(150, min_samples_leaf=8, max_features=0.4, random_state=0)

    laws = [
        (make_pipeline(StandardScaler(), Ridge(1.0)), shown.way),
        (trees(), shown.way),
        (KNeighborsRegressor(15, weights="distance"), near),
        (trees(), of_all),
        (trees(), np.hstack([of_all, shown.speeds])),
    ]
    return np.column_stack([law.fit(of[learned], shown.seconds[learned]).predict(of[asked]) for law, of in laws])


if __name__ == "__main__":
    main()
