"""An arena drawn in SVG, as the values of an arena file.

Shapes that are not filled, and lines, are walls; filled ones are obstacles. Its `data-kind`, its class, or the letters
of its id give any other kind of a shape: start, goal, light, tape, wall, obstacle or ignore.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

from realitygap.settings import shown

from ._part import why_no_part

Point = tuple[float, float]

NAMESPACE = "http://www.w3.org/2000/svg"
SVG = f"{{{NAMESPACE}}}"
UNITS = {"mm": 0.001, "cm": 0.01, "in": 0.0254, "pt": 0.0254 / 72, "pc": 0.0254 / 6}  # [m]
KINDS = ("start", "goal", "light", "tape", "wall", "obstacle", "ignore")
SILENT = ("defs", "metadata", "title", "desc", "style", "script", "namedview")  # draw nothing by themselves
SHAPES = ("line", "rect", "circle", "polyline", "polygon", "path")
ROUND = 32  # walls that stand for a circle that is not filled
SAME = 1e-9  # of lengths that should be one, relative: rounding of a drawing program's numbers
MOST_SHAPES = 5000
MOST_LETTERS = 2000  # of an attribute that is not a list of points
DEEPEST = 50  # groups in groups
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Affine:
    """An affine map of a point: x' = a x + c y + e, y' = b x + d y + f."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def __call__(self, x: float, y: float) -> Point:
        return self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f

    def after(self, first: Affine) -> Affine:
        """Return the map that applies `first` and then this one."""
        e, f = self(first.e, first.f)
        return Affine(
            self.a * first.a + self.c * first.b,
            self.b * first.a + self.d * first.b,
            self.a * first.c + self.c * first.d,
            self.b * first.c + self.d * first.d,
            e,
            f,
        )

    @property
    def scale(self) -> float:
        """Factor by which the map enlarges everything; nan if it differs between directions."""
        first, second = math.hypot(self.a, self.b), math.hypot(self.c, self.d)
        is_square = abs(self.a * self.c + self.b * self.d) <= 1e-6 * first * second
        return first if is_square and abs(first - second) <= 1e-6 * first else math.nan


@dataclass(frozen=True)
class Ink:
    """The style of an element.

    Attributes:
        place: Map from the drawing's unit to meters.
        is_filled: True if closed shapes are filled, as set by groups.
        kind: Kind of shape that a group sets.
    """

    place: Affine
    is_filled: bool = True
    kind: str | None = None


@dataclass(frozen=True)
class Shape:
    """A shape of the drawing in the arena.

    Attributes:
        tag: Tag of its element.
        kind: Kind of the shape.
        name: Name in messages.
        points: Corners, or the center [m].
        closed: True if the last corner joins the first.
        radius: Radius of a circle or of rounded corners [m].
        values: Attributes of the element.
    """

    tag: str
    kind: str
    name: str
    points: tuple[Point, ...]
    closed: bool
    radius: float
    values: dict[str, str]


def svg_values(text: str) -> dict[str, Any]:
    """Return the values of an arena file from a drawing, in meters, y upwards.

    Raises:
        ValueError: It is no drawing of a known size, or something in it cannot be used: everything, by name.
    """
    root = _root(text)
    shapes: list[Shape] = []
    problems: list[str] = []
    for element, ink in _elements(root, Ink(_to_meters(root)), 0):
        if len(shapes) + len(problems) >= MOST_SHAPES:
            raise ValueError(f"it has more than {MOST_SHAPES} shapes")
        try:
            shape = _shape(element, ink)
        except ValueError as error:
            problems.append(f"{_name(element)}: {error}")
            continue
        shapes.append(shape)
    values: dict[str, Any] = {"wall": [], "obstacle": [], "light": [], "floor": {"tape": []}}
    for shape in shapes:
        try:
            ADD[shape.kind](values, shape)
        except ValueError as error:
            problems.append(f"{shape.name}: {error}")
    if problems:
        raise ValueError("\n".join(problems))
    if "start" not in values:
        raise ValueError(
            'start: missing. Draw a line with id="start" from where trials begin to where the robot looks'
        )
    return values


def _root(text: str) -> ElementTree.Element:
    """Return the drawing; entities, which can make a small file huge, are refused."""
    declared = text.partition("<!DOCTYPE")[2].partition(">")[0]
    if "<!ENTITY" in text or "[" in declared:
        raise ValueError("it declares entities which are not read. Save it as plain SVG")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"it is not SVG: {error}") from None
    except ValueError as error:
        raise ValueError(f"it is not SVG: {error}") from None
    for element in root.iter():
        for key, value in element.attrib.items():
            if len(value) > MOST_LETTERS and key not in ("d", "points"):
                raise ValueError(f"{_name(element)}: {key[:60]} has more than {MOST_LETTERS:,} letters")
    if root.tag.removeprefix(SVG) != "svg":
        raise ValueError(f"it is not SVG: expected <svg>, got <{_tag(root)}>")
    return root


