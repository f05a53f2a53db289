"""The templates of pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import resources
from typing import Any


def render_page(name: str, content: Mapping[str, Any], **filters: Callable[..., str]) -> str:
    """A page from a template, its style sheet and its content.

    Args:
        name: Name of the template.
        content: Content of the page, to which the style sheet is added as `css`.
        filters: Functions that the template uses.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("realitygap.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(filters)
    tokens = resources.files("realitygap.drawing").joinpath("tokens.css").read_text(encoding="utf-8")
    return environment.get_template(name).render({**content, "css": tokens + template_text("report.css")})


def template_text(name: str) -> str:
    """The text of a file in the folder of templates."""
    return resources.files("realitygap.report").joinpath(f"templates/{name}").read_text(encoding="utf-8")
