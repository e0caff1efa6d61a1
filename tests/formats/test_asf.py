"""ASF/AMC, checked against 4 x 4 matrices that are built from the files' words without our code."""

from __future__ import annotations

import contextlib
import random
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from motionmind.body.motion import Motion
from motionmind.errors import FormatError, MotionMindError, MotionMindWarning
from motionmind.formats import read_motion
from motionmind.formats.asf_amc import read_amc
from motionmind.geometry import rotations as rot

Mutate = Callable[[str, random.Random], bytes]

ASF = """# by hand
:version 1.10
:name TOY
:units
  mass 1.0
  length 2.54
  angle deg
:documentation
  begin and end are words of a sentence here
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 10 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name back
    direction 0 2 0
    length 50
    axis 0 0 20 XYZ
    dof rx ry rz
    limits (-160.0 20.0)
           (-70.0 70.0)
           (-60.0 70.0)
  end
  begin
    id 2
    name head
    direction 0 1 0
    length 30
    axis 10 -20 30 ZYX
    dof rz rx
  end
  begin
    id 3
    name tail
    direction 0 0 -1
    length 20
    axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root back tail
    back head
  end
"""

AMC = """#!OML
:FULLY-SPECIFIED
:DEGREES
1
root 1 90 3 10 20 30
back 15 25 35
head 40 50
2
root 2 91 4 11 21 31
back 16 26 36
head 41 51
"""


def pair(folder: Path, asf: str = ASF, amc: str = AMC) -> Path:
    (folder / "toy.asf").write_text(asf)
    path = folder / "toy_01.amc"
    path.write_text(amc)
    return path


def fails(path: Path) -> str:
    with pytest.raises(FormatError) as caught:
        read_amc(path)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(str(path.parent))


# --- an oracle of our own making -----------------------------------------------------------------------------------


def blocks(text: str) -> dict[str, dict[str, list[str]]]:
    """The bones of a plain ASF: name -> keyword -> words."""
    bones = {}
    for block in text[text.index(":bonedata") : text.index(":hierarchy")].split("begin")[1:]:
        rows = {line.split()[0]: line.split()[1:] for line in block.splitlines() if line.split()}
        bones[rows["name"][0]] = rows
    return bones


def euler(order: str, angles: list[str], *, scale: float = 1.0) -> np.ndarray:
    """4 x 4 matrix of turns about fixed axes, the first first."""
    out = np.eye(4)
    for axis, angle in zip(order.lower(), angles, strict=True):
        step = np.eye(4)
        step[:3, :3] = Rotation.from_euler(axis, float(angle) * scale, degrees=True).as_matrix()
        out = step @ out
    return out


