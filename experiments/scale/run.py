"""Growth with the corpus: the time and memory of reading, retargeting and learning, and the disk that is filled.

Recordings are made to tens and hundreds of times as many: mirrored or not, at a tempo and on a body of their own, each
joint off by an angle that drifts. Each is written as a BVH file, read, brought to the body of the corpus, taken, and
removed.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, NamedTuple

import numpy as np

from experiments.charts import Panel, svg
from experiments.harness import Row, Setting, markdown
from experiments.material import recorded
from experiments.scale.memory import Memory
from experiments.scale.tweens import FPS, RATE, performed
from motionmind import Engine, Motion, own_skeleton, read_motion
from motionmind.corpus.gather import gather
from motionmind.corpus.recordings import Recording, Taking, take
from motionmind.discretize import make_discretization
from motionmind.executors.opening import open_team
from motionmind.executors.workshop import Workshop
from motionmind.formats.bvh import write_bvh
from motionmind.learned.neighbours import build_neighbours

NAME = "cmu-05"
# Times as much as was recorded, and workers; for a trial, as one clip of a bundled corpus.
SIZES, TRIAL = ((1, 1), (10, 1), (100, 1), (100, 2)), ((1, 1), (3, 2))
DEGREES, TALLER = 3.0, 0.15  # that joints of a copy are turned by, in the mean; share by which bodies differ at most
TOLERANCE = 15.0  # degrees


class Job(NamedTuple):
    """A performance to read and take.

    Attributes:
        data: the folder of recorded movement; None for bundled movement.
        clip: which of the recordings.
        number: which performance of it, from 0, which is the recording itself.
    """

    data: str | None
    clip: int
    number: int


class Spent(NamedTuple):
    """The size of a performance in bytes, frames and seconds of movement, and the processor time it took, seconds."""

    bytes: float
    frames: float
    seconds: float
    making: float
    reading: float
    retargeting: float
    taking: float


def jobs(setting: Setting) -> list[dict[str, Any]]:
    data = str(setting.data) if recorded(setting.data, NAME) else None
    return [{"data": data, "times": times, "workers": workers} for times, workers in (SIZES if data else TRIAL)]


def work(data: str | None, times: int, workers: int) -> list[Row]:
    """Build a corpus in a process of its own, whose memory is this corpus's alone."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as alone:
        return [alone.submit(measure, data, times, workers).result()]


def measure(data: str | None, times: int, workers: int, room: str | None = None, kept: Path | None = None) -> Row:
    """Read, retarget and learn so many times what was recorded, in a folder for large arrays and the corpus.

    Args:
        data: the folder of recorded movement; None for bundled movement.
        times: as much as was recorded.
        workers: processes.
        room: the folder for what is removed again.
        kept: the folder that the corpus is kept in; None to remove it.
    """
    kind = make_discretization("codebook", TOLERANCE)
    first = Engine.learn(gather("first", [own_skeleton(_recorded(data)[0])], rate=RATE), kind)
    build_neighbours(
        first.corpus.skeleton, first.statistics.orientations, first.statistics.weights
    )  # loads what is needed
    spent: list[Spent] = []
    with tempfile.TemporaryDirectory(dir=room) as scratch, open_team(workers) as team, Memory() as memory:
        workshop = Workshop.of(workers, Path(scratch))
        all_jobs = (Job(data, k, n) for n in range(times) for k in range(len(_recorded(data))))
        began = perf_counter()
        corpus = gather("scale", _kept(team.map(perform, all_jobs), spent), rate=RATE, workshop=workshop)
        taken, here = perf_counter(), process_time()
        engine = Engine.learn(corpus, kind, workshop)
        learned, by_processor = perf_counter(), process_time() - here
        place = kept or Path(scratch) / "scale"
        engine.save(place)
        saved = perf_counter()
        disk = sum(path.stat().st_size for path in place.rglob("*") if path.is_file())
    total = Spent(*np.sum(spent, axis=0).tolist())
    return {
        "times": times,
        "workers": workers,
        "hours": total.seconds / 3600.0,
        "frames": int(total.frames),
        "postures": len(corpus),
        "states": int(engine.space.sizes.sum()),
        "bvh_mb": total.bytes / 1e6,
        "reading_s": total.reading,
        "retargeting_s": total.retargeting,
        "taking_s": total.taking,
        "gathering_s": taken - began - total.making / workers,
        "learning_s": by_processor,
        "learned_s": learned - taken,
        "saving_s": saved - learned,
        "peak_mb": memory.most,
        "disk_mb": disk / 1e6,
    }


