"""Key frames joined by the engine, beside the text-to-motion model Kimodo and beside cubics."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from functools import partial
from time import process_time
from typing import Any

import numpy as np
from scipy.stats import t as student

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.kimodo.material import ASKED, OTHERS, STAND_IN, Demo, demo, learned, marked_slide, names
from experiments.material import FPS, recorded
from experiments.scale.memory import Memory
from motionmind import Engine, Motion, NoPathError, Posture
from motionmind._typing import Floats
from motionmind.body.contact import find_floor, foot_slide, foot_slides, skating
from motionmind.geometry import rotations as rot
from motionmind.geometry.splines import natural_spline, rotation_spline
from motionmind.metrics.smoothness import angular_jerk, angular_speed
from motionmind.synthesis.timeline import usual

SPACINGS = ("1 s", "2 s")
TEACHERS = ("cmu-05", "bandai", OTHERS)
BUDGET = 2_000
MAX_MOVES = 200
STANDING_MM = 10.0  # a frame: a foot near the floor that moves less stands
MEASURES = (
    "mm",
    "worst_mm",
    "degrees",
    "worst_degrees",
    "off",
    "skating",
    "slide",
    "standing",
    "jerk",
    "key_jerk",
    "speed",
)
KIMODO, CUBIC, GAPS, CALM, VIAS = "Kimodo", "cubic", "tween by tween", "tween by tween, liveliness 0", "one tween, vias"
OF_ENGINE = (GAPS, CALM, VIAS)

Way = Callable[[Mapping[int, Posture]], Motion]


def jobs(setting: Setting) -> list[dict[str, Any]]:
    """Return a job for each movement and corpus that is learned from; none where the movements are missing."""
    data = str(setting.data) if setting.data else None
    if setting.quick:
        return [{"data": None, "name": name, "teacher": STAND_IN} for name in names(None)[:1]]
    if not recorded(data, "kimodo"):
        return []
    teachers = [*recorded(data, *TEACHERS), OTHERS]
    return [{"data": data, "name": name, "teacher": teacher} for teacher in teachers for name in names(data)]


def work(data: str | None, name: str, teacher: str) -> list[Row]:
    """Join a movement's key frames in each way, and measure the results beside the movement."""
    one = demo(data, name)
    lesson = learned(data, teacher, name)
    ways: dict[str, Way] = {
        GAPS: partial(tween_by_tween, lesson.engine),
        CALM: partial(tween_by_tween, lesson.engine, liveliness=0.0),
        VIAS: partial(one_tween, lesson.engine),
    }
    if teacher in (TEACHERS[0], STAND_IN):  # once a movement
        ways = {KIMODO: lambda keys: one.motion, CUBIC: cubic} | ways
    rows = []
    for given in ((ASKED,) if one.asked else ()) + SPACINGS:
        keys = one.keys(given)
        for kind, way in ways.items():
            with Memory() as memory, warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                began = process_time()
                try:
                    made = way(keys)
                except NoPathError:
                    made = None
                spent = process_time() - began
            of_engine = kind in OF_ENGINE
            rows.append(
                {
                    "movement": name,
                    "given": given,
                    "kind": kind,
                    "teacher": teacher if of_engine else "",
                    "keys": len(keys) - 2,
                    "frames": len(one.motion),
                    **measured(one, keys, made),
                    "warned": int(bool(warned)),
                    "marked": marked_slide(data, name) if kind == KIMODO else np.nan,
                    "seconds": np.nan if kind == KIMODO else spent,
                    "megabytes": memory.most if of_engine else np.nan,
                    "learning": lesson.seconds if of_engine else np.nan,
                    "own_jerk": lesson.jerk if of_engine else np.nan,
                    "own_skating": lesson.skating if of_engine else np.nan,
                }
            )
    return rows


# --- ways through key frames ------------------------------------------------------------------------------------------


def cubic(keys: Mapping[int, Posture]) -> Motion:
    """Join key frames by natural cubic splines, which are twice continuously differentiable."""
    frames, postures = np.array(list(keys), dtype=float), list(keys.values())
    at = np.arange(frames[-1] + 1.0)
    rotations = rotation_spline(frames, np.stack([one.rotations for one in postures]), at)
    root = natural_spline(frames, np.stack([one.root for one in postures]), at)
    return Motion(postures[0].skeleton, rotations, root, at / FPS, "cubic")


