"""A driven body that meets a wall, in MuJoCo: bodies with mass, a contact that gives a little, cones of friction.

A servo pushes the body towards the motion that is commanded, harder along, across or around, or two wheels do, whose
grip gives out; a wall at y = 0 stands in its way. MuJoCo integrates forces over 2 ms; the contact `slide` of `sim`
knows neither mass nor force.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import mujoco
import numpy as np

Corners = list[tuple[float, float]]

STEP_S = 0.002
MASS = 0.9  # of an S2 with batteries, about [kg]
# What the servo answers to a deviation: along and across [N s/m], around [N m s/rad].
SERVO = np.array([40.0, 80.0, 0.16])
SIDES = 8  # of a rounded corner


class Wheels(NamedTuple):
    """Two wheels that are driven at the speeds that a commanded motion gives them, and slip on the floor."""

    arm: float = 0.0765  # of each from the middle [m]
    most: float = 2.0  # that each can push [N]
    slip: float = 0.03  # from which on it pushes hardly more [m/s]

    def push(self, along: float, across: float, around: float) -> tuple[float, float, float]:
        """Force ahead and to the left, and torque, where the body's motion is so much less than what is commanded."""
        ahead = aside = torque = 0.0
        for side in (1.0, -1.0):  # left, right
            slip = along - side * self.arm * around
            grip = self.most / math.sqrt(self.slip**2 + slip**2 + across**2)
            ahead += grip * slip
            aside += grip * across
            torque -= side * self.arm * grip * slip
        return ahead, aside, torque


class Push(NamedTuple):
    """A start before the wall y = 0, from below, and a motion that is commanded."""

    y: float  # [m]
    heading: float  # [rad]
    speed: float  # [m/s]
    turn: float  # [rad/s]
    seconds: float


def _outline(corners: Corners, radius: float) -> list[tuple[float, float]]:
    """Points around a convex polygon, counter-clockwise, whose corners are rounded."""
    points = []
    for k, (x, y) in enumerate(corners):
        normals = []
        for (x0, y0), (x1, y1) in ((corners[k - 1], (x, y)), ((x, y), corners[(k + 1) % len(corners)])):
            normals.append(math.atan2(-(x1 - x0), y1 - y0))
        turn = (normals[1] - normals[0]) % math.tau
        for j in range(SIDES + 1):
            angle = normals[0] + turn * j / SIDES
            points.append((x + radius * math.cos(angle), y + radius * math.sin(angle)))
    return points


class PushedBody:
    """A body of this outline before a wall of this friction, driven by a servo where no wheels are given."""

    def __init__(
        self, corners: Corners, radius: float, friction: float, wheels: Wheels | None = None
    ) -> None:
        self._wheels = wheels
        hull = " ".join(f"{x:.6f} {y:.6f} {z}" for z in (0.0, 0.05) for x, y in _outline(corners, radius))
        self._model = mujoco.MjModel.from_xml_string(f"""
            <mujoco>
              <option timestep="{STEP_S}" cone="elliptic" impratio="10" gravity="0 0 0" integrator="implicitfast"/>
              <asset><mesh name="hull" vertex="{hull}"/></asset>
              <worldbody>
                <geom name="wall" type="box" size="5 0.5 0.2" pos="0 0.5 0" contype="2" conaffinity="4"/>
                <body name="robot">
                  <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>
                  <geom name="hull" type="mesh" mesh="hull" mass="{MASS}" contype="4" conaffinity="2"/>
                </body>
              </worldbody>
              <contact>
                <pair geom1="hull" geom2="wall" condim="3" solref="0.004 1"
                      friction="{friction} {friction} 0.0001 0.0001 0.0001"/>
              </contact>
            </mujoco>""")
        self._data = mujoco.MjData(self._model)

    def end_of(self, push: Push) -> tuple[float, float, float]:
        """Where a push ends: x, y [m], heading [rad]."""
        data = self._data
        mujoco.mj_resetData(self._model, data)
        data.qpos[:] = 0.0, push.y, push.heading
        data.qvel[:] = push.speed * math.cos(push.heading), push.speed * math.sin(push.heading), push.turn
        for _ in range(round(push.seconds / STEP_S)):
            cos, sin = math.cos(data.qpos[2]), math.sin(data.qpos[2])
            vx, vy, turn = data.qvel
            off = np.array([push.speed - (cos * vx + sin * vy), sin * vx - cos * vy, push.turn - turn])
            along, across, around = SERVO * off if self._wheels is None else self._wheels.push(*off)
            data.qfrc_applied[:] = cos * along - sin * across, sin * along + cos * across, around
            mujoco.mj_step(self._model, data)
        x, y, heading = data.qpos
        return float(x), float(y), float(heading)
