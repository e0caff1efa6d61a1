"""Files that somebody brings: what is understood of them, and that no file does harm."""

from __future__ import annotations

import asyncio
import io
import os
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import pytest
from gltf_files import with_clips
from scores import TITLED
from studio_server import running

from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.errors import MotionMindError
from motionmind.formats import write_motion
from motionmind.geometry import rotations as rot
from motionmind.studio import room as room_module
from motionmind.studio import uploads as module
from motionmind.studio.corpora import Lesson, Mixed, Part, Recording, check_lesson, learn, list_all
from motionmind.studio.project import Project
from motionmind.studio.reading import is_posed_first
from motionmind.studio.room import Room
from motionmind.studio.uploads import Choices, Upload, Uploads

T = TypeVar("T")


@pytest.fixture
def uploads() -> Iterator[Uploads]:
    found = Uploads()
    yield found
    found.close()


async def once(data: bytes) -> AsyncIterator[bytes]:
    yield data


def bring(uploads: Uploads, name: str, data: bytes) -> Upload:
    return asyncio.run(uploads.take(name, once(data)))


def recording(count: int = 60, fps: float = 30.0) -> Motion:
    """A body that lifts its arms and turns a little, recorded."""
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (count, 23, 1))
    angle = 0.4 * np.sin(np.arange(count) / 9.0)
    axis = np.zeros((count, 3))
    axis[:, 2] = angle + 0.5
    for name in ("left_shoulder", "left_elbow", "right_hip"):
        rotations[:, human23().index(name)] = rot.exp(axis)
    root = np.tile([0.0, 0.9, 0.0], (count, 1)) + np.arange(count)[:, None] * [0.01, 0.0, 0.0]
    return Motion(human23(), rotations, root, np.arange(count) / fps, name="turn")


def bvh(tmp_path: Path, motion: Motion) -> bytes:
    path = tmp_path / "turn.bvh"
    write_motion(path, motion)
    return path.read_bytes()


def test_understands_a_recording(uploads: Uploads, tmp_path: Path) -> None:
    motion = recording()
    found = bring(uploads, "My turn.BVH", bvh(tmp_path, motion))
    assert found.error == ""
    facts = found.facts
    assert facts is not None
    assert (facts.joints, facts.rig, facts.people, facts.unit, facts.is_guessed) == (23, "human23", True, "cm", True)
    assert facts.body is not None
    assert facts.body.name == "My turn"
    assert facts.height == pytest.approx(1.7, abs=0.15)
    (clip,) = facts.clips
    assert (clip.name, clip.frames, round(clip.fps or 0)) == ("My turn", 60, 30)
    assert facts.faults == ()
    read = uploads.motion(found.id, 0)
    assert read.positions() == pytest.approx(motion.positions(), abs=1e-4)


@pytest.mark.long
def test_unit_and_rate_are_choices(uploads: Uploads, tmp_path: Path) -> None:
    found = bring(uploads, "turn.bvh", bvh(tmp_path, recording()))
    again = asyncio.run(uploads.read(found.id, Choices(unit="m", fps=60.0, skip=2)))
    assert again.facts is not None
    assert again.facts.height == pytest.approx(170.0, abs=15.0)
    assert again.facts.clips[0].fps == pytest.approx(60.0)
    assert len(uploads.motion(found.id, 0)) == 58
    with pytest.raises(MotionMindError, match="unknown unit ell: choose from cm"):
        asyncio.run(uploads.read(found.id, Choices(unit="ell")))


@pytest.mark.long
def test_a_pose_that_was_put_first_is_left_out(uploads: Uploads, tmp_path: Path) -> None:
    motion = recording()
    rotations = motion.rotations.copy()
    rotations[0] = [0.0, 0.0, 0.0, 1.0]
    rotations[1:, human23().index("left_knee")] = rot.exp(np.array([0.9, 0.0, 0.0]))
    posed = replace(motion, rotations=rotations)
    assert is_posed_first(posed)
    assert not is_posed_first(motion)
    found = bring(uploads, "turn.bvh", bvh(tmp_path, posed))
    assert found.facts is not None
    assert found.facts.clips[0].posed_first
    assert len(uploads.motion(found.id, 0)) == 59
    kept = asyncio.run(uploads.read(found.id, Choices(skip=0)))
    assert len(uploads.motion(kept.id, 0)) == 60


