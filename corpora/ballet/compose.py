"""The ballet corpus, composed by hand.

Two things are written here. The **vocabulary** says what a leg, an arm, a torso or a head does in a named position,
in degrees, for the left side only: the right one is its mirror image. The **phrases** put the parts together, one
posture a line, each part changing when it likes. Run this file to write the corpus again:

    python corpora/ballet/compose.py
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from motionmind import rotations as rot
from motionmind.formats import write_atomically, write_motion, write_posture
from motionmind.motion import Motion
from motionmind.skeleton import human23

Array = NDArray[np.float64]

BODY = human23()
TURNOUT = 60.0
TOLERANCE = 6.0  # degrees within which orientations count as the same state

# ---------------------------------------------------------------------------------------------- geometry of the body


def turns(order: str, *degrees: float) -> Array:
    """The rotation of turns about the axes in `order`, each about the axes as the one before left them."""
    return rot.from_euler(order, np.radians(degrees))


def segment(joint: str) -> Array:
    """Where the left side's `joint` lies in its parent's frame."""
    return np.array(BODY.offsets[BODY.index(f"left_{joint}")])


class Leg(NamedTuple):
    """A left leg. One that bears weight stands up from the floor; any other hangs from the pelvis."""

    hip: Array
    knee: Array
    ankle: Array
    toes: Array
    floor: str = ""  # "stands" or "touches"


def reach(target: Array, towards: float, end: Array, bend: float | None = None) -> tuple[Array, Array]:
    """Hip and knee that bring `end`, a place in the shank's frame, in line with `target`, seen from the hip.

    The knee points `towards` degrees outward. `bend` is the knee's; without it the knee bends until `end` is at
    `target`.
    """
    thigh, shank = -segment("knee")[1], np.hypot(end[1], end[2])
    slant = np.degrees(np.arctan2(end[2], -end[1]))
    if bend is None:
        cosine = (target @ target - thigh**2 - shank**2) / (2.0 * thigh * shank)
        bend = float(np.degrees(np.arccos(cosine)) + slant)
    knee = turns("x", bend)
    end = segment("knee") + rot.mul_vec(knee, end)
    down = target / np.linalg.norm(target)
    across = np.cross(rot.mul_vec(turns("y", towards), np.array([0.0, 0.0, 1.0])), down)
    across /= np.linalg.norm(across)
    line = rot.from_matrix(np.stack([across, -down, np.cross(down, across)], axis=-1))
    return rot.mul(line, rot.from_axis_angle([1.0, 0.0, 0.0], np.arctan2(end[2], -end[1]))), knee


def stand(across: float, ahead: float, bend: float = 0.0, heel: float = 0.0) -> Leg:
    """A leg that bears weight: the ball of the foot `across` and `ahead` of the hip (metres), the knee bent over it.

    The heel is lifted by `heel` degrees; the toes stay flat.
    """
    foot = turns("yx", TURNOUT, heel)
    ankle = np.array([across, 0.0, ahead]) - rot.mul_vec(foot, segment("toes"))
    length = np.linalg.norm(segment("knee") + rot.mul_vec(turns("x", bend), segment("ankle")))
    ankle[1] = -np.sqrt(length**2 - ankle[0] ** 2 - ankle[2] ** 2)
    hip, knee = reach(ankle, TURNOUT, segment("ankle"), bend)
    return Leg(hip, knee, rot.inv_mul(rot.mul(hip, knee), foot), turns("x", -heel), "stands")


def peel(across: float, ahead: float, heel: float) -> Leg:
    """A foot peeled off the floor down to its ball, the knee giving way, beside a straight standing leg."""
    foot = turns("yx", TURNOUT, heel)
    ankle = np.array([across, -hip_height(), ahead]) - rot.mul_vec(foot, segment("toes"))
    hip, knee = reach(ankle, TURNOUT, segment("ankle"))
    return Leg(hip, knee, rot.inv_mul(rot.mul(hip, knee), foot), turns("x", -heel), "touches")


def hip_height() -> float:
    """Height in metres of the hips over one straight standing leg."""
    leg = rot.mul_vec(STANDING["on"].hip, segment("knee") + segment("ankle")) + segment("toes")
    return -float(leg[1])


def lift(
    towards: float, height: float, knee: float = 0.0, out: float = TURNOUT, foot: float = 58.0, toes: float = 15.0
) -> Leg:
    """A leg in the air: the thigh `height` degrees from hanging, `towards` 0 front, 90 side, 180 back."""
    hip = rot.mul(turns("yxy", towards, -height, -towards), turns("y", out))
    return Leg(hip, turns("x", knee), turns("x", foot), turns("x", toes))


def arm(
    plane: float,
    raised: float,
    out: float,
    elbow: float,
    palm: float,
    wrist: tuple[float, float] = (0.0, 0.0),
    shoulder: tuple[float, float] = (0.0, 0.0),
    fingers: float = 14.0,
) -> dict[str, Array]:
    """A left arm.

    plane, raised: where the upper arm points: `plane` 0 to the side, 90 to the front; `raised` 0 down, 180 up.
    out: turn of the upper arm about itself; at 0 the elbow folds forward from the side, outward is up from there.
    elbow, palm: the elbow's flexion and the forearm's turn, which takes the palm up from facing down.
    wrist: flexion towards the palm, and towards the thumb.
    shoulder: the shoulder girdle lifted, and drawn forward.
    fingers: how far they curl.
    """
    clavicle = turns("yz", -shoulder[1], shoulder[0])
    return {
        "clavicle": clavicle,
        "shoulder": rot.inv_mul(clavicle, turns("yzx", -plane, raised - 90.0, -out)),
        "elbow": turns("yx", -elbow, -palm),
        "wrist": turns("yz", -wrist[1], -wrist[0]),
        "fingers": turns("z", -fingers),
    }


def rest(towards: float, foot: float, toes: float) -> Leg:
    """A straight leg stretched out along the floor, beside a standing leg that is straight too."""
    straight = segment("knee") + segment("ankle")
    ball = straight + rot.mul_vec(turns("x", foot), segment("toes"))
    tip = ball + rot.mul_vec(turns("x", foot + toes), BODY.tips[BODY.index("left_toes")])
    raised = 0.0
    for point in (ball, tip):
        out = point[2] * np.cos(np.radians(TURNOUT - towards))
        angle = np.arccos(hip_height() / np.hypot(point[1], out)) - np.arctan2(out, -point[1])
        raised = max(raised, float(np.degrees(angle)))
    return lift(towards, raised, foot=foot, toes=toes)._replace(floor="touches")


def draw_up(across: float, up: float, ahead: float, towards: float) -> Leg:
    """A bent leg whose pointed foot is drawn up along the standing one: its tip, seen from the hip, in metres."""
    foot, toes = turns("x", 58.0), turns("x", 15.0)
    tip = rot.mul_vec(toes, BODY.tips[BODY.index("left_toes")])
    end = segment("ankle") + rot.mul_vec(foot, segment("toes") + tip)
    return Leg(*reach(np.array([across, up, ahead]), towards, end), foot, toes)


def torso(*bends: tuple[float, float, float]) -> dict[str, Array]:
    """Pelvis, lumbar and thorax, each bent forward and to the left, then turned to the left."""
    return {
        joint: turns("yzx", turn, -left, forward)
        for joint, (forward, left, turn) in zip(("pelvis", "lumbar", "thorax"), bends, strict=True)
    }


def head(turn: float, left: float = 0.0, up: float = 0.0) -> dict[str, Array]:
    """The head turned to the left, inclined to the left, lifted; two parts in five of it by the neck."""
    shares = {"cervical": 0.4, "atlantal": 0.6}
    return {joint: turns("yzx", turn * share, -left * share, -up * share) for joint, share in shares.items()}


# ------------------------------------------------------------------------------------------------- the vocabulary

# Where the ball of a foot stands, seen from its own hip: (across, ahead) flat, and on demi-pointe, where the weight
# moves forward over the ball.
PLACES = {
    "first": ((0.073, 0.035), (0.073, -0.010)),
    "second": ((0.270, 0.035), (0.270, -0.010)),
    "fourth front": ((0.043, 0.225), (0.043, 0.192)),
    "fourth back": ((0.043, -0.095), (0.043, -0.128)),
    "fifth front": ((0.013, 0.125), (0.013, 0.081)),
    "fifth back": ((0.013, 0.005), (0.013, -0.039)),
    "bow": ((0.073, 0.235), (0.073, 0.190)),
    "arched": ((0.073, -0.055), (0.073, -0.100)),
    "on": ((-0.040, 0.040), (-0.115, -0.005)),
    "on side": ((-0.060, 0.040), (-0.115, -0.005)),
}
# How a standing leg stands: degrees of the knee, and of the lifted heel.
LEVELS = {
    "": (0.0, 0.0),
    "half": (29.0, 0.0),
    "plie": (58.0, 0.0),
    "deep": (92.0, 16.0),
    "grand": (124.0, 34.0),
    "push": (22.0, 30.0),
    "rise": (0.0, 24.0),
    "releve": (0.0, 48.0),
}


def weight(place: str, bend: float, heel: float) -> Leg:
    """A standing leg with the weight as far over the ball of the foot as the heel is lifted."""
    flat, high = PLACES[place]
    share = min(heel / 24.0, 1.0)
    across, ahead = (a + (b - a) * share for a, b in zip(flat, high, strict=True))
    return stand(across, ahead, bend, heel)


STANDING = {
    f"{place} {level}".strip(): weight(place, bend, heel) for place in PLACES for level, (bend, heel) in LEVELS.items()
}
LEGS = STANDING | {
    "slide front": rest(-8, 28, -20),
    "slide side": rest(82, 28, -20),
    "slide back": rest(188, 28, -20),
    "tendu front": rest(-8, 58, 15),
    "tendu side": rest(82, 58, 15),
    "tendu back": rest(188, 58, 15),
    "degage front": lift(-8, 46),
    "degage side": lift(82, 46),
    "degage back": lift(180, 34),
    "half front": lift(-6, 68),
    "half side": lift(82, 68, out=64),
    "high front": lift(-4, 90),
    "high side": lift(80, 90, out=68),
    "arabesque": lift(160, 44),
    "peel": peel(0.02, 0.11, 42),
    "brush side": lift(82, 38, foot=20, toes=0),
    "cou-de-pied front": draw_up(0.02, -0.83, 0.10, 62),
    "cou-de-pied back": draw_up(0.02, -0.83, -0.10, 70),
    "coupe front": draw_up(0.02, -0.70, 0.10, 62),
    "coupe back": draw_up(0.02, -0.70, -0.10, 70),
    "passe": draw_up(-0.05, -0.455, 0.04, 64),
    "attitude front": lift(20, 78, knee=85),
    "attitude side": lift(66, 86, knee=85),
    "attitude back": lift(140, 42, knee=80),
    "unfold front": lift(4, 86, knee=40),
    "unfold side": lift(76, 90, knee=40, out=64),
    "enveloppe side": lift(75, 66, knee=50),
    "unfold back": lift(152, 44, knee=38),
    "air first": lift(90, 2),
    "air second": lift(86, 27),
    "air fifth front": lift(-55, 7),
    "air fifth back": lift(235, 7),
}
ARMS = {
    "bas": arm(15, 14, -30, 38, 18, (14, 0), (0, 4)),
    "low": arm(52, 45, -11, 52, 51, (14, 0), (1, 6)),
    "first": arm(57, 70, -4, 59, 57, (14, 0), (3, 8)),
    "high": arm(54, 105, 23, 66, 67, (14, 0), (10, 8)),
    "fifth": arm(37, 141, 65, 57, 62, (14, 0), (20, 4)),
    "wide": arm(22, 71, 13, 38, 46, (8, 0), (4, 5)),
    "second": arm(5, 78, 24, 20, 31, (4, 0), (4, 2)),
    "demi-second": arm(0, 42, 5, 24, 35, (6, 0), (1, 2)),
    "ajar": arm(5, 25, -8, 32, 26, (10, 0), (0, 3)),
    "upper": arm(-10, 122, 39, 37, 49, (8, 0), (12, 2)),
    "crown": arm(14, 132, 52, 47, 55, (11, 0), (16, 2)),
    "reaching": arm(74, 86, -2, 32, 28, (8, 0), (6, 6), 9),
    "front": arm(90, 102, 0, 6, 0, (0, 0), (8, 6), 4),
    "side": arm(2, 90, 0, 5, 0, (0, 0), (4, 0), 4),
}
TORSOS = {
    "upright": torso((0, 0, 0), (0, 0, 0), (0, 0, 0)),
    "turned left": torso((0, 0, 0), (0, 0, 8), (0, 0, 16)),
    "inclined left": torso((0, 0, 0), (0, 9, 0), (3, 14, 0)),
    "forward half": torso((22, 0, 0), (12, 0, 0), (8, 0, 0)),
    "forward": torso((54, 0, 0), (24, 0, 0), (16, 0, 0)),
    "forward low": torso((86, 0, 0), (36, 0, 0), (24, 0, 0)),
    "lifted": torso((0, 0, 0), (-9, 0, 0), (-11, 0, 0)),
    "back": torso((0, 0, 0), (-20, 0, 0), (-22, 0, 0)),
    "devant": torso((-8, 0, 0), (4, 0, 0), (-2, 0, 0)),
    "listed left": torso((0, -10, 0), (0, 5, 0), (0, 0, 0)),
    "derriere left": torso((18, -2, 4), (-8, 0, -2), (-8, 0, -2)),
    "attitude left": torso((32, -6, 8), (-18, 4, -4), (-14, 0, -4)),
    "arabesque left": torso((46, -6, 10), (-22, 4, -5), (-16, 0, -5)),
}
HEADS = {
    "front": head(0),
    "left": head(42),
    "incline left": head(24, 14, -8),
    "lifted left": head(26, 6, 16),
    "up": head(0, 0, 22),
    "down": head(0, 0, -24),
}

# --------------------------------------------------------------------------------------- phrases: posture by posture

SIDE = re.compile(r"\b(left|right)\b")


@dataclass(frozen=True)
class Row:
    """One posture and the move that led to it."""

    seconds: float
    up: float | None  # metres from the floor to the lowest point; None where the feet stand
    travel: tuple[float, float]  # metres to the left and ahead, in a move without a foot on the floor
    face: float  # degrees to the left of the audience
    legs: tuple[str, str]  # left, right
    arms: tuple[str, str]
    torso: str
    head: str

    @property
    def body(self) -> tuple[object, ...]:
        """The posture without the way there."""
        return self.up, self.face, self.legs, self.arms, self.torso, self.head


def phrase(text: str) -> list[Row]:
    """Rows from lines of `seconds | legs | arms | torso | head`; what is not written stays as it was.

    `a / b` is the left and the right, one word is both; `fifth left` has the left foot in front. After the seconds,
    `up 0.2` is in the air, `left 0.3` and `ahead 0.3` travel there, and `face 45` turns the whole body.
    """
    rows = []
    cells = ["", "", "", "upright", "front"]
    seconds, face = 0.0, 0.0
    for line in text.strip().splitlines():
        written = [cell.strip() for cell in line.split("|")]
        cells = [new or old for new, old in zip(written + [""] * (5 - len(written)), cells, strict=True)]
        how = written[0].split()
        given = dict(zip(how[1::2], map(float, how[2::2]), strict=True))
        seconds, face = float(how[0]) if how else seconds, given.get("face", face)
        travel = (given.get("left", 0.0), given.get("ahead", 0.0))
        rows.append(Row(seconds, given.get("up"), travel, face, both(cells[1]), both(cells[2]), *cells[3:]))
    return rows


def both(cell: str) -> tuple[str, str]:
    """What the left and the right side do."""
    if "/" in cell:
        left, right = cell.split("/")
        return left.strip(), right.strip()
    front, back = SIDE.sub("front", cell), SIDE.sub("back", cell)
    return (back, front) if "right" in cell.split() else (front, back)


def other_side(rows: list[Row]) -> list[Row]:
    """The same with left and right exchanged."""
    return [
        replace(
            row,
            travel=(-row.travel[0], row.travel[1]),
            face=-row.face,
            legs=row.legs[::-1],
            arms=row.arms[::-1],
            torso=opposite(row.torso),
            head=opposite(row.head),
        )
        for row in rows
    ]


def opposite(name: str) -> str:
    """The name of the same thing on the other side."""
    return SIDE.sub(lambda side: "left" if side[0] == "right" else "right", name)


def back(rows: list[Row]) -> list[Row]:
    """The way back through the same postures."""
    return [
        rows[-1],
        *(replace(row, seconds=after.seconds) for row, after in zip(rows[-2::-1], rows[:0:-1], strict=True)),
    ]


def out_and_back(rows: list[Row]) -> list[Row]:
    """The rows, and the way back."""
    return join(rows, back(rows))


def over(legs: list[Row], above: list[Row]) -> list[Row]:
    """The legs and times of one phrase under the arms, torso and head of another; a shorter one holds its end."""
    upper = [above[min(i, len(above) - 1)] for i in range(len(legs))]
    return [
        replace(low, arms=high.arms, torso=high.torso, head=high.head) for low, high in zip(legs, upper, strict=True)
    ]


def join(*phrases: list[Row]) -> list[Row]:
    """One phrase after the other, each beginning with the posture that the last one ended with."""
    rows = phrases[0][:1]
    for part in phrases:
        if part[0].body != rows[-1].body:
            raise ValueError(f"a phrase begins with {part[0].body}, but the last one ended with {rows[-1].body}")
        rows = rows + part[1:]
    return rows


# ------------------------------------------------------------------------------------------------ rows to movement


def look_up(vocabulary: dict[str, dict[str, Array]], name: str) -> dict[str, Array]:
    """What a torso or a head does; the right is the mirror image of the left."""
    if "right" not in name.split():
        return vocabulary[name]
    return {joint: rot.mirror(turn) for joint, turn in vocabulary[opposite(name)].items()}


def rotations(row: Row) -> Array:
    """Local rotations [J, 4] of a row's posture, rounded: the same bytes on every machine."""
    trunk = look_up(TORSOS, row.torso)
    turned = trunk | look_up(HEADS, row.head) | {"pelvis": rot.mul(turns("y", row.face), trunk["pelvis"])}
    for i, side in enumerate(("left", "right")):
        leg, flip = LEGS[row.legs[i]], rot.mirror if side == "right" else np.array
        # A standing leg stays upright when the pelvis tilts on it; a free one goes along.
        hip = rot.inv_mul(trunk["pelvis"], flip(leg.hip)) if leg.floor == "stands" else flip(leg.hip)
        limb = leg._asdict() | ARMS[row.arms[i]]
        turned |= {f"{side}_{joint}": flip(turn) for joint, turn in limb.items() if joint != "floor"}
        turned[f"{side}_hip"] = hip
    return np.round(rot.canonical(np.array([turned[name] for name in BODY.names])), 8) + 0.0


