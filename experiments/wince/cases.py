"""Pairs of postures at which viewers winced, drawn: what they look like now, for a look before and after a change.

    python experiments/wince/cases.py FOLDER [--case NAME ...]

Each is a tween of the bundled ballet with nothing asked of it, in twelve postures evenly spread over its time, at half
the size of a contact sheet. The handstand is the fifth position of the arms and feet, upside down, with its hands
on the floor.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from motionmind import Engine, Posture, draw_sheet, own_skeleton, read_posture
from motionmind._typing import Floats
from motionmind.body.contact import lowest_height
from motionmind.geometry import rotations as rot
from motionmind.render.sheet import evenly, png

POSTURES = Path(__file__).parents[2] / "corpora" / "ballet" / "postures"
SHOWN = 12  # postures of a case
APART = 2.5  # metres
TURNED = 160.0  # degrees


def named(name: str) -> Posture:
    """A posture of the bundled ballet."""
    return own_skeleton(read_posture(POSTURES / f"{name}.json").as_motion()).posture(0)


def highest(name: str) -> Posture:
    """The posture of a clip of the bundled ballet whose lowest point is highest."""
    corpus = Engine.load("ballet").corpus
    motion = corpus.motion(next(clip for clip in corpus.clips if clip.name == name))
    return motion.posture(int(lowest_height(motion.skeleton, motion.rotations, motion.root).argmax()))


def upside_down(posture: Posture) -> Posture:
    """A posture turned over, with what is lowest then on the floor."""
    turned = whole_turned(posture, rot.from_axis_angle([1.0, 0.0, 0.0], np.pi))
    lift = np.array([0.0, lowest_height(turned.skeleton, turned.rotations, turned.root), 0.0])
    return replace(turned, root=turned.root - lift)


def whole_turned(posture: Posture, turn: Floats) -> Posture:
    """A posture turned about its root."""
    rotations = posture.rotations.copy()
    rotations[0] = rot.mul(turn, rotations[0])
    return replace(posture, rotations=rotations)


def moved(posture: Posture, by: tuple[float, float, float]) -> Posture:
    return replace(posture, root=posture.root + np.array(by))


CASES: dict[str, Callable[[], tuple[Posture, Posture]]] = {
    "arabesque-to-fifth": lambda: (named("arabesque"), named("fifth")),
    "bow-to-passe": lambda: (named("bow"), named("passe")),
    "fifth-into-a-jump": lambda: (named("fifth"), highest("sautes")),
    "fifth-into-a-grand-jete": lambda: (named("fifth"), highest("grand-jete")),
    "handstand-to-standing": lambda: (upside_down(named("arms-fifth")), named("fifth")),
    "far-apart": lambda: (named("fifth"), moved(named("tendu"), (APART, 0.0, 0.0))),
    "turned": lambda: (
        named("second"),
        whole_turned(named("fifth"), rot.from_axis_angle([0.0, 1.0, 0.0], np.radians(TURNED))),
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where the pictures go")
    parser.add_argument("--case", action="append", choices=CASES, help="draw this one; repeatable")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    engine = Engine.load("ballet")
    for name in asked.case or CASES:
        tween = engine.tween(*CASES[name]())
        motion = tween.motion
        path = asked.folder / f"{name}.png"
        sheet = draw_sheet(motion, evenly(range(len(motion)), SHOWN), columns=SHOWN // 2)
        path.write_bytes(png(sheet.reduce(2)))
        print(f"{path}: {tween.moves} moves in {motion.times[-1]:.2f} s")


if __name__ == "__main__":
    main()
