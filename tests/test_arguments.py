"""Every public function refuses what is of another type by one line, which is a MotionMindError and a TypeError."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scores import TITLED

import motionmind as mm
from motionmind import (
    MotionMindError,
    WrongTypeError,
    chaos,
    clean,
    discretize,
    duets,
    formats,
    gaps,
    learned,
    metrics,
    music,
    plots,
    retarget,
    transcription,
)
from motionmind import credits as crediting
from motionmind.corpus.gather import Gathering

# Made by MotionMind and given to its users, who make none; errors and warnings take any message.
ANSWERS = {
    "Bridge",
    "Cleaning",
    "Corpus",
    "Credit",
    "Deviation",
    "DuetTween",
    "Explanation",
    "Figure",
    "FoundPosture",
    "Gaps",
    "Library",
    "Link",
    "Plate",
    "Restyled",
    "Score",
    "Seam",
    "Sighting",
    "Source",
    "StateSpace",
    "Transcription",
    "Tween",
    "TweenReport",
    "Wait",
}
PROTOCOLS = {"Discretization", "MotionReader", "MotionWriter"}  # which others implement


class Nothing:
    """A value of a type that nobody takes."""


@cache
def things() -> dict[str, Any]:
    """Values to give: a body, an engine, and what they make."""
    engine = mm.Engine.load("ballet")
    motion = engine.corpus.motion(engine.corpus.clips[0])
    tween = engine.tween(motion.posture(0), motion.posture(3), moves=3)
    variation = mm.vary(motion, nudge=1.0)
    return {"engine": engine, "motion": motion, "posture": motion.posture(0), "tween": tween, "variation": variation}


def calls(folder: Path) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Every public function, and method that takes an argument, with arguments that it takes."""
    known = things()
    engine, motion, posture = known["engine"], known["motion"], known["posture"]
    variation, skeleton = known["variation"], posture.skeleton
    (folder / "bends.score").write_text(TITLED)
    (folder / "rig.toml").write_text('Hips = "pelvis"')
    (folder / "report.json").write_text(json.dumps(known["tween"].report()))
    mm.write_motion(folder / "clip.bvh", motion)
    mm.write_variation(folder / "variation.json", variation)
    flow = chaos.find_flow("lorenz")
    library = discretize.name_states([mm.read_score(folder / "bends.score")], 12.0)
    still = {"rotations": motion.rotations[:1], "root": motion.root[:1]}
    asked = {name: parameter.default for name, parameter in inspect.signature(mm.TweenRequest).parameters.items()}
    asked = {name: {} if name == "pin" else value for name, value in asked.items()}
    tween_asked = {"a": posture, "b": motion.posture(3), "moves": 3}
    gathering: dict[str, Any] = {"rate": None, "skip": 0, "facing": "free", "flips": "repair", "flip_degrees": 60.0}
    gathering |= {"mirror": False, "reverse": None, "about": None}
    gathering |= dict.fromkeys(("title", "author", "source", "licence", "citation", "performer"), "")
    assert gathering.keys() == Gathering.__annotations__.keys()
    path = folder / "out"
    beats, sound = music.Beats([0.0, 0.5]), music.Sound(np.zeros((8, 1)), 8000)
    path.with_suffix(".wav").write_bytes(sound.encode("WAV"))
    (folder / "beats.txt").write_text("0.5 1")
    return {
        "Beats": (music.Beats, {"times": [0.0, 0.5]}),
        "Beats.count": (beats.count, {"seconds": 0.7}),
        "Beats.grid": (beats.grid, {"every": 2, "seconds": 3.0}),
        "Beats.seconds": (beats.seconds, {"count": 3}),
        "Beats.starting_at": (beats.starting_at, {"seconds": 0.2}),
        "Sound": (music.Sound, {"samples": sound.samples, "rate": 8000}),
        "Sound.encode": (sound.encode, {"kind": "WAV"}),
        "Sound.part": (sound.part, {"start": 0.0, "seconds": 1.0}),
        "read_beats": (music.read_beats, {"path": folder / "beats.txt"}),
        "read_sound": (music.read_sound, {"path": path.with_suffix(".wav")}),
        "clean_motion": (clean.clean_motion, {"motion": known["tween"].motion, "without": ["feet"], "engine": engine}),
        "tween_duet": (
            duets.tween_duet,
            {"engine": engine, "a": (posture, posture), "b": (posture, motion.posture(3)), "duets": ()},
        ),
        "draw_deviation": (
            plots.draw_deviation,
            {"transcription": transcription.transcribe(motion.slice(0, 2))},
        ),
        "draw_cleaning": (plots.draw_cleaning, {"cleaning": clean.clean_motion(known["tween"].motion)}),
        "draw_floor_plan": (plots.draw_floor_plan, {"motion": known["tween"].motion}),
        "find_overstep": (plots.find_overstep, {"motion": motion, "stage": (8.0, 6.0)}),
        "draw_angles": (plots.draw_angles, {"motion": known["tween"].motion}),
        "compose": (mm.compose, {"path": folder / "bends.score", "clip": "bends"}),
        "draw_sheet": (mm.draw_sheet, {"motion": motion, "frames": [0]}),
        "explain": (mm.explain, {"tween": known["tween"]}),
        "find_gaps": (gaps.find_gaps, {"learned": engine, "pairs": 2, "count": 0, "named": {}}),
        "find_posture": (mm.find_posture, {"name": "ballet/fifth"}),
        "find_flow": (chaos.find_flow, {"name": "lorenz", "rho": 28.0}),
        "list_corpora": (mm.list_corpora, {"folder": folder}),
        "lossy_fields": (formats.lossy_fields, {"motion": motion, "path": "rest.bvh"}),
        "make_discretization": (discretize.make_discretization, {"kind": "codebook"}),
        "measure": (metrics.measure, {"motion": motion, "learned": engine}),
        "measure_effort": (metrics.measure_effort, {"motion": motion, "window": 0.2}),
        "name_states": (discretize.name_states, {"scores": [mm.read_score(folder / "bends.score")], "tolerance": 12.0}),
        "own_skeleton": (mm.own_skeleton, {"movement": motion}),
        "read_joint_mapping": (retarget.read_joint_mapping, {"path": folder / "rig.toml"}),
        "read_library": (discretize.read_library, {"name_or_path": "human23"}),
        "read_motion": (mm.read_motion, {"path": folder / "clip.bvh"}),
        "read_posture": (mm.read_posture, {"path": folder / "clip.bvh", "frame": 3}),
        "read_report": (mm.read_report, {"path": folder / "report.json"}),
        "read_score": (mm.read_score, {"path": folder / "bends.score"}),
        "read_variation": (mm.read_variation, {"path": folder / "variation.json"}),
        "transcribe": (
            transcription.transcribe,
            {"motion": motion.slice(0, 2), "tolerance": 6.0, "name": "c", "repeats": True, "vocabulary": ()},
        ),
        "restyle": (transcription.restyle, {"motion": motion, "engine": engine, "tolerance": 30.0}),
        "pass_through": (transcription.pass_through, {"postures": motion.slice(0, 2), "engine": engine}),
        "to_human23": (retarget.to_human23, {"movement": motion}),
        "vary": (mm.vary, {"piece": motion}),
        "draw_attractor": (plots.draw_attractor, {"path": path.with_suffix(".svg"), "variation": variation}),
        "draw_joint_graph": (
            plots.draw_joint_graph,
            {"path": path.with_suffix(".graphml"), "engine": engine, "joint": "left_hip"},
        ),
        "write_library": (discretize.write_library, {"path": path.with_suffix(".toml"), "library": library}),
        "write_motion": (mm.write_motion, {"path": path.with_suffix(".bvh"), "motion": motion}),
        "draw_picture": (mm.draw_picture, {"path": path.with_suffix(".png"), "motion": posture.as_motion()}),
        "write_posture": (mm.write_posture, {"path": path.with_suffix(".json"), "posture": posture}),
        "write_variation": (mm.write_variation, {"path": path.with_suffix(".var"), "variation": variation}),
        "Engine.alternatives": (lambda **given: [*engine.alternatives(**given)], {**tween_asked, "count": 1}),
        "Engine.check": (engine.check, {"pairs": 3}),
        "Engine.fit": (mm.Engine.fit, {"clips": [motion], **gathering}),
        "Engine.joint_graph": (engine.joint_graph, {"joint": "left_hip"}),
        "Engine.learn": (
            mm.Engine.learn,
            {"corpus": engine.corpus, "discretization": discretize.make_discretization("codebook")},
        ),
        "Engine.load": (mm.Engine.load, {"name": "ballet"}),
        "Engine.posture": (engine.posture, {"name": "ballet/fifth"}),
        "Engine.save": (engine.save, {"folder": folder / "saved"}),
        "Engine.tween": (engine.tween, tween_asked),
        "Flow": (chaos.Flow, {"name": "own", "field": flow.field, "start": flow.start, "step": 0.01}),
        "Insertion": (mm.Insertion, {"times": [0.0, 1.0], "credits": ()}),
        "Insertion.renamed": (mm.Insertion(np.arange(2.0)).renamed, {"joints": {}}),
        "Motion": (mm.Motion, {"skeleton": skeleton, "times": [0.0], **still}),
        "Motion.at": (motion.at, {"times": [0.5]}),
        "Motion.posture": (motion.posture, {"frame": 0}),
        "Motion.resample": (motion.resample, {"rate": 10.0}),
        "Motion.stretch_to": (motion.stretch_to, {"rate": 10.0}),
        "Motion.slice": (motion.slice, {"start": 0, "stop": 3}),
        "Piece": (mm.Piece, {"motion": motion, "frames": [0, len(motion) - 1]}),
        "Piece.of": (mm.Piece.of, {"motion": motion}),
        "Posture": (mm.Posture, {"skeleton": skeleton, "rotations": posture.rotations, "root": [0, 1, 0]}),
        "Skeleton": (
            mm.Skeleton,
            {"name": "arm", "names": ("a", "b"), "parents": (-1, 0), "offsets": [[0, 0, 0], [1, 0, 0]]},
        ),
        "Skeleton.children": (skeleton.children, {"joint": 0}),
        "Skeleton.difference": (skeleton.difference, {"other": skeleton}),
        "Skeleton.global_rotations": (skeleton.global_rotations, {"rotations": posture.rotations}),
        "Skeleton.index": (skeleton.index, {"joint": "left_hip"}),
        "Skeleton.local_rotations": (skeleton.local_rotations, {"turned": posture.rotations}),
        "Skeleton.positions": (skeleton.positions, {"rotations": posture.rotations, "root": posture.root}),
        "Skeleton.positions_and_tips": (
            skeleton.positions_and_tips,
            {"rotations": posture.rotations, "root": posture.root},
        ),
        "Skeleton.positions_with": (
            skeleton.positions_with,
            {"rotations": posture.rotations, "root": posture.root, "joints": [0], "points": [[0, 0, 0]]},
        ),
        "SearchOptions": (mm.SearchOptions, {}),
        "SearchOptions.nodes": (mm.SearchOptions().nodes, {"chains": 23}),
        "TweenRequest": (mm.TweenRequest, asked),
        "TweenRequest.of": (mm.TweenRequest.of, {"request": None, "moves": 3}),
        "TweenRequest.plain": (mm.TweenRequest().plain, {"chains": 23}),
        "Velocity": (mm.Velocity, {"rotations": np.zeros((len(skeleton), 3)), "root": [0, 1, 0]}),
        "Velocity.at_end": (mm.Velocity.at_end, {"motion": motion}),
        "Velocity.at_start": (mm.Velocity.at_start, {"motion": motion}),
        "Variation": (
            mm.Variation,
            {"piece": variation.piece, "course": variation.course, "order": variation.order},
        ),
        "Variation.approve": (variation.approve, {}),
        "Variation.around": (variation.around, {"seam": 1}),
        "Variation.cut": (variation.cut, {"first": 2, "last": 4, "before": 8}),
        "Variation.discard": (variation.discard, {}),
        "Variation.replace": (variation.replace, {"seam": 1, "alternative": 1}),
        "Variation.smooth": (mm.vary(motion).smooth, {"engine": engine, "moves": 1, "alternatives": 1}),
    }