def motion(name: str, rows: list[Row]) -> Motion:
    """The rows with times, and the root where the feet put it."""
    turned = np.array([rotations(row) for row in rows])
    points = BODY.positions_and_tips(turned, np.zeros(3))
    feet = points[:, [len(BODY) + BODY.index(f"{side}_toes") for side in ("left", "right")]]
    lowest = points[:, :, 1].min(axis=1)
    root = np.zeros((len(rows), 3))
    for i, row in enumerate(rows):
        root[i, 1] = (row.up or 0.0) - lowest[i]
        if i == 0:
            continue
        held = held_feet(rows[i - 1], row)
        if held:
            moved = np.mean([feet[i - 1, foot] - feet[i, foot] for foot in held], axis=0)
        else:
            moved = rot.mul_vec(turns("y", row.face), np.array([row.travel[0], 0.0, row.travel[1]]))
        root[i, [0, 2]] = root[i - 1, [0, 2]] + moved[[0, 2]]
    times = np.cumsum([0.0, *(row.seconds for row in rows[1:])])
    return Motion(BODY, turned, np.round(root, 5) + 0.0, np.round(times, 3), name)


def held_feet(before: Row, after: Row) -> list[int]:
    """The feet (0 left, 1 right) that stay where they are in a move: those that stand, or else those that touch."""
    if before.up is not None or after.up is not None:
        return []
    floors = [(LEGS[before.legs[i]].floor, LEGS[after.legs[i]].floor) for i in (0, 1)]
    standing = [i for i in (0, 1) if floors[i] == ("stands", "stands")]
    return standing or [i for i in (0, 1) if all(floors[i])]