def oracle(asf: str, frame: dict[str, list[str]], metres: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Start and end of each bone in metres, the way the format's authors describe it: bone by bone."""
    bones = blocks(asf)
    links = [line.split() for line in asf[asf.index(":hierarchy") :].splitlines()[2:] if len(line.split()) > 1]
    parents = {child: row[0] for row in links for child in row[1:]}
    root = np.eye(4)
    root[:3, 3] = [float(value) for value in frame["root"][:3]]
    ends = {"root": root @ euler("xyz", frame["root"][3:])}
    found = {}
    while len(ends) <= len(bones):
        for name, bone in bones.items():
            if name in ends or parents[name] not in ends:
                continue
            axis = euler(bone["axis"][3], bone["axis"][:3])
            dof = [channel[1] for channel in bone.get("dof", [])]
            local = axis @ euler("".join(dof), frame.get(name, [])) @ np.linalg.inv(axis)
            direction = np.array([float(value) for value in bone["direction"]])
            along = np.eye(4)
            along[:3, 3] = direction / np.linalg.norm(direction) * float(bone["length"][0])
            start = ends[parents[name]]
            ends[name] = start @ local @ along
            found[name] = (start[:3, 3] * metres, ends[name][:3, 3] * metres)
    return found


def frames_of(text: str) -> list[dict[str, list[str]]]:
    frames: list[dict[str, list[str]]] = []
    for line in text.splitlines():
        words = line.split()
        if len(words) == 1 and words[0].isdigit():
            frames.append({})
        elif frames and words:
            frames[-1][words[0]] = words[1:]
    return frames


def check(motion: Motion, asf: str, amc: str, frames: list[int], metres: float) -> None:
    rows = frames_of(amc)
    assert len(motion) == len(rows)
    names = motion.skeleton.names
    places = motion.skeleton.positions_and_tips(motion.rotations, motion.root)
    for frame in frames:
        expected = oracle(asf, rows[frame], metres)
        assert set(expected) == set(names) - {"root"}
        for name, (start, end) in expected.items():
            joint = names.index(name)
            np.testing.assert_allclose(places[frame, joint], start, atol=1e-9)
            if joint not in motion.skeleton.parents:
                np.testing.assert_allclose(places[frame, len(names) + joint], end, atol=1e-9)
            for child in motion.skeleton.children(joint):
                np.testing.assert_allclose(places[frame, child], end, atol=1e-9)


# --- the shared recordings -----------------------------------------------------------------------------------------


@pytest.mark.long
def test_every_recording(shared_data: Path) -> None:
    files = sorted((shared_data / "cmu-135").glob("*.amc"))
    assert len(files) == 9
    asf = (shared_data / "cmu-135" / "135.asf").read_text()
    for path in files:
        motion = read_motion(path)
        assert (motion.name, motion.skeleton.name, len(motion.skeleton)) == (path.stem, "135", 31)
        assert motion.fps == pytest.approx(120.0)
        places = motion.skeleton.positions_and_tips(motion.rotations[::8], motion.root[::8])
        lowest, highest = places[..., 1].min(axis=1), places[..., 1].max(axis=1)
        assert -0.06 < lowest.min() < 0.03  # one foot or the other is on the floor,
        assert np.median(lowest) < 0.05  # nearly always
        assert 1.3 < np.median(highest) < 1.7
        if path.stem in ("135_04", "135_10"):
            check(motion, asf, path.read_text(), [0, len(motion) // 2, len(motion) - 1], 0.0254 / 0.45)
    assert 1.5 < motion.skeleton.height < 1.7


def roots_reversed(text: str) -> str:
    return text.replace("root 1 90 3 10 20 30", "root 10 20 30 3 90 1").replace(
        "root 2 91 4 11 21 31", "root 11 21 31 4 91 2"
    )


# --- a toy ---------------------------------------------------------------------------------------------------------


def test_a_toy_agrees_with_matrices(tmp_path: Path) -> None:
    motion = read_amc(pair(tmp_path))
    assert motion.skeleton.names == ("root", "back", "head", "tail")
    assert motion.skeleton.parents == (-1, 0, 1, 0)
    moved = AMC.replace("root 1 90", "root 1 100").replace("root 2 91", "root 2 101")  # the root's preset position
    check(motion, ASF, moved, [0, 1], 0.01)  # 2.54 units to the inch are centimetres
    np.testing.assert_allclose(motion.times, [0.0, 1 / 120])


@pytest.mark.parametrize(
    ("asf", "amc"),
    [
        (lambda text: text.replace("\n", "\r\n"), lambda text: text.replace("\n", "\r\n")),
        (lambda text: text.replace("  length 2.54", "  length 2.54 # centimetres"), lambda text: "\n" + text + "\n\n"),
        (lambda text: text.replace("TX TY TZ RX RY RZ", "RX RY RZ TZ TY TX"), roots_reversed),
        (lambda text: text.replace("(-160.0 20.0)", "-160, 20"), lambda text: text.replace(":DEGREES\n", "")),
        (lambda text: text.replace("angle deg", "").replace("mass 1.0", ""), lambda text: text),
    ],
)
def test_the_same_movement_in_other_dress(tmp_path: Path, asf: Callable[[str], str], amc: Callable[[str], str]) -> None:
    plain = read_amc(pair(tmp_path))
    dressed = read_amc(pair(tmp_path, asf(ASF), amc(AMC)))
    assert dressed.skeleton == plain.skeleton
    np.testing.assert_array_equal(dressed.rotations, plain.rotations)
    np.testing.assert_array_equal(dressed.root, plain.root)


def test_turns_follow_the_order_in_which_they_are_listed(tmp_path: Path) -> None:
    motion = read_amc(pair(tmp_path, ASF.replace("TZ RX RY RZ", "TZ RZ RX RY")))
    expected = Rotation.from_euler("zxy", [10, 20, 30], degrees=True).as_quat()  # small letters: fixed axes
    assert rot.angle(motion.rotations[0, 0], expected) < 1e-12


def test_a_preset_orientation_is_the_frame_of_the_roots_turns(tmp_path: Path) -> None:
    motion = read_amc(pair(tmp_path, ASF.replace("orientation 0 0 0", "orientation 0 0 90")))
    preset = Rotation.from_euler("z", 90, degrees=True)
    expected = preset * Rotation.from_euler("xyz", [10, 20, 30], degrees=True) * preset.inv()
    assert rot.angle(motion.rotations[0, 0], expected.as_quat()) < 1e-12


def test_radians(tmp_path: Path) -> None:
    def radians(words: str) -> str:
        return " ".join(repr(float(np.radians(float(word)))) for word in words.split())

    asf = ASF.replace("angle deg", "angle rad").replace("0 0 20 XYZ", f"{radians('0 0 20')} XYZ")
    asf = asf.replace("10 -20 30 ZYX", f"{radians('10 -20 30')} ZYX")
    plain = read_amc(pair(tmp_path))
    half = read_amc(pair(tmp_path, asf))  # the AMC says :DEGREES, whatever the ASF does
    assert rot.angle(plain.rotations, half.rotations).max() < 1e-12
    amc = AMC.replace(":DEGREES", ":RADIANS").replace("head 40 50", f"head {radians('40 50')}")
    assert rot.angle(plain.rotations[0, 2], read_amc(pair(tmp_path, asf, amc)).rotations[0, 2]) < 1e-12


def test_changes_of_a_bones_length_are_left_out_and_said(tmp_path: Path) -> None:
    asf = ASF.replace("dof rz rx", "dof tx rz l rx")
    plain = read_amc(pair(tmp_path))
    still = read_amc(pair(tmp_path, asf, AMC.replace("40 50", "0 40 0 50").replace("41 51", "0 41 0 51")))
    np.testing.assert_array_equal(still.rotations, plain.rotations)
    path = pair(tmp_path, asf, AMC.replace("40 50", "0 40 7 50").replace("41 51", "0 41 0 51"))
    with pytest.warns(MotionMindWarning, match="changes of the length or place of head are ignored"):
        longer = read_amc(path)
    np.testing.assert_array_equal(longer.rotations, plain.rotations)


def test_frames_that_are_left_out_leave_a_gap(tmp_path: Path) -> None:
    motion = read_amc(pair(tmp_path, amc=AMC.replace("\n2\n", "\n5\n")), fps=10.0)
    np.testing.assert_allclose(motion.times, [0.0, 0.4])
    np.testing.assert_allclose(read_motion(pair(tmp_path), fps=30.0).times, [0.0, 1 / 30])


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_is_none(tmp_path: Path, fps: float) -> None:
    with pytest.raises(MotionMindError, match="fps must be a positive number"):
        read_amc(pair(tmp_path), fps=fps)


# --- finding the skeleton ------------------------------------------------------------------------------------------


def test_the_asf_beside_the_amc(tmp_path: Path) -> None:
    path = pair(tmp_path)
    (tmp_path / "toy.asf").rename(tmp_path / "other.ASF")
    assert read_amc(path).skeleton.name == "other"  # the only one
    (tmp_path / "toy.asf").write_text(ASF)
    assert read_amc(path).skeleton.name == "toy"  # what stands before the "_"
    (tmp_path / "toy_01.asf").write_text(ASF)
    assert read_amc(path).skeleton.name == "toy_01"  # the same stem
    assert read_amc(path, tmp_path / "other.ASF").skeleton.name == "other"
    assert read_motion(path, asf=tmp_path / "other.ASF").skeleton.name == "other"


def test_no_asf_or_too_many(tmp_path: Path) -> None:
    path = pair(tmp_path)
    (tmp_path / "toy.asf").unlink()
    assert "its skeleton, an .asf file, was not found" in fails(path)
    (tmp_path / "a.asf").write_text(ASF)
    (tmp_path / "b.asf").write_text(ASF)
    assert "(there are a.asf, b.asf): give its path" in fails(path)
    with pytest.raises(FormatError, match=r"c\.asf: cannot be read: there is no such file"):
        read_amc(path, tmp_path / "c.asf")


# --- faults --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("length 2.54", "length 0", "toy.asf:6: the unit of length is 0"),
        ("length 50", "length fifty", "toy.asf:20: 'fifty' where a number"),
        ("direction 0 2 0", "direction 0 2", "toy.asf:19: 2 numbers where three"),
        ("0 0 20 XYZ", "0 0 20 XYY", "toy.asf:21: 'XYY' where an order of axes"),
        ("dof rx ry rz", "dof rx rq rz", "toy.asf:22: 'RQ' is not a channel"),
        ("dof rx ry rz", "dof rx rx rz", "toy.asf:22: the channel RX twice"),
        ("order TX TY TZ RX RY RZ", "", "toy.asf:12: the root has no order"),
        ("name head", "name back", "toy.asf:27: a second bone 'back'"),
        ("name head", "", "toy.asf:27: a bone without a name"),
        ("ZYX\n    dof rz rx\n  end", "ZYX", "toy.asf:27: bone 'head' has no end"),
        ("length 20\n    axis 0 0 0 XYZ\n  end", "", "toy.asf:35: bone 'tail' has no end"),
        ("back head", "back haed", "toy.asf:45: there is no bone 'haed'; did you mean head?"),
        ("back head", "back tail", "toy.asf:45: bone 'tail' hangs from two others"),
        ("    back head\n", "", "toy.asf:27: the hierarchy does not reach head"),
        ("root back tail", "head back\n root tail", "the hierarchy does not reach back, head"),
        (ASF[ASF.index(":hierarchy") :], "", "there is no section :hierarchy"),
        (ASF, "", "there is no section :root"),
    ],
)
def test_faults_of_an_asf(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in ASF
    assert message in fails(pair(tmp_path, ASF.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("back 15 25 35", "back 15 25", "toy_01.amc:6: 2 values for back, which has 3 (rx ry rz)"),
        ("back 15 25 35", "back 15 nan 35", "toy_01.amc:6: 'nan' where a number"),
        ("back 15 25 35", "bakc 15 25 35", "toy_01.amc:6: there is no bone 'bakc'"),
        ("back 15 25 35", "tail 15 25 35", "toy_01.amc:6: bone 'tail' has values here, but no dof"),
        ("head 40 50", "back 15 25 35", "toy_01.amc:7: a second line for back in the same frame"),
        ("head 40 50\n", "", "toy_01.amc:7: frame 1 ends without head"),
        ("head 41 51\n", "", "frame 2 ends without head: is the file cut short?"),
        ("head 41 51", "head 41", "toy_01.amc:11: 1 values for head"),
        ("\n2\n", "\n1\n", "toy_01.amc:8: frame 1 after frame 1"),
        ("\n2\n", "\ntwo\n", "toy_01.amc:8: 'two' where a bone's values or a frame's number"),
        ("\n1\n", "\n", "toy_01.amc:4: values before the number of their frame"),
        (AMC, "", "no frames"),
    ],
)
def test_faults_of_an_amc(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in AMC
    assert message in fails(pair(tmp_path, amc=AMC.replace(old, new, 1)))


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_only_our_errors_escape(tmp_path_factory: pytest.TempPathFactory, mutate: Mutate, seed: int) -> None:
    folder = tmp_path_factory.getbasetemp() / "mutated"
    folder.mkdir(exist_ok=True)
    rng = random.Random(seed)
    path = pair(folder)
    for _ in range(4):
        asf = rng.random() < 0.5
        (folder / "toy.asf").write_bytes(mutate(ASF, rng) if asf else ASF.encode())
        path.write_bytes(AMC.encode() if asf else mutate(AMC, rng))
        with warnings.catch_warnings(), contextlib.suppress(MotionMindError):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", MotionMindWarning)
            assert len(read_amc(path)) >= 1