@pytest.mark.parametrize("flip_deg", [0.0, 90.0])
def test_a_pose_before_a_recording_with_flips(flip_deg: float) -> None:
    motion = recording()
    rotations = motion.rotations.copy()
    rotations[0] = [0.0, 0.0, 0.0, 1.0]
    for joint in ("left_knee", "right_knee", "left_shoulder", "right_shoulder"):
        rotations[1:, human23().index(joint)] = rot.exp(np.array([0.0, 0.0, 1.2]))
    rotations[5, human23().index("left_wrist")] = rot.exp(np.radians([flip_deg, 0.0, 0.0]))
    assert is_posed_first(replace(motion, rotations=rotations))


def test_quick_movement_is_no_pose_that_was_put_first() -> None:
    motion = recording()
    rotations = np.tile([0.0, 0.0, 0.0, 1.0], (len(motion), 23, 1))
    angles = np.zeros((len(motion), 3))
    angles[:, 0] = np.radians(15.0) * np.arange(len(motion))
    rotations[:, human23().index("left_knee")] = rot.exp(angles)
    assert not is_posed_first(replace(motion, rotations=rotations))


def test_names_joints_that_jump(uploads: Uploads, tmp_path: Path) -> None:
    motion = recording(90, 120.0)
    rotations = motion.rotations.copy()
    hip = human23().index("left_hip")
    rotations[30:40, hip] = rot.mul(rotations[30:40, hip], rot.exp(np.array([0.0, 3.0, 0.0])))
    found = bring(uploads, "turn.bvh", bvh(tmp_path, replace(motion, rotations=rotations)))
    assert found.facts is not None
    (fault,) = found.facts.faults
    assert (fault.joint, fault.times) == ("left_hip", 2)
    assert fault.seconds == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize("suffix", ["glb", "vrma"])
def test_lists_every_clip_of_a_file(uploads: Uploads, suffix: str, tmp_path: Path) -> None:
    turns = recording(), recording(90)
    path = with_clips(tmp_path / f"a.{suffix}", list(zip(["Slow <b>", "Long\n"], turns, strict=True))).write()
    found = bring(uploads, f"My hero.{suffix}", path.read_bytes())
    assert found.error == ""
    assert found.facts is not None
    assert found.facts.notes == ()
    assert [(one.name, one.frames) for one in found.facts.clips] == [
        ("My hero#Slow <b>", 60),
        ("My hero#Long\\u000a", 90),
    ]
    for number, turn in enumerate(turns):
        motion = uploads.motion(found.id, number)
        assert rot.angle(motion.rotations, turn.rotations).max() < 1e-3
    alone = with_clips(tmp_path / f"b.{suffix}", [("Slow", turns[0])]).write()
    facts = bring(uploads, f"one.{suffix}", alone.read_bytes()).facts
    assert facts is not None
    assert [one.name for one in facts.clips] == ["one"]


def test_reads_a_score(uploads: Uploads) -> None:
    found = bring(uploads, "bends.score", TITLED.encode())
    assert found.facts is not None
    assert [(clip.name, clip.frames, clip.fps) for clip in found.facts.clips] == [("bends", 3, None)]
    assert uploads.motion(found.id, 0).keyframed


def test_recorded_movement(uploads: Uploads, shared_data: Path) -> None:
    found = bring(uploads, "05_06.bvh", (shared_data / "cmu-05" / "05_06.bvh").read_bytes())
    assert found.facts is not None
    assert (found.facts.unit, found.facts.joints, len(found.facts.body.names if found.facts.body else ())) == (
        "cmu",
        31,
        23,
    )
    assert found.facts.clips[0].posed_first
    assert found.facts.faults[0].joint == "right_hip"


@pytest.mark.long
def test_an_amc_needs_its_asf(uploads: Uploads, shared_data: Path) -> None:
    amc, asf = ((shared_data / "cmu-135" / name).read_bytes() for name in ("135_04.amc", "135.asf"))
    alone = bring(uploads, "135_04.amc", amc)
    assert "upload its .asf" in alone.error
    skeleton = bring(uploads, "135.asf", asf)
    assert (skeleton.facts, skeleton.error) == (None, "")
    again = asyncio.run(uploads.read(alone.id, Choices(asf=skeleton.id)))
    assert again.error == ""
    assert bring(uploads, "135_04.amc", amc).facts is not None  # the .asf is there already


