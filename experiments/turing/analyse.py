"""Analysis of raters' answers: means, and whether generated movement is told from danced movement.

python experiments/turing/analyse.py FOLDER/key.json answers-*.json

For each scale it prints the means, with 95 % intervals over raters, and an analysis of variance in which both raters
and films are random effects: F1 of raters' means, F2 of films' means, and min F' of both (Clark, "The
language-as-fixed-effect fallacy", J. Verbal Learning and Verbal Behavior 12:335, 1973), which is small unless the
difference generalises to other raters and other films. Partial eta squared, of F1, is the size of the effect.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from motionmind._typing import Bools, Floats

KINDS = ("danced", "made")


@dataclass(frozen=True)
class Verdict:
    """The analysis of one scale.

    Attributes:
        means: mean rating of each kind.
        half: half of the 95 % interval of the difference, danced less made, over raters.
        f1, f2, min_f: F over raters, F over films, and min F'.
        p: p value of min F'.
        eta: partial eta squared of F1.
        raters, films: their numbers.
    """

    means: tuple[float, float]
    half: float
    f1: float
    f2: float
    min_f: float
    p: float
    eta: float
    raters: int
    films: int

    @property
    def difference(self) -> float:
        return self.means[0] - self.means[1]


def judged(ratings: Floats, made: Bools) -> Verdict:
    """Analyse ratings [raters, films] of films that were `made` [films], or else danced."""
    from scipy.stats import f, t

    raters, films = ratings.shape
    by_rater = ratings[:, ~made].mean(axis=1) - ratings[:, made].mean(axis=1)
    error = by_rater.std(ddof=1) / np.sqrt(raters)
    by_film = [ratings[:, kind].mean(axis=0) for kind in (~made, made)]
    within = sum(((one - one.mean()) ** 2).sum() for one in by_film) / (films - 2)
    spread = within * sum(1.0 / len(one) for one in by_film)
    f1 = float((by_rater.mean() / error) ** 2) if error > 0.0 else np.inf
    f2 = float((by_film[0].mean() - by_film[1].mean()) ** 2 / spread) if spread > 0.0 else np.inf
    if by_rater.mean() == 0.0:
        f1 = f2 = 0.0
    # min F' = F1 F2 / (F1 + F2), with (F1 + F2)^2 / (F1^2 / n2 + F2^2 / n1) degrees of freedom of the error, where n1
    # and n2 are those of F1 and F2; with an F that is infinite it is the other one.
    n1, n2 = raters - 1, films - 2
    if not np.isfinite(f1) or not np.isfinite(f2):
        min_f, degrees = min(f1, f2), float(n2 if f2 < f1 else n1)
    elif f1 + f2 == 0.0:
        min_f, degrees = 0.0, float(n1)
    else:
        min_f = f1 * f2 / (f1 + f2)
        degrees = (f1 + f2) ** 2 / (f1**2 / n2 + f2**2 / n1)
    return Verdict(
        (float(by_film[0].mean()), float(by_film[1].mean())),
        float(t.ppf(0.975, n1) * error),
        f1,
        f2,
        float(min_f),
        float(f.sf(min_f, 1, degrees)),
        float(f1 / (f1 + n1)) if np.isfinite(f1) else 1.0,
        raters,
        films,
    )


def read(key: Path, answers: list[Path]) -> tuple[dict[str, Floats], Bools]:
    """Read the ratings [raters, films] of each scale, and which films were made."""
    kinds: dict[str, dict[str, Any]] = json.loads(key.read_text())
    films = sorted(kinds)
    given = [json.loads(path.read_text()) for path in answers]
    for path, one in zip(answers, given, strict=True):
        if missing := sorted(set(films) - set(one["answers"])):
            raise SystemExit(f"{path}: {len(missing)} of {len(films)} films are not answered, {missing[0]} first")
    raters = [one["rater"] for one in given]
    if len(set(raters)) < 2 or len(set(raters)) < len(raters):
        raise SystemExit(
            f"it takes the answers of two raters at least, each once, not of {', '.join(raters) or 'none'}"
        )
    scales = list(given[0]["answers"][films[0]])
    ratings = {s: np.array([[one["answers"][film][s] for film in films] for one in given], dtype=float) for s in scales}
    return ratings, np.array([kinds[film]["kind"] == KINDS[1] for film in films])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("key", type=Path)
    parser.add_argument("answers", type=Path, nargs="+")
    options = parser.parse_args()
    ratings, made = read(options.key, options.answers)
    print(f"{'':8}{'danced':>8}{'made':>8}  difference        F1      F2  min F'       p  partial eta squared")
    for scale, given in ratings.items():
        v = judged(given, made)
        print(
            f"{scale:8}{v.means[0]:8.2f}{v.means[1]:8.2f}  {v.difference:5.2f} +- {v.half:4.2f}"
            f"{v.f1:8.2f}{v.f2:8.2f}{v.min_f:8.2f}{v.p:8.3f}  {v.eta:.2f}"
        )
    print(f"{v.raters} raters, {v.films} films")


if __name__ == "__main__":
    sys.exit(main())
