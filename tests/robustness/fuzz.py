"""Damages files at random, and checks that every reader reads them or refuses them in a line.

    python -m tests.robustness.fuzz --hours 8
    python -m tests.robustness.fuzz --seconds 60 --table

An input that fails (a traceback, a segmentation fault, more than 10 s, more than 1 GB) is kept among the cases, which
test_fuzz.py replays.
"""

from __future__ import annotations

import argparse
import base64
import faulthandler
import io
import json
import pickle
import random
import shutil
import signal
import struct
import sys
import tempfile
import time
import traceback
import warnings
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path

import numpy as np

from motionmind import Engine, Motion, human23, read_motion, vary, write_motion, write_posture, write_variation
from motionmind._typing import Floats
from motionmind.body.anatomy_file import read_body
from motionmind.corpus.manifest import SourceManifest, parse_manifest
from motionmind.corpus.store import load, read_manifest
from motionmind.discretize.library import read_library
from motionmind.discretize.spec import from_spec
from motionmind.errors import MotionMindError, MotionMindWarning
from motionmind.formats.papers import read_papers
from motionmind.geometry import rotations as rot
from motionmind.notation import compose as notation
from motionmind.notation.read import read_score
from motionmind.registry.archive import unpack
from motionmind.registry.index import open_index
from motionmind.registry.publishing import publish
from motionmind.retarget.joint_mapping import read_joint_mapping
from motionmind.tween.narrative import explain
from motionmind.tween.report import encode_report, read_report
from motionmind.tween.result import report_of
from motionmind.variation.variation_json import read_variation

try:
    import resource
except ImportError:  # the system is no POSIX
    resource = None  # type: ignore[assignment]

ROOT = Path(__file__).parents[2]
SEEDS = Path(__file__).parent / "seeds"
CASES = Path(__file__).parent / "cases"
LONGEST = 10.0  # seconds for an input
MOST_MEMORY = 2**30  # bytes for an input

Mutate = Callable[[bytes, Sequence[bytes], random.Random], bytes]


# --- damage ---------------------------------------------------------------------------------------------------------

# What parsers stumble over: numbers at limits and beyond, names that mean something, ends, signs, other scripts.
TOKENS = [
    *(b"nan", b"NaN", b"inf", b"-inf", b"1e999", b"1e300", b"-1e308", b"1e-320", b"1e6", b"-1", b"0", b"-0.0", b"1_0"),
    *(b"9" * 30, b"9" * 5000, b"2147483648", b"-2147483649", b"18446744073709551616", b"0x10", b"1e", b".", b"-", b"+"),
    *(b"{", b"}", b"[", b"]", b"(", b")", b'"', b"'", b"\\", b"/", b"|", b"=", b",", b":", b";", b"#", b"%s", b"{}"),
    *(b"null", b"true", b"{}", b"[]", b'""', b"[" * 500, b'{"a":' * 200, b"\n", b"\r", b"\t", b"\0", b"\x1b]0;x\x07"),
    *("\u202e \u2028 \x85 \u0661 é \ufeff".encode().split(b" ")),
    *(b"\xff\xfe", b"\xed\xa0\x80", b"\xc3"),
    *(b"End", b"Site", b"MOTION", b"Frames: 1", b"include", b"backwards", b"1000 times", b"..", b"/dev/null", b"~"),
]


