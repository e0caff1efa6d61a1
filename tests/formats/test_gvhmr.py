"""GVHMR's results, a file of PyTorch: tensors are read as PyTorch stores them, and nothing that they name is run."""

from __future__ import annotations

import io
import pickle
import re
import tracemalloc
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from motionmind.errors import FormatError
from motionmind.formats import read_motion
from motionmind.formats.smpl_data import read_gvhmr
from motionmind.geometry import rotations as rot
from motionmind.retarget.retarget import to_human23

FRAMES = 7
RNG = np.random.default_rng(5)
KINDS = {"<f4": "Float", "<f8": "Double", "<f2": "Half", "<i8": "Long", "|b1": "Bool"}


class Tensor:
    """A view of a storage: a tensor as PyTorch pickles it."""

    def __init__(self, data: NDArray[Any], **changes: Any) -> None:
        self.storage = np.ascontiguousarray(data).ravel()
        strides = tuple(step // data.itemsize for step in np.ascontiguousarray(data).strides)
        self.parts = {"offset": 0, "shape": data.shape, "strides": strides, "kind": KINDS[data.dtype.str]} | changes


class Pickler(pickle._Pickler):
    """Writes what `torch.save` does, by the instructions in its pickles."""

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, protocol=2)
        self.storages: list[bytes] = []

    def save(self, obj: Any, save_persistent_id: bool = True) -> None:
        if not isinstance(obj, Tensor):
            super().save(obj, save_persistent_id)  # type: ignore[misc]
            return
        parts = obj.parts
        self.write(b"ctorch._utils\n_rebuild_tensor_v2\n((")  # type: ignore[attr-defined]
        self.save("storage")
        self.write(f"ctorch\n{parts['kind']}Storage\n".encode())  # type: ignore[attr-defined]
        for one in (parts.get("key", str(len(self.storages))), "cpu", len(obj.storage)):
            self.save(one)
        self.write(b"tQ")  # type: ignore[attr-defined]
        for one in (parts["offset"], tuple(parts["shape"]), tuple(parts["strides"]), False):
            self.save(one)
        self.write(b"ccollections\nOrderedDict\n)RtR")  # type: ignore[attr-defined]
        self.storages.append(obj.storage.tobytes())


def saved(path: Path, held: object, *, compression: int = zipfile.ZIP_STORED, byteorder: bytes = b"little") -> Path:
    """Write a file as `torch.save` does."""
    file = io.BytesIO()
    pickler = Pickler(file)
    pickler.dump(held)
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("hmr4d_results/data.pkl", file.getvalue())
        archive.writestr("hmr4d_results/byteorder", byteorder)
        for key, data in enumerate(pickler.storages):
            archive.writestr(f"hmr4d_results/data/{key}", data)
        archive.writestr("hmr4d_results/version", b"3\n")
    return path


TURNS = 0.4 * RNG.normal(size=(FRAMES, 22, 3)).astype("f4")
TRANSL = RNG.normal(size=(FRAMES, 3)).astype("f4")


def results(**changes: Any) -> dict[str, Any]:
    """What GVHMR keeps."""
    params = {
        "body_pose": Tensor(TURNS[:, 1:].reshape(FRAMES, 63)),
        "betas": Tensor(np.zeros((FRAMES, 10), "f4")),
        "global_orient": Tensor(TURNS[:, 0]),
        "transl": Tensor(TRANSL),
    }
    params |= changes
    others = {"K_fullimg": Tensor(np.zeros((FRAMES, 3, 3), "f4")), "net_outputs": {"static": Tensor(np.ones(3, bool))}}
    return {"smpl_params_global": {name: one for name, one in params.items() if one is not None}} | others


def check(path: Path, atol: float = 1e-6) -> None:
    motion = read_motion(path)
    assert rot.angle(motion.rotations, rot.exp(TURNS.astype(float))).max() < atol
    np.testing.assert_allclose(motion.root, TRANSL + np.array([0.0, -0.35, 0.0]), atol=atol)
    assert (motion.name, motion.fps, len(motion.skeleton)) == (path.stem, pytest.approx(30.0), 22)


def test_results_are_read(tmp_path: Path) -> None:
    path = saved(tmp_path / "hmr4d_results.pt", results())
    check(path)
    assert read_motion(path, fps=25.0).fps == pytest.approx(25.0)
    assert to_human23(read_motion(path), up="y").skeleton.name == "human23"


