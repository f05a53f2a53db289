"""A twin's body in its arena: MuJoCo moves it and looks along rays."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import RobotError, from_extra
from realitygap.world import Arena, Pose

from ._model import TwinModel
from ._shape import WALL, mjcf_of

Floats = NDArray[np.float64]

SETTLING = 20  # steps in which a robot that was put down comes to rest
GROUPS = 6  # of MuJoCo
SETBACK = 0.01  # behind its mount, where rays of a sensor begin: what touches the mount is still ahead [m]
EYE_ABOVE = 0.05  # of the floor, where sensors look [m]


@functools.lru_cache(maxsize=16)
def _compiled(text: str) -> Any:
    """Return the model of a text in MuJoCo's XML; it is only read."""
    mujoco = from_extra("mujoco", "twin")
    if mujoco.get_mju_user_warning() is None:
        mujoco.set_mju_user_warning(
            lambda _: None
        )  # else it leaves MUJOCO_LOG.TXT behind; `move` tells of trouble
    return mujoco.MjModel.from_xml_string(text)


class Physics:
    """A twin's body, standing at a pose until its wheels are turned.

    Args:
        model: The twin.
        arena: Arena of the robot.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """

    def __init__(self, model: TwinModel, arena: Arena) -> None:
        self._mujoco = from_extra("mujoco", "twin")
        self.mj_model = _compiled(mjcf_of(model, arena))
        self.mj_data = self._mujoco.MjData(self.mj_model)
        self.radius = model.wheels.diameter / 2
        self._place, self._speed, self._control = self.mj_data.qpos, self.mj_data.qvel, self.mj_data.ctrl
        kinds = self._mujoco.mjtWarning
        lost = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
        self._lost = [self.mj_data.warning[kind] for kind in lost]
        self._seen = np.zeros(GROUPS, np.uint8)
        self._seen[WALL] = 1

    def place(self, pose: Pose) -> None:
        """Put it somewhere, at rest."""
        mujoco, data = self._mujoco, self.mj_data
        mujoco.mj_resetData(self.mj_model, data)
        x, y, heading = map(float, pose)
        half = heading / 2
        self._place[:7] = x, y, self.radius, math.cos(half), 0.0, 0.0, math.sin(half)
        mujoco.mj_step(self.mj_model, data, nstep=SETTLING)
        # It sinks into the floor by a little, and stays where it was put.
        self._place[:2] = x, y
        self._place[3:7] = math.cos(half), 0.0, 0.0, math.sin(half)
        self._place[7:9] = 0.0
        self._speed[:] = 0.0
        data.time = 0.0
        mujoco.mj_forward(self.mj_model, data)

    def stand(self, pose: Pose) -> None:
        """Show it at a pose, without physics."""
        half = pose.heading / 2
        self._place[:7] = pose.x, pose.y, self.radius, math.cos(half), 0.0, 0.0, math.sin(half)
        self._mujoco.mj_forward(self.mj_model, self.mj_data)

    def move(self, left: float, right: float, steps: int) -> None:
        """Let time pass with the motors at speeds of their wheels [m/s].

        Raises:
            RobotError: MuJoCo lost the robot.
        """
        self._control[0] = left / self.radius
        self._control[1] = right / self.radius
        self._mujoco.mj_step(self.mj_model, self.mj_data, nstep=steps)
        if any(warning.number for warning in self._lost):  # then MuJoCo has reset the state
            raise RobotError(
                "The twin's physics diverged: its file needs steps of less than 5 ms. Use softer motors "
                "(motors.stiffness, motors.torque) or a heavier body."
            )

    @property
    def pose(self) -> Pose:
        """Pose of the pen; its heading is that of the body's x, within -pi..pi."""
        x, y, _, a, b, c, d = self._place[:7].tolist()
        return Pose(x, y, math.atan2(2 * (a * d + b * c), 1 - 2 * (c * c + d * d)))

    @property
    def wheels(self) -> tuple[float, float]:
        """Distance that the left and the right wheel have turned since the twin was placed [m]."""
        left, right = self._place[7:9].tolist()
        return left * self.radius, right * self.radius

    @property
    def wheel_speeds(self) -> tuple[float, float]:
        """Speeds of the left and the right wheel [m/s]."""
        left, right = self._speed[6:8].tolist()
        return left * self.radius, right * self.radius

    def look(self, x: float, y: float, directions: Floats, reach: float) -> tuple[Floats, Floats]:
        """Return the distance and the cosine of incidence at which each ray from a point of the body meets something.

        Args:
            x, y: Ahead of the pen and to the left of it [m].
            directions: (r,) directions of the rays, positive to the left of the body's x [rad].
            reach: Length of the rays [m].

        Returns:
            (r,) distances [m], `reach` if a ray meets nothing; (r,) cosines between a ray and the normal of the
            surface.
        """
        here = self.pose
        sine, cosine = math.sin(here.heading), math.cos(here.heading)
        point = np.array([here.x + cosine * x - sine * y, here.y + sine * x + cosine * y, EYE_ABOVE])
        angles = directions + here.heading
        back = float(angles.mean())
        point[:2] -= SETBACK * math.cos(back), SETBACK * math.sin(back)
        n = len(angles)
        rays = np.zeros((n, 3))
        np.cos(angles, out=rays[:, 0])
        np.sin(angles, out=rays[:, 1])
        hit, far, normal = np.empty(n, np.int32), np.empty(n), np.zeros(3 * n)
        self._mujoco.mj_multiRay(
            self.mj_model,
            self.mj_data,
            point,
            rays.ravel(),
            self._seen,
            True,
            -1,
            hit,
            far,
            normal,
            n,
            reach + SETBACK,
        )
        far = np.where(far < 0, reach, np.maximum(far - SETBACK, 0.0))
        met = far < reach
        cosines = np.where(met, np.abs((rays * normal.reshape(n, 3)).sum(axis=1)), 0.0)
        return np.where(met, far, reach), cosines
