"""The readers of MotionMind, each with whole files, and with how they are damaged or generated."""

from __future__ import annotations

import base64
import io
import json
import pickle
import random
import struct
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Literal

import mido
import numpy as np
from fuzz_damage import damaged, damaged_archive
from fuzz_gltf import gltf_binaries, gltf_texts
from fuzz_structures import Generate, archives_of_arrays, arrays, documents, pickles, tars

from motionmind import Engine, Motion, human23, vary, write_motion, write_posture, write_variation
from motionmind._typing import Floats
from motionmind.body.anatomy_file import read_body
from motionmind.corpus.manifest import SourceManifest, parse_manifest
from motionmind.corpus.store import load, read_manifest
from motionmind.discretize.library import read_library
from motionmind.discretize.spec import from_spec
from motionmind.ensemble.dancers import find_approaches
from motionmind.ensemble.reading import read_ensemble
from motionmind.ensemble.writing import format_ensemble
from motionmind.formats import read_clips
from motionmind.formats.floor_path import read_floor_path
from motionmind.formats.papers import read_papers
from motionmind.geometry import rotations as rot
from motionmind.laban.drawing import draw_staff
from motionmind.laban.text import read_staff, staff_text
from motionmind.music import Sound, read_beats, read_sound
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

ROOT = Path(__file__).parents[2]
SEEDS = Path(__file__).parent / "seeds"
MAX_CLIPS = 4  # of a file that are read
P_GENERATED = 0.5  # of a reader's inputs, if it has a generator; a quarter of these is damaged as well

FLOOR_PATH = b"""<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0C.5 0 1 .5 1 1q0 1-1 1V2h-1.5Z"/></svg>"""
BEATS = b"# a waltz\n0.25 3\n0.75 1\n1.25 2\n1.75\n"

SIGNS = b"""laban 1
title A step
body human23
tempo 96.5
bar 3
counts 6
left support
  start | place middle
  0 1   | hold
right support
  start | place middle
  0 2   | left-forward high
left leg
  1 1   | back low very bent touch
head turn
  0 0.5 | turn 45 left
turn
  2 3   | turn 360 right
path
  1 4   | back
"""
ENSEMBLE = b"""\
piece = "p"
tempo = 108
piece_tempo = 120
mirror = true
canon = 4
formation = "V"
spacing = 1.6
facing = "centre"
stage = [8.0, 6.0]
[[dancer]]
name = "Anna"
place = [0.5, -1.0]
[[dancer]]
piece = "q"
facing = -90
mirrored = true
entry = 3

[[change]]
at = 9
counts = 4
formation = "circle"
spacing = 2.0
"""

