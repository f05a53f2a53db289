"""A network of a study drives a robot that each visitor sees move smoothly; in a real browser."""

from __future__ import annotations

import pytest

from realitygap.robots.twin import sample_twin
from realitygap.study import parse_study, run_study

from .conftest import PHONE, enter, expect

pytestmark = pytest.mark.slow

TEXT = """
[study]
name = "seen"
replicates = 3

[platform.jyro]
steps = 400

[[condition]]
name = "coverage-10"
"""

WATCH_FRAMES = """() => {
  const moves = [];
  let before = null;
  const look = () => {
    const place = document.querySelector('.rg-robot')?.getAttribute('transform') ?? null;
    moves.push(place !== before);
    before = place;
    if (moves.length > 60) moves.shift();
    window.isSmooth = moves.filter((moved) => moved).length >= 30;
    if (!window.isSmooth) requestAnimationFrame(look);
  };
  look();
}"""
"""Sets `isSmooth` when the robot was drawn at another place in half of 60 frames. A slow browser has fewer frames."""

PLATFORMS = {"": "SIM", "sim": "SIM", "twin:worn.toml": "TWIN", "scribbler:emulator://s2?fluke=2": "EMULATED"}
"""What a network drives on, and the label of each."""


def test_a_network_drives_live_and_can_be_played_when_it_is_stopped(lab, visit):
    run_study(parse_study(TEXT, "study.toml"), lab.root / "seen")
    (lab.root / "worn.toml").write_text(sample_twin("worn", 1).to_toml())
    page = visit("study/seen", size=PHONE)
    page.get_by_role("tab", name="Replay").click()
    for platform, label in PLATFORMS.items():
        enter(page, "Platform", platform)
        page.get_by_role("button", name="Drive live").click()
        live = page.locator(".rg-live")
        expect(live.locator(".rg-label")).to_have_text(label)
        page.wait_for_function("() => /step [2-9]/.test(document.querySelector('.rg-clock').textContent)")
        expect(live.locator(".rg-ray")).to_have_count(3)
        if (
            not platform
        ):  # the page draws all platforms alike; who comes later sees the line from its beginning
            page.evaluate(WATCH_FRAMES)
            page.wait_for_function("() => window.isSmooth")
            later = visit("study/seen")
            later.get_by_role("tab", name="Replay").click()
            later.locator(".rg-live .rg-trail").wait_for()
            first = later.locator(".rg-live .rg-trail").get_attribute("points").split()[0]
            assert first == page.locator(".rg-live .rg-trail").get_attribute("points").split()[0]
            later.close()
        page.get_by_role("button", name="End drive").click()
        page.get_by_text("Stopped.").wait_for()
        expect(live).to_have_count(0)
