"""Pictures of a twin in its arena, drawn by MuJoCo, if this machine can draw without a screen."""

from __future__ import annotations

import contextlib
import math
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import RobotError, from_extra
from realitygap.world import Arena, Pose

from ._model import TwinModel
from ._physics import Physics
from ._shape import DRAWN, FLOOR, WALL

DRIVERS = ("mujoco.egl", "mujoco.osmesa")
FIELD = math.radians(45)  # of view, up and down: MuJoCo's
TILT = 58.0  # of the camera, down from level [deg]


class TwinCamera(ClosedOnExit):
    """Looks down on an arena, and draws a twin in it.

    Args:
        model: The twin.
        arena: Arena of the robot.
        width, height: Size of pictures [px].

    Raises:
        MissingExtraError: MuJoCo is not installed.
        RobotError: This machine has no library that draws without a screen.
    """

    def __init__(self, model: TwinModel, arena: Arena, width: int, height: int) -> None:
        self._mujoco = from_extra("mujoco", "twin")
        self._physics = Physics(model, arena)
        self.width, self.height = width, height
        self._context = _off_screen(width, height)
        mj = self._mujoco
        self._scene = mj.MjvScene(self._physics.mj_model, maxgeom=2000)
        self._option = mj.MjvOption()
        self._option.geomgroup[:] = 0
        self._option.geomgroup[[WALL, FLOOR, DRAWN]] = 1
        self._view = mj.MjvCamera()
        self._aim(arena)
        with contextlib.ExitStack() as stack:
            stack.callback(self._context.free)
            self._drawer = mj.MjrContext(self._physics.mj_model, mj.mjtFontScale.mjFONTSCALE_100)
            mj.mjr_resizeOffscreen(width, height, self._drawer)
            mj.mjr_setBuffer(mj.mjtFramebuffer.mjFB_OFFSCREEN, self._drawer)
            stack.pop_all()

    def _aim(self, arena: Arena) -> None:
        """Move the camera so that the whole arena is in view."""
        segments = np.array(arena.segments or [(0.0, 0.0, 1.0, 1.0)])
        xs, ys = segments[:, [0, 2]], segments[:, [1, 3]]
        across, up = float(np.ptp(xs)), float(np.ptp(ys))
        wide = 2 * math.atan(math.tan(FIELD / 2) * self.width / self.height)
        view = self._view
        view.lookat[:] = (xs.min() + across / 2, ys.min() + up / 2, 0.0)
        view.azimuth, view.elevation = 90.0, -TILT
        view.distance = 1.15 * max(across / 2 / math.tan(wide / 2), up / 2 / math.tan(FIELD / 2)) + up / 4

    def picture(self, pose: Pose) -> NDArray[np.uint8]:
        """Return the picture of the twin at a pose, in red, green and blue, (height, width, 3)."""
        mj, physics = self._mujoco, self._physics
        physics.stand(pose)
        mj.mjv_updateScene(
            physics.mj_model,
            physics.mj_data,
            self._option,
            None,
            self._view,
            mj.mjtCatBit.mjCAT_ALL,
            self._scene,
        )
        seen = mj.MjrRect(0, 0, self.width, self.height)
        mj.mjr_render(seen, self._scene, self._drawer)
        pixels = np.empty((self.height, self.width, 3), np.uint8)
        mj.mjr_readPixels(pixels, None, seen, self._drawer)
        return pixels[::-1]

    def close(self) -> None:
        """Let go of the drawing library; safe to call twice."""
        if self._context is not None:
            self._drawer.free()
            self._context.free()
            self._context = None


def _off_screen(width: int, height: int) -> Any:
    """Return something to draw on that is no screen."""
    for driver in DRIVERS:
        with contextlib.suppress(Exception):  # each driver fails in its own way if its library is missing
            context = import_module(driver).GLContext(width, height)
            context.make_current()
            return context
    raise RobotError(
        "This machine cannot draw in three dimensions without a screen: neither EGL (Debian: libegl1) nor "
        "OSMesa (libosmesa6) is installed. Use the view from above."
    )
