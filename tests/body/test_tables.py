"""Movement as tables of other libraries: the same numbers, by name."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest

from motionmind.body.human import human23
from motionmind.body.motion import Insertion, Motion
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

ARM = Skeleton("arm", ("shoulder", "elbow"), (-1, 0), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]]))


@pytest.fixture(params=[ARM, human23()], ids=lambda skeleton: skeleton.name)
def motion(request: pytest.FixtureRequest) -> Motion:
    rng, joints = np.random.default_rng(7), len(request.param)
    rotations, times = rot.normalise(rng.normal(size=(6, joints, 4))), np.cumsum(rng.uniform(0.1, 0.5, 6))
    return Motion(request.param, rotations, rng.normal(size=(6, 3)), times, "waving", (Insertion(times[[1, 3, 4]]),))


def test_positions_are_those_of_the_skeleton(motion: Motion) -> None:
    expected = motion.skeleton.positions(motion.rotations, motion.root)
    np.testing.assert_array_equal(motion.positions(), expected)
    np.testing.assert_allclose(motion.positions()[:, 0], motion.root)


def test_a_table_has_each_joint_s_place_rotation_and_angle_by_name(motion: Motion) -> None:
    pytest.importorskip("pandas", reason="pandas is not installed")
    table = motion.to_dataframe()
    assert table.index.name == "seconds"
    np.testing.assert_array_equal(table.index, motion.times)
    assert table.attrs == {"name": "waving", "skeleton": motion.skeleton.name}
    for joint, name in enumerate(motion.skeleton.names):
        np.testing.assert_array_equal(table[name][["x", "y", "z"]], motion.positions()[:, joint])
        np.testing.assert_array_equal(table[name][["qx", "qy", "qz", "qw"]], motion.rotations[:, joint])
        half = np.clip(np.abs(motion.rotations[:, joint, 3]), 0.0, 1.0)
        np.testing.assert_allclose(table[name, "degrees"], np.degrees(2.0 * np.arccos(half)), atol=1e-5)
    assert table.xs("degrees", axis=1, level="value").shape == (6, len(motion.skeleton))


def test_a_data_set_has_the_same_by_dimensions_with_units(motion: Motion) -> None:
    pytest.importorskip("xarray", reason="xarray is not installed")
    found, joint = motion.to_xarray(), motion.skeleton.names[-1]
    assert found.sizes == {"time": 6, "joint": len(motion.skeleton), "axis": 3, "coefficient": 4}
    np.testing.assert_array_equal(found["time"], motion.times)
    np.testing.assert_array_equal(found["position"].sel(joint=joint, axis="y"), motion.positions()[:, -1, 1])
    np.testing.assert_array_equal(found["rotation"].sel(joint=joint, coefficient="qw"), motion.rotations[:, -1, 3])
    np.testing.assert_allclose(found["turned"].sel(joint=joint), motion.to_dataframe()[joint, "degrees"])
    assert found["inserted"].values.tolist() == [False, False, True, True, False, False]
    assert {name: found[name].attrs.get("units") for name in ("position", "turned", "time")} == {
        "position": "m",
        "turned": "degrees",
        "time": "s",
    }
    assert found.attrs == {"name": "waving", "skeleton": motion.skeleton.name}


@pytest.mark.parametrize(("library", "method"), [("pandas", "to_dataframe"), ("xarray", "to_xarray")])
def test_without_the_library_one_line_says_how_to_get_it(
    library: str, method: str, motion: Motion, monkeypatch: pytest.MonkeyPatch
) -> None:
    if find_spec(library) is not None:
        monkeypatch.setitem(sys.modules, library, None)  # as Python itself marks what cannot be imported
    with pytest.raises(MotionMindError, match=rf"^{method} needs {library}: pip install {library} ") as error:
        getattr(motion, method)()
    assert "\n" not in str(error.value)


def test_movement_imports_neither() -> None:
    code = "import sys; from motionmind import Motion; print({'pandas', 'xarray'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "set()\n"
