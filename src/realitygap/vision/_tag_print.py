"""Tags to print, at true scale."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from ._layout import tag_marks
from ._print import PAPERS, blank_page
from ._tags import CORNER_FAMILY, CORNER_IDS, CORNER_SIZE_M, RobotTag

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Paper = Literal["a4", "letter", "a3"]
PLACES = ("lower left", "lower right", "upper right", "upper left")
EDGE_M = 0.012  # of paper that printers leave blank
GRAY = "0.45"


def print_tags(
    path: Path | str, tag: RobotTag | None = None, corner_size: float = CORNER_SIZE_M, paper: Paper = "a4"
) -> int:
    """Write the robot's tag and four corner tags into a PDF, to be printed at 100 %.

    Args:
        path: The file; one that is there is replaced.
        tag: Tag of the robot. Default family: 36h11.
        corner_size: Side of the black square of a corner tag [m].
        paper: a4, letter or a3.

    Returns:
        The number of pages.

    Raises:
        ValueError: No such paper, no such tag, or tags that are too large for the paper.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    if paper not in PAPERS:
        raise ValueError(f"paper is {paper!r}, expected {', '.join(PAPERS)}.")
    robot = tag or RobotTag()
    if not corner_size > 0:
        raise ValueError(f"corner_size is {corner_size}, expected a length above 0 m.")
    height, width = PAPERS[paper]
    robots_side, corners_side = _with_border(robot.size), _with_border(corner_size)
    room = width - 2 * EDGE_M
    if robots_side > room or 2 * corners_side > room or 2 * corners_side + 0.07 > height - 2 * EDGE_M:
        raise ValueError(
            f"Tags of {robot.size:g} m and {corner_size:g} m with their borders do not fit on {paper}, expected at "
            f"most {room * 0.75:.3f} m and {room * 0.375:.3f} m."
        )
    pages = [_robots_page(robot, width, height), _corners_page(corner_size, width, height)]
    with PdfPages(path) as file:
        for page in pages:
            file.savefig(page)
    return len(pages)


def _with_border(size: float) -> float:
    """Return the side of a tag with its white border, a sixth of the black square on each side [m]."""
    return size * 4 / 3


def _page(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a sheet whose units are meters, from its lower left."""
    page, axes = blank_page(width, height)
    _ruler(axes, width)
    return page, axes


def _ruler(axes: Axes, width: float) -> None:
    x, y = width / 2 - 0.05, EDGE_M + 0.008
    axes.plot([x, x + 0.1], [y, y], color="black", lw=0.6)
    for k in range(11):
        tick = 0.004 if k % 5 == 0 else 0.0025
        axes.plot([x + k / 100] * 2, [y, y + tick], color="black", lw=0.6)
    words = "100 mm: measure it. Print at 100 %, without fitting to the page."
    axes.text(width / 2, y - 0.004, words, ha="center", va="top", fontsize=8, color=GRAY)


def _tag(axes: Axes, family: str, number: int, x: float, y: float, size: float) -> None:
    """Draw a tag about x, y [m], upright, with a line to cut along."""
    from matplotlib.patches import Rectangle

    for mark in tag_marks(family, number, x - size / 2, y - size / 2, size):
        black = Rectangle(
            (mark.x1, mark.y1),
            mark.x2 - mark.x1,
            mark.y2 - mark.y1,
            facecolor="black",
            lw=0.2,
            edgecolor="black",
        )
        axes.add_patch(black)
    side = _with_border(size)
    axes.add_patch(
        Rectangle(
            (x - side / 2, y - side / 2), side, side, fill=False, lw=0.4, ls=(0, (6, 4)), edgecolor=GRAY
        )
    )


def _robots_page(tag: RobotTag, width: float, height: float) -> Figure:
    page, axes = _page(width, height)
    family = tag.family or CORNER_FAMILY
    x, y, side = width / 2, height * 0.55, _with_border(tag.size)
    _tag(axes, family, tag.number, x, y, tag.size)
    top = y + side / 2
    axes.annotate(
        "", (x, top + 0.03), (x, top + 0.004), arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 1.5}
    )
    axes.text(x, top + 0.034, "front of the robot", ha="center", fontsize=11)
    words = (
        f"Tag {tag.number} ({family}), black square {1000 * tag.size:.0f} mm. Cut along the dashed line; leave the\n"
        "white border. Glue it flat on top of the robot, its middle above the pen, the arrow ahead."
    )
    axes.text(x, y - side / 2 - 0.008, words, ha="center", va="top", fontsize=9, color=GRAY)
    return page


def _corners_page(size: float, width: float, height: float) -> Figure:
    page, axes = _page(width, height)
    side = _with_border(size)
    apart = min(width / 2 - EDGE_M, side + 0.02) / 2
    for number, place in zip(CORNER_IDS, PLACES, strict=True):
        x = width / 2 + (apart if "right" in place else -apart)
        y = height / 2 + (1 if "upper" in place else -1) * (side / 2 + 0.015)
        _tag(axes, CORNER_FAMILY, number, x, y, size)
        axes.text(
            x, y - side / 2 - 0.003, f"{number}: {place}", ha="center", va="top", fontsize=9, color=GRAY
        )
    words = (
        f"Corners of the arena, black squares {1000 * size:.0f} mm. Cut along the dashed lines, and glue each flat on\n"
        "the floor into its corner, upright as here, its black square 10 mm from both walls."
    )
    axes.text(width / 2, height / 2 + side + 0.045, words, ha="center", va="bottom", fontsize=9, color=GRAY)
    return page
