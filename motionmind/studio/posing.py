"""Routes of the pose editor: open a posture, drag it, turn a joint, bring it closer to the corpus, store it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
import numpy as np
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from motionmind.body.mirror import find_sides
from motionmind.body.motion import Posture
from motionmind.errors import MotionMindError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.studio.api import body_of, error, json
from motionmind.studio.asks import Frame, Key
from motionmind.studio.balance import balance_of
from motionmind.studio.handles import handles_of, mirror, turned, turns_of, words_of
from motionmind.studio.known import Memory
from motionmind.studio.reach import drag, put_on_floor, standing_feet
from motionmind.studio.score_lines import score_lines

if TYPE_CHECKING:
    from motionmind.studio.studio import Studio

Name = Annotated[str, msgspec.Meta(max_length=200)]
Metres = Annotated[float, msgspec.Meta(ge=-1e4, le=1e4)]
Coefficient = Annotated[float, msgspec.Meta(ge=-2.0, le=2.0)]


class Pose(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A posture as the page sends it.

    Attributes:
        key: key of a movement of the same body.
        rotations: x, y, z, w of each joint in turn, local to the parent [4 J].
        root: position of the root, metres.
    """

    key: Key
    rotations: Annotated[tuple[Coefficient, ...], msgspec.Meta(max_length=40_000)]
    root: tuple[Metres, Metres, Metres]