# ---------------------------------------------------------------------------------------------------- the exercises

JUMP = phrase("""
    0          | fifth right      | bas           | upright      | right
    .30        | fifth right plie | low           |              | front
    .15        | fifth right push | first         |              |
    .15 up .24 | air fifth right  | high / wide   | turned right | left
    .20        | fifth right push | wide          | upright      |
    .15        | fifth right plie | demi-second   |              | front
    .30        | fifth right      | ajar          |              | right
""")

# Plies and releves, in each position of the feet.
OPENING = phrase("""
    0   | first | bas
    .5  |       | low           |         | incline left
    .5  |       | first
    .5  |       | wide          |         | front
    .5  |       | second        |         | left
""")
DEMI = """
    0   | PLACE      | second      |              | left
    .4  | PLACE half |             |              | front
    .4  | PLACE plie | demi-second |              | incline right
"""
GRAND = """
    0   | PLACE plie  | demi-second |             | incline right
    .4  | PLACE deep  | ajar        |
    .4  | PLACE grand | bas         |             | down
    .4  | PLACE deep  | low         |             | front
    .4  | PLACE plie  | first       |             | incline left
    .4  | PLACE half  | wide
    .4  | PLACE       | second      |             | left
"""
RELEVE = """
    0   | PLACE        | second     |             | left
    .4  | PLACE rise   | upper      |             | front
    .4  | PLACE releve | crown      |             | up
    .4  |              | fifth      |             | front
"""
TO_SECOND = phrase("""
    0   | first             | second | | left
    .3  | on / slide side   |        | | front
    .3  | on / tendu side   |        | | right
    .4  | second            |        | | left
    .4  | second half       | demi-second | | front
    .4  | second plie       | ajar
    .4  |                   | low    | | incline right
    .4  | second half       | first
    .4  | second            | wide   | | front
    .4  |                   | second | | left
""")
TO_FOURTH = phrase("""
    0   | second            | second | | left
    .3  | on / tendu side   |        | | front
    .3  | on / tendu front  | second / wide |
    .4  | fourth right      | second | | left
""")
TO_FIFTH = phrase("""
    0   | fourth right      | second | | left
    .3  | on / tendu front  | second / demi-second | | front
    .3  | on / slide front  | demi-second / ajar |
    .3  | fifth right       | second | | left
""")
CLOSING = phrase("""
    0   | fifth right       | second | | left
    .5  |                   | side
    .5  |                   | demi-second | | front
    .5  |                   | ajar
    .5  |                   | bas
""")