def _to_meters(root: ElementTree.Element) -> Affine:
    """Return the map from the drawing's unit, y downwards, to meters, y upwards."""
    box = _numbers(root.get("viewBox", ""))
    size = [_length(root.get(key, "")) for key in ("width", "height")]
    if len(box) != 4 or not (box[2] > 0 and box[3] > 0):
        if root.get("viewBox") is not None or root.get("data-meters-per-unit") is None:
            raise ValueError(
                f"viewBox: expected four numbers, width and height above 0, got {shown(root.get('viewBox'))}"
            )
        box = [0.0, 0.0, 0.0, 0.0]
    stated = root.get("data-meters-per-unit")
    if stated is not None:
        scale = (_numbers(stated) or [0.0])[0]
        if not scale > 0:
            raise ValueError(f"data-meters-per-unit: expected a number above 0, got {shown(stated)}")
    elif size[0] is None:
        raise ValueError(
            f"width: expected a length such as 800mm, to know how large the drawing is, got "
            f'{shown(root.get("width"))}. Or state data-meters-per-unit="0.001"'
        )
    else:
        scale = size[0] / box[2]
        if size[1] is not None and abs(size[1] / box[3] - scale) > 0.01 * scale:
            raise ValueError(
                "width and height do not fit the viewBox: one unit would not be as long across as up"
            )
    return Affine(scale, 0.0, 0.0, -scale, -box[0] * scale, (box[1] + box[3]) * scale)


def _length(text: str) -> float | None:
    """Return a length with a unit [m]."""
    match = re.fullmatch(r"\s*([-+.\deE]+?)\s*(mm|cm|in|pt|pc)\s*", text)
    numbers = _numbers(match[1]) if match else []
    return numbers[0] * UNITS[match[2]] if match and len(numbers) == 1 and numbers[0] > 0 else None


def _numbers(text: str) -> list[float]:
    return [float(part) for part in _NUMBER.findall(text)]


def _tag(element: ElementTree.Element) -> str:
    return element.tag.rpartition("}")[2] if isinstance(element.tag, str) else "?"


def _name(element: ElementTree.Element) -> str:
    own = element.get("id")
    return f"<{_tag(element)}>" if own is None else f"<{_tag(element)} id={shown(own)}>"


def _elements(parent: ElementTree.Element, ink: Ink, depth: int) -> Iterator[tuple[ElementTree.Element, Ink]]:
    """Yield the elements that draw something, each with its style."""
    if depth > DEEPEST:
        raise ValueError(f"groups lie more than {DEEPEST} deep in each other")
    for element in parent:
        tag = _tag(element)
        foreign = not isinstance(element.tag, str) or (
            element.tag.startswith("{") and not element.tag.startswith(SVG)
        )
        if foreign or tag in SILENT:
            continue
        fill = _style(element, "fill")
        here = Ink(
            ink.place.after(_transform(element)),
            ink.is_filled if fill in (None, "inherit") else fill not in ("none", "transparent"),
            _kind_stated(element) or ink.kind,
        )
        if here.kind == "ignore":
            continue
        if tag in ("g", "svg", "a"):
            yield from _elements(element, here, depth + 1)
        else:
            yield element, here


def _style(element: ElementTree.Element, key: str) -> str | None:
    """Return an attribute, also from `style`."""
    for part in element.get("style", "").split(";"):
        name, _, value = part.partition(":")
        if name.strip() == key:
            return value.strip()
    return element.get(key)


def _kind_stated(element: ElementTree.Element) -> str | None:
    own = re.match(r"[A-Za-z]*", element.get("id", ""))
    words = [element.get("data-kind", ""), *element.get("class", "").split(), own[0] if own else ""]
    return next((word.lower() for word in words if word.lower() in KINDS), None)


def _transform(element: ElementTree.Element) -> Affine:
    whole = Affine()
    for name, inside in re.findall(r"(\w+)\s*\(([^)]*)\)", element.get("transform", "")):
        n = _numbers(inside)
        if name == "matrix" and len(n) == 6:
            step = Affine(*n)
        elif name == "translate" and len(n) in (1, 2):
            step = Affine(e=n[0], f=n[1] if len(n) == 2 else 0.0)
        elif name == "scale" and len(n) in (1, 2):
            step = Affine(a=n[0], d=n[-1])
        elif name == "rotate" and len(n) in (1, 3):
            cos, sin = math.cos(math.radians(n[0])), math.sin(math.radians(n[0]))
            x, y = (n[1], n[2]) if len(n) == 3 else (0.0, 0.0)
            step = Affine(cos, sin, -sin, cos, x - cos * x + sin * y, y - sin * x - cos * y)
        else:
            raise ValueError(
                f"{_name(element)}: transform {name}({inside}) cannot be used. Expected translate, scale, rotate or "
                "matrix"
            )
        whole = whole.after(step)
    return whole


