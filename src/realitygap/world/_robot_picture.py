"""The picture of a robot from a file: outline, wheels, sensors with their reach, dimensions, and sources."""

from __future__ import annotations

import math
import textwrap

from realitygap.drawing import Disc, Ink, Line, Picture, Point, Shape, Text, picture_of

from ._pictures import dimension_line, length_text
from ._robot_model import SENSORS, LightSensor, RangeSensor, RobotModel

WIDTH = 480.0  # of the picture when its texts have their sizes [pt]
LETTERS = 104  # in a line of small text at that width
LINE_HEIGHT = 10.5  # [pt]
FARTHEST = 1.1  # how far cones are drawn at most, in lengths of the body
CONE = "#f3d9c6"
LIGHT_CONE = "#f6ecc9"
WHEEL = "#565d67"
SHELL = "#eef0f3"


@picture_of.register(RobotModel)
def model_picture(model: RobotModel) -> Picture:
    """Return a robot from above, facing right: outline, wheels, sensors and their reach, dimensions, sources.

    Args:
        model: The robot; of numbers that are drawn, the centers.
    """
    outlines = [part.outline() for part in model.body]
    xs, ys = zip(*(point for outline in outlines for point in outline), strict=True)
    back, front, low, high = min(xs), max(xs), min(ys), max(ys)
    size = _size(model)
    cut = FARTHEST * size
    shapes: list[Shape] = [_light_lobe(sensor, size) for sensor in model.light]
    shapes += [shape for sensor in model.range for shape in _cone(sensor, cut)]
    shapes += [Line(outline, None, closed=True, fill=SHELL) for outline in outlines]
    shapes += _wheels(model)
    shapes += [Line(outline, Ink.BODY, 1.6, closed=True) for outline in outlines]
    shapes += _marks(model)
    left, right, bottom, top = _around(shapes)
    pad = 0.08 * size
    bottom, left = min(bottom, low) - pad, min(left, back) - pad
    shapes += dimension_line(back, bottom, front, bottom, length_text(front - back), size=size / 0.6)
    shapes += dimension_line(left, low, left, high, length_text(high - low), size=size / 0.6)
    if model.drive.mixing == "wheels":
        half = model.drive.track / 2
        far = max(right, front) + 2 * pad
        shapes += dimension_line(
            far, -half, far, half, f"track {length_text(model.drive.track)}", size=size / 0.6
        )
        right = far
    left, right, top = left - 1.4 * pad, max(right, front) + pad, max(top, high) + pad
    return _with_words(model, shapes, left, bottom - 1.4 * pad, right, top)


def _size(model: RobotModel) -> float:
    """Return the length or width of the body, whichever is more [m]."""
    xs, ys = zip(*(point for part in model.body for point in part.outline()), strict=True)
    return float(max(max(xs) - min(xs), max(ys) - min(ys)))


def _with_words(
    model: RobotModel, shapes: list[Shape], left: float, bottom: float, right: float, top: float
) -> Picture:
    """Return the picture with the robot's name above and a legend with the sources of the numbers below."""
    wanted = (top - bottom) * 1.5
    if right - left < wanted:  # texts need some width
        more = (wanted - (right - left)) / 2
        left, right = left - more, right + more
    unit = (right - left) / WIDTH  # one point
    lines: list[tuple[str, str, str]] = [(text, color, mark) for text, color, mark in _legend(model)]
    for source in model.sources:
        wrapped = textwrap.wrap(source, LETTERS, subsequent_indent="   ")
        lines += [(text, Ink.MUTED, "") for text in wrapped]
    y = bottom - 2 * unit
    for text, color, mark in lines:
        y -= LINE_HEIGHT * unit
        if mark:
            shapes.append(Disc(left + 10 * unit, y, 2.4, color=None, fill=mark))
        shapes.append(Text(left + 18 * unit, y, text, 7.5, "start", color=color))
    top += 16 * unit
    shapes.append(Text(left + 6 * unit, top - 9 * unit, model.name, 9.0, "start", bold=True))
    return Picture(f"Robot {model.name}", _in_words(model), left, y - 8 * unit, right, top, tuple(shapes))


def _legend(model: RobotModel) -> list[tuple[str, str, str]]:
    """Return the text, the color of the text, and the color of the mark for each kind of mark."""
    rows: list[tuple[str, str, str]] = []
    if model.range:
        first = model.range[0]
        kinds = ", ".join(dict.fromkeys(sensor.response for sensor in model.range))
        cones = sorted({round(math.degrees(sensor.cone), 1) for sensor in model.range})
        cone = f", cone ±{cones[-1]:g}°" if cones[-1] else ""
        same = len({(sensor.x, sensor.y, sensor.direction) for sensor in model.range}) == 1
        where = " at one place" if same and len(model.range) > 1 else ""
        shorter = ", drawn shorter" if first.reach > FARTHEST * _size(model) else ""
        how = f"{kinds}, reach {length_text(first.reach)}{shorter}{cone}"
        rows.append((f"{_count(len(model.range), 'range sensor')}{where}: {how}", Ink.TEXT, Ink.PUBLISHED))
    for kind, sensors in model.sensors.items():
        if sensors and kind != "range":
            rows.append((_count(len(sensors), f"{kind} sensor"), Ink.TEXT, SENSORS[kind].ink))
    drive = model.drive
    if drive.mixing == "wheels":
        levels = f" in {drive.levels} levels" if drive.levels else ""
        how = f"wheels up to {drive.speed:g} m/s{levels}"
    else:
        how = f"move up to {drive.speed:g} m/s, turn up to {drive.turn_rate:g} rad/s"
    drawn = f"; {_count(len(model.vary), 'number')} drawn" if model.vary else ""
    rows.append(
        (
            f"{how}; a command lasts {model.step_s:g} s; contact: {model.contact.model}{drawn}",
            Ink.TEXT,
            Ink.OURS,
        )
    )
    return rows