def at(place: str, *texts: str) -> list[Row]:
    """The phrases one after the other, in one position of the feet; a releve comes back by the same way."""
    return join(*(phrase(text.replace("PLACE", place)) for text in texts))


def plies(place: str) -> list[Row]:
    """Demi-plie, grand plie and releve in one position of the feet."""
    releve = at(place, RELEVE)
    return join(at(place, DEMI), at(place, GRAND), releve, back(releve))


PREPARATION = phrase("""
    0   | fifth right | bas    | upright | right
    .4  |             | low    |         | incline left
    .4  |             | first  |         | front
    .4  |             | wide
    .4  |             | second |         | left
""")

# Tendus, degages, battements: from fifth to the front, to the side closing behind, to the back.
TENDU_FRONT = phrase("""
    0   | fifth right      | second        | upright | left
    .3  | on / slide front |
    .3  | on / tendu front | second / wide | turned right
""")
TENDU_SIDE = phrase("""
    0   | fifth right      | second        | upright | left
    .3  | on / slide side  |               |         | front
    .3  | on / tendu side  |               |         | right
    .3  | on / slide side  | second        |         | front
    .3  | fifth left       | second        |         | right
""")
TENDU_BACK = phrase("""
    0   | fifth left       | second        | upright | right
    .3  | on / slide back  | wide / second |         | front
    .3  | on / tendu back  | reaching / side |       | left
""")
KICK_FRONT = phrase("""
    0    | fifth right          | second | upright | left
    .15  | on / slide front
    .15  | on / tendu front
    .15  | on / degage front
    .15  | on / half front      | upper / second
    .15  | on / high front      | crown / second | devant
""")
KICK_SIDE = phrase("""
    0    | fifth right          | second | upright | left
    .15  | on / slide side
    .15  | on / tendu side
    .15  | on / degage side     |        |         | front
    .15  | on side / half side  |        | listed right
    .15  | on side / high side  | upper
""")
KICK_BACK = phrase("""
    0    | fifth left           | second | upright | right
    .15  | on / slide back
    .15  | on / tendu back      |        |         | front
    .15  | on / degage back | wide / second | derriere right
    .20  | on / arabesque  | reaching / second | arabesque right
""")
FIFTH_EN_HAUT = phrase("""
    0    | fifth right | second               | upright | left
    .3   |             | upper / demi-second
    .3   |             | crown / ajar         |         | incline right
    .3   |             | fifth / bas
    .3   |             | fifth / low          |         | incline left
    .3   |             | fifth / first        |         | front
    .3   |             | fifth / wide
    .3   |             | fifth / second       |         | right
""")


