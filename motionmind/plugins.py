"""Find formats, discretizations and flows that installed packages add, by their entry points.

Built-in names take precedence, and a package is imported only when used: installed packages change neither the start
time nor the built-in names. See docs/how-to/plugins.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from motionmind.display import displayed
from motionmind.errors import MotionMindError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

Group = Literal["motionmind.formats", "motionmind.discretizations", "motionmind.flows"]


def added(group: Group) -> list[str]:
    """Return the names that installed packages add to a group, sorted, without importing the packages."""
    return sorted({found.name for found in _entries(group)})


def load(group: Group, name: str) -> Any | None:
    """Load the object that an installed package adds under a name; None if there is none.

    Raises:
        MotionMindError: several packages add it, or the package cannot be imported; the message names them.
    """
    found = [one for one in _entries(group) if one.name == name]
    if not found:
        return None
    packages = sorted({_package(one) for one in found})
    if len(packages) > 1:
        raise MotionMindError(
            f"several packages add {displayed(name)} to {group}: {', '.join(packages)}; uninstall all but one"
        )
    try:
        return found[0].load()
    except Exception as error:
        raise MotionMindError(f"{origin(group, name)} cannot be imported: {_worded(error)}") from error


def origin(group: Group, name: str) -> str:
    """Return a name, its group and its package in words."""
    packages = sorted({_package(found) for found in _entries(group) if found.name == name})
    return f"{displayed(name)} in {group}, by the package {', '.join(packages)},"


def failure(group: Group, name: str, error: Exception) -> str:
    """Return the message for an added object that fails, in one line."""
    return f"{origin(group, name)} fails: {_worded(error)}"


def unfit(group: Group, name: str, wanted: str) -> MotionMindError:
    """Return the error for an added object of the wrong kind."""
    return MotionMindError(f"{origin(group, name)} must be {wanted}")


def _entries(group: Group) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, of all installed packages."""
    from importlib.metadata import entry_points  # slow to import

    return tuple(entry_points(group=group))


def _package(found: EntryPoint) -> str:
    return displayed(found.dist.name if found.dist is not None else found.module)


def _worded(error: Exception) -> str:
    """Return the type and the message of an error, in one line."""
    return displayed(f"{type(error).__name__}: {' '.join(str(error).split())}", 300)
