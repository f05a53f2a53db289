"""Windows to draw in, as in the courses' chapters on graphics: shapes that a notebook or the browser shows."""

from __future__ import annotations

import copy
import html
import math
from base64 import b64encode
from collections.abc import Sequence
from typing import Self

from ._colors import HasColor, has_color
from ._mistakes import MyroError, number, whole
from ._pictures import Picture
from ._show import show_markup

_LARGEST = 10_000  # [pixels] along a side of a window


class GraphWin:
    """A window of pixels, (0, 0) at the upper left, in which shapes are drawn; shown again after each change.

    Args:
        title: Title of the window. It replaces a window of the same title.
        width, height: [pixels].
        autoflush: Ignored, because each change is shown immediately.
    """

    def __init__(
        self, title: str = "Graphics Window", width: int = 200, height: int = 200, autoflush: bool = False
    ) -> None:
        self.title = title
        self.width = whole("GraphWin: the width", width, 1, _LARGEST)
        self.height = whole("GraphWin: the height", height, 1, _LARGEST)
        self.background = "white"
        self.items: list[GraphicsObject] = []
        self._corners = (0.0, 0.0, float(self.width), float(self.height), False)
        self._closed = False
        _windows[title] = _windows["default"] = self
        self.redraw()

    def _repr_svg_(self) -> str:
        return self.to_svg()

    def setBackground(self, color: str | HasColor) -> None:
        """Set the color behind the shapes."""
        self.background = _color(color)
        self.redraw()

    def setCoords(self, x1: float, y1: float, x2: float, y2: float) -> None:
        """Let coordinates run from (x1, y1) at the lower left to (x2, y2) at the upper right.

        Raises:
            MyroError: They span no area.
        """
        if x1 == x2 or y1 == y2:
            raise MyroError(
                f"setCoords: the corners are ({x1}, {y1}) and ({x2}, {y2}), expected corners that span an area."
            )
        self._corners = (x1, y1, x2, y2, True)
        self.redraw()

    def toScreen(self, x: float, y: float) -> tuple[float, float]:
        """Return pixels from coordinates."""
        x1, y1, x2, y2, upwards = self._corners
        down = (y2 - y) / (y2 - y1) if upwards else (y - y1) / (y2 - y1)
        return (x - x1) / (x2 - x1) * self.width, down * self.height

    def plot(self, x: float, y: float, color: str | HasColor = "black") -> None:
        """Draw a point."""
        point = Point(x, y)
        point.setFill(color)
        point.draw(self)

    plotPixel = plot

    def getMouse(self) -> Point:
        """Ask in the terminal for the place of a click. Differs: Myro waits for a click into the window."""
        while True:
            given = input(f"Click in {self.title!r}: x y = ").replace(",", " ").split()
            try:
                x, y = map(float, given)
                return Point(x, y)
            except ValueError:
                print(f"{' '.join(given)!r} is no place, expected two numbers as 100 50.")

    def checkMouse(self) -> Point | None:
        """Return None, because no click can reach a program here."""
        return None

    def getHeight(self) -> int:
        """Return its height [pixels]."""
        return self.height

    def getWidth(self) -> int:
        """Return its width [pixels]."""
        return self.width

    def close(self) -> None:
        """Draw nothing more."""
        self._closed = True

    def isClosed(self) -> bool:
        """Return whether it was closed."""
        return self._closed

    def setStatus(self, text: str = "") -> None:
        """Print a line that Myro shows at the bottom of its windows."""
        print(text)

    def redraw(self) -> None:
        """Show the window with what is drawn in it."""
        if self._closed:
            raise MyroError(f"The window {self.title!r} was closed; make a new one with GraphWin(...).")
        show_markup(self.title, self.to_svg())

    flush = redraw

    def to_svg(self) -> str:
        """Return the window as SVG."""
        shapes = "".join(item._svg(self) for item in self.items)
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{self.width}" height="{self.height}" role="img" '
            f'aria-label="{html.escape(self.title)}"><rect width="100%" height="100%" fill="{self.background}"/>'
            f"{shapes}</svg>"
        )