# Port de bras: the legs stay in fifth or in tendu, the arms and the torso move.
CIRCLE = phrase("""
    0   | fifth right | bas    | upright | right
    .5  |             | low    |         | incline left
    .5  |             | first
    .5  |             | high   |         | front
    .5  |             | crown  |         | up
    .5  |             | fifth
    .5  |             | crown  |         | front
    .5  |             | upper  |         | left
    .5  |             | second
    .5  |             | demi-second |    | front
    .5  |             | ajar   |         | incline right
    .5  |             | bas    |         | right
""")
ONE_BY_ONE = phrase("""
    0   | fifth right | bas             | upright       | right
    .5  |             | low             |               | front
    .5  |             | first           |               | incline left
    .5  |             | high / wide     | turned right  | front
    .5  |             | fifth / second  |               | left
    .5  |             | fifth / demi-second | inclined right
    .5  |             | fifth / ajar    | inclined right | incline right
    .5  |             | fifth / low     | upright       | front
    .5  |             | fifth / first   |               | incline left
    .5  |             | crown / reaching
    .5  |             | upper / front   | turned left   | lifted right
    .5  |             | second / reaching
    .5  |             | second / wide   | upright       | front
    .5  |             | demi-second     |               | right
    .5  |             | ajar
    .5  |             | bas
""")
TO_FIRST = phrase("""
    0   | fifth right     | bas    | upright      | right
    .4  | on / slide side | low    |              | front
    .4  | on / tendu side | first
    .4  | on / slide side | high   |              | up
    .4  | first           | crown
    .4  |                 | fifth  |              | front
""")
BOW = phrase("""
    0   | first  | fifth  | upright      | front
    .6  | bow    | crown  | forward half
    .6  |        | fifth  | forward
    .6  |        |        | forward low  | down
    .6  |        |        |              | front
    .6  |        | crown  | forward
    .6  |        | high   | forward half | incline left
    .6  | first  |        | upright
    .6  |        | crown  |              | front
    .6  | arched | fifth  | lifted       | up
    .6  |        | crown  | back
    .6  |        | upper  |              | lifted left
    .6  |        | second | lifted
    .6  | first  |        | upright      | left
    .6  |        | upper / demi-second | inclined right | front
    .6  |        | crown / ajar |        | incline right
    .6  |        | upper / bas  | upright | front
    .6  |        | second / bas
    .6  |        | demi-second / bas
    .6  |        | ajar / bas
    .6  |        | bas
""")

