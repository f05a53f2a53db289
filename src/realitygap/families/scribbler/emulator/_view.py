"""A live view in the terminal: arena, robot, path, lights, and the last command."""

from __future__ import annotations

import math
from types import TracebackType

import numpy as np
from rich.console import RenderableType
from rich.live import Live
from rich.panel import Panel

from realitygap._console import plain_text
from realitygap.families.scribbler.opcodes import Op

from ._emulator import Emulator

WIDTH, HEIGHT = 72, 30  # characters of the picture at most
FRAME_WIDTH, FRAME_HEIGHT = 4, 9  # of the terminal's characters that the picture must leave free
ASPECT = 2.0  # a character is twice as high as wide
ARROWS = "→↗↑↖←↙↓↘"
NAMES = {int(op): op.name for op in Op}
DOTS = 4000  # points of the path that are drawn


class LiveView:
    """Shows an emulator while it is served; its `show` is what a server calls.

    Args:
        emulator: Whom to show.
        title: Text above the picture.
    """

    def __init__(self, emulator: Emulator, title: str) -> None:
        self._emulator, self._title = emulator, title
        self._live = Live(auto_refresh=False, transient=True)

    def show(self) -> None:
        """Draw the current picture."""
        self._live.update(self._panel(self._emulator), refresh=True)

    def _panel(self, emulator: Emulator) -> RenderableType:
        size = self._live.console.size
        room = (min(WIDTH, size.width - FRAME_WIDTH), min(HEIGHT, size.height - FRAME_HEIGHT))
        text = "\n".join([*picture(emulator, *room), "", *status(emulator)])
        return Panel(plain_text(text, no_wrap=True), title=plain_text(self._title), expand=False)

    def __enter__(self) -> LiveView:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()


def picture(emulator: Emulator, width: int = WIDTH, height: int = HEIGHT) -> list[str]:
    """Draw the arena from above in at most `width` x `height` characters.

    It shows walls, obstacles #, the pen's path ·, and an arrow for the robot.
    """
    width, height = max(10, width), max(5, height)
    arena = emulator.scene.arena
    path = emulator.path()
    outlines = [obstacle.outline() for obstacle in arena.obstacles]
    sides = [(*a, *b) for line in outlines for a, b in zip(line, (*line[1:], line[0]), strict=True)]
    walls = np.array([*arena.walls, *sides], dtype=float).reshape(-1, 4)
    grid = arena.grid
    xs = np.concatenate([walls[:, 0], walls[:, 2], [grid.x, grid.right_end]])
    ys = np.concatenate([walls[:, 1], walls[:, 3], [grid.y, grid.upper_end]])
    left, low = float(xs.min()), float(ys.min())
    wide, deep = max(float(np.ptp(xs)), 1e-6), max(float(np.ptp(ys)), 1e-6)
    scale = min((width - 1) / wide, ASPECT * (height - 1) / deep)  # characters in a meter
    width, height = round(wide * scale) + 1, round(deep * scale / ASPECT) + 1
    canvas = np.full((height, width), " ")

    def put(x: np.ndarray, y: np.ndarray, mark: str) -> None:
        column = np.rint((x - left) * scale).astype(int)
        row = height - 1 - np.rint((y - low) * scale / ASPECT).astype(int)
        seen = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        canvas[row[seen], column[seen]] = mark

    put(path[-DOTS:, 1], path[-DOTS:, 2], "·")
    share = np.linspace(0, 1, 4 * (width + height))[:, None]
    put(
        (walls[:, 0] + share * (walls[:, 2] - walls[:, 0])).ravel(),
        (walls[:, 1] + share * (walls[:, 3] - walls[:, 1])).ravel(),
        "#",
    )
    pose = emulator.pose
    arrow = ARROWS[round(pose.heading / (math.pi / 4)) % 8]
    put(np.array([pose.x]), np.array([pose.y]), arrow)
    return ["".join(line).rstrip() for line in canvas]


def status(emulator: Emulator) -> list[str]:
    """Describe the robot's present state in a few lines."""
    pose = emulator.pose
    left, right = emulator.wheel_speeds()
    lights = emulator.robot.leds(emulator.now_ns)
    leds = "".join("●" if light else "○" for light in lights)
    volts = emulator.battery.volts(emulator.table.motors.load)
    lines = [
        f"x {pose.x:6.3f} m   y {pose.y:6.3f} m   heading {math.degrees(pose.heading) % 360:5.1f}°"
        f"   wheels {left:+.3f} {right:+.3f} m/s{'   stalled' if emulator.table.stalled else ''}",
        f"LEDs {leds}   battery {volts:.2f} V   {len(emulator.cells())} cells   {emulator.now:.1f} s",
        f"last command {describe(emulator.robot.last_command)}",
    ]
    fluke = emulator.fluke
    if fluke is not None:
        ahead = "Fluke" if emulator.fluke_ahead else "Scribbler"
        front = "on" if fluke.front_led else "off"
        lines.insert(
            2, f"{ahead} ahead   front LED {front}   back LED {fluke.back_led}   IR power {fluke.ir_power}"
        )
    if emulator.is_overloaded:
        lines.append("over-current: it answers nothing until a reset")
    if emulator.robot.tone is not None:
        lines.append(f"♪ {emulator.robot.tone[0]} Hz")
    if not emulator.is_connected:
        lines.append("the link is away")
    return lines


def describe(packet: bytes) -> str:
    """Return a command in words: its name and its bytes."""
    if not packet:
        return "none"
    return f"{NAMES.get(packet[0], 'unknown')} {' '.join(map(str, packet))}"
