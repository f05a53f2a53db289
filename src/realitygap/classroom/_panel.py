"""Panels that drive a robot by hand in a notebook: by a pad, arrow keys, or a gamepad; a world has sliders, too."""

from __future__ import annotations

import base64
import math
import threading
from collections.abc import Callable, Mapping
from functools import cache
from importlib import resources
from typing import Any

from realitygap._how_to_run import install_command
from realitygap.classroom.jyro import Camera, JyroWorld, SceneRobot
from realitygap.drawing import theme_rules, themed
from realitygap.errors import RealityGapError
from realitygap.playback import widget_class

FILES = resources.files(__package__)
"""Files of the pages of the widgets."""

HOLD_S = 0.6
"""Time without a message from the page after which a robot is stopped [s]; the page sends ten in a second."""

MOST_SPEED = 0.5
"""Speed of a robot in a world at full deflection [m/s]."""

MOST_TURN = 2.0
"""Rate of turn of a robot in a world at full deflection [rad/s]."""

_MAX_FRAMES = 10
"""Pictures of a running world in a second: as often as the page asks."""


@cache
def panel_class() -> type:
    """Return the class of the widget.

    Raises:
        RealityGapError: anywidget is not installed.
    """
    return widget_class(
        "Panel",
        f"A panel needs anywidget, which is not installed: {install_command('notebook')}. Without a notebook, "
        "drive on the page Robot of `realitygap lab`.",
        FILES.joinpath("panel.js").read_text("utf-8"),
        theme_rules(".rg-panel") + FILES.joinpath("panel.css").read_text("utf-8"),
        title="",
        svg="",
        camera="",
        clock="",
        problem="",
        robots=[],
        has_time=False,
    )


class _Panel:
    """A panel, and the answers to the messages of its page."""

    def __init__(self, title: str, **values: object) -> None:
        self.widget: Any = panel_class()(title=title, **values)
        self.widget.on_msg(self._hear)

    def _repr_mimebundle_(self, **options: object) -> object:
        return self.widget._repr_mimebundle_(**options)

    def _hear(self, _widget: object, content: Mapping[str, object], _buffers: object) -> None:
        try:
            self._obey(str(content.get("kind")), content)
            self.widget.problem = ""
        except RealityGapError as error:
            self.widget.problem = str(error)
        finally:
            self.widget.send({"kind": "heard", "n": content.get("n", 0)})

    def _obey(self, kind: str, content: Mapping[str, object]) -> None:
        raise NotImplementedError


class DrivePanel(_Panel):
    """A panel that drives a robot by hand; the robot stops if the page is silent for 0.6 s.

    The page is silent if the handle is released, if it loses the focus, or if it is closed. If the kernel itself
    ends, the guardian of the robot's driver stops the motors.

    Args:
        drive: Called with speed ahead and rate of turn to the left, -1 to 1 each, while the handle is held.
        stop: Called when it is released, and when the page is silent.
        title: The robot's name.
        picture: Function that returns an SVG of the robot after each command; None if the robot is not visible.

    Raises:
        RealityGapError: anywidget is not installed.
    """

    def __init__(
        self,
        drive: Callable[[float, float], None],
        stop: Callable[[], None],
        *,
        title: str = "Robot",
        picture: Callable[[], str] | None = None,
    ) -> None:
        self._drive, self._stop, self._picture = drive, stop, picture
        self._lock = threading.Lock()
        self._timer: threading.Timer | None = None
        super().__init__(title, svg="" if picture is None else themed(picture()))

    def _obey(self, kind: str, content: Mapping[str, object]) -> None:
        if kind == "drive":
            with self._lock:
                self._wait_again()
                self._drive(_share(content.get("ahead")), _share(content.get("turn")))
        elif kind == "release":
            self._halt()
        self._show()

    def _show(self) -> None:
        if self._picture is not None:
            self.widget.svg = themed(self._picture())

    def _wait_again(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
        self._timer = threading.Timer(HOLD_S, self._silent)
        self._timer.daemon = True
        self._timer.start()

    def _halt(self) -> None:
        with self._lock:
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
            self._stop()

    def _silent(self) -> None:
        try:
            self._halt()
        except RealityGapError as error:
            self.widget.problem = str(error)


class WorldPanel(_Panel):
    """A world of Jyro's rules with buttons to run, step, and reset it, and a pad, sliders, and a gamepad for a robot.

    Time passes only while the page asks for it, so nothing moves if the page is closed or hidden. A robot with a
    `brain` is driven by its program.

        world = JyroWorld(paper_arena())
        world.add(Pioneer(0.5, 0.3)).add(Camera())
        WorldPanel(world)

    Args:
        world: The world, with at least one robot.
        speed: Speed of a robot at full deflection [m/s].
        turn: Rate of turn at full deflection [rad/s].

    Attributes:
        robot: The robot that the panel drives, and whose camera it shows.

    Raises:
        RealityGapError: anywidget is not installed.
        ValueError: The world has no robot, or a number is not above 0.
    """

    def __init__(self, world: JyroWorld, *, speed: float = MOST_SPEED, turn: float = MOST_TURN) -> None:
        if not world.robots:
            raise ValueError(
                "The world has no robot, expected at least one. Add one: world.add(Pioneer(0.5, 0.3))."
            )
        for name, value in (("speed", speed), ("turn", turn)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value!r}, expected a number above 0.")
        self.world, self._speed, self._turn = world, speed, turn
        self.robot: SceneRobot = world.robots[0]
        names = [str(robot.name) for robot in world.robots]
        super().__init__("World", robots=names, has_time=True)
        self._show()

    def _obey(self, kind: str, content: Mapping[str, object]) -> None:
        if kind == "drive":
            self.robot.move(
                _share(content.get("ahead")) * self._speed, _share(content.get("turn")) * self._turn
            )
            return
        if kind == "release":
            self.robot.stop()
        elif kind == "run":
            self.world.step(max(1, round(1 / (_MAX_FRAMES * self.world.step_s))))
        elif kind == "step":
            self.world.step()
        elif kind == "reset":
            self.world.reset()
        elif kind == "choose":
            self.robot.stop()
            self.robot = self.world[str(content.get("robot"))]
        self._show()

    def _show(self) -> None:
        """Show the world as it is now."""
        cameras = [device for device in self.robot.devices if isinstance(device, Camera)]
        png = cameras[-1]._repr_png_() if cameras else b""
        self.widget.svg = themed(self.world.picture().to_svg())
        self.widget.camera = f"data:image/png;base64,{base64.b64encode(png).decode()}" if png else ""
        stalled = ", blocked" if self.robot.stalled else ""
        self.widget.clock = f"{self.world.time:.1f} s, step {self.world.n_steps}{stalled}"


def _share(value: object) -> float:
    """Return a deflection that a page sent, limited to -1 to 1; 0 if it is no number."""
    if isinstance(value, int | float) and math.isfinite(value):
        return min(max(float(value), -1.0), 1.0)
    return 0.0
