"""Drawings as files: SVG, PDF and PNG, each written whole or not at all."""

from __future__ import annotations

import html
import io
import textwrap
from dataclasses import replace
from pathlib import Path

from realitygap.drawing import Ink, Picture
from realitygap.errors import did_you_mean
from realitygap.records import write_whole
from realitygap.report.charts.house import Drawing, house_style, to_svg
from realitygap.report.charts.shapes import picture_sheet

ENDINGS = (".gif", ".mp4", ".pdf", ".png", ".svg")
"""Endings of the names of pictures; `.gif` and `.mp4` only for trials, which move."""

_DOTS = 200
"""Dots per inch of a PNG."""

_LETTERS = 16.5
"""Maximum number of letters per inch of a caption."""

_PICTURE_WIDTH = 6.4
"""Width of the picture of one arena, robot or network [in]."""


def check_ending(path: Path, endings: tuple[str, ...] = ENDINGS) -> str:
    """The ending of a picture's file, in small letters.

    Raises:
        ValueError: it is none of these.
    """
    ending = path.suffix.lower()
    if ending not in endings:
        hint = (
            "only trials can move: realitygap show movie, or a folder of results without another word"
            if ending in (".gif", ".mp4")
            else did_you_mean(ending, endings)
        )
        raise ValueError(
            f"{path} ends in {ending or 'nothing'}, expected {', '.join(endings[:-1])} or {endings[-1]}. "
            + hint[:1].upper()
            + hint[1:]
        )
    return ending


def save_drawing(drawing: Drawing, path: str | Path, *, title: str = "realitygap") -> Path:
    """Write a figure to a file. An existing file is replaced once the new one is complete.

    Args:
        drawing: Drawing of one of the `draw_...` functions.
        path: Path that ends in .svg, .pdf or .png.
        title: Title of the document.

    Returns:
        The path.

    Raises:
        RecordError: the file cannot be written, or belongs to a study's results.
        ValueError: another ending.
    """
    path = Path(path)
    write_whole(path, drawing_bytes(drawing, check_ending(path, (".pdf", ".png", ".svg")), title))
    return path


def save_picture(picture: Picture, path: str | Path) -> Path:
    """Write an arena's, a robot's or a network's picture to a file; see `save_drawing`."""
    path = Path(path)
    ending = check_ending(path, (".pdf", ".png", ".svg"))
    if ending == ".svg":
        write_whole(path, picture.to_svg().encode("utf-8"))
        return path
    with house_style():
        sheet = picture_sheet(picture, _PICTURE_WIDTH)
        sheet.settle()
        drawing = Drawing("", "", picture.description, sheet.figure)
    write_whole(path, drawing_bytes(drawing, ending, picture.title))
    return path


def captioned(drawing: Drawing, name: str) -> Drawing:
    """Return the drawing with its caption as text below, for a separate file; ids in it begin with `name`.

    The drawing's figure is changed.
    """
    figure = drawing.figure
    if figure is None:
        raise ValueError("The drawing was made without its figure, so that nothing can be written below it.")
    width, height = figure.get_size_inches()
    lines = textwrap.wrap(drawing.caption, int(width * _LETTERS))
    room = 0.14 + 0.155 * len(lines)
    figure.set_size_inches(width, height + room)
    scale = height / (height + room)
    for axes in figure.axes:
        box = axes.get_position(original=True)
        axes.set_position((box.x0, 1 - (1 - box.y0) * scale, box.width, box.height * scale))
    for legend in figure.legends:
        legend.set_bbox_to_anchor((0.0, 1 - scale, 1.0, scale), figure.transFigure)
    with house_style():
        for k, line in enumerate(lines):
            y = (room - 0.1 - 0.155 * k) / (height + room)
            figure.text(0.05 / width, y, line, fontsize=7.5, color=Ink.MUTED, va="top")
        return replace(drawing, svg=to_svg(figure, name, drawing.alt))


def drawing_bytes(drawing: Drawing, ending: str, title: str) -> bytes:
    """A figure in the format of a file's ending; the same figure gives the same bytes."""
    if ending == ".svg":
        return standalone_svg(drawing, title).encode("utf-8")
    if drawing.figure is None:
        raise ValueError("The drawing was made without its figure, so that it has no other form than SVG.")
    buffer = io.BytesIO()
    with house_style():
        if ending == ".pdf":
            about = {"Title": title, "Subject": drawing.alt, "Creator": "realitygap", "CreationDate": None}
            drawing.figure.savefig(buffer, format="pdf", metadata=about, facecolor=Ink.GROUND)
        else:
            drawing.figure.savefig(
                buffer,
                format="png",
                dpi=_DOTS,
                metadata={"Title": title, "Description": drawing.alt, "Software": "realitygap"},
                facecolor=Ink.GROUND,
            )
    return buffer.getvalue()


def standalone_svg(drawing: Drawing, title: str) -> str:
    """Return a figure as a separate document, with a title, a description, and a background."""
    start, rest = drawing.svg.split(">", 1)
    about = f"<title>{_text(title)}</title><desc>{_text(drawing.alt)}</desc>"
    ground = f'<rect width="100%" height="100%" fill="{Ink.GROUND}" />'
    return f"{start}>{about}{ground}{rest}"


def _text(text: str) -> str:
    printable = "".join(letter if letter.isprintable() else " " for letter in text)
    return html.escape(printable, quote=False)