_windows: dict[str, GraphWin] = {}


class GraphicsObject:
    """A shape with an outline, a fill and a width of its lines; shown once it was drawn into a window."""

    _fill: str | None = None

    def __init__(self, *points: Point) -> None:
        for point in points:
            if not isinstance(point, Point):
                raise MyroError(f"{type(self).__name__} was given {point!r}, expected a Point(x, y).")
        self.points = [point.clone() for point in points]
        self.outline = "black"
        self.line_width = 1.0
        self.window: GraphWin | None = None

    def setFill(self, color: str | HasColor) -> None:
        """Set the color inside: a name as "red", text as "#ff8000" or makeColor(255, 128, 0)."""
        self._fill = _color(color)
        self._changed()

    def setOutline(self, color: str | HasColor) -> None:
        """Set the color of the outline."""
        self.outline = _color(color)
        self._changed()

    def setWidth(self, width: float) -> None:
        """Set the width of the lines [pixels]."""
        self.line_width = number("setWidth: the width", width, 0)
        self._changed()

    def draw(self, graphwin: GraphWin | None = None) -> None:
        """Draw it into a window. Default: the newest one.

        Raises:
            MyroError: It is drawn already, or there is no window.
        """
        if self.window is not None:
            raise MyroError(
                f"This {type(self).__name__} is drawn already; undraw() it first, or draw a clone()."
            )
        self.window = graphwin if graphwin is not None else getWindow()
        self.window.items.append(self)
        self.window.redraw()

    def undraw(self) -> None:
        """Take it out of its window."""
        if self.window is not None:
            window, self.window = self.window, None
            window.items = [item for item in window.items if item is not self]
            window.redraw()

    def move(self, dx: float, dy: float) -> None:
        """Move it by so much."""
        for point in self.points:
            point.x, point.y = point.x + number("move: dx", dx), point.y + number("move: dy", dy)
        self._changed()

    def clone(self) -> Self:
        """Return a copy that is not drawn."""
        other = copy.copy(self)
        other.points = [point.clone() for point in self.points]
        other.window = None
        return other

    def getCenter(self) -> Point:
        """Return the middle of its first and its last point."""
        first, last = self.points[0], self.points[-1]
        return Point((first.x + last.x) / 2, (first.y + last.y) / 2)

    def getP1(self) -> Point:
        """Return its first point."""
        return self.points[0].clone()

    def getP2(self) -> Point:
        """Return its last point."""
        return self.points[-1].clone()

    def _changed(self) -> None:
        if self.window is not None:
            self.window.redraw()

    def _style(self) -> str:
        return f'fill="{self._fill or "none"}" stroke="{self.outline}" stroke-width="{self.line_width:g}"'

    def _on(self, window: GraphWin) -> list[tuple[float, float]]:
        return [window.toScreen(point.x, point.y) for point in self.points]

    def _svg(self, window: GraphWin) -> str:
        raise NotImplementedError


class Point(GraphicsObject):
    """A place, and a pixel there once drawn."""

    def __init__(self, x: float, y: float) -> None:
        super().__init__()
        self.x, self.y = number("Point: x", x), number("Point: y", y)

    def __repr__(self) -> str:
        return f"Point({self.x:g}, {self.y:g})"

    def getX(self) -> float:
        """Return its x."""
        return self.x

    def getY(self) -> float:
        """Return its y."""
        return self.y

    def getCenter(self) -> Point:
        """Return itself."""
        return self.clone()

    getP1 = getP2 = getCenter

    def move(self, dx: float, dy: float) -> None:
        """Move it by so much."""
        self.x, self.y = self.x + number("move: dx", dx), self.y + number("move: dy", dy)
        self._changed()

    def _svg(self, window: GraphWin) -> str:
        x, y = window.toScreen(self.x, self.y)
        return f'<rect x="{x:g}" y="{y:g}" width="1" height="1" fill="{self._fill or self.outline}"/>'


