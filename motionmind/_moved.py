"""Modules that moved in 0.2, for one version: importing an old name warns and gives the new module."""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from types import ModuleType

MOVED = {
    "engine": "tween.engine",
    "explain": "tween.narrative",
    "formats.files": "files",
    "formats.lost": "formats.lossy",
    "mapping": "retarget.joint_mapping",
    "metrics.feet": "body.contact",
    "mirror": "body.mirror",
    "motion": "body.motion",
    "notation.anatomy": "body.anatomy",
    "rotations": "geometry.rotations",
    "skeleton": "body.skeleton",
    "spline": "geometry.splines",
    "survey": "learned.summary",
}


class _Finder:
    """Find and load a module under the name that it had in 0.1.

    A finder and a loader by their methods alone: importing their base classes takes longer than all of this package.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        loader: Any = self
        package, _, old = fullname.partition(".")
        return ModuleSpec(fullname, loader) if package == "motionmind" and old in MOVED else None

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave the making of the module to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Put the module that runs under the new name in the place of this one."""
        import importlib
        import warnings

        new = f"motionmind.{MOVED[module.__name__.partition('.')[2]]}"
        warnings.warn(f"{module.__name__} is now {new}; the old name goes in 0.3", DeprecationWarning, stacklevel=2)
        sys.modules[module.__name__] = importlib.import_module(new)


def install() -> None:
    """Let old names be found; once however often it is called."""
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.append(_Finder())


def renamed(package: str, names: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the `__getattr__` of a package in which some names changed: an old one warns and gives the new."""

    def find(name: str) -> Any:
        if name not in names:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        import warnings

        message = f"{package}.{name} is now {names[name]}; the old name goes in 0.3"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(sys.modules[package], names[name])

    return find