@pytest.mark.long
def test_goes_with_the_studio(tmp_path: Path) -> None:
    uploads = Uploads()
    found = bring(uploads, "bends.score", TITLED.encode())
    folder = uploads.folder(found.id)
    assert folder.is_dir()
    uploads.forget(found.id)
    assert not folder.exists()
    with pytest.raises(MotionMindError, match="this file is gone"):
        uploads.motion(found.id, 0)
    other = uploads.folder(bring(uploads, "bends.score", TITLED.encode()).id)
    uploads.close()
    assert not other.exists()


HOLDER = "import sys; from motionmind.studio.room import Room; room = Room(); "
HOLDER += "print(room.folder, flush=True); sys.stdin.read()"


def test_folders_of_killed_studios_go_at_once_and_of_running_ones_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    environment = os.environ | {"TMPDIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", HOLDER]
    with ExitStack() as stack:
        holders = [
            stack.enter_context(
                subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment)
            )
            for _ in range(3)
        ]
        folders = [Path(holder.stdout.readline().rstrip()) for holder in holders if holder.stdout]
        for folder in folders:
            (folder / "upload").mkdir()
            os.utime(folder, (0.0, 0.0))  # however old it is
        holders[0].kill()
        holders[0].wait()
        room = Room()
        assert [folder.exists() for folder in folders] == [False, True, True]
        assert all((folder / "upload").is_dir() for folder in folders[1:])
        holders[1].communicate("")  # it ends
        assert [folder.exists() for folder in folders] == [False, False, True]
        holders[2].kill()
    room.close()
    Room().close()
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_taken_for_a_leftover_before_it_is_locked_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    lock_alone, taken, others = room_module.lock_alone, list[Path](), list[Room]()

    def interrupted(descriptor: int) -> bool:
        if not taken:
            taken.extend(tmp_path.iterdir())
            monkeypatch.setattr(room_module, "lock_alone", lock_alone)
            others.append(Room())  # of another process, which removes the first
        return lock_alone(descriptor)

    monkeypatch.setattr(room_module, "lock_alone", interrupted)
    room = Room()
    assert [folder.exists() for folder in (*taken, room.folder)] == [False, True]
    room.close()


@pytest.fixture
def _heeds_hangups() -> Iterator[None]:
    """Let processes heed SIGHUP even if the tests run under nohup."""
    handler = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, handler)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="these signals are POSIX")
@pytest.mark.usefixtures("_heeds_hangups")
@pytest.mark.parametrize("number", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_signal_that_ends_the_studio_removes_uploads_and_keeps_the_project(tmp_path: Path, number: str) -> None:
    (tmp_path / "tmp").mkdir()
    path = tmp_path / "piece.motionmind"
    with running(path, home=tmp_path, TMPDIR=str(tmp_path / "tmp")) as (process, client), client.listening() as events:
        next(events)
        answer = client.send("POST", "/api/imports", TITLED.encode(), X_Name="bends.score")
        assert answer.status == 200
        assert list((tmp_path / "tmp").glob("motionmind-studio-*/*/upload.score"))
        client.insert("b0", "ballet/adagio", 0, 9)
        process.send_signal(signal.Signals[number])
        _, err = process.communicate(timeout=60)
    assert process.returncode == (130 if number == "SIGINT" else 143)
    assert "Traceback" not in err
    assert not list((tmp_path / "tmp").glob("motionmind-*"))
    again = Project.open(path)
    assert [block.id for block in again.state.blocks] == ["b0"]
    again.close()


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="these signals are POSIX")
def test_the_end_of_the_terminal_ends_no_studio_that_ignores_it(tmp_path: Path) -> None:
    handler = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with running(tmp_path / "piece.motionmind", home=tmp_path) as (process, client):
            process.send_signal(signal.SIGHUP)
            client.insert("b0", "ballet/adagio", 0, 9)
            assert process.poll() is None
    finally:
        signal.signal(signal.SIGHUP, handler)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="there nobody can be asked whether a process runs")