class Line(GraphicsObject):
    """A straight line between two points."""

    arrow = "none"

    def __init__(self, p1: Point, p2: Point) -> None:
        super().__init__(p1, p2)

    def setArrow(self, option: str) -> None:
        """Put an arrow on its "first" or "last" end, on "both" or on "none"."""
        if option not in ("first", "last", "both", "none"):
            raise MyroError(
                f"setArrow: the option is {option!r}, expected 'first', 'last', 'both' or 'none'."
            )
        self.arrow = option
        self._changed()

    def _svg(self, window: GraphWin) -> str:
        ends = self._on(window)
        (x1, y1), (x2, y2) = ends
        color = self._fill or self.outline
        away = {"none": [], "first": [ends[::-1]], "last": [ends], "both": [ends, ends[::-1]]}[self.arrow]
        tips = "".join(_tip(tail, head, 6 + 2 * self.line_width, color) for tail, head in away)
        return (
            f'<line x1="{x1:g}" y1="{y1:g}" x2="{x2:g}" y2="{y2:g}" stroke="{color}" '
            f'stroke-width="{self.line_width:g}"/>{tips}'
        )


class Rectangle(GraphicsObject):
    """A rectangle between two opposite corners."""

    def __init__(self, p1: Point, p2: Point) -> None:
        super().__init__(p1, p2)

    def _box(self, window: GraphWin) -> tuple[float, float, float, float]:
        (x1, y1), (x2, y2) = self._on(window)
        return min(x1, x2), min(y1, y2), abs(x2 - x1), abs(y2 - y1)

    def _svg(self, window: GraphWin) -> str:
        x, y, width, height = self._box(window)
        return f'<rect x="{x:g}" y="{y:g}" width="{width:g}" height="{height:g}" {self._style()}/>'


class Oval(Rectangle):
    """An ellipse that fills the rectangle between two opposite corners."""

    def _svg(self, window: GraphWin) -> str:
        x, y, width, height = self._box(window)
        return (
            f'<ellipse cx="{x + width / 2:g}" cy="{y + height / 2:g}" rx="{width / 2:g}" ry="{height / 2:g}" '
            f"{self._style()}/>"
        )


class Circle(Oval):
    """A circle around a point."""

    def __init__(self, center: Point, radius: float) -> None:
        self.radius = number("Circle: the radius", radius, 0)
        GraphicsObject.__init__(self, center)
        x, y = center.x, center.y
        self.points = [Point(x - self.radius, y - self.radius), Point(x + self.radius, y + self.radius)]

    def getRadius(self) -> float:
        """Return its radius."""
        return self.radius


class Polygon(GraphicsObject):
    """A shape with three or more corners, given one by one or as a list."""

    def __init__(self, *points: Point | Sequence[Point]) -> None:
        corners = points[0] if len(points) == 1 and isinstance(points[0], Sequence) else points
        if len(corners) < 3:
            raise MyroError(f"Polygon was given {len(corners)} points, expected three or more.")
        super().__init__(*corners)

    def getPoints(self) -> list[Point]:
        """Return its corners."""
        return [point.clone() for point in self.points]

    def _svg(self, window: GraphWin) -> str:
        corners = " ".join(f"{x:g},{y:g}" for x, y in self._on(window))
        return f'<polygon points="{corners}" {self._style()}/>'


