"""MMCP: the open protocol between animation programs and motion generators.

`motionmcp` validates requests and encodes answers; this module converts requests to an `Order`, and errors to the
protocol's.
"""

from __future__ import annotations

import asyncio
import warnings
from collections.abc import Mapping, Sequence
from time import monotonic
from typing import Any

import numpy as np
from motionmcp import Backbone, GenerateRequest, ModelSpec, MotionResult, ProtocolError, server
from motionmcp.backbone import Limits
from motionmcp.schemas import Joint, ModelOption
from motionmcp.schemas import Skeleton as WireSkeleton

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.errors import MotionMindError, MotionMindWarning, NoPathError, SkeletonError
from motionmind.geometry import rotations as rot
from motionmind.search.solve import Progress
from motionmind.serve.order import Order, Pin, Pose, Waypoint
from motionmind.serve.perform import Performance, Stretch, perform
from motionmind.tween.engine import Engine
from motionmind.tween.headline import beyond, headline

CERTIFICATE = "certificate"  # code of the notes that `guard.with_extras` moves to the animations

_FPS = 30.0
_MAX_REQUEST_FPS = 120.0
_MAX_CLIP_S = 30.0
_MAX_REQUEST_JOINTS = 512
_MAX_WAITING = 4  # requests that wait for the running one
_SEARCH_TIMEOUT_S = 60.0  # then a search returns its best path; after twice as long, the request fails


class Model(Backbone):  # type: ignore[misc]
    """A corpus, served as a model of the protocol."""

    def __init__(self, engine: Engine, *, patience: float = _SEARCH_TIMEOUT_S) -> None:
        """Serve a corpus.

        Args:
            engine: the corpus.
            patience: seconds after which a search returns the best path so far.
        """
        self.model_id = engine.corpus.name
        self._engine, self._patience = engine, patience
        self._one_at_a_time, self._waiting, self._ends = asyncio.Lock(), 0, False

    def capabilities(self) -> ModelSpec:
        """Describe the model for the protocol."""
        corpus = self._engine.corpus
        names = list(corpus.chains)
        options = [ModelOption(name="novelty", type="number", default=0.0, minimum=0.0, maximum=1.0, title="Novelty")]
        if len(names) <= 32:  # the protocol allows an option no more values
            title = "Joints that keep their state"
            options.append(ModelOption(name="hold", type="flags", default=[], values=names, title=title))
        return ModelSpec(
            id=self.model_id,
            fps=_FPS,
            canonical_skeleton=_to_wire(corpus.skeleton),
            supports_retargeting=human23().difference(corpus.skeleton) is None,
            model_options=options,
            supported_constraints=["pose_keyframe", "root_path", "effector_target"],
            supported_guidance_types=["nocfg"],
            native_clip_seconds=_MAX_CLIP_S,
            recommended_max_duration_seconds=_MAX_CLIP_S,
            limits=Limits(
                max_duration_seconds=_MAX_CLIP_S,
                max_num_samples=8,
                max_constraints_per_request=128,
                max_request_bytes=1 << 20,
                max_batch_size=4,
            ),
        )

    def teardown(self) -> None:
        """Stop the running request, because the server is stopping."""
        self._ends = True

    async def generate(self, request: GenerateRequest) -> MotionResult:
        """Answer a request; up to `_MAX_WAITING` others wait.

        Raises:
            ProtocolError: it cannot be answered.
        """
        if self._waiting > _MAX_WAITING:
            raise ProtocolError("rate_limited", f"{self._waiting} requests are running or waiting: try again later")
        self._waiting += 1
        try:
            async with self._one_at_a_time:
                return await asyncio.to_thread(self._answer, request)
        finally:
            self._waiting -= 1

    def _answer(self, request: GenerateRequest) -> MotionResult:
        began = monotonic()

        def watch(_: Progress) -> bool:
            if self._ends:
                raise ProtocolError("model_unavailable", "the server is stopping")
            spent = monotonic() - began
            if spent > 2.0 * self._patience:
                raise ProtocolError("timeout", f"no path found within {spent:.0f} s: request less movement")
            return spent > self._patience

        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", MotionMindWarning)  # `beyond` reports the same
                order = order_of(request, self._engine.corpus.skeleton)
                return _to_result(perform(self._engine, order, watch), self._engine, request)
        except NoPathError as error:
            raise ProtocolError("invalid_request", str(error)) from None
        except SkeletonError as error:
            raise ProtocolError("invalid_skeleton", str(error)) from None
        except MotionMindError as error:
            raise ProtocolError("invalid_request", str(error)) from None
        except MemoryError:
            raise ProtocolError("resource_exhausted", "not enough memory") from None


