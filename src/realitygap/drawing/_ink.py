"""The colors of all pictures."""

from __future__ import annotations


class Ink:
    """The colors of all figures: apart in lightness, and for color-blind eyes (after Okabe & Ito, 2008).

    The eight pens are never told apart by color alone: each has a pattern of dashes and a number as well.
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
