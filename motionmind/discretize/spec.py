"""Discretizations by name, and as plain values that a manifest keeps."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import cast

from motionmind.discretize.codebook import Codebook
from motionmind.discretize.expert import ExpertLibrary
from motionmind.discretize.grids import EulerGrid, QuaternionGrid
from motionmind.discretize.library import library_from_mapping, read_library
from motionmind.discretize.protocol import Discretization
from motionmind.errors import FormatError, MotionMindError, did_you_mean

KINDS = ("codebook", "quaternion", "euler")

# What a specification of each kind may say besides its kind.
_KEYS = {
    "codebook": ("tolerance", "per_joint"),
    "quaternion": ("step", "per_joint"),
    "euler": ("degrees", "order", "per_joint"),
    "library": ("library", "tolerance", "per_joint"),
}


def make(kind: str, tolerance: float = 15.0, per_joint: Mapping[str, float] | None = None) -> Discretization:
    """The discretization that `kind` names: codebook, quaternion, euler, or else a library by name or .toml file.

    `tolerance` and `per_joint` are degrees and mean the same for every kind but the last: no orientation of the
    corpus lies further than that from its state. The grids get the widest step that keeps this promise, for
    quaternions sin(tolerance / 2), since a small rotation moves a coefficient by about half its angle. For a library
    it is how far off an orientation counts as one that the library has no name for.
    """
    per_joint = dict(per_joint or {})
    if kind == "codebook":
        return Codebook(tolerance, per_joint)
    # Checked here, in degrees: a grid would complain about a step that nobody wrote.
    checked = Codebook(tolerance, per_joint)
    if kind == "quaternion":
        step = QuaternionGrid.step_for
        return QuaternionGrid(step(checked.tolerance), {name: step(value) for name, value in per_joint.items()})
    if kind == "euler":
        width = EulerGrid.degrees_for
        return EulerGrid(width(checked.tolerance), per_joint={name: width(value) for name, value in per_joint.items()})
    try:
        return ExpertLibrary.read(kind, tolerance, per_joint)
    except FormatError as error:
        if kind.endswith(".toml"):
            raise
        hint = did_you_mean(kind, KINDS) or f"; the kinds without a library are {', '.join(KINDS)}"
        raise FormatError(f"{error}{hint}") from None


def to_spec(discretization: Discretization) -> dict[str, object]:
    """What a manifest keeps of a discretization: plain JSON values."""
    return discretization.to_spec()


def from_spec(spec: str | Mapping[str, object]) -> Discretization:
    """The discretization that `to_spec` described, from the mapping or its JSON text.

    `{"kind": "codebook", "tolerance": 15, "per_joint": {"left_hip": 10}}`; kinds are codebook, quaternion, euler
    and library, and a library may be given whole or by name. FormatError where it says anything else.
    """
    if isinstance(spec, str):
        try:
            spec = json.loads(spec)
        except (ValueError, RecursionError) as error:
            raise FormatError(f"discretization: not JSON: {error}") from None
    if not isinstance(spec, Mapping):
        raise FormatError(f"discretization: must be an object with a kind, not {spec!r:.60}")
    kind = spec.get("kind")
    if not isinstance(kind, str) or kind not in _KEYS:
        raise FormatError(f"discretization: the kind must be one of {', '.join(_KEYS)}, not {kind!r:.60}")
    options = {str(key): value for key, value in spec.items() if key != "kind"}
    for key in options:
        if key not in _KEYS[kind]:
            raise FormatError(f"discretization: {kind} has {', '.join(_KEYS[kind])}, no {key!r:.60}")
    if not isinstance(options.get("per_joint", {}), Mapping):
        raise FormatError("discretization: per_joint must be an object of joints and numbers")
    try:
        return _make(kind, options)
    except FormatError:
        raise
    except MotionMindError as error:
        raise FormatError(f"discretization: {error}") from None


def _make(kind: str, options: dict[str, object]) -> Discretization:
    # The classes check what they are given; the casts only say what it ought to be.
    per_joint = cast("Mapping[str, float]", options.get("per_joint", {}))
    if kind == "codebook":
        return Codebook(cast("float", options.get("tolerance", Codebook.tolerance)), per_joint)
    if kind == "quaternion":
        return QuaternionGrid(cast("float", options.get("step", QuaternionGrid.step)), per_joint)
    if kind == "euler":
        order = cast("str", options.get("order", EulerGrid.order))
        return EulerGrid(cast("float", options.get("degrees", EulerGrid.degrees)), order, per_joint)
    library = options.get("library")
    if isinstance(library, str):
        found = read_library(library)
    elif isinstance(library, Mapping):
        found = library_from_mapping(library)
    else:
        raise FormatError("discretization: library must be a name, a file or the library itself")
    return ExpertLibrary(found, cast("float", options.get("tolerance", ExpertLibrary.tolerance)), per_joint)