# Of a Piece, for those that arrange postures themselves; they check nothing.
INNER = {"Piece.around", "Piece.arrange", "Piece.chunks", "Piece.ends", "Piece.is_seam"}


def public() -> dict[str, Callable[..., Any]]:
    """Every public function, class and method that takes an argument, by name."""
    found: dict[str, Callable[..., Any]] = {}
    rooms = (
        mm,
        chaos,
        clean,
        crediting,
        discretize,
        duets,
        formats,
        gaps,
        learned,
        metrics,
        music,
        plots,
        retarget,
        transcription,
    )
    for name, thing in ((name, getattr(room, name)) for room in rooms for name in room.__all__):
        if (
            name in ANSWERS | PROTOCOLS
            or not callable(thing)
            or (isinstance(thing, type) and issubclass(thing, Exception))
        ):
            continue
        if name != "Engine":  # `fit` and `load` make one
            found[name] = thing
        if isinstance(thing, type):
            methods = inspect.getmembers(thing, lambda one: inspect.isfunction(one) or inspect.ismethod(one))
            found |= {f"{name}.{key}": method for key, method in methods if not key.startswith("_")}
    return {name: thing for name, thing in found.items() if [*parameters(thing)] and name not in INNER}


def parameters(thing: Callable[..., Any]) -> Mapping[str, inspect.Parameter]:
    """Return a function's parameters but the object itself."""
    return {name: one for name, one in inspect.signature(thing).parameters.items() if name != "self"}


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    return calls(tmp_path_factory.mktemp("arguments"))


def test_the_table_of_calls_has_every_public_function(known: dict[str, Any]) -> None:
    assert sorted(known) == sorted(public())


@pytest.mark.parametrize("name", sorted(public()))
def test_every_argument_of_another_type_is_refused_by_its_name(
    name: str, known: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    function, arguments = known[name]
    every = {key for key, one in parameters(public()[name]).items() if one.kind is not one.VAR_KEYWORD}
    for key in sorted((every | arguments.keys()) - {"seams"}):
        given = [Nothing()]
        parameter = parameters(public()[name]).get(key)
        if parameter is not None and parameter.default is not None and "None" not in str(parameter.annotation):
            given.append(None)
        for value in given:
            with pytest.raises(WrongTypeError) as error:
                function(**{**arguments, key: value})
            message = str(error.value)
            assert isinstance(error.value, MotionMindError), key
            assert isinstance(error.value, TypeError), key
            assert key.rstrip("_") in message.replace(" ", "_"), (key, message)
            assert "\n" not in message, (key, message)
            assert "0x" not in message, (key, message)
    if "seams" in every:
        with pytest.raises(WrongTypeError, match="seam"):
            function(Nothing())
    assert [*tmp_path.iterdir()] == []