def _shape(element: ElementTree.Element, ink: Ink) -> Shape:
    """Return a shape in the arena.

    Raises:
        ValueError: It cannot be used.
    """
    tag, place = _tag(element), ink.place
    if tag not in SHAPES:
        raise ValueError(f'cannot be used. Expected {", ".join(SHAPES)}; data-kind="ignore" leaves it out')
    points, closed, radius = OUTLINES[tag](element)
    if radius and not place.scale > 0:
        raise ValueError("is round, and drawn larger one way than the other. Draw it as a polygon")
    placed = tuple(place(x, y) for x, y in points)
    if not all(math.isfinite(value) for point in placed for value in point):
        raise ValueError("its place is no finite number")
    kind = ink.kind or ("obstacle" if closed and ink.is_filled else "wall")
    grown = radius * place.scale if radius else 0.0
    return Shape(tag, kind, _name(element), placed, closed, grown, dict(element.attrib))


def _number_of(element: ElementTree.Element, key: str, default: float | None = 0.0) -> float:
    text = element.get(key)
    if text is None and default is not None:
        return default
    match = re.fullmatch(rf"\s*({_NUMBER.pattern})\s*(?:px)?\s*", text or "")
    if match is None or not math.isfinite(float(match[1])):
        raise ValueError(f"{key} is {shown(text)}, expected a number")
    return float(match[1])


def _line(element: ElementTree.Element) -> tuple[list[Point], bool, float]:
    x1, y1, x2, y2 = (_number_of(element, key) for key in ("x1", "y1", "x2", "y2"))
    return [(x1, y1), (x2, y2)], False, 0.0


def _rect(element: ElementTree.Element) -> tuple[list[Point], bool, float]:
    x, y = _number_of(element, "x"), _number_of(element, "y")
    width, height = _number_of(element, "width", None), _number_of(element, "height", None)
    if not (width > 0 and height > 0):
        raise ValueError(f"is {width:g} wide and {height:g} high, expected more than 0")
    across = _number_of(element, "rx", _number_of(element, "ry"))
    up = _number_of(element, "ry", across)
    if across != up:
        raise ValueError(f"rx is {across:g} and ry {up:g}, expected the same: corners are round")
    r = min(max(across, 0.0), width / 2, height / 2)
    inner = [(x + r, y + r), (x + width - r, y + r), (x + width - r, y + height - r), (x + r, y + height - r)]
    return list(dict.fromkeys(inner)), True, r


def _circle(element: ElementTree.Element) -> tuple[list[Point], bool, float]:
    radius = _number_of(element, "r", None)
    if not radius > 0:
        raise ValueError(f"r is {radius:g}, expected more than 0")
    return [(_number_of(element, "cx"), _number_of(element, "cy"))], True, radius


def _poly(element: ElementTree.Element) -> tuple[list[Point], bool, float]:
    numbers = _numbers(element.get("points", ""))
    if len(numbers) < 4 or len(numbers) % 2:
        raise ValueError(f"has {len(numbers)} numbers in points, expected pairs, at least two")
    points = list(zip(numbers[::2], numbers[1::2], strict=True))
    is_closed = _tag(element) == "polygon" or (len(points) > 3 and points[0] == points[-1])
    return points, is_closed, 0.0


def _path(element: ElementTree.Element) -> tuple[list[Point], bool, float]:
    """Return a path of straight pieces: M, L, H, V and Z, absolute or relative."""
    parts = re.findall(rf"[A-Za-z]|{_NUMBER.pattern}", element.get("d", ""))
    points: list[Point] = []
    x = y = 0.0
    command, k, is_closed = "", 0, False
    while k < len(parts):
        if parts[k].isalpha():
            command, k = parts[k], k + 1
            if command.lower() not in "mlhvz":
                raise ValueError(f"has a curve ({command}) in d, expected straight pieces: M, L, H, V and Z")
            if is_closed or (command.lower() == "m" and points):
                raise ValueError("has several pieces in d, expected one. Break it apart")
            if command.lower() == "z":
                is_closed = True
            continue
        takes = 1 if command.lower() in "hv" else 2
        numbers = parts[k : k + takes]
        if not command or command in "zZ" or len(numbers) < takes or any(part.isalpha() for part in numbers):
            raise ValueError(f"d is {shown(element.get('d'))}, expected M x y, then L x y and so on")
        k += takes
        is_relative = command.islower()
        if command in "hH":
            x = float(numbers[0]) + (x if is_relative else 0.0)
        elif command in "vV":
            y = float(numbers[0]) + (y if is_relative else 0.0)
        else:
            x = float(numbers[0]) + (x if is_relative else 0.0)
            y = float(numbers[1]) + (y if is_relative else 0.0)
        points.append((x, y))
        command = {"m": "l", "M": "L"}.get(command, command)
    if len(points) < 2:
        raise ValueError("has less than two points in d")
    return points, is_closed or (len(points) > 3 and points[0] == points[-1]), 0.0