def test_a_studio_that_was_killed_leaves_nothing_for_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    dead = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    gone, stays, linked = (tmp_path / name for name in (f"motionmind-studio-{int(dead.stdout)}-a1_", "mine", "other"))
    for folder in (gone, stays, linked):
        (folder / "0").mkdir(parents=True)
        (folder / "0" / "upload.bvh").write_text("movement")
    (tmp_path / f"motionmind-studio-{int(dead.stdout)}-link").symlink_to(linked)
    fresh = tmp_path / f"motionmind-studio-{int(dead.stdout)}-b2_"
    fresh.mkdir()  # who runs elsewhere, and sees this folder, may have made it
    os.utime(gone, (time.time() - 9e4,) * 2)
    first = Uploads()
    second = Uploads()
    folders = [one.folder(bring(one, "bends.score", TITLED.encode()).id) for one in (first, second)]
    assert not gone.exists()
    assert all((folder / "0" / "upload.bvh").exists() for folder in (stays, linked))
    assert fresh.exists()
    assert all(folder.is_dir() for folder in folders)  # those who run keep theirs
    first.close()
    second.close()


# --- files that mean harm ---------------------------------------------------------------------------------------------


def zeros(count: int) -> bytes:
    """An array of zeros that unpacks to eight bytes for each of `count`, and is packed to a thousandth of that."""
    out = io.BytesIO()
    with (
        zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("poses.npy", "w", force_zip64=True) as member,
    ):
        header = io.BytesIO()
        np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (count,)})
        member.write(header.getvalue())
        for _ in range(count // 2**17):
            member.write(bytes(2**20))
    return out.getvalue()


HOSTILE: dict[str, tuple[str, Callable[[], bytes]]] = {
    "garbage": ("noise.bvh", lambda: np.random.default_rng(0).bytes(10 * 2**20)),
    "garbage in an archive": ("noise.npz", lambda: np.random.default_rng(0).bytes(2**20)),
    "an array of gigabytes": ("bomb.npz", lambda: zeros(2**28)),
    "JSON nested deep": ("deep.json", lambda: b"[" * 10**6),
    "a score that reads another file": ("nosy.score", lambda: b"include /etc/passwd\n"),
    "a score with a body of its own": ("body.score", lambda: b"body ../../secret.toml\n"),
    "a score without end": (
        "endless.score",
        lambda: (
            TITLED.partition("clip")[0].encode()
            + b"phrase q0 (W)\n  1 | W\n"
            + b"".join(b"phrase q%d (W)\n  q%d (W W)\n" % (i, i - 1) for i in range(1, 40))
            + b"clip c\n  start | stand\n  q39 (stand)\n"
        ),
    ),
    "nothing": ("empty.glb", lambda: b""),
}


@pytest.mark.long
@pytest.mark.parametrize("kind", HOSTILE)
def test_no_file_does_harm(uploads: Uploads, kind: str) -> None:
    name, data = HOSTILE[kind]
    before = time.monotonic()
    found = bring(uploads, name, data())
    assert found.facts is None
    assert found.error.startswith(name)
    assert "\n" not in found.error
    assert str(uploads.folder(found.id)) not in found.error
    assert "root:" not in found.error
    assert time.monotonic() - before < 60.0


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("include secret.score", "includes secret.score: upload that score too"),
        ("include\t../secret.score as x", "includes secret.score: upload that score too"),
        ("include\u00a0/etc/secret.score", "includes secret.score: upload that score too"),
        ("include /etc/passwd", "includes passwd: upload that score too"),
        ("body secret.toml", "uses a body file: upload a score for a built-in body"),
        ("body\u00a0../secret.toml", "uses a body file: upload a score for a built-in body"),
    ],
)
def test_a_score_names_no_files_of_this_machine(uploads: Uploads, line: str, words: str) -> None:
    found = bring(uploads, "nosy.score", f"{line}\n{TITLED}".encode())
    assert found.error == f"nosy.score:1: {words}"