class Opening(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for a frame of a movement."""

    key: Key
    frame: Frame = 0


class Dragging(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to drag a joint to a position.

    Attributes:
        pose: the posture.
        start: the posture when the drag began.
        joint: the joint or heel to drag.
        place: target position, metres.
        standing: the last joints of the feet that stay.
    """

    pose: Pose
    start: Pose
    joint: Name
    place: tuple[Metres, Metres, Metres]
    standing: Annotated[tuple[Name, ...], msgspec.Meta(max_length=100)]


class Turning(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to set an angle of a joint."""

    pose: Pose
    joint: Name
    angle: Name
    degrees: Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]


class Telling(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request for what the editor shows of a posture."""

    pose: Pose


class Changing(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to change a posture.

    Attributes:
        pose: the posture.
        to: "mirror" exchanges left and right, "floor" puts it on the floor, "known" turns each joint to an orientation
            in the corpus, "whole" takes the corpus's nearest posture.
        kept: the joint or heel that keeps its place, if possible.
    """

    pose: Pose
    to: Literal["mirror", "floor", "known", "whole"]
    kept: Name | None = None


class Keeping(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to store a posture in the project, or to write it as lines of a score."""

    pose: Pose
    name: Annotated[str, msgspec.Meta(min_length=1, max_length=80)]


class Poser:
    """Answers to the editor's requests."""

    def __init__(self, studio: Studio) -> None:
        self._studio = studio
        self._memories: dict[str, tuple[object, Memory]] = {}

    def opened(self, asked: Opening) -> dict[str, Any]:
        """Return a frame of a movement, with what the editor shows of its body."""
        motion = self._studio.movements.get(asked.key)
        if asked.frame >= len(motion):
            raise MotionMindError(f"{asked.key} has no frame {asked.frame}: its frames are 0 to {len(motion) - 1}")
        posture = motion.posture(asked.frame)
        skeleton = posture.skeleton
        try:
            find_sides(skeleton)
            mirrors = True
        except SkeletonError:
            mirrors = False
        return self.told(posture) | {
            "key": asked.key,
            "title": self._studio.movements.title(asked.key),
            "joints": [{"joint": name, "words": words_of(name)} for name in skeleton.names],
            "handles": [handle._asdict() for handle in handles_of(skeleton)],
            "mirrors": mirrors,
        }

    def dragged(self, asked: Dragging) -> dict[str, Any]:
        """Return the posture after a drag."""
        posture, start = self.posture(asked.pose), self.posture(asked.start)
        found = drag(posture, asked.joint, np.array(asked.place), start=start, standing=asked.standing)
        return self.told(found, turns=False)

    def turned(self, asked: Turning) -> dict[str, Any]:
        """Return the posture with a joint turned."""
        return self.told(turned(self.posture(asked.pose), asked.joint, asked.angle, asked.degrees))

    def changed(self, asked: Changing) -> dict[str, Any]:
        """Return a changed posture."""
        posture = self.posture(asked.pose)
        if asked.to == "mirror":
            return self.told(mirror(posture))
        if asked.to == "floor":
            return self.told(put_on_floor(posture))
        memory = self._memory()
        if not memory.fits(posture):
            raise MotionMindError("this corpus has a different body: it does not know these joints")
        if asked.to == "known":
            return self.told(memory.bring_joints(posture, asked.kept))
        found, clip, seconds = memory.bring_whole(posture)
        return self.told(found) | {"words": f"as in {clip} at {int(seconds // 60)}:{seconds % 60:04.1f}"}

    def kept(self, asked: Keeping) -> dict[str, Any]:
        """Store the posture in the project, and return its key."""
        return {"key": self._studio.movements.keep(self.posture(asked.pose).as_motion(), asked.name)}

    def scored(self, asked: Keeping) -> dict[str, Any]:
        """Return the posture as lines of a score."""
        return {"lines": score_lines(self.posture(asked.pose), asked.name)}

    def told(self, posture: Posture, *, turns: bool = True) -> dict[str, Any]:
        """Return what the editor shows of a posture; without `turns`, only the degrees of its angles."""
        out: dict[str, Any] = {
            "rotations": posture.rotations.reshape(-1).tolist(),
            "root": posture.root.tolist(),
            "standing": standing_feet(posture),
            "corpus": self._studio.project.state.corpus,
            "balance": balance_of(posture),
        }
        memory = self._memory()
        out["known"] = memory.known(posture) if memory.fits(posture) else []
        found = turns_of(posture)
        return out | (
            {"turns": [turn._asdict() for turn in found]} if turns else {"degrees": [t.degrees for t in found]}
        )

    def _memory(self) -> Memory:
        name = self._studio.project.state.corpus
        engine = self._studio.engine(name)
        if name not in self._memories or self._memories[name][0] is not engine:
            self._memories = {name: (engine, Memory(engine))}
        return self._memories[name][1]

    def posture(self, pose: Pose) -> Posture:
        """Return the posture that the page sent; raise MotionMindError if it is invalid."""
        skeleton = self._studio.movements.get(pose.key).skeleton
        rotations = np.array(pose.rotations)
        if len(rotations) != 4 * len(skeleton):
            raise MotionMindError(
                f"a posture of {skeleton.name} needs {4 * len(skeleton)} numbers, not {len(rotations)}"
            )
        rotations = rotations.reshape(-1, 4)
        if np.any(np.abs(rot.norm(rotations) - 1.0) > 1e-3):  # the page rounds
            raise MotionMindError("a rotation is not a unit quaternion")
        return Posture(skeleton, rot.normalise(rotations), np.array(pose.root))


def routes(studio: Studio) -> list[BaseRoute]:
    """Return the routes of the editor."""
    poser = Poser(studio)
    one = asyncio.Lock()  # one request at a time: all share the corpus's memory

    def route(path: str, schema: type[Any], answer: Callable[[Any], dict[str, Any]]) -> Route:
        async def respond(request: Request) -> Response:
            asked = await body_of(request, schema)
            async with one:
                try:
                    return json(await asyncio.to_thread(answer, asked))
                except MotionMindError as problem:
                    return error(str(problem))

        return Route(path, respond, methods=["POST"])

    return [
        route("/api/pose/open", Opening, poser.opened),
        route("/api/pose/tell", Telling, lambda asked: poser.told(poser.posture(asked.pose))),
        route("/api/pose/drag", Dragging, poser.dragged),
        route("/api/pose/turn", Turning, poser.turned),
        route("/api/pose/change", Changing, poser.changed),
        route("/api/pose/keep", Keeping, poser.kept),
        route("/api/pose/score", Keeping, poser.scored),
    ]
