"""Colors by their X11 names, as Jyro and many drawing libraries know them."""

from __future__ import annotations

import difflib
import functools
import re
from importlib import resources

Rgb = tuple[int, int, int]


def rgb_of(color: str) -> Rgb:
    """Return red, green and blue, 0 to 255, of an X11 name (any case, spaces or not) or of `#rrggbb`.

    Raises:
        ValueError: There is no such color.

    Source: `rgb.txt` of the X Window System; gray0 to gray100 are percentages.
    """
    name = color.strip().lower().replace(" ", "")
    known = x11_colors().get(name)
    if known is not None:
        return known
    if re.fullmatch("#[0-9a-f]{6}", name):
        return int(name[1:3], 16), int(name[3:5], 16), int(name[5:7], 16)
    near = difflib.get_close_matches(name, x11_colors(), n=1)
    hint = f"Did you mean {near[0]!r}?" if near else "Give an X11 name, such as 'red', or #rrggbb."
    raise ValueError(f"Unknown color {color!r}. {hint}")


def hex_of(color: str) -> str:
    """Return a color as `#rrggbb`, which pictures take.

    Raises:
        ValueError: There is no such color.
    """
    return "#{:02x}{:02x}{:02x}".format(*rgb_of(color))


@functools.cache
def x11_colors() -> dict[str, Rgb]:
    """Return all names, lower-case and without spaces, and what color each is."""
    text = resources.files("realitygap.drawing").joinpath("x11-colors.txt").read_text("ascii")
    colors = {}
    for line in text.splitlines():
        name, code = line.split()
        colors[name] = (int(code[:2], 16), int(code[2:4], 16), int(code[4:], 16))
    for percent in range(101):
        shade = int(percent * 2.55 + 0.5)
        colors[f"gray{percent}"] = colors[f"grey{percent}"] = (shade, shade, shade)
    return colors
