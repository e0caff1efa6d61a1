"""Files taken by workers: the same corpus whoever takes them, and what was done is not done again."""

from __future__ import annotations

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from command_line import Run
from faults import failing_at

from motionmind import write_motion
from motionmind.body.human import human23
from motionmind.body.motion import Motion
from motionmind.corpus import shards
from motionmind.corpus.corpus import Corpus
from motionmind.corpus.fingerprint import fingerprint
from motionmind.corpus.gather import gather
from motionmind.corpus.recordings import Taking
from motionmind.corpus.shards import Reading, Taken, shards_of, take_files
from motionmind.errors import CorpusError, MotionMindError, MotionMindWarning
from motionmind.executors.cluster import cluster
from motionmind.executors.here import this_process
from motionmind.executors.opening import open_team
from motionmind.executors.team import Team, UnfinishedError
from motionmind.geometry import rotations as rot

TAKING = Taking(mirror=True)


def dance(name: str, number: int, frames: int = 61) -> Motion:
    """Movement that differs with its number; now and then a joint flips."""
    t = np.arange(frames) / 30.0
    angles = 0.4 * np.sin(t[:, None] * (1.0 + np.arange(23) / 23.0) + number)
    angles[20:30, 5] += np.radians(150.0) * (number % 2)
    q = rot.from_axis_angle([0.6, 0.0, 0.8], angles)
    return Motion(human23(), q, np.stack([t, 1.0 + 0.0 * t, 0.0 * t], axis=1), t, name)


@pytest.fixture
def files(tmp_path: Path) -> dict[Path, str]:
    """Recordings in two formats, and a score."""
    found = {tmp_path / f"{name}.{'json' if name == 'c' else 'bvh'}": name for name in "abcde"}
    for number, (file, name) in enumerate(found.items()):
        write_motion(file, dance(name, number))
    return found


@dataclass
class Client:
    """Those who take files, and what they were told."""

    home: Path
    team: Team
    needed: float = 0.0

    def __post_init__(self) -> None:
        self.taken: list[Taken] = []

    def need(self, size: float) -> None:
        self.needed = size

    def gather(self, files: dict[Path, str], reading: Reading | None = None) -> Corpus:
        with shards_of("mine", self.home) as folder:
            reading = reading or Reading(TAKING)
            taken = take_files(
                files, reading, folder, self.team, on_need=self.need, on_taken=self.taken.append, on_odd=print
            )
            return gather("mine", taken, mirror=reading.taking.mirror)