# Adagio: developpes and poses on one leg, the right one working.
UP = phrase("""
    0   | fifth right         | bas   | upright | right
    .4  | on / peel           | low   |         | incline left
    .4  | on / coupe front    |       |         | front
    .4  | on / passe          | first
""")
DEVANT = phrase("""
    0   | on / passe          | first | upright | front
    .5  | on / attitude front | high  |         | lifted left
    .5  | on / unfold front   | crown / wide | devant
    .5  | on / high front     | fifth / second
    .8  |                     |
    .4  | on / half front
    .4  | on / degage front   | crown / second | upright | left
    .4  | on / tendu front    | upper / second
    .4  | on / slide front    | second |        | front
    .4  | fifth right         |       |         | right
""")
A_LA_SECONDE = phrase("""
    0   | on / passe          | first | upright | front
    .5  | on / attitude side  | wide  | listed right
    .5  | on side / unfold side | second |
    .5  | on side / high side |       |        | right
    .8  |
    .4  | on side / half side |       |         | front
    .4  | on / degage side    |       | upright
    .4  | on / tendu side     | demi-second
    .4  | on / slide side     | ajar  |         | incline left
    .4  | fifth left          | bas   |         | left
""")
ARABESQUE = phrase("""
    0   | fifth left          | bas   | upright | left
    .4  | on / slide back     | low   |         | front
    .4  | on / tendu back     | first |
    .4  | on / degage back | reaching / wide | derriere right
    .5  | on / arabesque | front / second | arabesque right
    .8  |                     | front / side
    .5  | on / unfold back | reaching / second | attitude right | lifted left
    .5  | on / attitude back | high / second
    .8  |                     | fifth / second
    .5  | on / coupe back     | crown / demi-second | upright | front
    .4  | on / peel           | upper / ajar
    .4  | fifth left          | second / bas
    .4  |                     | demi-second / bas |  | left
    .4  |                     | ajar / bas
    .4  |                     | bas
""")

OPEN_UP = phrase("""
     |  | second |  | right
     |  | wide   |  | front
     |  | first
""")

# Balances in passe, from a plie.
SPRING = phrase("""
    0   | fifth right         | bas   | upright | right
    .3  | fifth right half    | ajar
    .3  | fifth right plie    | demi-second |   | front
    .2  | fifth right push    | wide / demi-second
    .15 | on rise / cou-de-pied front | first / wide
    .15 | on releve / coupe front | first
    .3  | on releve / passe   | high
    .3  |                     | crown |         | up
    .6  |                     | fifth
""")
DOWN_BEHIND = phrase("""
    0   | on releve / passe   | fifth | upright | up
    .2  | on releve / coupe back | crown |      | front
    .2  | on rise / cou-de-pied back | crown / upper
    .2  | fifth left push     | upper / second
    .2  | fifth left plie     | second / demi-second | | left
    .3  | fifth left half     | demi-second / ajar
    .3  | fifth left          | ajar / bas
    .3  |                     | bas
""")

