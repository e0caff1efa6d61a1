"""numpy's arrays, by themselves and in archives: those of numbers are read as numpy reads them, others are refused."""

from __future__ import annotations

import io
import random
import struct
import tracemalloc
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from motionmind.body.rates import MAX_POSITIONS
from motionmind.errors import FormatError
from motionmind.formats import read_motion
from motionmind.formats._npy import read_array

PATH = Path("a.npy")


def written(array: NDArray[Any], version: tuple[int, int] = (1, 0)) -> bytes:
    out = io.BytesIO()
    np.lib.format.write_array(out, array, version)
    return out.getvalue()


def headed(header: str | bytes, data: bytes = b"", version: int = 1, length: int | None = None) -> bytes:
    """A file with any header."""
    text = header.encode("latin-1") if isinstance(header, str) else header
    size = struct.pack("<H" if version == 1 else "<I", len(text) if length is None else length)
    return b"\x93NUMPY" + bytes([version, 0]) + size + text + data


def refusal(data: bytes, max_bytes: int = 10**6) -> str:
    with pytest.raises(FormatError) as caught:
        read_array(io.BytesIO(data), max_bytes, "it", PATH)
    message = str(caught.value)
    assert "\n" not in message
    assert "pickle" not in message
    assert len(message) < 200
    return message.removeprefix(f"{PATH}: it ")


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0)])
@pytest.mark.parametrize("dtype", ["f2", "<f4", ">f8", "i1", ">i2", "u4", "<i8", "g"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (2, 3, 1, 2), (0, 3)])
def test_arrays_are_those_of_numpy(shape: tuple[int, ...], dtype: str, version: tuple[int, int]) -> None:
    array = np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(dtype)
    for one in (array, np.asfortranarray(array)):
        data = written(one, version)
        np.testing.assert_array_equal(read_array(io.BytesIO(data), 1000, "it", PATH), np.load(io.BytesIO(data)))


def test_headers_of_other_programs() -> None:
    data = np.arange(6.0).tobytes()
    for header in (
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2L, 3L), }\n",
        ' {"shape":(2,3),"fortran_order":False,"descr":"<f8"}',
    ):
        assert read_array(io.BytesIO(headed(header, data)), 1000, "it", PATH).tolist() == [[0, 1, 2], [3, 4, 5]]


ODD = [
    *("1", "-1", "0", "1.0", "True", "'3'", "None", "9" * 30, "9" * 5000, "(1,)", "[2]", "{}", "1e3", "1j", "a", "1L")
]
TYPES = [
    *("'<f8'", "'O'", "'<U9'", "'V9'", "'f8,f8'", "'(9,9)f8'", "[('a', '<f8')]", "8", "'f9'", "'x'", "''", "'a\\nb'")
]


@pytest.mark.parametrize("seed", range(300))
def test_odd_headers_are_refused_in_our_words(seed: int) -> None:
    rng = random.Random(seed)
    sizes = ", ".join(rng.choice(ODD) for _ in range(rng.choice([0, 1, 2, 3, 9, 90])))
    shape = rng.choice([f"({sizes},)", f"[{sizes}]", sizes, "()"])
    header = f"{{'descr': {rng.choice(TYPES)}, 'fortran_order': {rng.choice(ODD)}, 'shape': {shape}, }}"
    data = headed(rng.choice([header, header, header[: rng.randrange(len(header))]]), version=rng.choice([1, 2, 3, 4]))
    try:
        found = read_array(io.BytesIO(data + bytes(8 * rng.choice([0, 1, 3]))), 1000, "it", PATH)
    except FormatError:
        refusal(data)
    else:
        assert found.size <= 3


@given(st.binary(max_size=300))
def test_any_header(header: bytes) -> None:
    refusal(headed(header))


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "not a numpy array"),
        (written(np.arange(6.0))[:-1], "cut short, 47 of 48 bytes"),
        (headed(" " * 20_000), "its header has 20000 characters; that of an array of numbers has 10000 at most"),
        (headed("(" * 9000), "its header is not that of a numpy array"),
        (
            headed("{'descr': '<f8', 'fortran_order': False, 'shape': (-1, -1), }"),
            "its shape is not 8 whole numbers or fewer",
        ),
        (headed(f"{{'descr': '<f8', 'fortran_order': False, 'shape': (0, {2**62}), }}"), "is too large to be movement"),
        (headed("{'descr': '<f8', 'fortran_order': False, 'shape': (10000000, 3), }"), "is too large to be movement"),
        (
            headed("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1, 1, 1, 1, 1, 1, 1, 1), }"),
            "its shape is not",
        ),
        (headed("{'descr': '<f8', 'fortran_order': False, 'shape': (True, 1), }", bytes(8)), "its shape is not"),
        (headed("{'descr': '<q9', 'fortran_order': False, 'shape': (), }"), "numpy has no type '<q9'"),
    ],
)
def test_faults_are_named(data: bytes, said: str) -> None:
    assert said in refusal(data)


def zipped(path: Path, members: dict[str, bytes], kind: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", kind) as file:
        for name, data in members.items():
            file.writestr(name, data)
    return path


def peak_of_refusal(path: Path, said: str) -> int:
    tracemalloc.start()
    try:
        with pytest.raises(FormatError, match=said):
            read_motion(path)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.long
def test_archives_unpack_no_more_than_movement(tmp_path: Path) -> None:
    long_header = zipped(tmp_path / "header.npz", {"poses.npy": headed(bytes(10**8), version=2)})
    assert peak_of_refusal(long_header, "its header has 100000000 characters") < 10**7
    frames = 24 * MAX_POSITIONS // 600  # each less than is allowed, both more
    many = {f"{name}.npy": written(np.zeros((frames, 63), np.uint8)) for name in ("body_pose", "pose_body")}
    both = zipped(tmp_path / "many.npz", many)
    assert both.stat().st_size < 10**5
    assert peak_of_refusal(both, "is too large to be movement") < 4 * 24 * MAX_POSITIONS


def test_archives_of_other_compressions_are_refused(tmp_path: Path) -> None:
    for kind in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        path = zipped(tmp_path / "a.npz", {"poses.npy": written(np.zeros((3, 66)))}, kind)
        assert peak_of_refusal(path, "'poses' cannot be read: compressed otherwise than numpy does") < 10**6


@pytest.mark.parametrize("kind", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_checksums_are_compared(kind: int, tmp_path: Path) -> None:
    whole = written(np.zeros((3, 66)))
    path = zipped(tmp_path / "a.npz", {"poses.npy": whole}, kind)
    checksum = struct.pack("<I", zlib.crc32(whole))
    path.write_bytes(path.read_bytes().replace(checksum, bytes(4)))
    peak_of_refusal(path, "'poses' cannot be read: Bad CRC-32")
