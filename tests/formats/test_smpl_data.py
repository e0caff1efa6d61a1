"""AIST++'s pickles and FineDance's arrays: what they hold is read, and nothing that they name is run."""

from __future__ import annotations

import os
import pickle
import pickletools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from motionmind._typing import Floats
from motionmind.body.motion import Motion
from motionmind.errors import FormatError
from motionmind.formats import read_motion
from motionmind.formats._smpl import smpl_bodies
from motionmind.formats._unpickle import to_array, unpickle
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import to_human23

FRAMES = 6
RNG = np.random.default_rng(3)
TURNS = rot.normalise(RNG.normal(size=(FRAMES, 55, 4)))
TRANS = RNG.normal(size=(FRAMES, 3))


def vectors(joints: int) -> Floats:
    return rot.log(TURNS[:, :joints])


def rows(joints: int) -> Floats:
    """The first two rows of each rotation's matrix."""
    return rot.to_matrix(TURNS[:, :joints])[..., :2, :].reshape(FRAMES, -1)


def aist(**changes: Any) -> dict[str, Any]:
    held = {
        "smpl_loss": 1.6,
        "smpl_poses": vectors(24).reshape(FRAMES, 72),
        "smpl_scaling": np.array([93.8], np.float32),
        "smpl_trans": TRANS * np.float32(93.8),
    }
    return held | changes


def same_turns(found: Motion, joints: int, pelvis: float, rate: float) -> None:
    assert len(found.skeleton) == joints
    assert rot.angle(found.rotations, TURNS[:, :joints]).max() < 1e-6
    np.testing.assert_allclose(found.root, TRANS + np.array([0.0, pelvis, 0.0]), atol=1e-6)
    assert found.fps == pytest.approx(rate)
    assert to_human23(found).skeleton.name == "human23"


@pytest.mark.parametrize("protocol", range(6))
def test_aist_by_any_protocol(protocol: int, tmp_path: Path) -> None:
    path = tmp_path / "dance.pkl"
    path.write_bytes(pickle.dumps(aist(), protocol))
    same_turns(read_motion(path), 24, -0.24, 60.0)
    assert read_motion(path, fps=30.0).fps == pytest.approx(30.0)
    assert read_motion(path).name == "dance"


def old(array: Floats, names: Callable[[bytes], bytes]) -> bytes:
    """An array as numpy under Python 2 pickled it by protocol 0: its bytes as an escaped string."""
    raw = "".join(f"\\x{byte:02x}" for byte in array.astype("<f8").tobytes()).encode()
    shape = b"(" + b"".join(b"I%d\n" % size for size in array.shape) + b"t"
    return (
        b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n"
        + shape
        + b"cnumpy\ndtype\n(S'f8'\n"
        b"I0\nI1\ntR(I3\nS'<'\nNNNI-1\nI-1\nI0\ntbI00\nS'" + names(raw) + b"'\ntb"
    )


def test_aist_as_python_2_wrote_it(tmp_path: Path) -> None:
    held = {"smpl_poses": vectors(24).reshape(FRAMES, 72), "smpl_trans": TRANS * 93.8, "smpl_scaling": np.array([93.8])}
    items = b"".join(b"S'%s'\n%ss" % (name.encode(), old(array, bytes)) for name, array in held.items())
    path = tmp_path / "dance.pkl"
    path.write_bytes(b"(d" + items + b".")
    assert pickle.loads(path.read_bytes(), encoding="latin-1").keys() == held.keys()
    same_turns(read_motion(path), 24, -0.24, 60.0)


@pytest.mark.parametrize(
    "array",
    [
        np.arange(6.0).reshape(2, 3),
        np.asfortranarray(np.arange(6, dtype="<i2").reshape(2, 3)),
        np.arange(6, dtype=">f4"),
        np.array(2.5),
        np.float32(1.5),
        3,
        [[1, 2], [3, 4]],
    ],
    ids=str,
)
@pytest.mark.parametrize("protocol", [0, 2, 4, 5])
def test_arrays_are_those_of_pickle(array: Any, protocol: int) -> None:
    np.testing.assert_array_equal(to_array(unpickle(pickle.dumps(array, protocol))), array)