class Text(GraphicsObject):
    """A line of text around a point."""

    _FACES = ("arial", "courier", "helvetica", "times roman")

    def __init__(self, p: Point, text: object) -> None:
        super().__init__(p)
        self.text = str(text)
        self.face, self.size, self.style = "helvetica", 12.0, "normal"

    def setText(self, text: object) -> None:
        """Change the text."""
        self.text = str(text)
        self._changed()

    def getText(self) -> str:
        """Return the text."""
        return self.text

    def getAnchor(self) -> Point:
        """Return the point in its middle."""
        return self.points[0].clone()

    def setFace(self, face: str) -> None:
        """Set its letters: "helvetica", "arial", "courier" or "times roman"."""
        if face not in self._FACES:
            raise MyroError(f"setFace: the face is {face!r}, expected one of {', '.join(self._FACES)}.")
        self.face = face
        self._changed()

    def setSize(self, size: float) -> None:
        """Set the size of its letters, 5 to 36 [points]."""
        self.size = number("setSize: the size", size, 5, 36)
        self._changed()

    def setStyle(self, style: str) -> None:
        """Set its style: "normal", "bold", "italic" or "bold italic"."""
        if style not in ("normal", "bold", "italic", "bold italic"):
            raise MyroError(
                f"setStyle: the style is {style!r}, expected 'normal', 'bold', 'italic' or 'bold italic'."
            )
        self.style = style
        self._changed()

    def setTextColor(self, color: str | HasColor) -> None:
        """Set the color of its letters."""
        self.setFill(color)

    def _svg(self, window: GraphWin) -> str:
        ((x, y),) = self._on(window)
        return (
            f'<text x="{x:g}" y="{y:g}" dy="0.35em" text-anchor="middle" fill="{self._fill or self.outline}" '
            f'style="font: {self.style} {self.size:g}pt {self.face.replace("times roman", "serif")}">'
            f"{html.escape(self.text)}</text>"
        )


class Image(GraphicsObject):
    """A picture around a point: from a file, or one that a program made."""

    def __init__(self, p: Point, picture: Picture | str) -> None:
        super().__init__(p)
        self.picture = picture if isinstance(picture, Picture) else Picture(picture)

    def getAnchor(self) -> Point:
        """Return the point in its middle."""
        return self.points[0].clone()

    def _svg(self, window: GraphWin) -> str:
        ((x, y),) = self._on(window)
        width, height = self.picture.width, self.picture.height
        source = b64encode(self.picture.png()).decode()
        return (
            f'<image x="{x - width / 2:g}" y="{y - height / 2:g}" width="{width}" height="{height}" '
            f'href="data:image/png;base64,{source}"/>'
        )


def _tip(tail: tuple[float, float], head: tuple[float, float], size: float, color: str) -> str:
    """Return the tip of an arrow from tail to head."""
    length = math.dist(tail, head) or 1.0
    along = ((head[0] - tail[0]) / length * size, (head[1] - tail[1]) / length * size)
    wings = [
        (head[0] - along[0] - side * along[1], head[1] - along[1] + side * along[0]) for side in (0.4, -0.4)
    ]
    corners = " ".join(f"{x:g},{y:g}" for x, y in (head, *wings))
    return f'<polygon points="{corners}" fill="{color}"/>'


def _color(color: str | HasColor) -> str:
    """Return a color as SVG has it, from a name, from text as "#ff8000", or from a color of Myro."""
    if has_color(color):
        return "#{:02x}{:02x}{:02x}".format(*color.getRGB())
    if not isinstance(color, str) or not color.lstrip("#").isalnum():
        raise MyroError(
            f"The color is {color!r}, expected a name as 'red', text as '#ff8000' or makeColor(255, 128, 0)."
        )
    return color


def getWindow(name: str = "default") -> GraphWin:
    """Return the window of a title. Default: the newest one.

    Raises:
        MyroError: There is none.
    """
    if name not in _windows:
        raise MyroError(f"There is no window {name!r} yet. Make one with GraphWin({name!r}, 400, 300).")
    return _windows[name]


def draw(obj: GraphicsObject, win: GraphWin | None = None) -> None:
    """Draw a shape into a window. Default: the newest one."""
    obj.draw(win)


def undraw(obj: GraphicsObject) -> None:
    """Take a shape out of its window."""
    obj.undraw()


def distance(tuple1: Sequence[float], tuple2: Sequence[float]) -> float:
    """Return the distance between two points that are given as lists of numbers."""
    return float(sum((a - b) ** 2 for a, b in zip(tuple1, tuple2, strict=True)) ** 0.5)


makeWindow = GraphWin
makePoint = Point
makeLine = Line
makeRectangle = Rectangle
makeOval = Oval
makeCircle = Circle
makePolygon = Polygon
makeText = Text
makeImage = Image
