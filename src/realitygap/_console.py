"""Rich's console for texts that others wrote: none of them is markup, or controls the terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.progress import ProgressColumn, Task
from rich.text import Text

from realitygap._foreign_text import printable


def plain_text(text: str, **options: Any) -> Text:
    """Return a text for a place that Rich would otherwise read as markup; the options are those of `rich.text.Text`."""
    return Text(printable(text), **options)


class PlainConsole(Console):
    """A console that shows each text as it is, in messages and in cells, titles and captions of tables."""

    def render_str(
        self, text: str, *, style: Any = "", justify: Any = None, overflow: Any = None, **_: Any
    ) -> Text:
        """Return a text without markup, emoji codes, colors of numbers, and control characters."""
        return plain_text(text, style=style, justify=justify, overflow=overflow)


class PlainColumn(ProgressColumn):
    """A column of a progress bar with a text.

    Args:
        text: The text, with fields of a task such as {task.description}.
    """

    def __init__(self, text: str) -> None:
        self._format = text
        super().__init__()

    def render(self, task: Task) -> Text:
        """Return the text of a task."""
        return plain_text(self._format.format(task=task), style="none", justify="left")
