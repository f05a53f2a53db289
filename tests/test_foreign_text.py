"""Texts of others on the terminal and on pages."""

from __future__ import annotations

import json
import unicodedata

import pytest

from realitygap._foreign_text import page_text, printable, script_text

DIRECTIONS = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}
MARKS = ["\u061c", "\u200e", "\u200f"]


@pytest.fixture(scope="module")
def controls() -> list[str]:
    """All control characters and marks of direction."""
    letters = map(chr, range(0x110000))
    return MARKS + [
        letter
        for letter in letters
        if unicodedata.category(letter) == "Cc" or unicodedata.bidirectional(letter) in DIRECTIONS
    ]


def test_printable_escapes_each_control_and_keeps_lines_and_letters(controls):
    for letter in (*controls, "\ud800", "\u200b", "\ufeff"):
        assert printable(f"a{letter}b").isprintable() or letter == "\n", ascii(letter)
    assert printable("two\nlines: é, 30 %, [/2], 東, \\x1b") == "two\nlines: é, 30 %, [/2], 東, \\x1b"
    assert printable("\x1b]52;c\x07\x9b31m\u202e") == "\\x1b]52;c\\x07\\x9b31m\\u202e"


def test_page_has_no_control_also_not_as_an_escape_in_a_script(controls):
    for letter in controls:
        is_space = letter in "\t\n\r"
        assert (letter in page_text(f"a{letter}b")) == is_space, ascii(letter)
        for text in (json.dumps(letter), json.dumps(letter, ensure_ascii=False)):
            assert (json.loads(script_text(text)) == letter) == is_space, ascii(letter)


def test_script_keeps_other_letters_and_written_escapes():
    for text in ("é 東 🤖 \\u202e \\\\u202e C:\\u001b", '"', "a\\", "tab\tend\n"):
        for escaped in (True, False):
            assert json.loads(script_text(json.dumps(text, ensure_ascii=escaped))) == text