def app(engine: Engine, **options: Any) -> Any:
    """Return the ASGI application that serves a corpus, for `Guard` to wrap."""
    return server.build_app(Model(engine, **options), title="MotionMind")


def order_of(request: GenerateRequest, own: Skeleton) -> Order:
    """Convert a request to an order.

    Args:
        request: the request, valid under the protocol's schema.
        own: the corpus's skeleton.

    Raises:
        ProtocolError: a number is not finite or out of range, there is no pose, or the skeleton is unsupported.
    """
    fps = request.fps(_FPS)
    if not 1.0 <= fps <= _MAX_REQUEST_FPS:
        raise ProtocolError("invalid_options", f"timing.fps must be from 1 to {_MAX_REQUEST_FPS:g}, not {fps:g}")
    skeleton, stands = _from_wire(request.skeleton, own)
    number = {name: joint for joint, name in enumerate(skeleton.names)}
    poses, waypoints, pins = [], [], []
    for index, one in enumerate(request.constraints):
        where = f"constraints[{index}]"
        if one.type == "pose_keyframe":
            rotations, given = np.tile(rot.IDENTITY, (len(skeleton), 1)), np.zeros(len(skeleton), dtype=np.bool_)
            for name, rotation in one.joint_rotations.items():
                rotations[number[name]] = _unit(rotation, f"{where}.joint_rotations.{name}")
                given[number[name]] = True
            root = None if one.root_position is None else _place(one.root_position, f"{where}.root_position")
            poses.append(Pose(one.frame, rotations, given | (one.fill_mode == "rest"), root))
        elif one.type == "root_path":
            headings: Sequence[float | None] = one.heading_radians or [None] * len(one.frames)
            for frame, place, heading in zip(one.frames, one.positions_xz, headings, strict=True):
                turn = None if heading is None else float(_place([heading], f"{where}.heading_radians")[0])
                waypoints.append(Waypoint(frame, _place(place, f"{where}.positions_xz"), turn))
        else:
            turns: Sequence[Any] = one.rotations or [None] * len(one.frames)
            for frame, place, turned in zip(one.frames, one.positions, turns, strict=True):
                rotation = None if turned is None else _unit(turned, f"{where}.rotations")
                pins.append(Pin(frame, number[one.joint], _place(place, f"{where}.positions"), rotation))
    if not poses:
        raise ProtocolError(
            "invalid_request",
            "no pose_keyframe: MotionMind moves from pose to pose and ignores prompts; give the pose at the first and "
            "last frame",
        )
    options = request.options
    chosen: Mapping[str, Any] = (options.model_options if options else None) or {}
    return Order(
        skeleton,
        stands,
        request.total_frames,
        fps,
        poses,
        waypoints,
        pins,
        samples=options.num_samples if options else 1,
        seed=(options.seed or 0) % (1 << 32) if options else 0,
        hold=chosen.get("hold", ()),
        novelty=float(chosen.get("novelty", 0.0)),
    )