class Runs:
    """What a pickle that is meant to harm holds."""

    def __init__(self, function: Callable[..., object], *given: object) -> None:
        self.call = function, given

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return self.call


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize("function", [os.mkdir, eval, np.load, open, getattr])
def test_nothing_is_run(function: Callable[..., object], protocol: int, tmp_path: Path) -> None:
    path = tmp_path / "dance.pkl"
    path.write_bytes(pickle.dumps(aist(smpl_poses=Runs(function, str(tmp_path / "made"))), protocol))
    with pytest.raises(FormatError, match=r"it names [\w.]+, and pickled code is never run"):
        read_motion(path)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "data",
    [
        b"\x80\x02r\xff\xff\xff\xff.",  # keeps a value at a place far away
        b"\x80\x05\x96\xff\xff\xff\xff\xff\xff\x00\x00.",  # takes more bytes than there are
        b"\x80\x04\x8e\xff\xff\xff\xff\xff\xff\x00\x00.",
        b"\x80\x02" + b"]" * 30_000 + b".",
        b"\x80\x02cnumpy\nndarray\n(J\xff\xff\xff\x7ftR.",
        b"cnumpy\ndtype\n}b.",
        b"",
        b"not a pickle",
        pickle.dumps([1, 2]),
        pickle.dumps({"smpl_poses": 1}),
    ],
)
def test_other_bytes_are_refused(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(data)
    with pytest.raises(FormatError, match=r"a\.pkl: "):
        read_motion(path)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"smpl_poses": vectors(22).reshape(FRAMES, 66)}, r"'smpl_poses' has the shape \[6, 66\], not frames by 72"),
        ({"smpl_trans": TRANS[:3]}, r"'smpl_trans' has the shape \[3, 3\], not \[6, 3\]"),
        ({"smpl_scaling": np.zeros(1)}, "'smpl_scaling' must be one number above 0"),
        ({"smpl_trans": TRANS * np.nan}, r"'smpl_trans'\[0, 0\] is nan"),
        ({"smpl_trans": np.array(["a"] * 6)}, "'smpl_trans': 'U1' is not a type of numbers"),
        ({"smpl_trans": None}, "'smpl_trans': it holds no numbers"),
    ],
)
def test_what_is_wrong_is_named(change: dict[str, Any], said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps(aist(**change)))
    with pytest.raises(FormatError, match=said):
        read_motion(path)


def test_a_shape_beyond_its_bytes_takes_no_memory(tmp_path: Path) -> None:
    data = pickle.dumps(aist(smpl_trans=TRANS.astype("<f8")), 2)
    at = next(place for code, value, place in pickletools.genops(data) if code.name == "BININT1" and value == 6)
    path = tmp_path / "a.pkl"
    path.write_bytes(data[:at] + b"J\xff\xff\xff\x7f" + data[at + 2 :])
    with pytest.raises(FormatError, match="do not fill the shape"):
        read_motion(path)


@pytest.mark.parametrize(
    ("columns", "joints"),
    [
        (lambda: [TRANS, rows(52)], 52),
        (lambda: [np.ones((FRAMES, 4)), TRANS, rows(52)], 52),
        (lambda: [TRANS, rows(22)], 22),
        (lambda: [TRANS, vectors(52).reshape(FRAMES, -1)], 52),
        (lambda: [TRANS, vectors(55).reshape(FRAMES, -1)], 55),
    ],
)
def test_finedance(columns: Callable[[], list[Floats]], joints: int, tmp_path: Path) -> None:
    np.save(tmp_path / "001.npy", np.concatenate(columns(), axis=1))
    same_turns(read_motion(tmp_path / "001.npy"), joints, -0.35, 30.0)


def test_arrays_that_are_no_dance(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    np.save(path, np.zeros((4, 100)))
    with pytest.raises(FormatError, match=r"an array of the shape \[4, 100\], not frames by one of 315, 319"):
        read_motion(path)
    np.save(path, np.zeros((4, 315)))
    with pytest.raises(FormatError, match="the rows of a rotation's matrix are zero or parallel"):
        read_motion(path)
    np.save(path, np.array([Runs(os.mkdir, str(tmp_path / "made"))], object), allow_pickle=True)
    with pytest.raises(FormatError, match="not a numpy array: Object arrays cannot be loaded"):
        read_motion(path)
    path.write_bytes(path.read_bytes()[:8])
    with pytest.raises(FormatError, match=r"a\.npy: "):
        read_motion(path)
    assert list(tmp_path.iterdir()) == [path]


def test_an_array_that_claims_too_much(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    np.save(path, np.zeros((4, 315)))
    path.write_bytes(path.read_bytes().replace(b"(4, 315)", b"(9999999999, 315)").replace(b" " * 9 + b"\n", b"\n"))
    with pytest.raises(FormatError, match=r"a\.npy: "):
        read_motion(path)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("a.c3d", "C3D holds markers on the skin, not joints"),
        ("a.fbx", r"FBX is not read: open it in Blender \(File, Import, FBX\) and export glTF"),
    ],
)
def test_formats_that_are_refused_with_the_reason(name: str, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(FormatError, match=said):
        read_motion(tmp_path / name)


def test_smpl_bodies_have_the_joints_that_files_have() -> None:
    assert [len(body) for body in smpl_bodies().values()] == [22, 24, 52, 55]