def assert_same(one: Corpus, other: Corpus) -> None:
    assert one.clips == other.clips
    assert one.faults == other.faults
    assert one.skeleton == other.skeleton
    assert (one.rate, one.skip) == (other.rate, other.skip)
    for name in ("rotations", "root", "times", "detail"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


def test_the_same_corpus_whoever_takes_the_files(files: dict[Path, str], tmp_path: Path) -> None:
    from motionmind.formats import read_motion

    plain = gather("mine", (replace(read_motion(file), name=name) for file, name in files.items()), mirror=True)
    assert plain.faults
    assert_same(Client(tmp_path / "1", this_process()).gather(files), plain)
    assert_same(Client(tmp_path / "2", Team(partial(ThreadPoolExecutor, 7), lambda: 9)).gather(files), plain)


def test_the_same_corpus_on_a_cluster(files: dict[Path, str], tmp_path: Path) -> None:
    """Its workers' threads, too, take one file at a time each."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        2, threads_per_worker=2, dashboard_address=":0", processes=False, protocol="tcp"
    ) as local:
        with cluster(local.scheduler_address) as team:
            on_cluster = Client(tmp_path / "1", team).gather(files)
        assert_same(on_cluster, Client(tmp_path / "2", this_process()).gather(files))


def test_a_cluster_builds_the_same_files(run: Run, files: dict[Path, str], tmp_path: Path) -> None:
    """By the command itself; those that it reads, and all that is learned."""
    distributed = pytest.importorskip("distributed")
    homes = [tmp_path / "cluster", tmp_path / "here"]
    with distributed.LocalCluster(
        2, threads_per_worker=1, dashboard_address=":0", processes=False, protocol="tcp"
    ) as c:
        for home, ways in zip(homes, (["--scheduler", c.scheduler_address], []), strict=True):
            done = run("corpus", "build", "mine", *files, *ways, "--home", home)
            assert done.code == 0, done
    assert files_in(homes[0]) == files_in(homes[1])


def files_in(home: Path) -> dict[Path, bytes]:
    return {file.relative_to(home): file.read_bytes() for file in home.rglob("*") if file.is_file()}


def test_shards_are_gone_when_the_corpus_is_there(files: dict[Path, str], tmp_path: Path) -> None:
    client = Client(tmp_path, this_process())
    client.gather(files)
    assert not (tmp_path / "shards").exists()
    assert client.needed > sum(taken.size for taken in client.taken) > 0


def test_what_was_taken_is_not_taken_again(
    files: dict[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And what had changed since, is; as is what was damaged."""
    calls: list[str] = []
    take = shards.take

    def counted(motion: Motion, taking: Taking) -> shards.Recording:
        calls.append(motion.name)
        return take(motion, taking)

    monkeypatch.setattr(shards, "take", failing_at(4, counted, KeyboardInterrupt()))
    with pytest.raises(KeyboardInterrupt):
        Client(tmp_path, this_process()).gather(files)
    assert len(calls) == 3
    kept = sorted((tmp_path / "shards" / "mine").rglob("*.npz"))
    assert len(kept) == 3
    kept[0].write_bytes(kept[0].read_bytes()[:999])
    write_motion(tmp_path / "b.bvh", dance("b", 17))
    monkeypatch.setattr(shards, "take", counted)
    again = Client(tmp_path, this_process()).gather(files)
    assert len(calls) in (3 + 3, 3 + 4)  # the two that were left, the one that changed; the damaged may be that one
    assert_same(again, Client(tmp_path / "fresh", this_process()).gather(files))


def test_a_shard_depends_on_all_that_was_read(tmp_path: Path) -> None:
    """Such as a score that is included, of which its name says nothing."""
    score = "title  A\nbody   human23\ninclude two.score\nlegs\n  up = stand out 10 turn 8\nclip a: A\n"
    (tmp_path / "one.score").write_text(score + "  start | up\n  1     | low\n")
    second = "title  B\nbody   human23\nlegs\n  low = stand out 10 turn 8, bend {}\n"
    found = []
    with open_team() as team:
        for bend in (30, 30, 60):
            (tmp_path / "two.score").write_text(second.format(bend))
            job = shards.Job(tmp_path / "one.score", "", Reading(Taking()), tmp_path, fingerprint([]))
            (taken,) = team.map(shards.take_file, [job])
            assert taken.key, taken.fault
            opened = shards._open(job, taken.key)
            assert opened
            found.append(opened[0][0].pieces[0].rotations)
    assert np.array_equal(found[0], found[1])
    assert not np.array_equal(found[0], found[2])


def test_other_options_are_other_shards(files: dict[Path, str], tmp_path: Path) -> None:
    file = next(iter(files))
    readings = [Reading(Taking()), Reading(TAKING), Reading(Taking(skip=1)), Reading(Taking(), unit="cm")]
    jobs = [shards.Job(file, "a", one, tmp_path, "") for one in readings]
    assert len({shards._key(job) for job in jobs}) == len(jobs)


def test_warnings_are_given_again_from_a_shard(tmp_path: Path) -> None:
    write_motion(tmp_path / "still.bvh", dance("still", 0).slice(0, 1))
    job = shards.Job(tmp_path / "still.bvh", "still", Reading(Taking()), tmp_path, fingerprint([]))
    for _ in range(2):
        with pytest.warns(MotionMindWarning, match="holds one posture"):
            list(shards._recordings(job, shards.take_file(job)))


# --- faults -----------------------------------------------------------------------------------------------------------


def test_files_that_cannot_be_read_are_reported(run: Run, files: dict[Path, str], tmp_path: Path) -> None:
    """By whoever reads them: workers, or this process, which builds the same files."""
    bad = tmp_path / "bad.bvh"
    bad.write_text("junk")
    homes = {workers: tmp_path / f"by-{workers}" for workers in (1, 2)}
    for workers, home in homes.items():
        ran = run("corpus", "build", "mine", *files, bad, "--mirror", "--workers", workers, "--home", home)
        assert ran.code == 0
        assert f"note: {bad}:1: not a BVH file: it must begin with HIERARCHY; left out\n" in ran.err
        assert "note: left out 1 file of 6\n" in ran.err
    assert files_in(homes[1]) == files_in(homes[2])
    ran = run("corpus", "build", "mine", bad, *files, "--strict-files")
    assert ran.code == 2
    assert ran.err == f"error: {bad}:1: not a BVH file: it must begin with HIERARCHY\n"
    ran = run("corpus", "build", "mine", bad)
    assert ran.code == 2
    assert "error: " in ran.err


def test_files_on_other_joints_than_most_are_reported(run: Run, files: dict[Path, str], tmp_path: Path) -> None:
    odd = tmp_path / "odd.bvh"
    motion = dance("odd", 1)
    names = tuple(f"part{number}" for number in range(23))
    write_motion(odd, replace(motion, skeleton=replace(motion.skeleton, name="odd", names=names)))
    ran = run("corpus", "build", "mine", odd, *files)
    assert ran.code == 0
    assert f"note: {odd}: is on another skeleton than {next(iter(files))}: odd lacks " in ran.err
    assert "may bring it there); left out\nnote: left out 1 file of 6\n" in ran.err
    assert run("corpus", "info", "mine", "--json").json["joints"][0] == "pelvis"
    ran = run("corpus", "build", "mine", odd, *files, "--strict-files", "--replace")
    assert (ran.code, f"error: {odd}: is on another skeleton than " in ran.err) == (2, True)


def test_a_full_disk_is_told_and_what_was_done_is_kept(
    files: dict[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = shards.replace_file
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    monkeypatch.setattr(shards, "replace_file", failing_at(3, write, full))
    with pytest.raises(UnfinishedError, match="No space left on device; what is done is kept"):
        Client(tmp_path, this_process()).gather(files)
    assert len(list((tmp_path / "shards").rglob("*.npz"))) == 2


def test_a_disk_that_is_too_small_is_told_before_all_files_are_read(
    files: dict[Path, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shards.shutil, "disk_usage", lambda _: shutil._ntuple_diskusage(10, 9, 1))
    client = Client(tmp_path, this_process())
    with pytest.raises(CorpusError, match=r"the corpus needs about .* GB of disk, and 0\.0 GB are free"):
        client.gather(files)
    assert len(client.taken) == 2  # one of each format


def test_shards_that_another_build_removes_are_made_again(files: dict[Path, str], tmp_path: Path) -> None:
    client = Client(tmp_path, this_process())
    with shards_of("mine", tmp_path) as folder:
        taken = take_files(
            files, Reading(TAKING), folder, client.team, on_need=client.need, on_taken=print, on_odd=print
        )
        first = next(taken)
        shutil.rmtree(folder)
        one = gather("mine", [first, *taken], mirror=True)
    assert_same(one, Client(tmp_path / "fresh", this_process()).gather(files))


def test_a_build_leaves_the_shards_of_another_that_runs(files: dict[Path, str], tmp_path: Path) -> None:
    with shards_of("mine", tmp_path) as folder:
        Client(tmp_path, this_process()).gather(files)
        assert len(list(folder.rglob("*.npz"))) == len(files)
    assert not folder.exists()


def test_a_worker_of_another_version_is_told(files: dict[Path, str], tmp_path: Path) -> None:
    job = shards.Job(next(iter(files)), "a", Reading(TAKING), tmp_path, "another")
    with pytest.raises(MotionMindError, match="another version of MotionMind"):
        shards.take_file(job)


def test_a_build_that_was_killed_goes_on(files: dict[Path, str], tmp_path: Path, run: Run) -> None:
    """Its workers', here; the corpus is that of a build that nobody disturbed."""
    build = ["corpus", "build", "mine", *map(str, files)]
    homes = [tmp_path / "killed", tmp_path / "calm"]
    command = [sys.executable, "-m", "motionmind", *build, "--workers", "2", "--home", str(homes[0])]
    killed = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60.0
    while not list(homes[0].rglob("*.npz")) and killed.poll() is None and time.monotonic() < deadline:
        time.sleep(0.01)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert list(homes[0].rglob("*.npz"))
    assert not list(homes[0].rglob("manifest.json"))
    for home in homes:
        assert run(*build, "--workers", 1, "--home", home).code == 0
    assert files_in(homes[0]) == files_in(homes[1])