# Allegro.
SINK = phrase("""
    0          | fifth right      | bas         | upright | right
    .2         | fifth right half
    .2         | fifth right plie
""")
SAUTE = phrase("""
    0          | first            | bas         | upright | front
    .2         | first half       | ajar
    .2         | first plie       | demi-second
    .15        | first push       | ajar
    .15 up .18 | air first        | demi-second
    .15        | first push       | ajar
    .15        | first plie       |             |         | left
    .15        | first push       | low
    .15 up .20 | air second       | wide        |         | front
    .15        | second push      | second
    .15        | second plie      |             |         | right
    .15        | second push      | wide
    .15 up .20 | air second       | demi-second |         | front
    .15        | fifth right push | ajar
    .15        | fifth right plie | bas         |         | right
""")
ECHAPPE = phrase("""
    0          | fifth right plie | bas         | upright | right
    .15        | fifth right push | low         |         | front
    .15 up .15 | air second       | first
    .15        | second push      | wide
    .15        | second plie      | second      |         | left
    .15        | second push      | demi-second
    .15 up .15 | air first        | ajar        |         | front
    .15        | fifth left push
    .15        | fifth left plie  | bas         |         | left
""")
CHANGEMENT = phrase("""
    0                  | fifth left plie  | bas  | upright | left
    .15                | fifth left push  | ajar |         | front
    .15 up .16 face 45 | air first        | bas
    .15                | fifth right push | ajar
    .15                | fifth right plie | bas  |         | right
    .15                | fifth right push | low
    .15 up .16 face 0  | air first        | first |        | front
    .15                | fifth left push  | low
    .15                | fifth left plie  | bas  |         | left
    .15                | fifth left push  | ajar |         | front
    .15 up .16         | air fifth left   | low
    .15                | fifth right push | ajar
    .15                | fifth right plie | bas  |         | right
""")
GLISSADE = phrase("""
    0                   | fifth left plie  | bas  | upright | left
    .15                 | on plie / brush side | ajar |     | front
    .15                 | on plie / degage side | demi-second
    .12                 | on push / degage side
    .12 up .05 left -.3 | air second       |      | turned left | right
    .12 left -.25       | degage side / on push
    .15                 | brush side / on plie | ajar | upright | front
    .2                  | fifth left plie  | bas  |         | left
""")
ASSEMBLE = phrase("""
    0                   | fifth left plie  | bas  | upright | left
    .15                 | on plie / brush side | low / ajar | | front
    .15                 | on plie / degage side | first / demi-second
    .12                 | on push / degage side | high / second | turned left | right
    .15 up .20 left -.1 | air first / air second
    .12 up .10          | air fifth right  | crown / second | | front
    .15                 | fifth right push | upper / demi-second | upright
    .15                 | fifth right plie | second / ajar | | right
    .2                  | fifth right half | demi-second / ajar
    .2                  | fifth right      | ajar / bas
    .3                  |                  | bas
""")
JETE = phrase("""
    0                   | fifth left plie  | bas  | upright | left
    .15                 | on plie / brush side | ajar |     | right
    .12                 | on push / degage side | low / demi-second
    .12 up .12 left -.2 | cou-de-pied back / air second | first / wide | turned right | front
    .12                 | coupe back / on push | first / second |  | right
    .15                 | coupe back / on plie
    .15                 | coupe back / on push | first / wide | upright | front
    .12 up .10          | coupe back / air first | low / wide
    .15                 | coupe back / on push | low / demi-second
    .15                 | coupe back / on plie | low / ajar | | left
    .15                 | enveloppe side / on plie | ajar | | right
    .15                 | brush side / on plie
    .2                  | fifth left plie  | bas  |         | left
""")
PAS_DE_BOURREE = phrase("""
    0    | fifth right plie      | bas         | upright | right
    .15  | on plie / brush side  | ajar        |         | front
    .15  | on plie / degage side | demi-second
    .15  | on push / brush side
    .15  | fifth left releve     | ajar        |         | left
    .15  | brush side / on releve | low
    .15  | second releve         | ajar
    .15  | on releve / brush side | low        |         | right
    .15  | fifth right push
    .2   | fifth right plie      | bas
    .2   | fifth right half
    .2   | fifth right
""")

