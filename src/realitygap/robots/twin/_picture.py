"""The picture of a twin from above, to scale, as plain shapes."""

from __future__ import annotations

import math

from realitygap.drawing import Disc, Ink, Line, Picture, Point, Shape, Text
from realitygap.world import dimension_line, length_text, rounded

from ._ir import places_of
from ._model import TwinModel
from ._shape import WHEEL_WIDTH, shell_of

SHELL, WHEEL, CONE = "#eef0f3", "#565d67", "#f3d9c6"
PAD = 0.03  # [m]


def outline_of(model: TwinModel) -> tuple[Point, ...]:
    """Return points around the outline that meets walls, x and y [m], (b, 2)."""
    return rounded(*shell_of(model))


def twin_picture(model: TwinModel) -> Picture:
    """Return a twin from above, facing right: shell, wheels, caster, pen, and the cones of its infrared."""
    outline = outline_of(model)
    xs, ys = zip(*outline, strict=True)
    back, front, low, high = min(xs), max(xs), min(ys), max(ys)
    wheels, ir = model.wheels, model.ir
    shapes: list[Shape] = [
        shape
        for place, mount in zip(places_of(model), ir.mount, strict=True)
        for shape in _cone(place, mount.direction, ir.cone, ir.half)
    ]
    shapes.append(Line(outline, Ink.BODY, 1.6, closed=True, fill=SHELL))
    shapes += [_wheel(model, side) for side in (1, -1)]
    shapes.append(Disc(wheels.caster, 0.0, 2.4, fill=WHEEL))
    shapes.append(Disc(0.0, 0.0, 2.8, fill=Ink.OURS))
    far = max(front, *(x + ir.half for x, _ in places_of(model))) + PAD
    shapes += dimension_line(back, low - PAD, front, low - PAD, length_text(front - back))
    shapes += dimension_line(back - PAD, low, back - PAD, high, length_text(high - low))
    half = wheels.track / 2
    shapes += dimension_line(far, -half, far, half, f"track {length_text(wheels.track)}")
    words = (
        f"{model.name} (TWIN)",
        f"half the pulses come back from {length_text(ir.half)}; {model.body.mass:g} kg",
    )
    for k, text in enumerate(words):
        shapes.append(Text(back, high + PAD * (1.4 - 0.6 * k), text, 8.0 - k, "start", bold=not k))
    size = f"{length_text(front - back)} long, {length_text(high - low)} wide"
    said = f"{words[0]} from above, facing right: {size}; {words[1]}."
    return Picture(
        f"Twin {model.name}",
        said,
        back - 4 * PAD,
        low - 3 * PAD,
        far + 4 * PAD,
        high + 3 * PAD,
        tuple(shapes),
    )


def _wheel(model: TwinModel, side: int) -> Shape:
    wheels = model.wheels
    left, long, wide = side * wheels.track / 2, wheels.diameter / 2, WHEEL_WIDTH / 2
    corners = ((long, wide), (-long, wide), (-long, -wide), (long, -wide))
    return Line(tuple((wheels.axle + x, left + y) for x, y in corners), None, closed=True, fill=WHEEL)


def _cone(place: Point, direction: float, half_angle: float, reach: float) -> list[Shape]:
    def at(angle: float) -> Point:
        return place[0] + reach * math.cos(angle), place[1] + reach * math.sin(angle)

    edge = tuple(at(direction + half_angle * k / 6) for k in range(-6, 7))
    return [
        Line((place, *edge), None, closed=True, fill=CONE),
        Line((place, at(direction)), Ink.PUBLISHED, 0.9, (3.0, 1.6)),
    ]