Mutate = Callable[[bytes, Sequence[bytes], random.Random], bytes]


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
        generate: makes another file; None if there are only damaged ones.
    """

    name: str
    file: str
    seeds: Sequence[bytes]
    read: Callable[[Path], object]
    beside: dict[str, bytes] = field(default_factory=dict)
    mutate: Mutate = damaged
    generate: Generate | None = None

    def inputs(self, seed: int) -> Iterator[bytes]:
        """Yield damaged and generated files, the same for the same seed."""
        rng = random.Random(f"{seed} {self.name}")
        while True:
            if self.generate is None or rng.random() > P_GENERATED:
                yield self.mutate(rng.choice(self.seeds), self.seeds, rng)
            else:
                made = self.generate(self.seeds, rng)
                yield made if rng.random() < 0.75 else self.mutate(made, self.seeds, rng)

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
    for motion in islice(read_clips(path), MAX_CLIPS):
        check_motion(motion)


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


def _signs(path: Path) -> None:
    """Read signs, draw them, and write them again."""
    staff = read_staff(path)
    draw_staff(staff).encode(".svg")
    staff_text(staff)


def _ensemble(path: Path) -> None:
    """Read an ensemble of dancers who stand still, and find how near they are."""
    posture = rot.IDENTITY * np.ones((2, 23, 1))
    still = Motion(human23(), posture, np.zeros((2, 3)), np.array([0.0, 0.5]))
    ensemble = read_ensemble(path, lambda _: still)
    find_approaches(ensemble.motions(np.array([0.0, ensemble.seconds])))
    format_ensemble(ensemble, str)


def _beats(path: Path) -> None:
    """Read beats, and count by them."""
    beats = read_beats(path)
    beats.grid(3, 60.0)


def _midi() -> bytes:
    """Return a MIDI file with an upbeat, a waltz and a change of tempo."""
    file, out = mido.MidiFile(ticks_per_beat=96), io.BytesIO()
    messages = [
        mido.MetaMessage("time_signature", numerator=1, denominator=4),
        mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(93.7)),
        mido.MetaMessage("time_signature", numerator=3, denominator=4, time=96),
        mido.Message("note_on", note=60, time=96),
        mido.MetaMessage("set_tempo", tempo=mido.bpm2tempo(131), time=300),
        mido.Message("note_off", note=60, time=600),
    ]
    file.tracks.append(mido.MidiTrack(messages))
    file.save(file=out)
    return out.getvalue()


def _sound(kind: Literal["WAV", "FLAC"]) -> bytes:
    """Return a sound file."""
    return Sound(np.sin(np.linspace(0.0, 99.0, 400))[:, None], 8000).encode(kind)


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
    whole = {**built, "manifest.json": manifest}
    chosen = [name for name in built if "." not in Path(name).stem or "targets" in name]
    insect = ROOT / "corpora" / "walk-hexapod"
    source = (insect / "manifest.json").read_bytes()
    jsons = [made["json"], (folder / "posture.json").read_bytes()]
    archive, _, index = publish(
        "walk-hexapod", folder / "public", url="https://example.org/", date="2026-11-23", licence_text="CC0"
    ).files
    listed = index.read_bytes()
    return [
        Reader("BVH", "a.bvh", [seeds["small.bvh"], made["bvh"], seeds["duo.bvh"]], _movement),
        Reader("JSON movement", "a.json", jsons, _movement, generate=documents),
        Reader("npz", "a.npz", [made["npz"]], _movement, mutate=damaged_archive, generate=archives_of_arrays),
        Reader("Kimodo's npz", "a.npz", [seeds["soma30.npz"]], _movement, mutate=damaged_archive),
        Reader("GVHMR's results", "a.pt", [seeds["gvhmr.pt"]], _movement, mutate=damaged_archive),
        Reader("places of joints", "a.npy", [seeds["humanml3d.npy"], seeds["mdm.npy"]], _movement, generate=arrays),
        Reader("GLB", "a.glb", [made["glb"], made["vrma"]], _movement, generate=gltf_binaries),
        Reader("glTF, text", "a.gltf", [_text_of(made["vrma"])], _movement, generate=gltf_texts),
        Reader("AIST++'s pickle", "a.pkl", [_pickled(motion, n) for n in (0, 2, 5)], _movement, generate=pickles),
        Reader(
            "FineDance's array",
            "a.npy",
            [_array(np.zeros((4, 159))), _array(np.ones((3, 315)))],
            _movement,
            generate=arrays,
        ),
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
        Reader("ensemble", "a.toml", [ENSEMBLE], _ensemble),
        Reader("floor path, text", "a.csv", [b"x,z\n0,0\n0.5,1.25\n# on\n2;3\n"], read_floor_path),
        Reader("floor path, SVG", "a.svg", [FLOOR_PATH], read_floor_path),
        Reader("Labanotation's signs", "a.laban", [SIGNS], _signs),
        Reader("text of beats", "a.txt", [BEATS], _beats),
        Reader("MIDI", "a.mid", [_midi()], _beats),
        Reader("sound", "a.wav", [_sound("WAV"), _sound("FLAC")], read_sound),
        Reader(
            "joint mapping, JSON",
            "a.json",
            [b'{"joints": {"Hips": "pelvis", "Knee": "left_knee"}}'],
            read_joint_mapping,
            generate=documents,
        ),
        Reader("variation", "a.json", [(folder / "variation.json").read_bytes()], _variation, generate=documents),
        Reader("report", "a.json", [encode_report(report_of(tween, None))], _report, generate=documents),
        Reader("manifest of scores", "manifest.json", [source], _source_manifest, generate=documents),
        Reader("manifest of a built corpus", "manifest.json", [manifest], _built_corpus, built, generate=documents),
        *(
            Reader(f"array {Path(name).stem}", name, [built[name]], _built_corpus, whole, generate=arrays)
            for name in sorted(chosen)[:4]
        ),
        Reader("index of corpora", "index.json", [listed], _index, generate=documents),
        Reader("archive of a corpus", "a.tar", [archive.read_bytes()], _archive, {"index.json": listed}, generate=tars),
    ]
