"""Movements near a reference, as the solve sees them, and gradients by central differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from motionmind._typing import Floats
from motionmind.body.human import human23
from motionmind.body.skeleton import Skeleton
from motionmind.geometry import rotations as rot
from motionmind.solver.kinematics import Freedom, State, body_of
from motionmind.solver.system import Normal
from motionmind.solver.terms import Term

FPS = 30.0
HUMAN = human23()
HINGES = "left_knee", "right_knee", "left_elbow", "right_elbow"
BALLS = "pelvis", "left_hip", "right_hip", "lumbar", "left_shoulder", "right_shoulder"


def freedom_of(skeleton: Skeleton, balls: tuple[str, ...] = BALLS, hinges: tuple[str, ...] = HINGES) -> Freedom:
    """Three degrees of freedom for each ball joint, one for each hinge, about an axis that is none of the frame's."""
    joints, axes = [], []
    for number, name in enumerate(skeleton.names):
        own = np.eye(3) if name in balls else np.array([[2.0, 1.0, 2.0]]) / 3.0 if name in hinges else np.zeros((0, 3))
        joints += [number] * len(own)
        axes.append(own)
    return Freedom(np.array(joints, dtype=np.int64), np.concatenate(axes))


def random_rotations(skeleton: Skeleton, frames: int, angle: float, seed: int) -> Floats:
    """Local rotations [frames, J, 4] by angles of about so many radians."""
    return rot.exp(angle * np.random.default_rng(seed).normal(size=(frames, len(skeleton), 3)))


def random_state(seed: int, size: float, frames: int = 6, angle: float = 0.2, skeleton: Skeleton = HUMAN) -> State:
    """A movement whose unknowns are about so great, near postures whose joints turn by so many radians."""
    rng, freedom = np.random.default_rng(seed), freedom_of(skeleton)
    reference, root = random_rotations(skeleton, frames, angle, seed), rng.normal(size=(frames, 3))
    return State(body_of(skeleton), freedom, reference, root, size * rng.normal(size=(frames, freedom.unknowns)))


def moved(state: State, step: Floats) -> State:
    """The same movement a step [N, n] farther."""
    reference = rot.mul(state.rotations, rot.inv(_turns(state)))
    return State(state.body, state.freedom, reference, state.root - state.x[:, :3], state.x + step)


def _turns(state: State) -> Floats:
    turned = np.zeros((*state.rotations.shape[:2], 3))
    for joint in np.unique(state.freedom.joints):
        own, columns = state.freedom.slices(joint)
        turned[:, joint] = state.x[:, columns] @ state.freedom.axes[own]
    return rot.exp(turned)


def differences(of: Callable[[State], Floats | float], state: State, width: float = 1e-5) -> Floats:
    """The derivatives of a function of a movement, by central differences [N, n, ...]."""
    out = []
    for index in np.ndindex(state.x.shape):
        step = np.zeros(state.x.shape)
        step[index] = width
        out.append((of(moved(state, step)) - of(moved(state, -step))) / (2.0 * width))
    return np.array(out).reshape(*state.x.shape, *np.shape(out[0]))


def linearised(term: Term, state: State) -> Normal:
    """The normal equations of a term alone."""
    normal = Normal(*state.x.shape)
    term.add(state, normal)
    normal.expand(state.mass_jacobian)
    return normal
