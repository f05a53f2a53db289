"""Texts that others wrote, such as names, notes and messages, without characters that control a terminal or a page."""

from __future__ import annotations

import re

_NO_PAGE = (
    "\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff"
)
"""Characters that HTML does not allow, and those that show letters in another order."""

_IN_PAGE = re.compile(f"[{_NO_PAGE}]")
_IN_SCRIPT = re.compile(
    r"(?<!\\)((?:\\\\)*)\\(?:[bf]|u(?:00(?:0[0-8bcef]|1[0-9a-f]|7f|[89][0-9a-f])|061c|200[ef]|202[a-e]|206[6-9]))"
)
"""The same characters as escapes in JSON, and the escaped backslashes before them."""

UNKNOWN = "\ufffd"
"""Shown on a page in place of such a character."""


def printable(text: str) -> str:
    r"""Return a text in which an escape such as \x1b or \u202e stands for each character that is no letter or sign.

    Line ends stay. So the text cannot control a terminal, and it shows what is in it.
    """
    if text.isprintable():
        return text
    return "".join(
        letter if letter == "\n" or letter.isprintable() else letter.encode("unicode_escape").decode()
        for letter in text
    )


def page_text(text: str) -> str:
    """Return a text or a whole page in which a sign stands for each character that a page must not have."""
    return _IN_PAGE.sub(UNKNOWN, text)


def script_text(text: str) -> str:
    """Return JSON for a script, in which the same sign stands for the same characters, also if they are escaped."""
    return _IN_SCRIPT.sub(rf"\1\\u{ord(UNKNOWN):04x}", page_text(text))