@pytest.mark.long
def test_scores_take_in_others_that_were_brought(uploads: Uploads) -> None:
    words, phrases = TITLED.partition("clip")[0], "include words.score\nphrase dip\n  1 | bend\n"
    top = "include ../steps/phrases.score\nclip two\n  start | stand\n  dip\n  1 | stand\n"
    first = bring(uploads, "top.score", top.encode())
    assert first.error == "top.score:1: includes phrases.score: upload that score too"
    bring(uploads, "phrases.score", phrases.encode())
    assert (
        asyncio.run(uploads.read(first.id, Choices())).error
        == "phrases.score:1: includes words.score: upload that score too"
    )
    bring(uploads, "words.score", words.encode())
    found = asyncio.run(uploads.read(first.id, Choices()))
    assert found.error == ""
    assert found.facts is not None
    assert [one.name for one in found.facts.clips] == ["two"]
    wrong = bring(uploads, "wrong.score", b"include words.score\nclip three\n  start | leap\n")
    assert wrong.error.startswith("wrong.score:3: ")
    itself = bring(uploads, "itself.score", b"include itself.score\n" + TITLED.encode())
    assert "includes itself" in itself.error


@pytest.mark.parametrize(
    "name", ["../../up.bvh", "/etc/cron.d/up.bvh", "a\x00b.bvh", "x" * 5000 + ".bvh", "\x1b[31m.bvh"]
)
def test_names_are_no_paths(uploads: Uploads, name: str) -> None:
    found = bring(uploads, name, b"HIERARCHY")
    assert [path.name for path in uploads.folder(found.id).iterdir() if path.suffix == ".bvh"] == ["upload.bvh"]
    assert "\x1b" not in found.name + found.error
    assert "\x00" not in found.name + found.error
    assert len(found.error) <= 400


@pytest.mark.parametrize(
    "name", ["virus.exe", "dance.fbx", "markers.c3d", "text", "scene.gltf", "aist.pkl", "a.usdz", "a.bvh.gz"]
)
def test_other_files_are_refused(uploads: Uploads, name: str) -> None:
    with pytest.raises(MotionMindError, match=name):
        bring(uploads, name, b"anything")
    assert uploads.list() == ()


def test_a_file_that_is_too_large_leaves_nothing(uploads: Uploads, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MAX_UPLOAD_BYTES", 2**20)
    with pytest.raises(MotionMindError, match="larger than 1 MB"):
        bring(uploads, "large.bvh", bytes(2**20 + 1))
    assert uploads.list() == ()
    assert [path.name for path in uploads._room.folder.iterdir()] == ["lock"]


def test_a_file_that_takes_too_long_is_given_up(uploads: Uploads, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "TIME_LIMIT_S", 0.01)
    monkeypatch.setattr(module, "_START_S", 0.0)
    found = bring(uploads, "bends.score", TITLED.encode())
    assert "took longer" in found.error


# --- corpora ----------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_learns_a_corpus_of_what_was_brought(uploads: Uploads, tmp_path: Path) -> None:
    home = tmp_path / "home"
    found = bring(uploads, "turn.bvh", bvh(tmp_path, recording()))
    assert found.facts is not None
    lesson = Lesson("mine", "Turns", (Part(found.id),), (Mixed("ballet", 0.5),), rate=1.0)
    check_lesson(lesson, home)
    seen: list[Any] = []
    result = learn(
        lambda *told: seen.append(told), lesson, [Recording(uploads.folder(found.id), found.facts, 0, 0)], home
    )
    assert result["name"] == "mine"
    assert result["clips"] > 1
    assert [done for done, _, _ in seen] == sorted(done for done, _, _ in seen)
    entry = next(one for one in list_all(home) if one["name"] == "mine")
    assert (entry["title"], entry["own"], entry["clips"]) == ("Turns", True, result["clips"])
    with pytest.raises(MotionMindError, match="already"):
        check_lesson(lesson, home)


@pytest.mark.parametrize(
    ("lesson", "words"),
    [
        (Lesson("ballet", parts=(Part("a"),)), "bundled"),
        (Lesson("../up", parts=(Part("a"),)), "cannot be a corpus's name"),
        (Lesson("new"), "nothing to learn from"),
        (Lesson("new", mix=(Mixed("/etc"),)), "no corpus /etc"),
    ],
)
def test_what_cannot_be_learned(lesson: Lesson, words: str, tmp_path: Path) -> None:
    with pytest.raises(MotionMindError, match=words):
        check_lesson(lesson, tmp_path)