def tween_by_tween(engine: Engine, keys: Mapping[int, Posture], liveliness: float = 0.5) -> Motion:
    """Join each key frame to the next by a tween that takes on the velocity of the one before."""
    frames, postures = list(keys), list(keys.values())
    made: list[Motion] = []
    for number in range(len(keys) - 1):
        seconds = (frames[number + 1] - frames[number]) / FPS
        before = made[-1] if made else None
        made.append(
            engine.tween(
                *postures[number : number + 2],
                before=before,
                duration=seconds,
                liveliness=liveliness,
                node_budget=BUDGET,
                max_moves=MAX_MOVES,
                fps=FPS,
            ).motion
        )
    rotations = np.concatenate([made[0].rotations[:1], *(one.rotations[1:] for one in made)])
    root = np.concatenate([made[0].root[:1], *(one.root[1:] for one in made)])
    return Motion(postures[0].skeleton, rotations, root, np.arange(len(root)) / FPS, GAPS)


def one_tween(engine: Engine, keys: Mapping[int, Posture]) -> Motion:
    """Join the first key frame to the last by a tween that passes the others after as many moves as time allows.

    A posture to pass fixes joints and facing, not the place; the corpus's durations of moves decide when it is passed.
    """
    frames, postures = list(keys), list(keys.values())
    step = usual(engine.grammar.transitions)
    via = [(keys[frame], max(round(frame / FPS / step), 1)) for frame in frames[1:-1]]
    ends = postures[0], postures[-1]
    options = {"duration": frames[-1] / FPS, "node_budget": BUDGET, "max_moves": MAX_MOVES, "fps": FPS}
    try:
        return engine.tween(*ends, via=via, **options).motion
    except NoPathError:  # the corpus needs more moves from one to the next
        moves = max(1, round(frames[-1] / FPS / step)), MAX_MOVES
        return engine.tween(*ends, via=[posture for posture, _ in via], moves=moves, **options).motion


# --- measures ---------------------------------------------------------------------------------------------------------


def measured(one: Demo, keys: Mapping[int, Posture], made: Motion | None) -> Row:
    """Return the measures of a movement; NaN where there is none.

    Distances from the inner key frames are in mm of joints and in degrees of local rotations, skating in the share of
    frames, slides of all low feet and of standing ones in mm a frame, jerk, in all and across key frames, in rad/s^3,
    speed in rad/s.
    """
    if made is None:
        return dict.fromkeys(MEASURES, np.nan)
    frames, wanted = list(keys)[1:-1], list(keys.values())[1:-1]
    places, truth = made.positions(), one.motion.positions()
    asked = one.motion.skeleton.positions(
        np.stack([posture.rotations for posture in wanted]), np.stack([posture.root for posture in wanted])
    )
    mm = 1000.0 * rot.norm(places[frames] - asked)
    turned = np.degrees(rot.angle(made.rotations[frames], np.stack([posture.rotations for posture in wanted])))
    floor = find_floor(one.motion.skeleton, one.motion.rotations, one.motion.root)
    body = made.skeleton, made.rotations, made.root, floor
    slides = 1000.0 * foot_slides(*body)
    standing = slides[(slides > 0.0) & (slides < STANDING_MM)]  # 0 is a foot in the air
    jerk = angular_jerk(made.rotations, FPS).mean(axis=1)
    across = np.unique(np.add.outer(frames, range(-2, 0)))  # from four frames with a key frame among the inner two
    values = (
        *np.round([mm.mean(), mm.max(), turned.mean(), turned.max()], 3),
        1000.0 * rot.norm(places - truth).mean(),
        *(skating(*body), 10.0 * foot_slide(*body), standing.mean() if standing.size else np.nan),
        *(jerk.mean(), jerk[across].mean()),
        angular_speed(made.rotations, FPS).mean(),
    )
    return dict(zip(MEASURES, map(float, values), strict=True))


# --- tables -----------------------------------------------------------------------------------------------------------


def chart(rows: list[Row]) -> str:
    """Draw all ways but vias, which leave the place open."""
    rows, panels = [row for row in rows if row["kind"] != VIAS], []
    for given in _given(rows):
        panel = Panel(f"key frames: {given}", "jerk, rad/s³", "frames that skate, %", joined=False)
        for title, found in _ways(rows, given).items():
            panel.series[title] = [(row["jerk"], 100.0 * row["skating"]) for row in found]
        panels.append(panel)
    return svg(panels)


