"""Growth with the corpus: the time and memory of reading, retargeting and learning, and the disk that is filled.

Recordings are made to tens and hundreds of times as many: mirrored or not, at a tempo and on a body of their own, each
joint off by an angle that drifts. Each is written as a BVH file, read, brought to the body of the corpus, and removed.
"""

from __future__ import annotations

import resource
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import recorded
from experiments.scale.tweens import FPS, RATE, performances
from motionmind import Engine, Motion, make_discretization, own_skeleton, read_motion
from motionmind.corpus.gather import gather
from motionmind.formats.bvh import write_bvh

NAME = "cmu-05"
TIMES, TRIAL = (1, 10, 100), (1, 3)  # times as much as was recorded; as one clip of a bundled corpus
DEGREES, TALLER = 3.0, 0.15  # that joints of a copy are turned by, in the mean; share by which bodies differ at most
TOLERANCE = 15.0  # degrees


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if recorded(setting.data, NAME) else None
    return [{"data": data, "times": times} for times in (TIMES if data else TRIAL)]


def work(data: str | None, times: int) -> list[Row]:
    """Build a corpus in a process of its own, whose memory is this corpus's alone."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as alone:
        return [alone.submit(measure, data, times).result()]


def measure(data: str | None, times: int) -> Row:
    """Read, retarget and learn so many times what was recorded."""
    clips = _recorded(data)
    kind = make_discretization("codebook", TOLERANCE)
    Engine.learn(gather("first", [own_skeleton(clips[0])], rate=RATE), kind)  # loads what learning needs
    spent = {"bytes": 0.0, "frames": 0.0, "seconds": 0.0, "making": 0.0, "reading": 0.0, "retargeting": 0.0}
    with tempfile.TemporaryDirectory() as scratch:
        began = perf_counter()
        corpus = gather("scale", _read_again(clips, times, Path(scratch), spent), rate=RATE)
        gathering = perf_counter() - began - spent["making"] - spent["reading"] - spent["retargeting"]
        began = perf_counter()
        engine = Engine.learn(corpus, kind)
        learning = perf_counter() - began
        engine.save(Path(scratch) / "scale")
        disk = sum(path.stat().st_size for path in (Path(scratch) / "scale").rglob("*") if path.is_file())
    return {
        "times": times,
        "hours": spent["seconds"] / 3600.0,
        "frames": int(spent["frames"]),
        "postures": len(corpus),
        "states": int(engine.space.sizes.sum()),
        "bvh_mb": spent["bytes"] / 1e6,
        "reading_s": spent["reading"],
        "retargeting_s": spent["retargeting"],
        "gathering_s": gathering,
        "learning_s": learning,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "disk_mb": disk / 1e6,
    }


def _recorded(data: str | None) -> list[Motion]:
    """Return the recordings on their own bodies, at 30 frames a second, without the T-pose before them."""
    if data is None:
        corpus = Engine.load("ballet").corpus
        return [corpus.recording(clip).resample(FPS) for clip in corpus.clips[:2]]
    clips = (read_motion(path) for path in sorted(Path(data, NAME).glob("*.bvh")))
    return [clip.slice(1, len(clip)).resample(FPS) for clip in clips]


def _read_again(clips: list[Motion], times: int, folder: Path, spent: dict[str, float]) -> Iterator[Motion]:
    """Yield the recordings and other performances, each from a file of its own, and add up what that takes."""
    made, rng = performances(clips, times, DEGREES, seed=0), np.random.default_rng(1)
    path = folder / "performance.bvh"
    while True:
        began = perf_counter()
        if (motion := next(made, None)) is None:
            return
        write_bvh(path, _on_another_body(motion, 1.0 + rng.uniform(-TALLER, TALLER)))
        written = perf_counter()
        read = read_motion(path)
        known = perf_counter()
        own = replace(own_skeleton(read), name=motion.name)
        spent["retargeting"] += perf_counter() - known
        spent["reading"] += known - written
        spent["making"] += written - began
        spent["bytes"] += path.stat().st_size
        spent["frames"] += len(read)
        spent["seconds"] += float(read.times[-1])
        path.unlink()
        yield own


def _on_another_body(motion: Motion, size: float) -> Motion:
    """Return the same movement by a body of another size."""
    body = motion.skeleton
    return replace(
        motion, skeleton=replace(body, offsets=size * body.offsets, tips=size * body.tips), root=size * motion.root
    )


def chart(rows: list[Row]) -> str:
    parts = ("reading_s", "retargeting_s", "gathering_s", "learning_s")
    time = Panel("microseconds a posture", "postures", "microseconds", log=True)
    for part in parts:
        time.series[part.removesuffix("_s")] = [(row["postures"], 1e6 * row[part] / row["postures"]) for row in rows]
    memory = Panel("memory and disk", "postures", "MB", log=True)
    for part, title in (("peak_mb", "most memory"), ("disk_mb", "on disk")):
        memory.series[title] = [(row["postures"], row[part]) for row in rows]
    return svg([time, memory])


def tell(rows: list[Row]) -> str:
    def of_posture(part: str, row: Row) -> str:
        return f"{row[part]:.1f} s ({1e6 * row[part] / row['postures']:.0f} µs)"

    return markdown(
        {
            "times": lambda r: r["times"],
            "hours": lambda r: f"{r['hours']:.2f}",
            "frames read": lambda r: f"{r['frames']:,}",
            "postures": lambda r: f"{r['postures']:,}",
            "states": lambda r: f"{r['states']:,}",
            "BVH": lambda r: f"{r['bvh_mb']:.0f} MB, {r['bvh_mb'] / r['reading_s']:.1f} MB/s",
            "reading": lambda r: of_posture("reading_s", r),
            "retargeting": lambda r: of_posture("retargeting_s", r),
            "gathering": lambda r: of_posture("gathering_s", r),
            "learning": lambda r: of_posture("learning_s", r),
            "most memory": lambda r: f"{r['peak_mb']:.0f} MB",
            "on disk": lambda r: f"{r['disk_mb']:.0f} MB",
        },
        rows,
    )
