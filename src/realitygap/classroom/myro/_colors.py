"""Colors, and the color spaces that Myro's courses know."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from typing import Protocol, TypeGuard

from ._mistakes import MyroError, number, whole

Rgb = tuple[int, int, int]
Rgba = tuple[int, int, int, int]


class HasColor(Protocol):
    """A pixel or a color."""

    def getRGB(self) -> Rgb: ...

    def getRGBA(self) -> Rgba: ...


class Color:
    """A color of four parts, each 0 to 255: red, green, blue and alpha (255 is opaque).

    Made from three or four numbers, a list of them, another color, or text as "#ff8000". Parts are limited to 0..255.

    Raises:
        MyroError: It was given something else.
    """

    __slots__ = ("alpha", "rgb")

    def __init__(self, *rgb: float | str | Sequence[float] | HasColor) -> None:
        parts = _parts(rgb)
        self.rgb: Rgb = (_channel(parts[0]), _channel(parts[1]), _channel(parts[2]))
        self.alpha = _channel(parts[3]) if len(parts) == 4 else 255

    def __repr__(self) -> str:
        red, green, blue = self.rgb
        return f"<Color instance (r={red}, g={green}, b={blue}, a={self.alpha})>"

    def __eq__(self, other: object) -> bool:
        return self.getRGBA() == other.getRGBA() if has_color(other) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.getRGBA())

    def __add__(self, other: HasColor) -> Color:
        return Color(*(mine + theirs for mine, theirs in zip(self.getRGB(), other.getRGB(), strict=True)))

    def __sub__(self, other: HasColor) -> Color:
        return Color(*(mine - theirs for mine, theirs in zip(self.getRGB(), other.getRGB(), strict=True)))

    def getColor(self) -> Color:
        """Return a copy of the color."""
        return Color(*self.getRGBA())

    def setColor(self, color: HasColor) -> None:
        """Become another color."""
        self.setRGBA(color.getRGBA())

    def getRGB(self) -> Rgb:
        """Return red, green and blue, each 0 to 255."""
        return self.rgb

    def setRGB(self, rgb: Sequence[float]) -> None:
        """Set red, green and blue, each 0 to 255."""
        self.rgb = Color(rgb).rgb

    def getRGBA(self) -> Rgba:
        """Return red, green, blue and alpha, each 0 to 255."""
        return (*self.rgb, self.alpha)

    def setRGBA(self, rgba: Sequence[float]) -> None:
        """Set red, green, blue and alpha, each 0 to 255."""
        new = Color(rgba)
        self.rgb, self.alpha = new.rgb, new.alpha

    def getAlpha(self) -> int:
        """Return the opacity of the color, 0 to 255."""
        return self.alpha

    def setAlpha(self, value: float) -> None:
        """Set how opaque the color is, 0 to 255."""
        self.alpha = _channel(value)

    def makeLighter(self) -> None:
        """Move each part by 35 % towards white."""
        self.rgb = lighter(self.rgb)

    def makeDarker(self) -> None:
        """Leave 65 % of each part."""
        self.rgb = darker(self.rgb)


def _parts(rgb: Sequence[object]) -> Sequence[object]:
    if len(rgb) == 1:
        (only,) = rgb
        if isinstance(only, str):
            return _from_text(only)
        if has_color(only):
            return only.getRGBA()
        rgb = tuple(only) if isinstance(only, Sequence) else rgb
    if len(rgb) not in (3, 4):
        raise MyroError(
            f"A color was made from {rgb!r}, expected red, green and blue from 0 to 255, as makeColor(255, 128, 0)."
        )
    return rgb


def has_color(value: object) -> TypeGuard[HasColor]:
    """Return whether something is a pixel or a color."""
    return hasattr(value, "getRGBA")


def _from_text(text: str) -> tuple[int, ...]:
    digits = text.strip().removeprefix("#")
    try:
        if len(digits) != 6:
            raise ValueError
        return tuple(bytes.fromhex(digits))
    except ValueError:
        raise MyroError(f"{text!r} is no color, expected text as '#ff8000'.") from None


def _channel(value: object) -> int:
    if type(value) is int:  # by far the most common, in loops over a million pixels
        return 0 if value < 0 else 255 if value > 255 else value
    return int(min(max(number("A part of a color", value), 0.0), 255.0))


def lighter(rgb: Rgb) -> Rgb:
    """Return red, green and blue, each moved by 35 % towards 255."""
    red, green, blue = (int((255 - part) * 0.35 + part) for part in rgb)
    return (red, green, blue)


def darker(rgb: Rgb) -> Rgb:
    """Return 65 % of red, green and blue."""
    red, green, blue = (int(part * 0.65) for part in rgb)
    return (red, green, blue)


black = Color(0, 0, 0)
white = Color(255, 255, 255)
blue = Color(0, 0, 255)
red = Color(255, 0, 0)
green = Color(0, 255, 0)
gray = Color(128, 128, 128)
darkGray = Color(64, 64, 64)
lightGray = Color(192, 192, 192)
yellow = Color(255, 255, 0)
pink = Color(255, 175, 175)
magenta = Color(255, 0, 255)
cyan = Color(0, 255, 255)


def makeColor(red: float, green: float, blue: float, alpha: float = 255) -> Color:
    """Return a color from red, green and blue, each 0 to 255, perhaps see-through (alpha 0 to 255).

    Raises:
        MyroError: A part is not a number.
    """
    return Color(red, green, blue, alpha)


def color_rgb(r: int, g: int, b: int) -> str:
    """Return the color as text for graphics: `color_rgb(255, 128, 0)` is "#ff8000".

    Raises:
        MyroError: A part is not a whole number from 0 to 255.
    """
    parts = (whole(f"color_rgb: {name}", part, 0, 255) for name, part in (("r", r), ("g", g), ("b", b)))
    return "#" + "".join(f"{part:02x}" for part in parts)


def rgb_color(color: str) -> tuple[int, int, int]:
    """Return red, green and blue from text as "#ff8000".

    Raises:
        MyroError: It is no such text.
    """
    return Color(color).rgb


def rgb2hsv(red: float, green: float, blue: float) -> tuple[float, float, float]:
    """Return the hue, saturation and value; hue and saturation 0 to 1, value in the unit of red, green and blue."""
    return colorsys.rgb_to_hsv(red, green, blue)


def hsv2rgb(h: float, s: float, v: float) -> tuple[float, float, float]:
    """Return red, green and blue from hue and saturation (0 to 1) and value, in the unit of the value."""
    return colorsys.hsv_to_rgb(h, s, v)


def rgb2hls(red: float, green: float, blue: float) -> tuple[float, float, float]:
    """Return the hue, lightness and saturation, from red, green and blue of 0 to 1."""
    return colorsys.rgb_to_hls(red, green, blue)


def hls2rgb(h: float, l: float, s: float) -> tuple[float, float, float]:  # noqa: E741
    """Return red, green and blue of 0 to 1, from hue, lightness and saturation."""
    return colorsys.hls_to_rgb(h, l, s)


def rgb2yiq(red: float, green: float, blue: float) -> tuple[float, float, float]:
    """Return Y, I and Q, from red, green and blue of 0 to 1."""
    return colorsys.rgb_to_yiq(red, green, blue)


def yiq2rgb(y: float, i: float, q: float) -> tuple[float, float, float]:
    """Return red, green and blue of 0 to 1, from Y, I and Q."""
    return colorsys.yiq_to_rgb(y, i, q)


def rgb2yuv(R: float, G: float, B: float) -> list[int]:
    """Return [Y, U, V], each 0 to 255, from red, green and blue of 0 to 255: what `configureBlob` compares with."""
    return [
        _channel(0.299 * R + 0.587 * G + 0.114 * B),
        _channel(-0.14713 * R - 0.28886 * G + 0.436 * B + 128),
        _channel(0.615 * R - 0.51499 * G - 0.10001 * B + 128),
    ]


def yuv2rgb(Y: float, U: float, V: float) -> list[int]:
    """Return [red, green, blue], each 0 to 255, from Y, U and V of 0 to 255."""
    return [
        _channel(Y + 1.4075 * (V - 128)),
        _channel(Y - 0.3455 * (U - 128) - 0.7169 * (V - 128)),
        _channel(Y + 1.7790 * (U - 128)),
    ]