def perform(job: Job) -> tuple[Recording, Spent]:
    """Make a performance and write it; read it, bring it to the body of the corpus and take its postures."""
    began = process_time()
    motion = performance(_recorded(job.data)[job.clip], job)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "performance.bvh"
        write_bvh(path, motion)
        written = process_time()
        read = read_motion(path)
        known = process_time()
        size = path.stat().st_size
    found = process_time()
    own = replace(own_skeleton(read), name=motion.name)
    brought = process_time()
    recording = take(own, Taking(RATE))
    taken = process_time()
    seconds = written - began, known - written, brought - found, taken - brought
    return recording, Spent(size, len(read), float(read.times[-1]), *seconds)


def performance(clip: Motion, job: Job) -> Motion:
    """Return a performance of a clip on a body of its own; which one, the job's numbers say alone."""
    rng = np.random.default_rng([job.number, job.clip])
    motion = performed(clip, job.number, DEGREES, rng) if job.number else clip
    return _on_another_body(motion, 1.0 + rng.uniform(-TALLER, TALLER))


def _kept(found: Iterator[tuple[Recording, Spent]], spent: list[Spent]) -> Iterator[Recording]:
    """Yield recordings, and keep what they took."""
    for recording, took in found:
        spent.append(took)
        yield recording


@cache
def _recorded(data: str | None) -> tuple[Motion, ...]:
    """Return the recordings on their own bodies, at 30 frames a second, without the T-pose before them."""
    if data is None:
        corpus = Engine.load("ballet").corpus
        return tuple(corpus.recording(clip).resample(FPS) for clip in corpus.clips[:2])
    clips = (read_motion(path) for path in sorted(Path(data, NAME).glob("*.bvh")))
    return tuple(clip.slice(1, len(clip)).resample(FPS) for clip in clips)


def _on_another_body(motion: Motion, size: float) -> Motion:
    """Return the same movement by a body of another size."""
    body = motion.skeleton
    return replace(
        motion, skeleton=replace(body, offsets=size * body.offsets, tips=size * body.tips), root=size * motion.root
    )


def chart(rows: list[Row]) -> str:
    alone = [row for row in rows if row["workers"] == 1]
    time = Panel("microseconds a posture, one worker", "postures", "microseconds", log=True)
    for part in ("reading_s", "retargeting_s", "taking_s", "learning_s"):
        time.series[part.removesuffix("_s")] = [(row["postures"], 1e6 * row[part] / row["postures"]) for row in alone]
    memory = Panel("memory and disk, one worker", "postures", "MB", log=True)
    for part, title in (("peak_mb", "most memory"), ("disk_mb", "on disk")):
        memory.series[title] = [(row["postures"], row[part]) for row in alone]
    return svg([time, memory])


def tell(rows: list[Row]) -> str:
    def of_posture(part: str, row: Row) -> str:
        return f"{row[part]:.1f} s ({1e6 * row[part] / row['postures']:.0f} µs)"

    def in_all(row: Row) -> str:
        return f"{row['gathering_s'] + row['learned_s'] + row['saving_s']:.1f} s"

    return markdown(
        {
            "times": lambda r: r["times"],
            "workers": lambda r: r["workers"],
            "hours": lambda r: f"{r['hours']:.2f}",
            "frames read": lambda r: f"{r['frames']:,}",
            "postures": lambda r: f"{r['postures']:,}",
            "states": lambda r: f"{r['states']:,}",
            "BVH": lambda r: f"{r['bvh_mb']:.0f} MB, {r['bvh_mb'] / r['reading_s']:.1f} MB/s",
            "reading": lambda r: of_posture("reading_s", r),
            "retargeting": lambda r: of_posture("retargeting_s", r),
            "taking": lambda r: of_posture("taking_s", r),
            "all three, by the clock": lambda r: of_posture("gathering_s", r),
            "learning": lambda r: of_posture("learning_s", r),
            "by the clock": lambda r: of_posture("learned_s", r),
            "in all, by the clock": in_all,
            "most memory": lambda r: f"{r['peak_mb']:.0f} MB",
            "on disk": lambda r: f"{r['disk_mb']:.0f} MB",
        },
        rows,
    )