def _in_words(model: RobotModel) -> str:
    legend = ". ".join(text for text, _, _ in _legend(model))
    return f"{model.name} seen from above, facing right. {model.description} {legend}."


def _count(n: int, what: str) -> str:
    return f"{n} {what}{'' if n == 1 else 's'}"


def _cone(sensor: RangeSensor, cut: float) -> list[Shape]:
    """Return the area that a range sensor covers, cut off if its reach is long."""
    reach = min(sensor.reach, cut)
    end = _polar(sensor.x, sensor.y, sensor.direction, reach)
    shapes: list[Shape] = []
    if sensor.cone:
        shapes.append(
            Line(
                _sector(sensor.x, sensor.y, sensor.direction, sensor.cone, reach),
                None,
                closed=True,
                fill=CONE,
            )
        )
    shapes.append(Line(((sensor.x, sensor.y), end), Ink.PUBLISHED, 0.9, (3.0, 1.6)))
    if reach < sensor.reach:
        shapes.append(Disc(*end, 1.1, color=None, fill=Ink.PUBLISHED))
    return shapes


def _light_lobe(sensor: LightSensor, size: float) -> Shape:
    """Return a short piece of a light sensor's lobe, in the direction that it faces."""
    lobe = _sector(sensor.x, sensor.y, sensor.direction, sensor.width, 0.16 * size)
    return Line(lobe, None, closed=True, fill=LIGHT_CONE)


def _sector(x: float, y: float, direction: float, half: float, reach: float) -> tuple[Point, ...]:
    n = max(2, math.ceil(2 * half / 0.1))
    rim = tuple(_polar(x, y, direction - half + 2 * half * k / n, reach) for k in range(n + 1))
    return ((x, y), *rim)


def _polar(x: float, y: float, angle: float, far: float) -> Point:
    return x + far * math.cos(angle), y + far * math.sin(angle)


def _wheels(model: RobotModel) -> list[Shape]:
    looks, drive = model.looks, model.drive
    shapes: list[Shape] = []
    if drive.mixing == "wheels" or looks.wheel_diameter:
        across, along = looks.wheel_width / 2, looks.wheel_diameter / 2
        for side in (1, -1):
            x, y = drive.axle, side * drive.track / 2
            rim = (
                (x + along, y + across),
                (x - along, y + across),
                (x - along, y - across),
                (x + along, y - across),
            )
            shapes.append(Line(rim, WHEEL, 0.8, closed=True, fill=WHEEL))
    if looks.caster is not None:
        shapes.append(Disc(*looks.caster, 4.0, color=None, fill=WHEEL))
    return shapes


def _marks(model: RobotModel) -> list[Shape]:
    """Return the marks of the sensors, the pen, and the center, and an arrow in the direction of move = 1."""
    forwards, _ = zip(*(point for part in model.body for point in part.outline()), strict=True)
    tip = 0.5 * max(forwards) * model.drive.ahead
    head = 0.12 * max(forwards) * model.drive.ahead
    shapes: list[Shape] = [
        Line(((0.0, 0.0), (tip, 0.0)), Ink.OURS, 1.5),
        Line(((tip - head, head * 0.6), (tip, 0.0), (tip - head, -head * 0.6)), Ink.OURS, 1.5),
        Disc(0.0, 0.0, 2.6, fill=Ink.OURS),
    ]
    if model.looks.pen is not None:
        shapes.append(Disc(*model.looks.pen, 4.6, color=Ink.OURS, fill=SHELL))
        shapes.append(Disc(*model.looks.pen, 1.6, color=None, fill=Ink.OURS))
    for kind, sensors in model.sensors.items():
        if kind != "range":
            ink = SENSORS[kind].ink
            shapes += [Disc(s.x, s.y, 2.6, color=Ink.GROUND, fill=ink, width=0.6) for s in sensors]
    shapes += [Disc(s.x, s.y, 2.0, color=Ink.GROUND, fill=Ink.PUBLISHED, width=0.5) for s in model.range]
    return shapes


def _around(shapes: list[Shape]) -> tuple[float, float, float, float]:
    """Return left, right, bottom and top of shapes that are as large as they are drawn."""
    points = [point for shape in shapes if isinstance(shape, Line) for point in shape.points]
    xs, ys = zip(*points, strict=True)
    return min(xs), max(xs), min(ys), max(ys)
