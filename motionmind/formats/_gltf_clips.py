"""The clips in a glTF file: which animations move the body, and how they move its nodes.

Animations are alternatives, so each is a clip. Some exporters, however, split one movement into an animation for each
node or property.

Section numbers refer to "glTF 2.0 Specification", version 2.0.1, The Khronos Group (2021).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from motionmind.clip_names import distinct_names, find_name
from motionmind.errors import enumerated, quoted, suggestion
from motionmind.formats._gltf import Animation, Gltf, Sampler
from motionmind.formats._gltf_poses import PATH_TYPES, Track, Tracks
from motionmind.geometry import rotations as rot

_MAX_SHOWN = 20  # names in a message
_SAME_SPAN_S = 1e-3  # between the ends of parts of one movement


@dataclass(frozen=True)
class Clips:
    """The clips of a body.

    Attributes:
        names: a name for each animation of the file (`distinct_names`).
        moving: indices of the animations that move the body.
        chosen: indices of those to read: the named one, or `usual`.
        usual: indices of those to read if none is named: the first with more than one key, or the parts of a movement
            that an exporter split.
        apart: indices of animations of other bodies, if neither a skin nor a list of bones tells which is read.
        turned: nodes that any of `moving` rotates.
    """

    names: tuple[str, ...]
    moving: tuple[int, ...]
    chosen: tuple[int, ...]
    usual: tuple[int, ...]
    apart: tuple[int, ...]
    turned: frozenset[int]

    @property
    def are_several(self) -> bool:
        """Whether there are clips to choose from."""
        return len(self.moving) > 1 and len(self.usual) == 1


def find_clips(gltf: Gltf, parents: list[int], body: set[int], wanted: str | None = None) -> Clips:
    """Find the clips that move a body, without reading their curves.

    Args:
        gltf: the file.
        parents: of its nodes, -1 for none.
        body: nodes of the body; if empty, the body is the tree of nodes that the chosen animation moves.
        wanted: name of the animation to choose, or its number from 1; None for the usual one.

    Raises:
        FormatError: there is no such animation, or it does not move the body.
    """
    animations = gltf.document.animations
    names = distinct_names([one.name for one in animations])
    moved = [_moved(one) for one in animations]
    named = None if wanted is None else _find(gltf, names, wanted)
    still = frozenset(number for number, one in enumerate(animations) if _is_pose(gltf, one))
    has_body = bool(body)
    if not has_body:
        order = sorted((number for number, nodes in enumerate(moved) if nodes), key=lambda number: number in still)
        first = named if named is not None else next(iter(order), None)
        body = set() if first is None else _tree(parents, moved[first])
    moving = tuple(number for number, nodes in enumerate(moved) if not nodes.isdisjoint(body))
    played = [number for number in moving if number not in still]
    if named is not None and named not in moving:
        known = enumerated((names[number] for number in moving), _MAX_SHOWN) or "none"
        raise gltf.fault(f"clip {quoted(names[named])} does not move the body; clips that do: {known}")
    # A named clip does without the clocks of the others.
    is_split = named is None and _is_split(gltf, [animations[one] for one in played])
    usual = tuple(played) if is_split else (*played, *moving)[:1]
    chosen = usual if named is None else (named,)
    apart = () if has_body else tuple(one for one, nodes in enumerate(moved) if nodes and nodes.isdisjoint(body))
    turned = frozenset(
        node for number in moving for node in _moved(animations[number], "rotation") & body if 0 <= node < len(parents)
    )
    return Clips(names, moving, chosen, usual, apart, turned)


def _find(gltf: Gltf, names: tuple[str, ...], wanted: str) -> int:
    """Return the index of the animation with a name or a number; FormatError if there is none."""
    found = find_name(names, wanted)
    if found is None:
        raise gltf.fault(f"no clip {quoted(wanted)}{suggestion(wanted, names, most=_MAX_SHOWN)}")
    return found


def _moved(animation: Animation, *paths: str) -> set[int]:
    """Return the nodes that an animation moves, by any of some properties or, without these, by all."""
    wanted = paths or PATH_TYPES
    nodes = {one.target.node for one in animation.channels if one.target.path in wanted}
    return {node for node in nodes if node is not None}


def _tree(parents: list[int], nodes: Iterable[int]) -> set[int]:
    """Return all nodes of the trees of some nodes; nodes that do not exist stay, for `tracks_of` to find."""
    roots = list(range(len(parents)))
    known = [parent < 0 for parent in parents]
    for node in range(len(parents)):
        path = [node]
        while not known[path[-1]]:
            path.append(parents[path[-1]])
        for one in path:
            roots[one], known[one] = roots[path[-1]], True
    wanted = {roots[node] for node in nodes if 0 <= node < len(parents)}
    return {node for node, root in enumerate(roots) if root in wanted} | {
        node for node in nodes if node >= len(parents)
    }


def _is_pose(gltf: Gltf, animation: Animation) -> bool:
    """Return whether an animation has only one key."""
    rows = gltf.document.accessors
    return all(not 0 <= one.input < len(rows) or rows[one.input].count <= 1 for one in animation.samplers)


def _is_split(gltf: Gltf, animations: list[Animation]) -> bool:
    """Return whether animations are parts of one movement: each moves one node, for the same time as the others."""
    targets = [(one.target.node, one.target.path) for animation in animations for one in animation.channels]
    if (
        len(animations) < 2
        or len({*targets}) < len(targets)
        or not all(len({one.target.node for one in animation.channels}) == 1 for animation in animations)
    ):
        return False
    spans = np.array([_span(gltf, animation) for animation in animations])
    return bool(np.all(np.ptp(spans, axis=0) <= _SAME_SPAN_S))


def _span(gltf: Gltf, animation: Animation) -> tuple[float, float]:
    """Return the times of the first and the last key of an animation, seconds."""
    name = f"animation {quoted(animation.name)}"
    times = [gltf.numbers(one.input, "SCALAR", name) for one in animation.samplers]
    return min(float(one.min()) for one in times), max(float(one.max()) for one in times)


def tracks_of(gltf: Gltf, animation: Animation) -> Tracks:
    """Return the tracks of an animation."""
    found: Tracks = {}
    read: dict[tuple[int, int, str, str], Track] = {}  # nodes may share a sampler, and samplers their numbers
    name = quoted(animation.name) if animation.name else "without a name"
    for number, channel in enumerate(animation.channels):
        node, path = channel.target.node, channel.target.path
        if node is None or path not in PATH_TYPES:
            continue
        what = f"animation {name}, channel {number}"
        gltf.member(gltf.document.nodes, node, f"{what}: node")
        sampler = gltf.member(animation.samplers, channel.sampler, f"{what}: sampler")
        key = sampler.input, sampler.output, sampler.interpolation, path
        if key not in read:
            read[key] = _track(gltf, sampler, path, what)
        found[node, path] = read[key]
    return found


def _track(gltf: Gltf, sampler: Sampler, path: str, what: str) -> Track:
    """Return the keys of a sampler for a path."""
    times = gltf.numbers(sampler.input, "SCALAR", what)[:, 0]
    values = gltf.numbers(sampler.output, PATH_TYPES[path], what)
    if sampler.interpolation not in ("LINEAR", "STEP", "CUBICSPLINE"):
        raise gltf.fault(f"{what}: interpolation {quoted(sampler.interpolation)} is unknown")
    if np.any(np.diff(times) <= 0.0):
        raise gltf.fault(f"{what}: its times do not increase")
    curve = sampler.interpolation == "CUBICSPLINE"
    if len(values) != len(times) * (3 if curve else 1):
        raise gltf.fault(f"{what}: {len(values)} values for {len(times)} times")
    values = values.reshape(len(times), 3, -1) if curve else values
    if path == "rotation":
        keys = values[:, 1] if curve else values
        if not np.all(rot.norm(keys) > 1e-5):
            raise gltf.fault(f"{what}: a rotation is zero")
        values = values if curve else rot.normalise(values)
    return Track(times, values, sampler.interpolation)
