"""Check what README and the guides claim of commands, against the same commands without the option."""

from __future__ import annotations

import contextlib
import re
import shlex
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from bundled_clips import ballet_clip

from motionmind import Motion, read_motion, read_posture, write_motion
from motionmind.cli import main
from motionmind.geometry import rotations as rot
from motionmind.tween.engine import Engine
from motionmind.tween.report import TweenReport, read_report

ROOT = Path(__file__).parents[2]
README, TUTORIAL, TWEEN = (ROOT / name for name in ("README.md", "docs/tutorial.md", "docs/how-to/tween.md"))
CLIP = ballet_clip("adagio").resample(30.0).slice(0, 600)


class Made(NamedTuple):
    """A movement that a command made, and its report."""

    motion: Motion
    report: TweenReport

    @property
    def seconds(self) -> float:
        return float(self.motion.times[-1])


Check = Callable[[Made, list[Made]], bool]  # takes the plain tween, and what the command made


@dataclass(frozen=True)
class Claim:
    """A claim of a document.

    Attributes:
        document: the document.
        text: its words, as they stand there.
        options: what only the documented command has, of all commands there.
        holds: whether the claim is true.
    """

    document: Path
    text: str
    options: str
    holds: Check

    def __str__(self) -> str:
        return f"{self.document.stem}:{self.options}"


# --- quantities -------------------------------------------------------------------------------------------------------


def velocities(motion: Motion) -> np.ndarray:
    """Return the joints' velocities between frames, radians per second [T - 1, J, 3]."""
    turns = rot.log(rot.inv_mul(motion.rotations[:-1], motion.rotations[1:]))
    return np.asarray(turns / np.diff(motion.times)[:, None, None])


def energy(made: Made) -> float:
    """Return the mean square of the joints' velocities."""
    return float(np.mean(velocities(made.motion) ** 2))


def misfit(made: Made, seconds: tuple[float, float]) -> float:
    """Return the difference of the velocities at A and B from the recording's at two times, as a share of these."""
    moving = velocities(CLIP)
    wanted = np.stack([moving[round(30 * seconds[0]) - 1], moving[round(30 * seconds[1])]])
    assert np.degrees(np.linalg.norm(wanted, axis=-1)).max(axis=1).min() > 20.0, "the ends do not move"
    return float(np.linalg.norm(velocities(made.motion)[[0, -1]] - wanted) / np.linalg.norm(wanted))


def farthest(one: Made, other: Made) -> float:
    """Return the greatest mean angle of joints between two movements, at equal shares of their times, degrees."""
    shares = np.linspace(0.0, 1.0, 50)
    frames = [np.rint(shares * (len(made.motion) - 1)).astype(int) for made in (one, other)]
    angles = rot.angle(one.motion.rotations[frames[0]], other.motion.rotations[frames[1]])
    return float(np.degrees(angles.mean(axis=1).max()))


def differing(one: Made, other: Made) -> float:
    """Return the share of joints' states in which two paths differ between A and B."""
    return float(np.mean(np.array(one.report.path)[1:-1] != np.array(other.report.path)[1:-1]))


def drift(made: Made, joint: str) -> float:
    """Return a joint's greatest distance from its place in A, metres."""
    motion = made.motion
    places = motion.positions()
    at = places[:, motion.skeleton.names.index(joint)]
    return float(np.linalg.norm(at - at[0], axis=1).max())


def nearest(made: Made, posture: str) -> float:
    """Return the least mean angle of joints between the movement and a posture, degrees."""
    wanted = read_posture(posture).rotations
    return float(np.degrees(rot.angle(made.motion.rotations, wanted).mean(axis=1).min()))


def rarity_price(made: Made) -> float:
    """Return the slope of a move's cost over -log of its likelihood: the price of rarity."""
    rarity = -np.log(made.report.likelihood)  # without a bridge in sight
    return float(np.polyfit(rarity.ravel(), np.ravel(made.report.costs.moves), 1)[0])


def passages_of(made: Made) -> set[float]:
    """Return the times in the recording of the passages that a movement follows, seconds."""
    return {round(source.seconds, 1) for source in made.report.detail}