@pytest.mark.parametrize("dtype", ["f2", "f4", "f8"])
def test_types_of_numbers(dtype: str, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.pt", results(transl=Tensor(TRANSL.astype(dtype))))
    check(path, 2e-3 if dtype == "f2" else 1e-6)


def test_views_of_a_storage(tmp_path: Path) -> None:
    padded = Tensor(np.concatenate([np.zeros(5, "f4"), TRANSL.T.ravel()]))  # by columns, after five other numbers
    padded.parts |= {"offset": 5, "shape": (FRAMES, 3), "strides": (1, FRAMES)}
    check(saved(tmp_path / "a.pt", results(transl=padded)))


class Runs:
    """What runs a command when it is unpickled."""

    def __reduce__(self) -> tuple[Any, ...]:
        return eval, ("1/0",)


NOT_GVHMR = "of PyTorch's files only GVHMR's results are read: load it there, and save its poses in AMASS's form"


@pytest.mark.parametrize(
    ("held", "message"),
    [
        ({"state_dict": {}}, f"{NOT_GVHMR} (.npz) (no 'smpl_params_global')"),
        ([1, 2], NOT_GVHMR),
        ({"smpl_params_global": 3}, NOT_GVHMR),
        ({"smpl_params_global": {}, "more": Runs()}, ".eval, and pickled code is never run"),
        (results(transl=None), "'transl' cannot be read: it is no tensor"),
        (results(transl="there"), "'transl' cannot be read: it is no tensor"),
        (results(transl=Tensor(np.zeros((FRAMES, 3), bool))), "'transl' cannot be read: it holds no numbers"),
        (results(transl=Tensor(TRANSL, offset=1)), "'transl' cannot be read: it reaches beyond its storage"),
        (results(transl=Tensor(TRANSL, strides=(4, 1))), "it reaches beyond its storage"),
        (results(transl=Tensor(TRANSL, strides=(-3, 1))), "its shape is invalid"),
        (results(transl=Tensor(TRANSL, offset=-1)), "its shape is invalid"),
        (results(transl=Tensor(TRANSL, shape=(FRAMES,))), "its shape is invalid"),
        (results(transl=Tensor(TRANSL, shape=(2**40, 3), strides=(0, 1))), "it is too large to be movement"),
        (results(transl=Tensor(TRANSL, shape=(1,) * 9, strides=(0,) * 9)), "it is too large to be movement"),
        (results(transl=Tensor(TRANSL, key="../0")), "'transl' cannot be read: "),
        (results(transl=Tensor(TRANSL, key=3)), "'transl' cannot be read: it has no storage"),
        (results(transl=Tensor(TRANSL[:-1])), f"'transl' has the shape [{FRAMES - 1}, 3], not [{FRAMES}, 3]"),
        (results(body_pose=Tensor(TURNS[:, 1:21].reshape(FRAMES, 60))), f"'body_pose' has the shape [{FRAMES}, 60]"),
        (results(transl=Tensor(np.full((FRAMES, 3), np.nan, "f4"))), "'transl'[0, 0] is nan"),
    ],
)
def test_what_is_no_movement(held: object, message: str, tmp_path: Path) -> None:
    path = saved(tmp_path / "a.pt", held)
    with pytest.raises(FormatError, match=re.escape(message)) as caught:
        read_motion(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_other_archives(tmp_path: Path) -> None:
    squeezed = saved(tmp_path / "a.pt", results(), compression=zipfile.ZIP_DEFLATED)
    with pytest.raises(FormatError, match="is compressed, which PyTorch never does"):
        read_motion(squeezed)
    with pytest.raises(FormatError, match="its numbers are not little-endian"):
        read_motion(saved(tmp_path / "a.pt", results(), byteorder=b"big"))
    (tmp_path / "a.pt").write_bytes(pickle.dumps([1]))
    with pytest.raises(FormatError, match=re.escape(NOT_GVHMR)):
        read_motion(tmp_path / "a.pt")


def test_damaged_files_are_refused_with_little_memory(tmp_path: Path) -> None:
    data = saved(tmp_path / "a.pt", results()).read_bytes()
    rng = np.random.default_rng(0)
    said = []
    tracemalloc.start()
    try:
        for _ in range(60):
            damaged = bytearray(data)
            for at in rng.integers(0, len(data), 4):
                damaged[at] = rng.integers(0, 256)
            (tmp_path / "b.pt").write_bytes(damaged[: rng.integers(len(data) // 2, len(data) + 1)])
            try:
                read_gvhmr(tmp_path / "b.pt")
            except FormatError as error:
                said.append(str(error))
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert said
    assert not [line for line in said if "\n" in line]
