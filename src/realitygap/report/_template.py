"""The templates of pages."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from importlib import resources
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from realitygap._foreign_text import page_text

if TYPE_CHECKING:
    from jinja2 import Environment


def render_page(name: str, content: Mapping[str, Any], **filters: Callable[..., str]) -> str:
    """A page from a template, its style sheet and its content.

    Args:
        name: Name of the template.
        content: Content of the page, to which the style sheet is added as `css`.
        filters: Functions that the template uses.
    """
    tokens = resources.files("realitygap.drawing").joinpath("tokens.css").read_text(encoding="utf-8")
    template = page_environment(**filters).get_template(name)
    return _keep_units(page_text(template.render({**content, "css": tokens + template_text("report.css")})))


def page_environment(**filters: Callable[..., str]) -> Environment:
    """Return the environment of the templates, with the functions that one of them uses."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("realitygap.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(filters, formula=_formula, badge=_badge)
    return environment


def _formula(text: str) -> Markup:
    """Return a text of ours with the index of the effect size A12 set low."""
    return escape(text).replace("A12", Markup("A<sub>12</sub>"))


_BADGE = re.compile(r"(?<=\. )((SIM|TWIN|EMULATED|REAL)\b[^.]*)\.")
"""A sentence of a caption that is the label of a figure and its n."""


def _badge(text: str) -> Markup:
    """Return a caption with its label and n as a badge."""
    return Markup(_BADGE.sub(r'<span class="badge label-\2">\1</span>', str(escape(text))))


_UNIT = re.compile(
    r"<(script|style|svg|pre|code)\b.*?</\1>|<[^>]*>|(\d) (?=(?:%|m?s|min|h|[cmk]?m|in|m?V|Hz|°|[kM]B|px)(?!\w))",
    re.DOTALL,
)
"""A number before its unit, or a part of a page in which spaces stay as they are. The lab's `frame.js` has the same."""


def _keep_units(page: str) -> str:
    """Return a page on which no line ends between a number and its unit."""
    return _UNIT.sub(lambda found: f"{found[2]}\u00a0" if found[2] else found[0], page)


def packed(script: str) -> str:
    """Return a script without comments, indentation, and spaces at operators. Each of its comments ends its line."""
    bare = re.sub(r"^\s*//.*\n|^\s+|\s+//.*$", "", script, flags=re.MULTILINE)
    return re.sub(
        r"(\"[^\"]*\"|`[^`]*`)|\s*([{}(),;:=+*/<>?&|])\s*", lambda found: found[1] or found[2], bare
    )


def template_text(name: str) -> str:
    """The text of a file in the folder of templates."""
    return resources.files("realitygap.report").joinpath(f"templates/{name}").read_text(encoding="utf-8")
