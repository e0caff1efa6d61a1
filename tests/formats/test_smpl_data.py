"""AIST++'s pickles and FineDance's arrays: what they hold is read, and nothing that they name is run."""

from __future__ import annotations

import codecs
import os
import pickle
import pickletools
import struct
import tracemalloc
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


@pytest.mark.parametrize("dump", [pickle.dumps, pickle._dumps])
@pytest.mark.parametrize("protocol", range(6))
def test_arrays_and_types_may_be_shared(dump: Callable[[object, int], bytes], protocol: int) -> None:
    poses, trans = vectors(24), np.asfortranarray(TRANS).astype(">f4")
    held = {"a": poses, "again": poses, "turned": poses.T, "b": trans, "c": trans + 1, "d": np.float32(1.5), "e": ["a"]}
    found = unpickle(dump(held, protocol))
    assert isinstance(found, dict)
    assert found["e"] == ["a"]
    for name in "a", "again", "turned", "b", "c", "d":
        np.testing.assert_array_equal(to_array(found[name]), held[name])


def nested(make: Callable[[list[Any]], Any], times: int = 6) -> Any:
    """A value that holds one below it ten times, and so on: a million numbers in a few bytes."""
    value: Any = 1.0
    for _ in range(times):
        value = make([value] * 10)
    return value


TEXT, FREQUENT = "a" * 100_000, 500  # a value, and how often a file mentions it, in two bytes each
REPEATED = b"X" + struct.pack("<I", len(TEXT)) + TEXT.encode() + b"q\x00"
LONG_NUMBER = b"L0x" + b"f" * len(TEXT) + b"\nq\x00"
SCALAR = np.float32(1.0).__reduce__()[0]
AMPLIFIED = {
    "lists": pickle.dumps(aist(smpl_poses=nested(list)), 2),
    "tuples": pickle.dumps(aist(smpl_poses=nested(tuple)), 2),
    "dicts": pickle.dumps(aist(smpl_poses=nested(lambda rows: dict(zip("abcdefghij", rows, strict=True)))), 2),
    "itself": b"]q\x00h\x00a.",
    "key": pickle.dumps({nested(tuple): 1}, 2),
    "key, not shared": pickle.dumps({(1, 2): 1}, 2),
    "key, protocol 0": b"(dI1\nI2\ns.",
    "type": pickle.dumps(aist(smpl_poses=Runs(SCALAR, Runs(np.dtype, nested(list)), b"")), 2),
    "arrays": pickle.dumps(aist(smpl_poses=[np.zeros(10_000)] * FREQUENT), 2),
    "texts": pickle.dumps(aist(smpl_poses=[TEXT] * FREQUENT), 2),
    "encoded texts": pickle.dumps(aist(smpl_poses=[Runs(codecs.encode, TEXT, "latin1") for _ in range(FREQUENT)]), 2),
    "arguments": b"\x80\x02" + REPEATED + b"c_codecs\nencode\nq\x01" + b"h\x01h\x00R" * FREQUENT + b".",
    "shape": (
        b"(S'smpl_trans'\nI1\nS'smpl_poses'\ncnumpy.core.numeric\n_frombuffer\n(S''\ncnumpy\ndtype\n(S'f8'\ntR("
        + (LONG_NUMBER + b"h\x00" * FREQUENT)
        + b"tS'C'\ntRd."
    ),
}


@pytest.mark.parametrize("name", AMPLIFIED)
def test_a_value_in_many_places_takes_no_memory(name: str, tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(AMPLIFIED[name])
    tracemalloc.start()
    try:
        with pytest.raises(FormatError, match=r"a\.pkl: ") as error:
            read_motion(path)
        assert tracemalloc.get_traced_memory()[1] < 10 * len(AMPLIFIED[name]) + 10**6
    finally:
        tracemalloc.stop()
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300 + len(str(path))


@pytest.mark.parametrize("name", ["lists", "tuples", "dicts", "itself", *(name for name in AMPLIFIED if "key" in name)])
def test_values_are_trees_with_names(name: str) -> None:
    """Counting, printing or comparing such a value takes no longer than reading the pickle."""
    with pytest.raises(pickle.UnpicklingError, match=r"it holds one list in several places|its keys are not strings"):
        unpickle(AMPLIFIED[name])


@pytest.mark.parametrize("value", [3, 2.5, True, None, "text", np.array(1.0), np.float32(1.0), Runs(np.dtype, "f8")])
def test_arrays_without_rows(value: Any, tmp_path: Path) -> None:
    path = tmp_path / "a.pkl"
    for name in "smpl_poses", "smpl_trans":
        path.write_bytes(pickle.dumps(aist(**{name: value}), 2))
        with pytest.raises(FormatError, match=f"'{name}'"):
            read_motion(path)


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
    with pytest.raises(FormatError, match="the array holds no numbers"):
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


def test_smpl_bodies_have_the_joints_that_files_have() -> None:
    assert [len(body) for body in smpl_bodies().values()] == [22, 24, 52, 55]
