"""How often a wrong frame rate is detected, and a right one is questioned.

python -m experiments clock
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from scipy.interpolate import CubicSpline

from experiments.charts import Panel, svg
from experiments.clock.held_out import held_out, signs_row
from experiments.harness import Row, Setting, markdown
from experiments.material import RECORDED, corpus, families, recorded, recordings
from motionmind import Motion
from motionmind.body.tempo import find_signs, question_signs
from motionmind.metrics.figures import at_rate

TUNED_ON = ("cmu-05", "cmu-16 odd")
SPEEDS = (0.1, 0.125, 0.2, 0.25, 0.5, 2.0, 5.0)  # 240 frames a second labelled 24 and 30, 120 labelled 24, 30 and 60
PARTS_S = (2.0, 4.0, 8.0)  # lengths of parts with the right frame rate


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if setting.data else None
    names = [] if setting.quick else recorded(data, *RECORDED)
    groups = [group for name in names for group in (["cmu-16 odd", "cmu-16 even"] if name == "cmu-16" else [name])]
    return [{"data": data, "group": group} for group in groups or ["karate"]]


def work(data: str | None, group: str) -> list[Row]:
    """Find the signs of recordings, whole at wrong and right rates, and of parts at the right one."""
    name = group.partition(" ")[0]
    family = {take: takes[0] for takes in families(data, name) for take in takes}
    rows = []
    for clip in recordings_of(data, group):
        parts = [part for seconds in PARTS_S for part in parts_of(clip, seconds)]
        wholes = [(speed, relabelled(clip, speed)) for speed in SPEEDS]
        for speed, kind, motion in [
            (1.0, "whole", clip),
            *((1.0, "part", part) for part in parts),
            *((speed, "whole", whole) for speed, whole in wholes),
        ]:
            signs = find_signs(motion)
            found = question_signs(signs) if signs else ""
            rows.append(
                {
                    "group": group,
                    "family": family.get(clip.name, clip.name),
                    "recording": clip.name,
                    "speed": speed,
                    "of": kind,
                    "questioned": int(bool(found)),
                    "right_way": int(speed != 1.0 and ("slow" if speed < 1.0 else "fast") in found),
                    **signs_row(signs),
                }
            )
    return rows


def recordings_of(data: str | None, group: str) -> list[Motion]:
    """Return the recordings of a folder, or of half of it, on human23."""
    name, _, half = group.partition(" ")
    if name not in RECORDED:
        whole = corpus(data, name)
        return [at_rate(whole.recording(clip)) for clip in whole.clips]
    assert data is not None
    wanted = {"": (0, 1), "odd": (1,), "even": (0,)}[half]
    return [clip for clip in recordings(data, name) if not half or int(clip.name.split("_")[-1]) % 2 in wanted]


def relabelled(clip: Motion, speed: float) -> Motion:
    """Return a recording that plays at `speed` times its own, with 24 frames a second or more."""
    rate = max(clip.fps, 24.0 / speed)
    if rate > clip.fps * 1.01:
        fine = clip.resample(rate)
        clip = replace(fine, root=CubicSpline(clip.times, clip.root)(fine.times))  # lines would look like keyframes
    return replace(clip, times=(clip.times - clip.times[0]) / speed)


def parts_of(clip: Motion, seconds: float) -> list[Motion]:
    """Divide a recording into parts, at 24 and 30 frames a second and at its own rate."""
    rates = [clip.resample(fps) if fps < clip.fps else clip for fps in (24.0, 30.0, clip.fps)]
    lengths = [int(seconds * one.fps) for one in rates]
    return [
        one.slice(begin, begin + length)
        for one, length in zip(rates, lengths, strict=True)
        for begin in range(0, len(one) - length + 1, length)
    ]


def chart(rows: list[Row]) -> str:
    panel = Panel("questioned", "times the true speed", "share of recordings", log=True)
    for (group, kind, speed), found in sorted(_counted(rows).items()):
        if kind == "whole":
            share = sum(row["questioned"] for row in found) / len(found)
            panel.series[group] = [*panel.series.get(group, []), (speed, share)]
    return svg([panel])


def tell(rows: list[Row]) -> str:
    counted = _counted(rows)
    groups = list(dict.fromkeys(row["group"] for row in rows))
    columns: dict[str, Callable[[Row], object]] = {
        "recordings": lambda one: one["group"] + " (bounds chosen on these)" * (one["group"] in TUNED_ON),
        "right rate": lambda one: _count(counted[one["group"], "whole", 1.0]),
        "parts at the right rate": lambda one: _count(counted.get((one["group"], "part", 1.0), [])),
    }
    for speed in SPEEDS:
        title = f"{speed:g} times too fast" if speed > 1.0 else f"{1.0 / speed:g} times too slow"
        columns[title] = lambda one, speed=speed: _count(counted[one["group"], "whole", speed])
    table = markdown(columns, [{"group": group} for group in groups])
    return f"### The shipped bounds\n\n{table}\n\n{held_out(rows)}".strip()


def _counted(rows: list[Row]) -> dict[tuple[str, str, float], list[Row]]:
    """Return the rows of each group, whole or part, at each speed."""
    out: dict[tuple[str, str, float], list[Row]] = {}
    for row in rows:
        out.setdefault((row["group"], row["of"], row["speed"]), []).append(row)
    return out


def _count(rows: list[Row]) -> str:
    questioned = sum(row["questioned"] for row in rows)
    wrong = sum(row["questioned"] - row["right_way"] for row in rows if row["speed"] != 1.0)
    return f"{questioned} of {len(rows)}" + f" ({wrong} the wrong way)" * bool(wrong)
