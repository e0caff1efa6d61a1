"""Plan the contacts of a body: stances, flights and the floor, as terms of the solve."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from motionmind._typing import Bools, Floats
from motionmind.body.skeleton import Skeleton
from motionmind.body.support import standing_rises
from motionmind.footing.balance import falls_without, is_beyond, walks
from motionmind.footing.feet import GRIP_HEIGHT_M, Foot
from motionmind.footing.flight import FLIGHT_CERTAIN_SHARE, Flight, find_flights, flying_frames
from motionmind.footing.ground import Stretch
from motionmind.footing.shape import Shape, shape_of
from motionmind.footing.smoothing import smoothstep
from motionmind.footing.support_phases import (
    HOLDS_UP_SHARE,
    LIMB_TOUCHES_M,
    SupportPhases,
    find_staying,
    find_support_phases,
)
from motionmind.learned.posture_statistics import FIRMNESS_HALVED_MPS
from motionmind.solver.reaches import Reach
from motionmind.solver.terms import Contacts

STEP_HEIGHT_M = 0.105  # of a step from 0.3 m on whose reference does not lift the foot; chosen on cmu-05 and cmu-16
LIFT_S = 0.1  # before and after a reach for which its foot is off the floor
STANDS_THERE_M = 0.02  # distance of a standing foot from the place of a reach that it need not leave the floor for
FULL_SWING_M = 0.08  # height of a swinging foot from which its standard deviations apply in full


class ContactSds(NamedTuple):
    """Standard deviations of the contacts.

    Attributes:
        stance: position of a point in stance, metres.
        stance_place: level position of a stance that includes no given posture, metres: the solve finds its place.
        swing: level position of a swinging foot, metres.
        swing_height: height of a swinging foot, metres.
        low_swing: share of both at the floor.
        low_swing_speed: level speed of a swinging foot at the floor, m/s.
        firm_speed: speed of the firmest foot, m/s.
        support_speed: speed of a supporting hand, knee or trunk, m/s.
    """

    stance: float = 0.003
    stance_place: float = 0.1
    swing: float = 0.04
    swing_height: float = 0.02
    low_swing: float = 0.2
    low_swing_speed: float = 0.15
    firm_speed: float = 0.03
    support_speed: float = 0.1


SDS = ContactSds()


class _Point(NamedTuple):
    """The contact of a point.

    Attributes:
        point: its number.
        targets: target positions [N, 3], metres.
        sds: standard deviations of these [N, 3], metres.
        stands: whether it stands [N].
        moves: target displacements between frames [N - 1, 2], level, metres.
        slips: standard deviations of these [N - 1], metres.
    """

    point: int
    targets: Floats
    sds: Floats
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
        lifted: whether each foot is off the floor for a reach [N, feet]; None for none.
        passes: a foot, a frame, and the position of the root [3] at which the foot would be at its place then, metres.
        phases: its support: stances of the feet, and other parts on the floor.
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
    lifted: Bools | None = None
    passes: list[tuple[int, int, Floats]] = field(default_factory=list)
    phases: SupportPhases = field(init=False)

    def plan_steps(self) -> None:
        """Plan the steps."""
        self.phases = find_support_phases(
            self.shape,
            self.stretch,
            self.mass,
            self.flying,
            self.staying,
            self.feet,
            self.fps,
            self.falls,
            self.lifted,
        )

    def replan_steps(self, root: Floats, mass: Floats) -> bool:
        """Plan the steps again if the body would fall as it now moves, and return whether it would.

        Args:
            root: positions of the root [N, 3], metres.
            mass: positions of the centre of mass [N, 3], metres.
        """
        if self.staying is not None or walks(root, self.fps):
            return False
        points = self.shape.places[..., [0, 2]] + root[:, None, [0, 2]]
        for foot, own in enumerate(self.shape.feet):
            points[:, own] += (self.phases.targets[:, foot] - root[:, [0, 2]])[:, None]
        centre = np.ascontiguousarray(mass[:, [0, 2]])
        if not is_beyond(points, self.phases.touching(self.shape), centre, self.overhang)[1:-1].any():
            return False
        low = self.phases.all_standing().touching(self.shape)
        self.falls = falls_without(points, low, self.shape.feet, centre, self.overhang)
        self.plan_steps()
        return True

    def contacts(self, root: Floats, steps: bool) -> Contacts:
        """Return the contacts for a root near these positions [N, 3]; without steps, feet are free to slide."""
        parts = [*self._of_feet(root, steps), *self._of_others(root)]
        count = len(root)
        frames, points, targets, sds, stands = (
            [none] for none in (*np.zeros((2, 0), dtype=np.int64), *np.zeros((2, 0, 3)), np.zeros(0, dtype=np.bool_))
        )
        for part in parts:  # the given postures, first and last, are exact
            some = 1 + np.flatnonzero(np.isfinite(part.sds[1:-1]).any(axis=1))
            frames.append(some)
            points.append(np.full(len(some), part.point))
            targets.append(part.targets[some])
            sds.append(part.sds[some])
            stands.append(part.stands[some])
        return Contacts(
            np.concatenate(frames),
            np.concatenate(points),
            np.concatenate(targets),
            np.concatenate(sds),
            np.concatenate(stands),
            np.array([part.point for part in parts], dtype=np.int64),
            _stacked([part.moves for part in parts], (count - 1, 0, 2)),
            _stacked([part.slips for part in parts], (count - 1, 0)),
        )

    def reach_with_feet(self, reaches: Sequence[Reach]) -> None:
        """Plan the steps again so that feet pass the places of their own reaches."""
        root, first, last = self.stretch.ground.root, self.stretch.frames.start, len(self.mass) - 1
        planned, lifted = self._off(root), np.zeros((last + 1, len(self.feet)), dtype=np.bool_)
        for reach in reaches:
            at = self.fps * reach.seconds - first
            frame = round(at)
            for k, foot in enumerate(self.feet):
                if not 0 < frame < last or reach.joint not in foot.leg[foot.knee :]:
                    continue
                off = reach.place - self.shape.places[frame, reach.joint] - root[frame]
                if np.linalg.norm(off - planned[frame, k]) > STANDS_THERE_M or not self.phases.stands[frame, k]:
                    lifted[1:-1, k] |= np.abs(np.arange(last + 1) - at)[1:-1] <= LIFT_S * self.fps
                    self.passes.append((k, frame, off + root[frame]))
        if lifted.any():
            self.lifted = lifted
            if self.staying is not None and lifted[:, self.staying].any():
                self.staying = None
            self.plan_steps()

    def _of_feet(self, root: Floats, steps: bool) -> Iterator[_Point]:
        """Yield the targets of the feet's points."""
        shape, phases, ground, off = self.shape, self.phases, self.stretch.ground, self._off(root)
        if not steps:
            off[..., [0, 2]] = 0.0
        for k, foot in enumerate(self.feet):
            stands = phases.stands[:, k]
            own = np.zeros(len(root), dtype=np.bool_)  # in a stance that includes no given posture
            for stance in phases.stances[k]:
                own[stance.start : stance.end + 1] = stance.start > 0 and stance.end < len(root) - 1
            firm = np.clip(ground.firm[:, foot.limb], 1e-2, 1.0)
            speed = np.hypot(FIRMNESS_HALVED_MPS * np.sqrt(1.0 / firm - 1.0), SDS.firm_speed)
            high = np.maximum(shape.low[:, k] + root[:, 1] + off[:, k, 1] - ground.floor, 0.0)
            free = np.where(self.flying, np.inf, np.clip(high / FULL_SWING_M, SDS.low_swing, 1.0))
            if self.lifted is not None:
                free[self.lifted[:, k]] = np.inf
            still = stands[1:] & stands[:-1]
            slip = np.where(still, 0.5 * (speed[1:] + speed[:-1]), SDS.low_swing_speed) / self.fps
            for point in np.flatnonzero(shape.feet[k]):
                at = shape.places[:, point] + root + off[:, k]
                hold = np.exp(-(shape.places[:, point, 1] - shape.low[:, k]) / GRIP_HEIGHT_M)
                firmly = SDS.stance / np.sqrt(np.maximum(hold, 1e-3))
                height = np.where(stands, firmly, SDS.swing_height * free)
                level = np.where(stands, np.where(own, SDS.stance_place, firmly), SDS.swing * free)
                if not steps:
                    level[:] = np.inf
                bears = np.where(stands, hold, np.where(self.flying, 0.0, hold * np.exp(-high / 0.02)))  # 1/e at 0.02 m
                both = np.minimum(bears[1:], bears[:-1])
                slips = np.where((both > 1e-2) & steps, slip / np.sqrt(np.maximum(both, 1e-9)), np.inf)
                moves = np.where(still[:, None], np.diff(at[:, [0, 2]], axis=0), 0.0)
                yield _Point(int(point), at, np.stack([level, height, level], axis=1), stands, moves, slips)

    def _of_others(self, root: Floats) -> Iterator[_Point]:
        """Yield the targets of supporting hands, knees or the trunk: on the floor, level where they are."""
        shape = self.shape
        rests = self.phases.others > HOLDS_UP_SHARE
        for part in np.flatnonzero(rests.any(axis=0)):
            for point in np.flatnonzero(shape.others[part]):
                at = shape.places[:, point] + root
                at[:, 1] = self.stretch.ground.floor + shape.places[:, point, 1] - shape.low_others[:, part]
                on = rests[:, part] & (shape.places[:, point, 1] < shape.low_others[:, part] + LIMB_TOUCHES_M)
                sds = np.where(on[:, None], [SDS.stance_place, SDS.stance, SDS.stance_place], np.inf)
                slips = np.where(on[1:] & on[:-1], SDS.support_speed / self.fps, np.inf)
                yield _Point(int(point), at, sds, on, np.diff(at[:, [0, 2]], axis=0), slips)

    def _off(self, root: Floats) -> Floats:
        """Return the displacement of each foot from the reference [N, feet, 3], metres.

        A foot in stance is in its place on the floor. Between stances the displacement changes smoothly from one to
        the other, and the foot is lifted, the higher the longer the step.
        """
        shape, phases, count = self.shape, self.phases, len(root)
        out = np.zeros((count, len(self.feet), 3))
        level = phases.targets - root[:, None, [0, 2]]
        height = shape.low + root[:, 1:2] - self.stretch.ground.floor[:, None]
        # Never lift a foot that alone supports the body.
        support = phases.stands.sum(axis=1) + (phases.others > HOLDS_UP_SHARE).sum(axis=1) + self.flying
        borne = support[:, None] > phases.stands
        for k in range(len(self.feet)):
            off = out[:, k]
            for stance in phases.stances[k]:
                here = slice(stance.start, stance.end + 1)
                off[here, 0], off[here, 2] = level[here, k].T
                wanted = np.zeros(count)  # a foot given above the floor comes down in 0.3 s
                for edge in {stance.start, stance.end} & {0, count - 1}:
                    near = np.clip(1.0 - np.abs(np.arange(count) - edge) / (0.3 * self.fps), 0.0, 1.0)
                    wanted += height[edge, k] * smoothstep(near)
                off[here, 1] = (wanted - height[:, k])[here]
            passed = [(frame, place) for foot, frame, place in self.passes if foot == k and not phases.stands[frame, k]]
            for frame, place in passed:
                off[frame] = place - root[frame]
            stops = [*((stance.start, stance.end) for stance in phases.stances[k]), *((at, at) for at, _ in passed)]
            edges = [0, *(frame for stop in sorted(stops) for frame in stop), count - 1]
            for begin, end in zip(edges[::2], edges[1::2], strict=True):
                if end - begin < 2:
                    continue
                part, share = slice(begin, end + 1), np.linspace(0.0, 1.0, end - begin + 1)
                off[part] = off[begin] + smoothstep(share)[:, None] * (off[end] - off[begin])
                on_its_way = (begin == 0 and self.stretch.moving[0]) or (end == count - 1 and self.stretch.moving[1])
                if on_its_way or not phases.stances[k]:
                    continue
                places = shape.tracks[part, k] + root[part][:, [0, 2]] + off[part][:, [0, 2]]
                step = places[-1] - places[0]
                far = min(float(np.linalg.norm(step)) / 0.3, 1.0)  # a step from 0.3 m on is long
                rise = smoothstep(np.minimum(share, share[::-1]) / 0.33)  # the foot rises, and sinks, in a third
                lift = np.where(borne[part, k], STEP_HEIGHT_M * far * rise, 0.0)
                off[part, 1] += np.maximum(lift - height[part, k] - off[part, 1], 0.0)
                # Near the floor a foot moves straight from place to place, whatever the reference does.
                strays = places - places[0] - smoothstep(share)[:, None] * step
                low = (1.0 - far) * (1.0 - smoothstep((height[part, k] + off[part, 1]) / FULL_SWING_M))
                off[part, 0], off[part, 2] = (off[part][:, [0, 2]] - low[:, None] * strays).T
        return out


def _stacked(parts: list[Floats], shape: tuple[int, ...]) -> Floats:
    """Stack arrays as columns; return zeros of this shape if there are none."""
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
        feet: feet that may be placed.
        overhang: allowed distance of the centre of mass from the support, metres.
        gravity: m/s^2.
        fps: frames a second.
        flies: whether it may leave the floor.
        falls: how far it would fall without each foot [N, feet], 0 to 1; None where unknown.
    """
    shape, root, count = shape_of(skeleton, stretch.posed, feet), stretch.ground.root, len(stretch.ground.root)
    standing = stretch.ground.floor - shape.lowest
    above = root[[0, -1], 1] - standing[[0, -1]]
    # Up to 0.12 m above the floor a foot may stay throughout; from 0.04 m on a body is in the air where walks are.
    staying = find_staying(shape, root[:, [0, 2]]) if above.max() < 0.12 else None
    hovers = tuple(
        bool(staying is None and stretch.ground.aloft[end] > FLIGHT_CERTAIN_SHARE and above[end] > 0.04)
        for end in (0, -1)
    )
    flights: list[Flight] = []
    # Nor does a body hop that stands on the same limb, in one place, at both ends.
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
    plan.plan_steps()
    return plan
