"""Plan the contacts of a body: stances, flights and the floor. A plan moves nothing; it writes terms of the solve."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.contact import Posed
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import standing_rises
from motionmind.footing.balance import falls_without, is_beyond, walks
from motionmind.footing.bearing import (
    HOLDS_UP_SHARE,
    LIMB_TOUCHES_M,
    Bearing,
    Shape,
    find_bearing,
    find_staying,
    shape_of,
)
from motionmind.footing.feet import Foot
from motionmind.footing.flight import AIRBORNE_FROM_M, FLIGHT_CERTAIN_SHARE, Flight, find_flights, flying_frames
from motionmind.footing.ground import Ground
from motionmind.synth.terms import Contacts

POINT_GRIP_M = 0.015  # height above a foot's lowest point at which the grip of a point has fallen to 1/e
STANCE_SD_M = 0.003  # standard deviation of the position of a point in stance
STANCE_PLACE_SD_M = 0.1  # the same, level, of a stance that includes no given posture: the solve finds its place
SWING_SD_M = 0.04  # the same, level, of a swinging foot
SWING_HEIGHT_SD_M = 0.02  # the same, of its height
LOW_SWING_SD_SHARE, FULL_SWING_SD_FROM_M = (
    0.2,
    0.08,
)  # share of both at the floor, and height from which they apply in full
HALF_FIRM_MPS = 0.3  # m/s: speed of a foot that the corpus counts as half firm
SWING_GRIP_M = 0.02  # height of a swinging foot at which its grip has fallen to 1/e
LOW_SWING_SPEED_SD_MPS = 0.15  # m/s, standard deviation of a swinging foot's level speed at the floor
FIRM_FOOT_SPEED_SD_MPS = 0.03  # m/s, standard deviation of the firmest foot's speed
SUPPORT_SPEED_SD_MPS = 0.1  # m/s, standard deviation of the speed of a supporting hand, knee or trunk
STEP_RISE_SHARE = 0.33  # share of a step in which the foot rises, and in which it comes down
STEP_HEIGHT_M = 0.105  # height of a step whose reference does not lift the foot; chosen on cmu-05 and cmu-16
LONG_STEP_M = 0.3  # length of a step from which it is that high
FOOT_COMES_DOWN_S = 0.3  # seconds for a foot given above the floor to come down
STAYING_FOOT_HEIGHT_M = 0.12  # height above the floor up to which one foot may stay throughout (`find_staying`)


class Stretch(NamedTuple):
    """A movement of N frames between two given postures.

    Attributes:
        frames: slice of the whole movement.
        posed: the movement relative to its root.
        ground: the ground under it.
        moving: whether the velocity is given at the first and at the last frame.
        passing: whether the body passes them, at whatever velocity.
        rates: vertical velocities of the root there, m/s; None where unknown.
    """

    frames: slice
    posed: Posed
    ground: Ground
    moving: tuple[bool, bool]
    passing: tuple[bool, bool]
    rates: tuple[float | None, float | None]


class _Point(NamedTuple):
    """Targets of a point [N, 3] and their spreads [N, 3], whether it stands [N], and its level displacements [N - 1, 2]
    and theirs [N - 1], metres."""

    point: int
    targets: Floats
    spreads: Floats
    stands: Bools
    moves: Floats
    slips: Floats


@dataclass
class Plan:
    """The plan of a stretch.

    Attributes:
        stretch: the stretch.
        shape: the body in each frame.
        flights: its flights.
        flying: whether it is in flight [N].
        feet: its feet.
        staying: a foot that stands throughout, or None.
        mass: its centre of mass relative to the root [N, 3], metres.
        overhang: allowed distance of the centre of mass from the support, metres.
        fps: frames a second.
        falls: how far it would fall without each foot [N, feet], 0 to 1; None where unknown.
        bearing: its support: stances of the feet, and other parts that bear weight.
    """

    stretch: Stretch
    shape: Shape
    flights: list[Flight]
    flying: Bools
    feet: list[Foot]
    staying: int | None
    mass: Floats
    overhang: float
    fps: float
    falls: Floats | None
    bearing: Bearing = field(init=False)

    def step(self) -> None:
        """Plan the steps."""
        stretch = self.stretch
        self.bearing = find_bearing(
            self.shape,
            stretch.ground.root[:, [0, 2]],
            self.mass[:, [0, 2]],
            stretch.ground.firm,
            self.flying,
            self.staying,
            stretch.moving,
            stretch.passing,
            self.feet,
            self.fps,
            self.falls,
        )

    def again(self, root: Floats, mass: Floats) -> bool:
        """Plan the steps again if the body, as it now moves, would fall; return whether it would.

        Args:
            root: positions of the root [N, 3], metres.
            mass: positions of the centre of mass [N, 3], metres.
        """
        if self.staying is not None or walks(root, self.fps):
            return False
        points = self.shape.places[..., [0, 2]] + root[:, None, [0, 2]]
        for foot, own in enumerate(self.shape.feet):
            points[:, own] += (self.bearing.targets[:, foot] - root[:, [0, 2]])[:, None]
        centre = np.ascontiguousarray(mass[:, [0, 2]])
        if not is_beyond(points, self.bearing.touching(self.shape), centre, self.overhang)[1:-1].any():
            return False
        low = self.bearing.all_standing().touching(self.shape)
        self.falls = falls_without(points, low, self.shape.feet, centre, self.overhang)
        self.step()
        return True

    def contacts(self, root: Floats, steps: bool) -> Contacts:
        """Return the contacts for a root near these positions [N, 3]; without steps, feet are free to slide."""
        parts = [*self._of_feet(root, steps), *self._of_others(root)]
        count = len(root)
        frames, points, targets, spreads, stands = (
            [none] for none in (*np.zeros((2, 0), dtype=np.int64), *np.zeros((2, 0, 3)), np.zeros(0, dtype=np.bool_))
        )
        for part in parts:  # the given postures, first and last, are exact
            some = 1 + np.flatnonzero(np.isfinite(part.spreads[1:-1]).any(axis=1))
            frames.append(some)
            points.append(np.full(len(some), part.point))
            targets.append(part.targets[some])
            spreads.append(part.spreads[some])
            stands.append(part.stands[some])
        return Contacts(
            np.concatenate(frames),
            np.concatenate(points),
            np.concatenate(targets),
            np.concatenate(spreads),
            np.concatenate(stands),
            np.array([part.point for part in parts], dtype=np.int64),
            _stacked([part.moves for part in parts], (count - 1, 0, 2)),
            _stacked([part.slips for part in parts], (count - 1, 0)),
        )

    def _of_feet(self, root: Floats, steps: bool) -> Iterator[_Point]:
        """Yield the targets of the feet's points."""
        shape, bearing, ground, off = self.shape, self.bearing, self.stretch.ground, self._off(root)
        if not steps:
            off[..., [0, 2]] = 0.0
        for k, foot in enumerate(self.feet):
            stands = bearing.stands[:, k]
            own = np.zeros(len(root), dtype=np.bool_)  # in a stance that includes no given posture
            for stance in bearing.stances[k]:
                own[stance.start : stance.end + 1] = stance.start > 0 and stance.end < len(root) - 1
            firm = np.clip(ground.firm[:, foot.limb], 1e-2, 1.0)
            speed = np.hypot(HALF_FIRM_MPS * np.sqrt(1.0 / firm - 1.0), FIRM_FOOT_SPEED_SD_MPS)
            high = np.maximum(shape.low[:, k] + root[:, 1] + off[:, k, 1] - ground.floor, 0.0)
            free = np.where(self.flying, np.inf, np.clip(high / FULL_SWING_SD_FROM_M, LOW_SWING_SD_SHARE, 1.0))
            still = stands[1:] & stands[:-1]
            slip = np.where(still, 0.5 * (speed[1:] + speed[:-1]), LOW_SWING_SPEED_SD_MPS) / self.fps
            for point in np.flatnonzero(shape.feet[k]):
                at = shape.places[:, point] + root + off[:, k]
                hold = np.exp(-(shape.places[:, point, 1] - shape.low[:, k]) / POINT_GRIP_M)
                firmly = STANCE_SD_M / np.sqrt(np.maximum(hold, 1e-3))
                height = np.where(stands, firmly, SWING_HEIGHT_SD_M * free)
                level = np.where(stands, np.where(own, STANCE_PLACE_SD_M, firmly), SWING_SD_M * free)
                if not steps:
                    level[:] = np.inf
                bears = np.where(stands, hold, np.where(self.flying, 0.0, hold * np.exp(-high / SWING_GRIP_M)))
                both = np.minimum(bears[1:], bears[:-1])
                slips = np.where((both > 1e-2) & steps, slip / np.sqrt(np.maximum(both, 1e-9)), np.inf)
                moves = np.where(still[:, None], np.diff(at[:, [0, 2]], axis=0), 0.0)
                yield _Point(int(point), at, np.stack([level, height, level], axis=1), stands, moves, slips)

    def _of_others(self, root: Floats) -> Iterator[_Point]:
        """Yield the targets of supporting hands, knees or the trunk: on the floor, in their own places."""
        shape = self.shape
        rests = self.bearing.others > HOLDS_UP_SHARE
        for part in np.flatnonzero(rests.any(axis=0)):
            for point in np.flatnonzero(shape.others[part]):
                at = shape.places[:, point] + root
                at[:, 1] = self.stretch.ground.floor + shape.places[:, point, 1] - shape.low_others[:, part]
                on = rests[:, part] & (shape.places[:, point, 1] < shape.low_others[:, part] + LIMB_TOUCHES_M)
                spreads = np.where(on[:, None], [STANCE_PLACE_SD_M, STANCE_SD_M, STANCE_PLACE_SD_M], np.inf)
                slips = np.where(on[1:] & on[:-1], SUPPORT_SPEED_SD_MPS / self.fps, np.inf)
                yield _Point(int(point), at, spreads, on, np.diff(at[:, [0, 2]], axis=0), slips)

    def _off(self, root: Floats) -> Floats:
        """Return the displacement of each foot from the reference [N, feet, 3], metres.

        A foot in stance is in its place on the floor. Between stances the displacement changes smoothly from one to
        the other, and the foot is lifted, the higher the longer the step.
        """
        shape, bearing, count = self.shape, self.bearing, len(root)
        out = np.zeros((count, len(self.feet), 3))
        level = bearing.targets - root[:, None, [0, 2]]
        height = shape.low + root[:, 1:2] - self.stretch.ground.floor[:, None]
        # Never lift a foot that alone supports the body.
        support = bearing.stands.sum(axis=1) + (bearing.others > HOLDS_UP_SHARE).sum(axis=1) + self.flying
        borne = support[:, None] > bearing.stands
        for k in range(len(self.feet)):
            off = out[:, k]
            for stance in bearing.stances[k]:
                here = slice(stance.start, stance.end + 1)
                off[here, 0], off[here, 2] = level[here, k].T
                wanted = np.zeros(count)
                for edge in {stance.start, stance.end} & {0, count - 1}:
                    near = np.clip(1.0 - np.abs(np.arange(count) - edge) / (FOOT_COMES_DOWN_S * self.fps), 0.0, 1.0)
                    wanted += height[edge, k] * _eased(near)
                off[here, 1] = (wanted - height[:, k])[here]
            edges = [0, *(frame for stance in bearing.stances[k] for frame in (stance.start, stance.end)), count - 1]
            for begin, end in zip(edges[::2], edges[1::2], strict=True):
                if end - begin < 2:
                    continue
                part, share = slice(begin, end + 1), np.linspace(0.0, 1.0, end - begin + 1)
                off[part] = off[begin] + _eased(share)[:, None] * (off[end] - off[begin])
                on_its_way = (begin == 0 and self.stretch.moving[0]) or (end == count - 1 and self.stretch.moving[1])
                if on_its_way or not bearing.stances[k]:
                    continue
                places = shape.tracks[part, k] + root[part][:, [0, 2]] + off[part][:, [0, 2]]
                step = places[-1] - places[0]
                far = min(float(np.linalg.norm(step)) / LONG_STEP_M, 1.0)
                lift = np.where(
                    borne[part, k], STEP_HEIGHT_M * far * _eased(np.minimum(share, share[::-1]) / STEP_RISE_SHARE), 0.0
                )
                off[part, 1] += np.maximum(lift - height[part, k] - off[part, 1], 0.0)
                # Near the floor a foot moves straight from place to place, whatever the reference does.
                strays = places - places[0] - _eased(share)[:, None] * step
                low = (1.0 - far) * (1.0 - _eased((height[part, k] + off[part, 1]) / FULL_SWING_SD_FROM_M))
                off[part, 0], off[part, 2] = (off[part][:, [0, 2]] - low[:, None] * strays).T
        return out