def states_of(made: Made, joint: str) -> list[int]:
    at = made.report.joints.index(joint)
    return [row[at] for row in made.report.path]


def starts_as_recorded(plain: Made, made: list[Made]) -> bool:
    return misfit(made[0], (6.0, 2.0)) < 0.5 * misfit(plain, (6.0, 2.0))


def are_different(share: float) -> Check:
    """Return whether all differ by a share of their states, in equally many moves, and visibly."""

    def check(_: Made, made: list[Made]) -> bool:
        assert len(made) > 2
        assert len({one.report.moves for one in made}) == 1
        pairs = list(combinations(made, 2))
        return min(differing(*pair) for pair in pairs) >= share and min(farthest(*pair) for pair in pairs) > 5.0

    return check


# --- claims -----------------------------------------------------------------------------------------------------------

CLAIMS = [
    Claim(
        README,
        "the left foot stays in place",
        "ballet/arabesque ballet/fifth",
        lambda _, made: drift(made[0], "left_toes") < 0.03 and drift(made[0], "right_toes") > 1.0,
    ),
    Claim(README, "leaves and arrives with the velocity of the recording", "@6.0s~", starts_as_recorded),
    Claim(TUTORIAL, "no path through the states costs less", "--report", lambda _, made: made[0].report.gap < 1e-9),
    Claim(
        TUTORIAL,
        "A `--pace` below 1 makes it slower",
        "--pace 0.7",
        lambda plain, made: made[0].seconds > 1.2 * plain.seconds and energy(made[0]) < energy(plain),
    ),
    Claim(TUTORIAL, "finds clearly different movements", "--alternatives 3", are_different(0.2)),
    Claim(
        TUTORIAL,
        "lets rare moves compete with frequent ones",
        "--novelty 0.5",
        lambda plain, made: rarity_price(made[0]) < 0.8 * rarity_price(plain),
    ),
    Claim(TWEEN, "also takes the clip's velocity there", "@6.0s~", starts_as_recorded),
    Claim(TWEEN, "fixes or bounds the number of moves", "--moves 8 -o", lambda _, made: made[0].report.moves == 8),
    Claim(TWEEN, "fixes or bounds the number of moves", "6..10", lambda _, made: 6 <= made[0].report.moves <= 10),
    Claim(TWEEN, "sets the seconds", "--duration 2.5", lambda _, made: abs(made[0].seconds - 2.5) < 0.02),
    Claim(
        TWEEN,
        "`--pace 1.2` makes it 1.2 times as fast",
        "--pace 1.2",
        lambda plain, made: abs(plain.seconds / made[0].seconds - 1.2) < 0.05,
    ),
    Claim(
        TWEEN,
        "passes through posture C",
        "--via C.json -o",
        lambda plain, made: nearest(made[0], "C.json") < min(8.0, 0.7 * nearest(plain, "C.json")),
    ),
    Claim(
        TWEEN,
        "keeps A's state until the last move",
        "--pin left_elbow -o",
        lambda plain, made: (
            len(set(states_of(made[0], "left_elbow")[:-1])) == 1 < len(set(states_of(plain, "left_elbow")[:-1]))
        ),
    ),
    Claim(
        TWEEN,
        "leaves one out, to see its effect",
        "--without balance",
        lambda plain, made: farthest(plain, made[0]) > 0.5,
    ),
    Claim(
        TWEEN, "calmer than any dancer", "--liveliness 0 ", lambda plain, made: energy(made[0]) < 0.95 * energy(plain)
    ),
    Claim(TWEEN, "is livelier", "--liveliness 0.8", lambda plain, made: energy(made[0]) > 1.01 * energy(plain)),
    Claim(
        TWEEN,
        "follows the passage at 4 s in the recording `clip`",
        "--passage clip@4",
        lambda plain, made: 4.0 in passages_of(made[0]) - passages_of(plain),
    ),
    Claim(
        TWEEN,
        "0, where frequent moves are cheap",
        "--novelty 0.5",
        lambda plain, made: rarity_price(made[0]) < 0.8 * rarity_price(plain),
    ),
    Claim(TWEEN, "`--differ 0.3` makes that 30 %", "--differ 0.3", are_different(0.3)),
    Claim(
        TWEEN,
        "The first is the usual tween",
        "--differ 0.3",
        lambda plain, made: made[0].report.path == plain.report.path,
    ),
    Claim(TWEEN, "draws a random path", "--sample", lambda plain, made: made[0].report.path != plain.report.path),
]