OUTLINES: dict[str, Callable[[ElementTree.Element], tuple[list[Point], bool, float]]] = {
    "line": _line,
    "rect": _rect,
    "circle": _circle,
    "polyline": _poly,
    "polygon": _poly,
    "path": _path,
}


def _corners(shape: Shape) -> list[Point]:
    """Return the corners of a shape, each once and counter-clockwise if it is closed."""
    points = [point for k, point in enumerate(shape.points) if k == 0 or point != shape.points[k - 1]]
    if not shape.closed:
        return points
    if len(points) > 1 and math.dist(points[0], points[-1]) <= SAME:
        points.pop()
    twice_area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(points, [*points[1:], points[0]], strict=True))
    return points if twice_area >= 0 else points[::-1]


def _add_wall(values: dict[str, Any], shape: Shape) -> None:
    if shape.radius:
        if shape.tag != "circle":
            raise ValueError("has round corners, which only obstacles have. Fill it, or leave rx out")
        (x, y), r = shape.points[0], shape.radius
        turns = [2 * math.pi * k / ROUND for k in range(ROUND)]
        shape = replace(
            shape, points=tuple((x + r * math.cos(a), y + r * math.sin(a)) for a in turns), radius=0.0
        )
    points = _corners(shape)
    if shape.closed:
        points = [*points, points[0]]
    values["wall"] += [[*a, *b] for a, b in pairwise(points)]


def _add_obstacle(values: dict[str, Any], shape: Shape) -> None:
    points = _corners(shape)
    x, y = (sum(point[axis] for point in points) / len(points) for axis in (0, 1))
    corners = [(px - x, py - y) for px, py in points]
    problem = why_no_part(corners, shape.radius)
    if problem:
        raise ValueError(f"{problem}; or do not fill it, which makes it walls")
    values["obstacle"].append(
        {"x": x, "y": y, "corner": [list(corner) for corner in corners], "radius": shape.radius}
    )


def _middle(shape: Shape) -> Point:
    points = _corners(shape)
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)


def _add_light(values: dict[str, Any], shape: Shape) -> None:
    text = shape.values.get("data-strength", "1")
    numbers = _numbers(text)
    if len(numbers) != 1 or numbers[0] < 0:
        raise ValueError(f"data-strength is {shown(text)}, expected a number of at least 0")
    x, y = _middle(shape)
    values["light"].append({"x": x, "y": y, "strength": numbers[0]})


def _add_goal(values: dict[str, Any], shape: Shape) -> None:
    if shape.tag != "circle":
        raise ValueError("marks the goal, expected a circle")
    if "goal" in values:
        raise ValueError("marks a second goal, expected one")
    (x, y) = shape.points[0]
    values["goal"] = [x, y, shape.radius]


def _add_start(values: dict[str, Any], shape: Shape) -> None:
    if "start" in values:
        raise ValueError("marks a second start, expected one")
    x, y = shape.points[0]
    heading = 0.0
    if len(shape.points) == 2:
        heading = math.atan2(shape.points[1][1] - y, shape.points[1][0] - x)
    elif shape.tag != "circle":
        raise ValueError("marks the start, expected a line to where the robot looks, or a circle")
    values["start"] = [x, y, heading]


def _add_tape(values: dict[str, Any], shape: Shape) -> None:
    points = _corners(shape)
    if shape.radius or len(points) < 2:
        raise ValueError("is tape, expected straight lines")
    if shape.closed:
        points = [*points, points[0]]
    values["floor"]["tape"] += [[*a, *b] for a, b in pairwise(points)]


ADD: dict[str, Callable[[dict[str, Any], Shape], None]] = {
    "wall": _add_wall,
    "obstacle": _add_obstacle,
    "light": _add_light,
    "goal": _add_goal,
    "start": _add_start,
    "tape": _add_tape,
}
