"""Formats, discretizations and flows that other packages add, found by the entry points of installed packages.

A package is asked only for what MotionMind itself does not have, and imported only when it is used, so that neither the
time to start nor what is built in depends on what is installed. See docs/how-to/plugins.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from motionmind.display import displayed
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Group = Literal["motionmind.formats", "motionmind.discretizations", "motionmind.flows"]


def added(group: Group) -> list[str]:
    """Return the names that installed packages add to a group, sorted; none of the packages is imported."""
    return sorted({found.name for found in _entries(group)})


def load(group: Group, name: str) -> Any | None:
    """Return what an installed package adds under a name; None if none does.

    Raises:
        MotionMindError: several packages add it, or the one that does cannot be imported; the message names them.
    """
    found = [one for one in _entries(group) if one.name == name]
    if not found:
        return None
    packages = sorted({_package(one) for one in found})
    if len(packages) > 1:
        raise MotionMindError(
            f"{displayed(name)} is added to {group} by several packages, {', '.join(packages)}: uninstall all but one"
        )
    try:
        return found[0].load()
    except Exception as error:
        raise MotionMindError(f"{origin(group, name)} cannot be imported: {_worded(error)}") from error


def origin(group: Group, name: str) -> str:
    """Return what adds a name, in words: the name, its group and the package."""
    packages = sorted({_package(found) for found in _entries(group) if found.name == name})
    return f"{displayed(name)} in {group}, by the package {', '.join(packages)},"


def failure(group: Group, name: str, error: Exception) -> str:
    """Say in a line that something added fails."""
    return f"{origin(group, name)} fails: {_worded(error)}"


def unfit(group: Group, name: str, wanted: str) -> MotionMindError:
    """Return the error that says that something added is not what it should be."""
    return MotionMindError(f"{origin(group, name)} must be {wanted}")


def _entries(group: Group) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, of all installed packages."""
    from importlib.metadata import entry_points  # slow to import

    return tuple(entry_points(group=group))


def _package(found: EntryPoint) -> str:
    return displayed(found.dist.name if found.dist is not None else found.module)


def _worded(error: Exception) -> str:
    """Return an error's type and its message, in a line."""
    return displayed(f"{type(error).__name__}: {' '.join(str(error).split())}", 300)