def _stacked(parts: list[Floats], shape: tuple[int, ...]) -> Floats:
    """Return arrays as the columns of one; of this shape if there are none."""
    return np.stack(parts, axis=1) if parts else np.zeros(shape)


def plan_contacts(
    skeleton: Skeleton,
    stretch: Stretch,
    mass: Floats,
    feet: list[Foot],
    overhang: float,
    gravity: float,
    fps: float,
    flies: bool,
    falls: Floats | None,
) -> Plan:
    """Plan the contacts of a body between two given postures.

    Args:
        skeleton: the body.
        stretch: its movement.
        mass: its centre of mass relative to the root [N, 3], metres.
        feet: those that may be placed.
        overhang: allowed distance of the centre of mass from the support, metres.
        gravity: m/s^2.
        fps: frames a second.
        flies: whether it may leave the floor.
        falls: how far it would fall without each foot [N, feet], 0 to 1; None where unknown.
    """
    shape, root, count = shape_of(skeleton, stretch.posed, feet), stretch.ground.root, len(stretch.ground.root)
    standing = stretch.ground.floor - shape.lowest
    above = root[[0, -1], 1] - standing[[0, -1]]
    staying = find_staying(shape, root[:, [0, 2]]) if above.max() < STAYING_FOOT_HEIGHT_M else None
    hovers = tuple(
        bool(staying is None and stretch.ground.aloft[end] > FLIGHT_CERTAIN_SHARE and above[end] > AIRBORNE_FROM_M)
        for end in (0, -1)
    )
    flights: list[Flight] = []
    # A body that stands on the same limb, in one place, at both ends does not hop either.
    if flies and staying is None and standing_rises(skeleton, stretch.posed.rotations[[0, -1]], root[[0, -1]]) is None:
        rates = [
            None if rate is None else rate + float(step)
            for rate, step in zip(stretch.rates, fps * np.diff(mass[:, 1])[[0, -1]], strict=True)
        ]
        heights = root[[0, -1], 1] + mass[[0, -1], 1]
        pair = hovers[0], hovers[1]
        flights = find_flights(
            stretch.ground.aloft,
            stretch.ground.leaps,
            standing + mass[:, 1],
            heights,
            pair,
            (rates[0], rates[1]),
            gravity,
            fps,
        )
    flying = flying_frames(flights, (hovers[0], hovers[1]), count)
    plan = Plan(stretch, shape, flights, flying, feet, staying, mass, overhang, fps, falls)
    plan.step()
    return plan


def _eased(share: Floats) -> Floats:
    """Return the smoothstep of a share, clipped to 0 and 1."""
    share = np.clip(share, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))