def _to_result(performances: Sequence[Performance], engine: Engine, request: GenerateRequest) -> MotionResult:
    """Convert performances to the protocol's result, with the certificate of each as a note."""
    notes: list[dict[str, Any]] = [
        {"code": "note", "severity": "info", "message": message}
        for message in dict.fromkeys(note for one in performances for note in one.notes)
    ]
    if any(segment.type == "text" for segment in request.segments):
        message = f"prompts are ignored: the corpus {engine.corpus.name} determines the style"
        notes.append({"code": "prompt_ignored", "severity": "warning", "message": message})
    for sample, one in enumerate(performances):
        for stretch in one.stretches:
            for remark in beyond(stretch.tween):
                message = f"frames {stretch.first} to {stretch.last}: {remark}"
                notes.append({"code": "beyond_corpus", "severity": "warning", "message": message, "sample": sample})
    certificates = [
        {
            "code": CERTIFICATE,
            "severity": "info",
            "message": "; ".join(headline(stretch.tween) for stretch in one.stretches) or "still",
            "sample": sample,
            "corpus": engine.corpus.name,
            "stretches": [_certificate(stretch) for stretch in one.stretches],
        }
        for sample, one in enumerate(performances)
    ]
    return MotionResult(
        rotations=np.stack([one.rotations for one in performances]),
        root_translations=np.stack([one.root for one in performances]),
        notes=[*certificates, *notes],
    )


def _certificate(stretch: Stretch) -> dict[str, Any]:
    tween = stretch.tween
    return {
        "first_frame": stretch.first,
        "last_frame": stretch.last,
        "status": tween.status,
        "cost": float(tween.cost),
        "lower_bound": float(tween.lower_bound),
        "moves": int(tween.moves),
        "bridges": len(tween.bridges),
    }


def _to_wire(skeleton: Skeleton) -> WireSkeleton:
    """Convert a skeleton to the protocol's, standing on the floor in its rest pose."""
    low = float(skeleton.rest[: len(skeleton), 1].min())
    return WireSkeleton(
        joints=[
            Joint(
                name=name,
                parent=None if parent < 0 else skeleton.names[parent],
                rest_translation=tuple(map(float, skeleton.offsets[joint])) if parent >= 0 else (0.0, -low, 0.0),
                rest_rotation=(0.0, 0.0, 0.0, 1.0),
            )
            for joint, (name, parent) in enumerate(zip(skeleton.names, skeleton.parents, strict=True))
        ]
    )


def _from_wire(wire: WireSkeleton, own: Skeleton) -> tuple[Skeleton, Floats]:
    """Return a skeleton, and the position of its root joint in the rest pose [3].

    A skeleton with the corpus's joints also gets the corpus's tips, scaled, because the protocol has no tips.
    """
    joints = wire.joints
    if len(joints) > _MAX_REQUEST_JOINTS:
        raise ProtocolError("invalid_skeleton", f"a skeleton may have {_MAX_REQUEST_JOINTS} joints, not {len(joints)}")
    if joints[0].parent is not None:
        raise ProtocolError("invalid_skeleton", f"the first joint must be the root, not {joints[0].name!r}")
    for joint in joints:
        if not np.abs(np.asarray(joint.rest_rotation) @ rot.IDENTITY) > 1.0 - 1e-6:
            raise ProtocolError(
                "invalid_skeleton", f"joint {joint.name!r}: rest_rotation must be 0, 0, 0, 1; rotations are from rest"
            )
    offsets = np.stack([_place(joint.rest_translation, f"joint {joint.name!r}") for joint in joints])
    stands = offsets[0].copy()
    offsets[0] = 0.0
    number = {joint.name: index for index, joint in enumerate(joints)}
    parents = tuple(-1 if joint.parent is None else number[joint.parent] for joint in joints)
    skeleton = Skeleton("the skeleton of the request", tuple(number), parents, offsets)
    if own.difference(skeleton) is None:
        tips = own.tips if np.allclose(offsets, own.offsets, atol=1e-6) else own.tips * skeleton.height / own.height
        skeleton = Skeleton(own.name, own.names, own.parents, offsets, tips)
    return skeleton, stands


def _place(numbers: Sequence[float], where: str) -> Floats:
    found = np.array(numbers, dtype=np.float64)
    if not np.all(np.abs(found) < 1e4):
        raise ProtocolError(
            "invalid_request", f"{where}: {list(numbers)} must be finite and below 10000 (metres or radians)"
        )
    return found


def _unit(numbers: Sequence[float], where: str) -> Floats:
    found = np.array(numbers, dtype=np.float64)
    if not 1e-3 < np.linalg.norm(found) < 1e3:
        raise ProtocolError("invalid_request", f"{where}: {list(numbers)} is not a unit quaternion (x, y, z, w)")
    return found / np.linalg.norm(found)
