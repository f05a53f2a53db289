"""The colors that all pages share."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from importlib import resources
from pathlib import Path

import pytest

import realitygap
from realitygap.drawing import Ink, Line, Picture, themed_file

SHEET = resources.files("realitygap.drawing").joinpath("tokens.css").read_text("utf-8")
LIGHT, DARK = (dict(re.findall(r"--([\w-]+): (#\w{6});", part)) for part in (SHEET.partition("@media")[::2]))


def contrast(first: str, second: str) -> float:
    """The contrast of two colors. Source: WCAG 2.2, relative luminance."""

    def luminance(color: str) -> float:
        shares = [int(color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def test_sheet_has_the_colors_of_figures():
    assert {name: LIGHT[f"ink-{name}"] for name in Ink.names()} == Ink.names()


LABELS = {"SIM": "muted"} | {name: f"ink-{name.lower()}" for name in ("TWIN", "EMULATED", "REAL")}


def test_a_label_has_one_color_in_players_and_on_all_pages():
    for label, color in LABELS.items():
        assert LIGHT[color] == getattr(Ink, label, Ink.MUTED)
    package = Path(realitygap.__file__).parent
    for sheet in (
        "report/templates/report.css",
        "lab/pages/static/lab.css",
        "drawing/cards/card.css",
        "playback/player.css",
    ):
        rules = (package / sheet).read_text("utf-8")
        for label, color in LABELS.items():
            assert re.search(
                rf"-{label.lower()}\b[^{{]*{{ (color|background): var\(--{color}\); }}", rules
            ), (
                sheet,
                label,
            )


def test_both_themes_have_the_same_colors():
    assert set(LIGHT) == set(DARK)


@pytest.mark.parametrize("colors", [LIGHT, DARK], ids=["light", "dark"])
def test_words_can_be_read_on_their_grounds(colors):
    for ink in ("text", "muted", "accent", "danger", "ok", "warn", *LABELS.values()):
        for ground in ("ground", "card"):
            assert contrast(colors[ink], colors[ground]) >= 4.5, (ink, ground)


def test_picture_as_a_file_is_dark_on_a_dark_page_and_light_without_styles():
    picture = Picture("title", "text", 0.0, 0.0, 1.0, 1.0, (Line(((0.0, 0.0), (1.0, 1.0)), "#000000"),))
    styled = '<svg><path style="fill: #1c1f24; stroke: #fefefe"/></svg>'
    for svg in (picture.to_svg(), styled):
        root = ET.fromstring(themed_file(svg))
        rules = root[0].text or ""
        assert "(prefers-color-scheme: dark)" in rules
        assert "--ink-text: #e6e8eb" in rules
        assert "var(--ink-text, #" in themed_file(svg)
        assert "var(--ink-ground, #fefefe)" in themed_file(svg)
