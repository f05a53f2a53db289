"""The colors of all pictures: our inks, X11 names, and the theme of the page around a picture."""

from __future__ import annotations

import difflib
import functools
import re
from importlib import resources


class Ink:
    """The colors of all figures: apart in lightness, and for color-blind eyes (after Okabe & Ito, 2008).

    The eight pens are never told apart by color alone: each has a pattern of dashes and a number as well. The label of
    trials has the color of its name; SIM is MUTED.
    """

    TEXT = "#1c1f24"
    MUTED = "#5a626d"
    RULE = "#d3d8de"
    GROUND = "#fefefe"
    OURS = "#0a4f8f"
    BAND = "#a9c9e8"
    RUN = "#6d7580"
    PUBLISHED = "#b8480a"
    REACH = "#c2182b"
    VISITED = "#dfe9f3"
    BODY = "#8d949e"
    PEN0 = "#16191d"
    PEN1 = "#0072b2"
    PEN2 = "#c94f00"
    PEN3 = "#00805c"
    PEN4 = "#b0508c"
    PEN5 = "#a67a00"
    PEN6 = "#3d9bd6"
    PEN7 = "#7a1f4d"
    TWIN = "#6a3d9a"
    EMULATED = "#8a4b00"
    REAL = "#1e6b34"

    @classmethod
    def names(cls) -> dict[str, str]:
        """Return the color by name, lower-case; the page's style sheet has a variable `--ink-NAME` for each."""
        return {name.lower(): color for name, color in vars(cls).items() if name.isupper()}


PENS: tuple[tuple[str, tuple[float, ...]], ...] = (
    (Ink.PEN0, ()),
    (Ink.PEN1, (6, 1.5)),
    (Ink.PEN2, (1.3, 1.5)),
    (Ink.PEN3, (5, 1.5, 1.3, 1.5)),
    (Ink.PEN4, (3, 1.6)),
    (Ink.PEN5, (7, 1.5, 1.3, 1.5, 1.3, 1.5)),
    (Ink.PEN6, (2, 1)),
    (Ink.PEN7, (9, 2.5)),
)
"""Color and dashes [pt] of the paper's eight pens; a ninth individual takes the first pen again."""


def line_pen(index: int) -> tuple[str, tuple[float, ...]]:
    """Return the color and dashes [pt] of a line in a chart: those of a pen, then colors with dashes of other pens.

    Args:
        index: Number of the line, from 0. The first 64 lines all differ.
    """
    n = len(PENS)
    return PENS[index % n][0], PENS[(index + index // n) % n][1]


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


_BLACK = "#000000"
_COLOR = re.compile('"(' + "|".join(Ink.names().values()) + f')"|(?<=stroke=)"({_BLACK})"')
_STYLED = re.compile("(?<=: )(" + "|".join(Ink.names().values()) + ')(?=[;"])')
"""A color within a `style` attribute, as matplotlib writes it."""
_NAMES = {color: name for name, color in Ink.names().items()} | {_BLACK: "text"}
"""A black line, such as a wall of Jyro's, would vanish on a dark ground; black areas have an outline or a ground."""

_DARK = (
    'html[data-theme="dark"]',
    'body[data-theme="dark"]',
    'body[data-jp-theme-light="false"]',
    "body.vscode-dark",
)
"""Pages that say that they are dark: of Sphinx themes, JupyterLab, and VS Code."""

_NOT = ('[data-theme="light"]', "[data-jp-theme-light]", ".vscode-light")
_NOT_LIGHT = f"html:not({_NOT[0]}) body{''.join(f':not({mark})' for mark in _NOT)}"
"""Pages that do not say that they are light, so that the reader's system decides."""


@functools.cache
def theme_rules(selector: str) -> str:
    """Return CSS that gives the elements of a selector the variables of `tokens.css`, light or dark as their page is.

    Args:
        selector: A class, such as ".rg-card". Only these elements and what they contain have the variables.
    """
    light, dark = _rules()
    pages = ", ".join(f"{page} {selector}" for page in _DARK)
    by_system = f"@media (prefers-color-scheme: dark) {{ {_NOT_LIGHT} {selector} {{ {dark} }} }}"
    return f"{selector} {{ {light} }} {pages} {{ {dark} }} {by_system} "


@functools.cache
def _rules() -> tuple[str, str]:
    """Return the variables of `tokens.css`, light and dark; pictures lie on a card."""
    sheet = resources.files("realitygap.drawing").joinpath("tokens.css").read_text("utf-8")
    light, dark = (
        " ".join(rules.split()) + "; --ink-ground: var(--card);"
        for rules in re.findall(r":root \{(.*?);\s*\}", re.sub(r"/\*.*?\*/", "", sheet), re.DOTALL)
    )
    return light, dark


def themed_file(svg: str) -> str:
    """Return a picture as a separate SVG file that is dark if the page that shows it is dark."""
    start, _, rest = svg.partition(">")
    dark = f"<style>@media screen and (prefers-color-scheme: dark) {{ :root {{ {_rules()[1]} }} }}</style>"
    return f"{start}>{dark}{_STYLED.sub(lambda match: themed_color(match[1]), themed(rest))}"


def themed(svg: str) -> str:
    """Return a picture as SVG whose colors follow the theme, and are the light ones if styles are stripped."""
    return _COLOR.sub(lambda match: f'"{themed_color(match[1] or match[2])}"', svg)


def themed_color(color: str) -> str:
    """Return a color that follows the theme, as CSS; one that is no `Ink` stays as it is."""
    return f"var(--ink-{_NAMES[color]}, {color})" if color in _NAMES else color
