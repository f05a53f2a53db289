"""A figure on a page: in two widths, with its number and the values that it shows on hover."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from markupsafe import Markup

from realitygap._foreign_text import script_text
from realitygap.report._template import packed, template_text
from realitygap.report.charts.house import NARROW, Drawing, inline
from realitygap.report.charts.marks import marks_content


@dataclass
class FigureOnPage:
    """A figure in two widths, of which the page shows the one that fits.

    Attributes:
        anchor: Id on the page; the same in all studies.
        drawing: The wide form.
        counterpart: The paper's figure that shows the same; empty for none.
        number: Number on the page, from 1, which `number_figures` sets.
    """

    anchor: str
    drawing: Drawing
    counterpart: str = ""
    number: int = 0
    wide: Markup = field(init=False)
    narrow: Markup = field(init=False)
    marks: dict[str, Any] | None = field(init=False)

    def __post_init__(self) -> None:
        narrow = self.drawing.in_width(NARROW)
        self.wide, self.narrow = Markup(inline(self.drawing.svg)), Markup(inline(narrow.svg))
        self.marks = marks_content(self.drawing, narrow) if self.drawing.marks else None

    @property
    def title(self) -> str:
        """The name of the figure, such as Figure 1."""
        return f"Figure {self.number}"

    @property
    def caption(self) -> str:
        """The caption of the drawing, and the paper's figure that shows the same."""
        more = f" Counterpart of the paper’s {self.counterpart}." if self.counterpart else ""
        return self.drawing.caption + more


def hover_content(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a page needs to show the values of its figures: `marks`, `hover`, and `hover_hash`."""
    script = packed(template_text("hover.js")) + template_text("page.js")
    marks = {each.anchor: each.marks for each in figures_in(content) if each.marks}
    return {"marks": as_json(marks), "hover": Markup(script), "hover_hash": hash_of(script)}


def hash_of(script: str) -> str:
    """The hash of a script, as a page's policy names it."""
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def as_json(values: Mapping[str, Any]) -> Markup:
    """JSON for a script element: nothing in it ends the element, whatever the names are."""
    text = script_text(json.dumps(values, separators=(",", ":"), allow_nan=False))
    for letter in "<>&":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return Markup(text)


def number_figures(figures: Iterable[FigureOnPage | str | None]) -> None:
    """Number figures in the order given; reasons why one is missing (text) and None have no number."""
    placed = [each for each in figures if isinstance(each, FigureOnPage)]
    for number, figure in enumerate(placed, 1):
        figure.number = number


def figures_in(content: Any) -> Iterator[FigureOnPage]:
    """Yield all figures in the content of a page."""
    if isinstance(content, FigureOnPage):
        yield content
    elif isinstance(content, list):
        for each in content:
            yield from figures_in(each)
    elif isinstance(content, Mapping):
        yield from figures_in(list(content.values()))
