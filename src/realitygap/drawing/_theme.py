"""The colors of all pages for parts of a notebook, which follow the notebook's theme."""

from __future__ import annotations

import functools
import re
from importlib import resources

from ._ink import Ink

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
