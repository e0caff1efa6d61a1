"""Specifications of discretizations: by name, and as plain values for manifests."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import cast

from motionmind import plugins
from motionmind.arguments import check_mapping, check_path
from motionmind.discretize.codebook import Codebook
from motionmind.discretize.expert import ExpertLibrary
from motionmind.discretize.grids import EulerGrid, QuaternionGrid
from motionmind.discretize.library import library_from_mapping, read_library
from motionmind.discretize.protocol import Discretization
from motionmind.errors import FormatError, MotionMindError, did_you_mean

_GROUP: plugins.Group = "motionmind.discretizations"

KINDS = ("codebook", "quaternion", "euler")

# Keys of a specification besides "kind".
_KEYS_OF_KIND = {
    "codebook": ("tolerance", "per_joint"),
    "quaternion": ("step", "per_joint"),
    "euler": ("degrees", "order", "per_joint"),
    "library": ("library", "tolerance", "per_joint"),
}


def make_discretization(
    kind: str, tolerance: float = 15.0, per_joint: Mapping[str, float] | None = None
) -> Discretization:
    """Make a discretization by name.

    For every kind but a library, no orientation of the corpus is further than the tolerance from its state. Grids get
    the widest step for which this holds; for quaternions that is sin(tolerance / 2), as a small rotation changes a
    coefficient by about half its angle. In a library, an orientation further off than the tolerance has no name.

    Args:
        kind: codebook, quaternion, euler, or else the name or .toml file of a library, or a kind that an installed
            package adds (an entry point in `motionmind.discretizations`).
        tolerance: degrees.
        per_joint: degrees for single joints.

    Raises:
        MotionMindError: a tolerance is out of range.
        FormatError: there is no such kind or library.

    >>> from motionmind.discretize import make_discretization
    >>> make_discretization("codebook", tolerance=10.0, per_joint={"left_hip": 5.0}).tolerance
    10.0
    """
    check_path("kind", kind)
    check_mapping("per_joint", per_joint, or_none=True)
    kind, per_joint = os.fspath(kind), dict(per_joint or {})
    if kind == "codebook":
        return Codebook(tolerance, per_joint)
    # Check in degrees: a grid's own message would be about a step that the caller did not write.
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
        if kind in plugins.added(_GROUP):
            return _make_added(kind, {"tolerance": tolerance, "per_joint": per_joint})
        hint = (
            did_you_mean(kind, [*KINDS, *plugins.added(_GROUP)])
            or f"; the kinds without a library are {', '.join(KINDS)}"
        )
        raise FormatError(f"{error}{hint}") from None


def to_spec(discretization: Discretization) -> dict[str, object]:
    """Return a discretization as plain JSON values, which a manifest keeps."""
    return discretization.to_spec()


def from_spec(spec: str | Mapping[str, object]) -> Discretization:
    """Make the discretization of a specification; the inverse of `to_spec`.

    Args:
        spec: a mapping or its JSON text: `{"kind": "codebook", "tolerance": 15, "per_joint": {"left_hip": 10}}`. Kinds
            are codebook, quaternion, euler and library; a library may be given whole or by name.

    Raises:
        FormatError: it is not a specification, or a value is out of range.
    """
    if isinstance(spec, str):
        try:
            spec = json.loads(spec)
        except (ValueError, RecursionError) as error:
            raise FormatError(f"discretization: not JSON: {error}") from None
    if not isinstance(spec, Mapping):
        raise FormatError(f"discretization: must be an object with a kind, not {spec!r:.60}")
    kind = spec.get("kind")
    if isinstance(kind, str) and kind not in _KEYS_OF_KIND and kind in plugins.added(_GROUP):
        return _make_added(kind, {str(key): value for key, value in spec.items() if key != "kind"})
    if not isinstance(kind, str) or kind not in _KEYS_OF_KIND:
        raise FormatError(f"discretization: the kind must be one of {', '.join(_KEYS_OF_KIND)}, not {kind!r:.60}")
    options = {str(key): value for key, value in spec.items() if key != "kind"}
    for key in options:
        if key not in _KEYS_OF_KIND[kind]:
            raise FormatError(f"discretization: {kind} has no key {key!r:.60}, only {', '.join(_KEYS_OF_KIND[kind])}")
    if not isinstance(options.get("per_joint", {}), Mapping):
        raise FormatError("discretization: per_joint must be an object of joints and numbers")
    try:
        return _make(kind, options)
    except FormatError:
        raise
    except MotionMindError as error:
        raise FormatError(f"discretization: {error}") from None


def _make_added(kind: str, options: Mapping[str, object]) -> Discretization:
    """Make a discretization of a kind that an installed package adds."""
    make = plugins.load(_GROUP, kind)
    if not callable(make):
        raise plugins.unfit(_GROUP, kind, "a class or function that makes a Discretization")
    try:
        made = make(**options)
    except MotionMindError:
        raise
    except Exception as error:
        raise FormatError(f"discretization: {plugins.failure(_GROUP, kind, error)}") from error
    if not isinstance(made, Discretization) or made.kind != kind:
        raise plugins.unfit(_GROUP, kind, "a function that makes a Discretization of that kind")
    return made


def _make(kind: str, options: dict[str, object]) -> Discretization:
    # The classes check their arguments; the casts only satisfy the type checker.
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
