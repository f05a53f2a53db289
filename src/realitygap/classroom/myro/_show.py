"""Pictures and drawings on the screen: in a notebook below the cell, elsewhere in the browser."""

from __future__ import annotations

import html
import sys
import tempfile
import webbrowser
from base64 import b64encode
from pathlib import Path
from typing import Any

from ._mistakes import MyroError, notebook_shell
from ._pictures import Picture

_REFRESH_S = 1  # between two looks of the browser at a page that may have changed
_SMALL, _LARGE = 250, 640  # pictures smaller than that are shown larger [pixels], larger ones smaller

_shown: dict[str, Picture] = {}
_handles: dict[str, Any] = {}
_opened: set[Path] = set()
_folder: Path | None = None


def show(picture: Picture, name: str = "default") -> None:
    """Show a picture; another one of the same name takes its place.

    In a notebook it appears below the cell. Elsewhere it is written as a page whose name is printed, and opened in the
    browser where there is a screen.

    Raises:
        MyroError: It is not a picture, or has no pixels.
    """
    if not isinstance(picture, Picture) or not picture.width or not picture.height:
        raise MyroError(
            f"show: the picture is {picture!r}, expected one made by takePicture() or makePicture(...)."
        )
    _shown[name] = picture
    longest = max(picture.width, picture.height)
    scale = _SMALL / longest if longest < _SMALL else min(1.0, _LARGE / longest)
    source = b64encode(picture.png()).decode()
    show_markup(
        name,
        f'<img src="data:image/png;base64,{source}" width="{round(picture.width * scale)}" '
        f'alt="Picture {html.escape(name)}, {picture.width} by {picture.height} pixels">',
    )


def repaint(picture: Picture | None = None, name: str = "default") -> None:
    """Show a picture again after it was changed.

    Args:
        picture: Picture. Default: the one shown under this name.
        name: Name of the place in which it is shown.

    Raises:
        MyroError: Nothing was shown under this name.
    """
    if picture is None and name not in _shown:
        raise MyroError(f"repaint: nothing was shown as {name!r}. Call show(picture, {name!r}) first.")
    show(picture or _shown[name], name)


def show_markup(name: str, markup: str) -> None:
    """Show HTML or SVG under a name, in the place of what was there under this name."""
    if notebook_shell() is not None:
        _in_notebook(name, markup)
    else:
        _in_browser(name, markup)


def _in_notebook(name: str, markup: str) -> None:
    from IPython.display import HTML, display

    if name in _handles:
        _handles[name].update(HTML(markup))
    else:
        _handles[name] = display(HTML(markup), display_id=True)


def _in_browser(name: str, markup: str) -> None:
    global _folder
    _folder = _folder or Path(tempfile.mkdtemp(prefix="myro-"))
    page = _folder / f"{''.join(letter if letter.isalnum() else '-' for letter in name)}.html"
    title = html.escape(f"Myro: {name}")
    page.write_text(
        f'<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="{_REFRESH_S}">'
        f"<title>{title}</title>{markup}",
        encoding="utf-8",
    )
    if page not in _opened:
        _opened.add(page)
        print(f"{title} is shown in {page}")
        if sys.stdout.isatty():
            webbrowser.open(page.as_uri())


def forget_cells() -> None:
    """Show things below the present cell of a notebook from now on, not below the one that showed them first."""
    _handles.clear()