def tell(rows: list[Row]) -> str:
    parts = []
    for given in _given(rows):
        ways = _ways(rows, given)
        count = len({row["movement"] for row in rows if row["given"] == given})
        asked = "that were asked of Kimodo" if given == ASKED else f"every {given}, from its movement"
        lines = [{"way": title, "all": found} for title, found in ways.items()]
        parts += [f"### Key frames {asked}, of {count} movements", markdown(_COLUMNS, lines)]
    marked = [row["marked"] for row in rows if row["kind"] == KIMODO and row["given"] == SPACINGS[0]]
    if np.isfinite(marked).any():
        parts.append(f"Feet that Kimodo marks as standing slide by {spread(np.array(marked))} mm a frame.")
    parts += ["### The corpora's own movement", _corpora(rows)]
    for given in _given(rows):
        parts += [f"### Movement by movement, key frames: {given}", _by_movement(rows, given)]
    return "\n\n".join(parts)


def spread(values: Floats) -> str:
    """Return a mean over movements, with half of its 95 % interval for three or more."""
    if len(values) < 3:
        return _digits(values.mean())
    half = student.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return f"{_digits(values.mean())} ± {_digits(half)}" if half > 0.0 else _digits(values.mean())


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"


def _given(rows: list[Row]) -> list[str]:
    """Return which key frames there are, those asked first."""
    return [given for given in (ASKED, *SPACINGS) if any(row["given"] == given for row in rows)]


def _corpora(rows: list[Row]) -> str:
    """A row for each corpus: its own jerk and skating, and the seconds that learning takes."""
    columns: dict[str, Callable[[Row], object]] = {
        "corpus": lambda r: r["name"],
        "jerk, rad/s³": partial(_cell, "own_jerk"),
        "skating, %": partial(_cell, "own_skating", scale=100.0),
        "seconds to learn": partial(_cell, "learning"),
    }
    lessons = {(row["teacher"], row["learning"]): row for row in rows if row["teacher"]}
    teachers = dict.fromkeys(teacher for teacher, _ in lessons)
    lines = [{"name": name, "all": [row for (of, _), row in lessons.items() if of == name]} for name in teachers]
    return markdown(columns, lines)


def _ways(rows: list[Row], given: str) -> dict[str, list[Row]]:
    """Return the rows of each way, by its title."""
    out: dict[str, list[Row]] = {}
    for row in rows:
        if row["given"] == given:
            title = row["kind"] + (f", {row['teacher']}" if row["teacher"] else "")
            out.setdefault(title, []).append(row)
    return out


def _by_movement(rows: list[Row], given: str) -> str:
    """A row for each movement: how much each way skates, and its jerk."""
    ways = _ways(rows, given)
    columns: dict[str, Callable[[Row], object]] = {"skating, %; jerk, rad/s³": lambda r: r["movement"]}
    for title, found in ways.items():
        by_name = {row["movement"]: row for row in found}
        columns[title] = lambda r, by_name=by_name: _pair(by_name[r["movement"]])
    return markdown(columns, next(iter(ways.values())))


def _pair(row: Row) -> str:
    return f"{100.0 * row['skating']:.1f}; {row['jerk']:.0f}" if np.isfinite(row["jerk"]) else "no path"


def _cell(key: str, line: Row, scale: float = 1.0, *, worst: bool = False) -> str:
    found = scale * np.array([row[key] for row in line["all"] if np.isfinite(row[key])])
    if not len(found):
        return "not measured here" if key in ("seconds", "megabytes") else ""
    return _digits(found.max()) if worst else spread(found)


_COLUMNS: dict[str, Callable[[Row], object]] = {
    "": lambda r: r["way"],
    "off key frames, mm": partial(_cell, "mm"),
    "worst, mm": partial(_cell, "worst_mm", worst=True),
    "degrees": partial(_cell, "degrees"),
    "worst, degrees": partial(_cell, "worst_degrees", worst=True),
    "skating, %": partial(_cell, "skating", scale=100.0),
    "slide, mm a frame": partial(_cell, "slide"),
    "standing feet, mm a frame": partial(_cell, "standing"),
    "jerk, rad/s³": partial(_cell, "jerk"),
    "across key frames": partial(_cell, "key_jerk"),
    "speed, rad/s": partial(_cell, "speed"),
    "off Kimodo's, mm": partial(_cell, "off"),
    "too fast for the corpus": lambda r: f"{sum(row['warned'] for row in r['all'])} of {len(r['all'])}",
    "seconds": partial(_cell, "seconds"),
    "memory, MB": partial(_cell, "megabytes", worst=True),
}
