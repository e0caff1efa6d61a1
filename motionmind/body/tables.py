"""Movement as tables of pandas and xarray, which are imported on first use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.errors import MotionMindError
from motionmind.geometry import rotations as rot

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

AXES, COEFFICIENTS = ("x", "y", "z"), ("qx", "qy", "qz", "qw")


def turned_degrees(rotations: Floats) -> Floats:
    """Return the angles by which joints are turned from rest [...], 0 to 180 degrees, from rotations [..., 4]."""
    return np.degrees(rot.angle(rotations, rot.IDENTITY))


def data_frame(
    joints: Sequence[str], times: Floats, positions: Floats, rotations: Floats, about: Mapping[str, str]
) -> pd.DataFrame:
    """Return a table with a row a frame; see `Motion.to_dataframe`.

    Args:
        joints: the joints' names [J].
        times: seconds [T].
        positions: of the joints [T, J, 3], metres.
        rotations: unit quaternions x, y, z, w [T, J, 4], local.
        about: the table's attributes.

    Raises:
        MotionMindError: pandas is not installed.
    """
    pandas = _library("pandas", "to_dataframe")
    values = np.concatenate([positions, rotations, turned_degrees(rotations)[..., None]], axis=-1)
    columns = pandas.MultiIndex.from_product([joints, [*AXES, *COEFFICIENTS, "degrees"]], names=["joint", "value"])
    table: pd.DataFrame = pandas.DataFrame(
        values.reshape(len(times), -1), index=pandas.Index(times, name="seconds"), columns=columns
    )
    table.attrs.update(about)
    return table


def data_set(
    joints: Sequence[str],
    times: Floats,
    positions: Floats,
    rotations: Floats,
    inserted: Bools,
    about: Mapping[str, str],
) -> xr.Dataset:
    """Return arrays with named dimensions; see `Motion.to_xarray`. Arguments as of `data_frame`.

    Args:
        joints: the joints' names [J].
        times: seconds [T].
        positions: of the joints [T, J, 3], metres.
        rotations: unit quaternions x, y, z, w [T, J, 4], local.
        inserted: whether the engine made each frame [T].
        about: the arrays' attributes.

    Raises:
        MotionMindError: xarray is not installed.
    """
    xarray = _library("xarray", "to_xarray")
    frame, degrees = ("time", "joint"), turned_degrees(rotations)
    found: xr.Dataset = xarray.Dataset(
        {
            "position": ((*frame, "axis"), positions, {"units": "m"}),
            "rotation": ((*frame, "coefficient"), rotations, {"units": "1", "about": "local to the parent's frame"}),
            "turned": (frame, degrees, {"units": "degrees", "about": "angle from rest"}),
            "inserted": ("time", inserted, {"about": "made by the engine"}),
        },
        coords={
            "time": ("time", times, {"units": "s"}),
            "joint": list(joints),
            "axis": list(AXES),
            "coefficient": list(COEFFICIENTS),
        },
        attrs=dict(about),
    )
    return found


def _library(name: str, method: str) -> Any:
    """Import an optional library; MotionMindError says how to install it."""
    try:
        return import_module(name)
    except ImportError as error:
        raise MotionMindError(f"{method} needs {name}: pip install {name} ({error})") from error