# --- running ----------------------------------------------------------------------------------------------------------


class Guide:
    """A document whose commands run in a folder of its own, with a recording and the corpus that it builds."""

    def __init__(self, document: Path, folder: Path) -> None:
        self.folder = folder
        self._made: dict[str, list[Made]] = {}
        self.text = " ".join(document.read_text("utf-8").split())
        self.commands = re.findall(r"^    (?:.* && )?(motionmind .*)$", document.read_text("utf-8"), re.M)
        with self.inside():
            write_motion("clip.bvh", CLIP)
            for line in self.commands:
                if line.startswith(("motionmind corpus build", "motionmind posture ")):
                    run(line)

    @contextlib.contextmanager
    def inside(self) -> Iterator[None]:
        with contextlib.chdir(self.folder), pytest.MonkeyPatch.context() as patch:
            patch.setenv("MOTIONMIND_HOME", str(self.folder / "home"))
            yield

    def verify(self, claim: Claim) -> bool:
        """Return whether a claim is in the document, and true of the one command with its options."""
        assert claim.text in self.text
        (line,) = (line for line in self.commands if line.startswith("motionmind tween") and claim.options in line)
        words = shlex.split(line)[1:]
        with self.inside():
            plain = [word.removesuffix("~") for word in words[:3]]
            if "--corpus" in words:
                plain += words[words.index("--corpus") :][:2]
            return bool(claim.holds(self._tweens(plain)[0], self._tweens(words)))

    def _tweens(self, words: list[str]) -> list[Made]:
        """Return what a tween command makes, whatever files it names."""
        kept = list(words)
        for option in ("-o", "--report"):
            if option in kept:
                at = kept.index(option)
                del kept[at : at + 2]
        if (line := shlex.join(kept)) not in self._made:
            folder = tempfile.mkdtemp(dir=".")
            run(f"motionmind {line} -o {folder}/motion.json --report {folder}/report.json")
            files = zip(sorted(Path(folder).glob("motion*")), sorted(Path(folder).glob("report*")), strict=True)
            self._made[line] = [Made(read_motion(motion), read_report(report)) for motion, report in files]
        return self._made[line]


def run(line: str) -> None:
    """Run a command line in this process; words with a * are patterns, as a shell has them."""
    words = [name for word in shlex.split(line)[1:] for name in (sorted(Path().glob(word)) if "*" in word else [word])]
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    assert ended.value.code == 0, line


@pytest.fixture(scope="module")
def guide(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], Guide]:
    """Return a function that sets up a document at its first use."""
    return cache(lambda document: Guide(document, tmp_path_factory.mktemp(document.stem)))


@pytest.mark.parametrize("claim", CLAIMS, ids=str)
def test_a_claim_is_in_its_document_and_true(claim: Claim, guide: Callable[[Path], Guide]) -> None:
    assert guide(claim.document).verify(claim), claim.text


def test_a_greater_tolerance_joins_more_postures_as_the_tutorial_says(guide: Callable[[Path], Guide]) -> None:
    tutorial = guide(TUTORIAL)
    assert "add more clips, or raise `--tolerance`" in tutorial.text
    (build,) = (line for line in tutorial.commands if "corpus build" in line)
    assert build.endswith("--tolerance 15")
    with tutorial.inside():
        run(build.replace(" mine ", " coarser ").replace("--tolerance 15", "--tolerance 25"))
        joinable = [Engine.load(name).check(500)["joinable"] for name in ("mine", "coarser")]
    assert joinable[0] < joinable[1]
