"""A card: an object as HTML for notebooks, without a script, so that it works on GitHub, in VS Code, and in a PDF."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING, Any, ClassVar

from realitygap._foreign_text import page_text

from ._colors import theme_rules, themed
from ._picture import Picture

if TYPE_CHECKING:
    from jinja2 import Template


MOST_BYTES = 200_000
"""Size of a card at most."""

MOST_ROWS = 100
"""Rows of a table that are shown."""

MOST_LETTERS = 600
"""Letters of a text that are shown."""


@dataclass(frozen=True)
class Bar:
    """A number with its interval, drawn on an axis from `start` to `end`; None leaves out what is unknown."""

    kind: ClassVar[str] = "bar"
    estimate: float | None
    low: float | None
    high: float | None
    start: float
    end: float

    def at(self, value: float) -> float:
        """Place of a value on the axis, 0 to 100."""
        return 100.0 * min(max((value - self.start) / ((self.end - self.start) or 1.0), 0.0), 1.0)


@dataclass(frozen=True)
class Spark:
    """Values in order, drawn as a line on an axis from `start` to `end`."""

    kind: ClassVar[str] = "spark"
    values: tuple[float, ...]
    start: float
    end: float

    @property
    def points(self) -> str:
        """The line, as the points of an SVG polyline."""
        last, height = max(len(self.values) - 1, 1), (self.end - self.start) or 1.0
        return " ".join(
            f"{2 + 86 * k / last:.1f},{18 - 16 * min(max((value - self.start) / height, 0), 1):.1f}"
            for k, value in enumerate(self.values)
        )


@dataclass(frozen=True)
class Table:
    """A table whose cells are texts, bars, or sparks; the first column names the rows.

    Attributes:
        heads: (c,) head of each column.
        rows: (r, c) cells.
        title: Title; needed if it is closed.
        closed: True to show only the title until a reader opens it.
    """

    kind: ClassVar[str] = "table"
    heads: Sequence[str]
    rows: Sequence[Sequence[str | Bar | Spark]]
    title: str = ""
    closed: bool = False

    @property
    def shown(self) -> Sequence[Sequence[str | Bar | Spark]]:
        """The rows that are shown."""
        return self.rows[:MOST_ROWS]


@dataclass(frozen=True)
class Card:
    """An object as a notebook shows it.

    Attributes:
        title: Title.
        labels: Labels of its numbers: SIM, TWIN, EMULATED, or REAL.
        lead: The finding, or the size, in a sentence.
        warning: Warning for readers; empty if there is none.
        parts: Tables, pictures, and paragraphs, in order.
        code: Calls that lead on, one a line.
    """

    title: str
    labels: Sequence[str] = ()
    lead: str = ""
    warning: str = ""
    parts: Sequence[Table | Picture | str] = ()
    code: Sequence[str] = ()

    def to_html(self) -> str:
        """Return the card as one `div`; all texts are escaped, and it has at most 200 KB."""
        page = self._render(self.parts)
        if len(page.encode()) <= MOST_BYTES:
            return page
        return self._render(["The rest is too large for a notebook."])

    def _render(self, parts: Sequence[Table | Picture | str]) -> str:
        return _template().render(card=self, parts=parts)


@functools.cache
def _template() -> Template:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("realitygap.drawing", "cards"),
        autoescape=True,
        finalize=_printable,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["svg"] = lambda picture: themed(picture.to_svg(300.0))
    environment.globals["style"] = _style()
    return environment.get_template("card.html.jinja")


def _style() -> str:
    style = resources.files("realitygap.drawing").joinpath("cards/card.css").read_text("utf-8")
    return theme_rules(".rg-card") + " ".join(style.split())


def _printable(value: Any) -> Any:
    """Return a text that a page may have, and that is not too long; what is HTML already stays."""
    if not isinstance(value, str) or hasattr(value, "__html__"):
        return value
    text = page_text(value)
    return text if len(text) <= MOST_LETTERS else text[: MOST_LETTERS - 1] + "…"


@functools.singledispatch
def picture_of(shown: Any, **options: Any) -> Picture:
    """Return the picture of an object. A module that draws a type registers its function here.

    Raises:
        TypeError: Nothing draws this type.
    """
    raise TypeError(f"Nothing draws {type(shown).__name__}.")


@functools.singledispatch
def card_of(shown: Any) -> Card:
    """Return the card of an object. A module that describes a type registers its function here.

    Raises:
        TypeError: Nothing describes this type.
    """
    raise TypeError(f"Nothing describes {type(shown).__name__}.")


class ShownAsCard:
    """Something that notebooks show by its card."""

    def _repr_html_(self) -> str:
        return card_of(self).to_html()


@functools.singledispatch
def widget_of(shown: Any) -> Any:
    """Return the widget of an object; None if it has none, or what shows it is not installed."""
    return None