# Steps into the first arabesque.
STEP = phrase("""
    0    | fifth right            | bas            | upright | right
    .4   | on / slide front       | low            |         | front
    .4   | on / tendu front       | first
    .4   | fourth right           | reaching       |         | up
    .4   | slide back / on        | wide / front   |         | front
    .4   | tendu back / on
    .4   | degage back / on       | side / front   | derriere left
    .5   | arabesque / on         |                | arabesque left
    1    |
    .5   | degage back / on       | side / reaching | derriere left
    .4   | tendu back / on        | second / wide  | upright | left
    .4   | slide back / on        | second         |         | front
    .4   | fifth right            | demi-second    |         | left
    .4   |                        | ajar           |         | right
    .4   |                        | bas
""")
CHANGE_OVER = over(
    TENDU_SIDE,
    phrase("""
    | | bas   | | right
    | | low   | | front
    | | first
    | | low   | | incline right
    | | bas   | | left
"""),
)
TENDUS = join(TENDU_FRONT, back(TENDU_FRONT), TENDU_SIDE, TENDU_BACK, back(TENDU_BACK))
DEGAGES = join(*(out_and_back(kick[:4]) for kick in (KICK_FRONT, KICK_SIDE)), TENDU_SIDE, out_and_back(KICK_BACK[:4]))
KICKS = join(out_and_back(KICK_FRONT), out_and_back(KICK_SIDE), TENDU_SIDE, out_and_back(KICK_BACK))
ADAGIO = join(UP, DEVANT, over(UP, OPEN_UP), A_LA_SECONDE, ARABESQUE)
BALANCES = join(SPRING, back(SPRING), SPRING, DOWN_BEHIND)
ALLEGRO = join(other_side(SINK), GLISSADE, JETE, GLISSADE, ASSEMBLE, SINK, PAS_DE_BOURREE)

CLIPS = {
    "jump": ("The jump in seven positions: fifth, plie, push, air, landing, plie, fifth", JUMP),
    "plies": (
        "Demi-plies, grand plies and releves in first, second, fourth and fifth",
        join(
            OPENING,
            plies("first"),
            TO_SECOND,
            TO_FOURTH,
            plies("fourth right"),
            TO_FIFTH,
            plies("fifth right"),
            CLOSING,
        ),
    ),
    "tendus": (
        "Tendus to the front, the side and the back, one side and the other",
        join(PREPARATION, TENDUS, other_side(TENDUS), CLOSING),
    ),
    "degages": ("Degages, quick and low", join(PREPARATION, DEGAGES, other_side(DEGAGES), FIFTH_EN_HAUT)),
    "battements": (
        "Grand battements to the front, the side and the back",
        join(PREPARATION, KICKS, other_side(KICKS), CLOSING),
    ),
    "port-de-bras": (
        "Arms together and one by one, a bow forward and a bend back",
        join(CIRCLE, ONE_BY_ONE, TO_FIRST, BOW),
    ),
    "adagio": ("Developpes to the front and the side, arabesque and attitude", join(ADAGIO, other_side(ADAGIO))),
    "arabesques": ("Steps into the first arabesque, one on each side", join(STEP, CHANGE_OVER, other_side(STEP))),
    "balances": ("Passe on demi-pointe, from a plie", join(BALANCES, other_side(BALANCES))),
    "sautes": (
        "Sautes in first and second, echappes, changements",
        join(SAUTE, ECHAPPE, CHANGEMENT, other_side(CHANGEMENT), other_side(back(SINK))),
    ),
    "glissades": ("Glissade, assemble, jete, pas de bourree", join(ALLEGRO, other_side(ALLEGRO))),
}

POSTURES = {
    "first": "first | bas | upright | front",
    "second": "second | second | upright | left",
    "fourth": "fourth right | second | upright | left",
    "fifth": "fifth right | bas | upright | right",
    "plie": "first plie | demi-second | upright | incline right",
    "grand-plie": "fifth right grand | bas | upright | down",
    "releve": "fifth right releve | fifth | upright | front",
    "tendu": "on / tendu side | second | upright | right",
    "coupe": "on / coupe front | low | upright | front",
    "passe": "on releve / passe | fifth | upright | front",
    "devant": "on / high front | fifth / second | devant | lifted left",
    "a-la-seconde": "on side / high side | second | listed right | right",
    "attitude": "on / attitude back | fifth / second | attitude right | lifted left",
    "arabesque": "on / arabesque | front / side | arabesque right | front",
    "arms-fifth": "first | fifth | upright | front",
    "bow": "bow | fifth | forward low | down",
}


def compose(folder: Path) -> None:
    """Write clips, postures and manifest into `folder`."""
    for name, (_, rows) in CLIPS.items():
        write_motion(made(folder / "clips") / f"{name}.json", motion(name, rows))
    for name, text in POSTURES.items():
        write_posture(made(folder / "postures") / f"{name}.json", motion(name, phrase("0 |" + text)).posture(0))
    clips = [{"name": name, "file": f"clips/{name}.json", "about": about} for name, (about, _) in CLIPS.items()]
    manifest = {
        "format": "motionmind-corpus",
        "version": 1,
        "name": "ballet",
        "title": "Ballet exercises: barre, port de bras, adagio, allegro",
        "author": "The MotionMind authors",
        "licence": "CC0-1.0",
        "source": "Composed by hand for MotionMind: compose.py, beside this file, holds every position and phrase",
        "facing": "stage",
        "rate": None,
        "discretization": {"kind": "codebook", "tolerance": TOLERANCE},
        "clips": clips,
    }
    write_atomically(folder / "manifest.json", (json.dumps(manifest, indent=2) + "\n").encode())


def made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder


if __name__ == "__main__":
    compose(Path(__file__).parent)