def damaged(data: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    """Damage bytes in one place, or in a few: a law of none of the formats."""
    out = bytearray(data)
    for _ in range(rng.choice([1, 1, 1, 1, 2, 4])):
        at = rng.randrange(len(out) + 1)
        long = rng.choice([1, 1, 2, 4, 16, 64, 256])
        match rng.randrange(10):
            case 0:
                del out[at : at + long]
            case 1 if at < len(out):
                out[at] ^= 1 << rng.randrange(8)
            case 2:
                out[at:at] = out[at : at + long]
            case 3:
                out[at : at + rng.choice([0, 1, long])] = rng.choice(TOKENS)
            case 4:
                out[at : at + long] = rng.randbytes(rng.randint(0, 4))
            case 5:
                other = rng.choice(others)
                there = rng.randrange(len(other) + 1)
                out[at : at + rng.choice([0, long])] = other[there : there + long]
            case 6 if rng.random() < 0.3:
                del out[at:]
            case _:
                out = bytearray(_in_words(bytes(out), rng))
    return bytes(out)


def _in_words(data: bytes, rng: random.Random) -> bytes:
    """Delete, double, exchange or replace lines or words."""
    mark = rng.choice([b"\n", b" ", b",", b"\n"])
    parts = data.split(mark)
    at, other = rng.randrange(len(parts)), rng.randrange(len(parts))
    match rng.randrange(5):
        case 0:
            del parts[at]
        case 1:
            parts.insert(at, parts[other])
        case 2:
            parts[at], parts[other] = parts[other], parts[at]
        case 3:
            parts[at] = rng.choice(TOKENS)
        case 4:
            parts[at:at] = [parts[other]] * rng.choice([2, 30, 300])
    return mark.join(parts)[: 1 << 18]


def damaged_archive(data: bytes, others: Sequence[bytes], rng: random.Random) -> bytes:
    """Damage an archive's bytes, or one of the files in it, so that its checksum is right."""
    if rng.random() < 0.3:
        return damaged(data, others, rng)
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as archive, zipfile.ZipFile(out, "w") as made:
        names = archive.namelist()
        chosen = rng.choice(names)
        for name in names:
            inner = archive.read(name)
            dated_1980 = zipfile.ZipInfo(name)  # and not as late as it is, which would be other bytes each time
            kind = zipfile.ZIP_DEFLATED
            made.writestr(dated_1980, damaged(inner, [inner], rng) if name == chosen else inner, kind)
    return out.getvalue()


# --- readers --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Reader:
    """A reader, and what it reads whole.

    Attributes:
        name: of the format.
        file: the name of the file that is damaged.
        seeds: its contents, whole.
        read: reads the file, and uses what it read.
        beside: the files that lie beside it.
        mutate: damages the file.
    """

    name: str
    file: str
    seeds: Sequence[bytes]
    read: Callable[[Path], object]
    beside: dict[str, bytes] = field(default_factory=dict)
    mutate: Mutate = damaged

    def inputs(self, seed: int) -> Iterator[bytes]:
        """Yield damaged files, the same for the same seed."""
        rng = random.Random(f"{seed} {self.name}")
        while True:
            yield self.mutate(rng.choice(self.seeds), self.seeds, rng)

    def lay_out(self, folder: Path) -> Path:
        """Make a folder with the files beside; return the path of the file to read."""
        for name, data in self.beside.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
        folder.mkdir(parents=True, exist_ok=True)
        return folder / self.file


def check_motion(motion: Motion) -> None:
    """Check that movement is finite, and turned by unit quaternions."""
    assert len(motion) >= 1
    assert np.isfinite(motion.root).all()
    assert np.isfinite(motion.skeleton.offsets).all()
    assert (np.diff(motion.times) > 0.0).all()
    assert np.allclose(np.linalg.norm(motion.rotations, axis=-1), 1.0, atol=1e-6)


def _movement(path: Path) -> None:
    check_motion(read_motion(path))


def _papers(path: Path) -> None:
    check_motion(read_papers(path))


def _score(path: Path) -> None:
    score = read_score(path)
    for motion in notation.motions(score):
        check_motion(motion)
    for name in score.postures:
        notation.posture(score, name)


def _report(path: Path) -> None:
    str(explain(read_report(path)))


def _variation(path: Path) -> None:
    check_motion(read_variation(path).motion())


def _source_manifest(path: Path) -> None:
    source = parse_manifest(read_manifest(path.parent), SourceManifest, path)
    from_spec(source.discretization)


def _built_corpus(path: Path) -> None:
    Engine.load(str(path.parent if path.suffix == ".json" else path.parents[1])).info()


def _index(path: Path) -> None:
    open_index(str(path))


def _archive(path: Path) -> None:
    """Unpack an archive, of which the index beside it is true."""
    (entry,) = open_index(str(path.with_name("index.json"))).index.corpora
    with tempfile.TemporaryDirectory() as folder:
        unpack(path, entry.files, Path(folder) / "unpacked")


def _moving(frames: int) -> Motion:
    """A body that turns and travels."""
    body = human23()
    rotations = np.tile(rot.IDENTITY, (frames, len(body), 1))
    rotations[:, 0] = rot.about_vertical(np.linspace(0.0, 1.0, frames))
    return Motion(body, rotations, np.linspace([0, 1, 0], [1, 1, 0], frames), np.arange(frames) / 30.0, "clip")


def _pickled(motion: Motion, protocol: int) -> bytes:
    """Return a motion's path, with SMPL at rest, as AIST++ has movement."""
    poses = np.zeros((len(motion), 72))
    held = {"smpl_poses": poses, "smpl_trans": motion.root, "smpl_scaling": np.array([1.0]), "smpl_loss": 0.5}
    return pickle.dumps(held, protocol)


def _array(array: Floats) -> bytes:
    """Return an array as numpy writes it, with rotations that can be."""
    if array.shape[1] == 315:
        array[:, 3:] = np.tile(np.eye(2, 3).ravel(), 52)
    out = io.BytesIO()
    np.save(out, array)
    return out.getvalue()


def _text_of(glb: bytes) -> bytes:
    """Return a GLB as text, its numbers in base64, and some of them as curves and jumps."""
    (length,) = struct.unpack_from("<I", glb, 12)
    document = json.loads(glb[20 : 20 + length])
    data = base64.b64encode(glb[28 + length :]).decode()
    document["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{data}"
    document["animations"][0]["samplers"][2]["interpolation"] = "STEP"
    return json.dumps(document).encode()


def readers(folder: Path) -> list[Reader]:
    """Make every reader's whole files in a folder, and return the readers."""
    motion, seeds = _moving(4), {path.name: path.read_bytes() for path in SEEDS.iterdir()}
    made: dict[str, bytes] = {}
    for suffix in ("bvh", "json", "npz", "txt", "glb", "vrma"):
        write_motion(folder / f"clip.{suffix}", motion)
        made[suffix] = (folder / f"clip.{suffix}").read_bytes()
    write_posture(folder / "posture.json", motion.posture(0))
    engine = Engine.load("walk-hexapod")
    clip = engine.corpus.motion(engine.corpus.clips[0])
    tween = engine.tween(clip.posture(0), clip.posture(9))
    write_variation(folder / "variation.json", vary(clip.slice(0, 8), engine, nudge=1.0, alternatives=1).cut(2, 3, 5))
    engine.save(folder / "built")
    stored = load(folder / "built")
    built = {str(path.relative_to(folder / "built")): path.read_bytes() for path in stored.place.glob("*.npy")}
    manifest = (folder / "built" / "manifest.json").read_bytes()
    arrays = [name for name in built if "." not in Path(name).stem or "targets" in name]
    insect = ROOT / "corpora" / "walk-hexapod"
    archive, _, index = publish(
        "walk-hexapod", folder / "public", url="https://example.org/", date="2026-11-23", licence_text="CC0"
    ).files
    return [
        Reader("BVH", "a.bvh", [seeds["small.bvh"], made["bvh"]], _movement),
        Reader("JSON movement", "a.json", [made["json"], (folder / "posture.json").read_bytes()], _movement),
        Reader("npz", "a.npz", [made["npz"]], _movement, mutate=damaged_archive),
        Reader("GLB", "a.glb", [made["glb"], made["vrma"]], _movement),
        Reader("glTF, text", "a.gltf", [_text_of(made["vrma"])], _movement),
        Reader("AIST++'s pickle", "a.pkl", [_pickled(motion, protocol) for protocol in (0, 2, 5)], _movement),
        Reader("FineDance's array", "a.npy", [_array(np.zeros((4, 159))), _array(np.ones((3, 315)))], _movement),
        Reader("papers' notation", "a.txt", [seeds["braces.txt"], seeds["lines.txt"], made["txt"]], _papers),
        Reader("AMC", "toy_01.amc", [seeds["toy.amc"]], _movement, {"toy.asf": seeds["toy.asf"]}),
        Reader(
            "ASF",
            "toy.asf",
            [seeds["toy.asf"]],
            lambda path: _movement(path.with_name("toy_01.amc")),
            {"toy_01.amc": seeds["toy.amc"]},
        ),
        Reader(
            "score",
            "a.score",
            [seeds["piece.score"], seeds["vocabulary.score"]],
            _score,
            {"vocabulary.score": seeds["vocabulary.score"]},
        ),
        Reader(
            "included score",
            "vocabulary.score",
            [seeds["vocabulary.score"]],
            lambda path: _score(path.with_name("a.score")),
            {"a.score": seeds["piece.score"]},
        ),
        Reader("body", "a.toml", [(insect / "hexapod.toml").read_bytes()], read_body),
        Reader("library of states", "a.toml", [seeds["library.toml"]], read_library),
        Reader("joint mapping, TOML", "a.toml", [seeds["joints.toml"]], read_joint_mapping),
        Reader(
            "joint mapping, JSON",
            "a.json",
            [b'{"joints": {"Hips": "pelvis", "Knee": "left_knee"}}'],
            read_joint_mapping,
        ),
        Reader("variation", "a.json", [(folder / "variation.json").read_bytes()], _variation),
        Reader("report", "a.json", [encode_report(report_of(tween, None))], _report),
        Reader("manifest of scores", "manifest.json", [(insect / "manifest.json").read_bytes()], _source_manifest),
        Reader("manifest of a built corpus", "manifest.json", [manifest], _built_corpus, built),
        *(
            Reader(f"array {Path(name).stem}", name, [built[name]], _built_corpus, {**built, "manifest.json": manifest})
            for name in sorted(arrays)[:4]
        ),
        Reader("index of corpora", "index.json", [index.read_bytes()], _index),
        Reader("archive of a corpus", "a.tar", [archive.read_bytes()], _archive, {"index.json": index.read_bytes()}),
    ]


# --- campaigns ------------------------------------------------------------------------------------------------------


@dataclass
class Tally:
    """Counts of a reader's inputs, the seconds that all and the slowest took, and the faults that were found."""

    inputs: int = 0
    read: int = 0
    refused: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    faults: list[str] = field(default_factory=list)


class Overdue(BaseException):
    """A reader that takes too long; no Exception, which readers may catch."""


def _overdue(*_: object) -> None:
    raise Overdue(f"more than {LONGEST:g} s")


@contextmanager
def _limits() -> Iterator[None]:
    """End what takes too long: with an error that is kept, or, where compiled code hangs, with a traceback and all."""
    previous = signal.signal(signal.SIGALRM, _overdue)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    faulthandler.dump_traceback_later(3.0 * LONGEST, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)


def largest() -> int:
    """Return the most memory that this process has had, bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def attempt(reader: Reader, path: Path, data: bytes) -> tuple[bool, str]:
    """Give a reader a damaged file; return whether it read it, and the fault in a line, "" if there is none."""
    path.write_bytes(data)
    before, was_read, fault = largest(), False, ""
    try:
        with _limits(), warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MotionMindWarning)
            reader.read(path)
        was_read = True
    except MotionMindError as error:
        fault = f"a message of several lines: {str(error)[:200]!r}" if "\n" in str(error) else ""
    except (Exception, Overdue) as error:  # anything else is a fault, whatever it is
        frame = traceback.extract_tb(error.__traceback__)[-1]
        fault = f"{type(error).__name__}: {str(error)[:200]} ({Path(frame.filename).name}:{frame.lineno})"
    grown = largest() - before
    return was_read, fault or (f"{grown / 1e9:.1f} GB of memory" if grown > MOST_MEMORY else "")


def folder_of(reader: Reader) -> str:
    """Return the name of the folder with a reader's cases."""
    return reader.name.translate(str.maketrans(" ", "-", ",'"))


def keep(reader: Reader, data: bytes, folder: Path) -> Path:
    """Keep an input that failed among the cases of its reader, named by its content."""
    place = folder / folder_of(reader)
    place.mkdir(parents=True, exist_ok=True)
    path = place / sha256(data).hexdigest()[:12]
    path.write_bytes(data)
    return path


def campaign(chosen: Sequence[Reader], folder: Path, seconds: float, seed: int, kept: Path = CASES) -> dict[str, Tally]:
    """Damage files for some seconds, as long for each reader; print and keep those that fail.

    The inputs of a reader follow from the seed; how many there are depends on the machine.
    """
    tallies = {reader.name: Tally() for reader in chosen}
    inputs = {reader.name: reader.inputs(seed) for reader in chosen}
    paths = {reader.name: reader.lay_out(folder / str(number)) for number, reader in enumerate(chosen)}
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        reader = min(chosen, key=lambda one: tallies[one.name].seconds)
        tally, data, began = tallies[reader.name], next(inputs[reader.name]), time.perf_counter()
        was_read, fault = attempt(reader, paths[reader.name], data)
        took = time.perf_counter() - began
        tally.inputs += 1
        tally.read += was_read and not fault
        tally.refused += not was_read and not fault
        tally.seconds += took
        tally.slowest = max(tally.slowest, took)
        if fault:
            if fault not in tally.faults:
                print(f"{reader.name}, input {tally.inputs}: {fault}; kept as {keep(reader, data, kept)}", flush=True)
            tally.faults.append(fault)
    return tallies


def table(tallies: dict[str, Tally]) -> str:
    """Format a campaign as a table of Markdown."""
    rows = [
        f"| {name} | {one.inputs:,} | {one.read:,} | {one.refused:,} | {len(one.faults):,} | {1e3 * one.slowest:.0f} |"
        for name, one in tallies.items()
    ]
    every = tallies.values()
    total = f"| all | {sum(one.inputs for one in every):,} | {sum(one.read for one in every):,} |"
    total += f" {sum(one.refused for one in every):,} | {sum(len(one.faults) for one in every):,} |"
    total += f" {1e3 * max(one.slowest for one in every):.0f} |"
    return "\n".join(
        ["| reader | inputs | read | refused | failed | slowest, ms |", "|---|--:|--:|--:|--:|--:|", *rows, total]
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a campaign; return 1 if an input failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.robustness.fuzz", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--hours", type=float, default=0.0, help="run for so long")
    parser.add_argument("--seconds", type=float, default=60.0, help="run for so long, if no hours are given")
    parser.add_argument("--seed", type=int, default=0, help="begin with other inputs")
    parser.add_argument("--reader", help="damage the files of this reader alone")
    parser.add_argument("--table", action="store_true", help="print the table of docs/robustness.md")
    given = parser.parse_args(arguments)
    if resource is None:
        print(
            "error: there is no POSIX here, by which time and memory are limited: use Linux or macOS", file=sys.stderr
        )
        return 2
    faulthandler.enable()
    in_memory = Path("/dev/shm")  # where files cost no time
    folder = Path(tempfile.mkdtemp(prefix="fuzz-", dir=in_memory if in_memory.is_dir() else None))
    print(f"inputs in {folder}, where the last one stays if Python itself crashes", flush=True)
    chosen = [one for one in readers(folder) if given.reader in (None, one.name)]
    if not chosen:
        parser.error(f"no reader {given.reader}; there are {', '.join(one.name for one in readers(folder))}")
    # Address space is no memory, but what asks for so much more of it than libraries have is a fault, and is caught.
    resource.setrlimit(resource.RLIMIT_DATA, (6 * MOST_MEMORY, resource.RLIM_INFINITY))
    found = campaign(chosen, folder, 3600.0 * given.hours or given.seconds, given.seed)
    if given.table:
        print(table(found))
    shutil.rmtree(folder)
    faults = sum(len(one.faults) for one in found.values())
    print(f"{sum(one.inputs for one in found.values()):,} inputs, {faults:,} failed")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
