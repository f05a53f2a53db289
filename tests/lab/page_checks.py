"""Checks that hold on every page of the lab, in every state.

Each returns the faults that it finds, so that a test reads `assert covered(button) == []`.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from axe_playwright_python.sync_playwright import Axe

from .conftest import DESKTOP, PHONE

SIZES = {"desktop": DESKTOP, "tablet": (768, 1024), "zoom of 200 %": (720, 450), "phone": PHONE}
AXE_THEMES = {"desktop": "light", "phone": "dark"}
"""Sizes at which axe-core runs, and the theme at each. A second theme at one size costs a third of all checks."""
MOST_CONTROLS = 200
SETTLED_MS = 250
"""Time until nothing fades in any more [ms]."""
STILL_MS = 80
"""The same with reduced motion: time until a page has its new size [ms]."""

_COVERED = """(it) => {
  const box = it.getBoundingClientRect();
  const across = [box.left + 4, box.right - 4], down = [box.top + 4, box.bottom - 4];
  const points = across.flatMap((x) => down.map((y) => [x, y]));
  points.push([(box.left + box.right) / 2, (box.top + box.bottom) / 2]);
  return points.map(([x, y]) => document.elementFromPoint(x, y)).filter((found) => !it.contains(found))
    .map((found) => found ? found.outerHTML.slice(0, 200) : "out of sight");
}"""
_CUT = """() => [...document.querySelectorAll("body *:not(svg *)")].filter((it) => it.checkVisibility()
  && it.clientWidth && [...it.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim())
  && it.scrollWidth > it.clientWidth + 1
  && (getComputedStyle(it).textOverflow === "ellipsis" || getComputedStyle(it).overflowX === "visible"))
  .map((it) => `cut: ${it.textContent}`)"""
_SMALL = """() => [...document.querySelectorAll(
  "button, [role=button], [role=tab], [role=radio], .q-field, .lab-trail a, .rg-bar label, select, input[type=range]")]
  .filter((it) => it.checkVisibility()).map((it) => [it, it.getBoundingClientRect()])
  .filter(([it, { width, height }]) => width > 1 && (Math.round(width) < 44 || Math.round(height) < 44))
  .map(([it, { width, height }]) => `${Math.round(width)} x ${Math.round(height)} px: ${it.outerHTML.slice(0, 120)}`)"""
_BROAD = """() => [...document.querySelectorAll(".lab-main .q-btn")].filter((it) => it.checkVisibility()
  && it.clientWidth > 400).map((it) => `${it.clientWidth} px broad: ${it.textContent}`)"""
_WATCH = """() => {
  window.tooManyStates = [];
  const look = () => {
    const cards = [...document.querySelectorAll(".lab-study")];
    for (const card of cards.length ? cards : [document.body]) {
      const words = [...card.querySelectorAll(".lab-state")].map((it) => it.textContent);
      if (words.length > 1) window.tooManyStates.push(words.join(" and "));
    }
  };
  new MutationObserver(look).observe(document.body, { subtree: true, childList: true, characterData: true });
  look();
}"""
_ALIKE = """() => {
  const kinds = "button, input:not([type=file]), select, textarea, [role=button], [role=tab], [role=radio]";
  const textOf = (id) => document.getElementById(id)?.textContent ?? "";
  const textsOf = (it) => (it.getAttribute("aria-labelledby") || "").split(" ").map(textOf).join(" ");
  const labelOf = (it) => it.getAttribute("aria-label") || textsOf(it) || it.labels?.[0]?.textContent;
  const groupOf = (it) => it.closest("[role=group][aria-label]")?.ariaLabel ?? "";
  const nameOf = (it) => [groupOf(it), (labelOf(it) || it.textContent).trim()].join(" ").trim();
  const all = [...document.querySelectorAll(kinds)].filter((it) => it.checkVisibility());
  return all.filter((it, index) => all.findIndex((other) => nameOf(other) === nameOf(it)) !== index)
    .map((it) => `another control is named "${nameOf(it)}": ${it.outerHTML.slice(0, 120)}`);
}"""
_MISSED = """() => [...document.querySelectorAll(
  "a[href], button, input, textarea, select, [tabindex='0']")].filter((it) => it.checkVisibility() && !it.disabled
  && it.tabIndex >= 0 && it.getAttribute("aria-disabled") !== "true" && it.type !== "file"
  && !it.dataset.reached).map((it) => `Tab does not reach ${it.outerHTML.slice(0, 200)}`)"""
_TO_START = """() => {
  document.body.tabIndex = -1;
  document.body.focus();
  document.body.removeAttribute("tabindex");
  window.lastFocused = null;
  for (const it of document.querySelectorAll("[data-reached]")) delete it.dataset.reached;
}"""
_FOCUSED = """() => {
  const it = document.activeElement, style = getComputedStyle(it), last = window.lastFocused;
  if (it === document.body || it.dataset.reached) return "all";
  it.dataset.reached = "yes";
  window.lastFocused = it;
  if (last && last.isConnected && !(last.compareDocumentPosition(it) & Node.DOCUMENT_POSITION_FOLLOWING))
    return `out of order: ${it.outerHTML.slice(0, 200)}`;
  const bars = ".lab-header, .lab-steps-bar, .lab-requests, .lab-actions, .lab-stop-bar";
  const box = it.getBoundingClientRect(), middle = (box.left + box.right) / 2;
  const isCovered = (y) => document.elementFromPoint(middle, y)?.closest(bars) && !it.closest(bars);
  if ([box.top + 3, box.bottom - 3].some(isCovered)) return `focus behind a bar: ${it.outerHTML.slice(0, 200)}`;
  const border = it.closest(".q-field") && getComputedStyle(it.closest(".q-field__control"), "::after").borderTopWidth;
  return style.outlineStyle !== "none" || border === "2px" ? "" : `no visible focus: ${it.outerHTML.slice(0, 200)}`;
}"""

_UNTIL_STILL = """async () => {
  await new Promise(requestAnimationFrame);
  await new Promise(requestAnimationFrame);
  const moving = document.getAnimations().filter((it) => it.effect.getComputedTiming().endTime !== Infinity);
  await Promise.all(moving.map((it) => it.finished.catch(() => {})));
}"""
"""Transitions begin with the next frame, which is late on a busy machine. A canceled one rejects `finished`."""

_AXE = Axe()
_RUN_AXE = """async () => {
  const found = await axe.run(document, { resultTypes: ["violations"] });
  return found.violations.map(({ impact, id, nodes }) => ({ impact, id, targets: nodes.map((node) => node.target) }));
}"""


_DRAWN = """(wanted) => new Promise((done) => {
  const values = new Set(), began = performance.now();
  let most = 0;
  const look = () => {
    for (const bar of document.querySelectorAll("[role=progressbar][aria-valuenow]")) {
      const drawn = bar.querySelector(".q-linear-progress__model").getBoundingClientRect().width;
      const value = Number(bar.getAttribute("aria-valuenow"));
      most = Math.max(most, Math.abs(drawn / bar.clientWidth - value));
      values.add(value);
    }
    const isOver = values.size >= wanted || performance.now() - began > 60000;
    isOver ? done([most, values.size]) : requestAnimationFrame(look);
  };
  look();
})"""


def wrong_bars(page: Any, wanted: int) -> list[str]:
    """Return how far a bar is drawn from its value while the bars of a page take so many values, and if they don't."""
    most, n_values = page.evaluate(_DRAWN, wanted)
    wrong = [f"a bar is drawn {most:.3f} of its width from its value"] if most > 0.01 else []
    return wrong + ([f"only {n_values} values in a minute"] if n_values < wanted else [])


def settle(page: Any) -> None:
    """Wait until nothing fades in any more, and a page has its size."""
    is_still = page.evaluate("() => matchMedia('(prefers-reduced-motion: reduce)').matches")
    page.wait_for_timeout(STILL_MS if is_still else SETTLED_MS)
    page.evaluate(_UNTIL_STILL)


def covered(locator: Any) -> list[str]:
    """Return what lies above the center or a corner of an element, or "out of sight"."""
    found: list[str] = locator.evaluate(_COVERED)
    return found


def cut(page: Any) -> list[str]:
    """Return the texts that are too wide for their place: they end in an ellipsis, or run into what is next to them."""
    found: list[str] = page.evaluate(_CUT)
    return found


def wide(page: Any) -> list[str]:
    """Return by how much the page is wider than the screen."""
    over = page.evaluate("() => document.documentElement.scrollWidth - window.innerWidth")
    return [f"{over} px wider than the screen"] if over > 0 else []


def _lasting(page: Any, look: Callable[[Any], list[str]]) -> list[str]:
    """Return what a check finds for five seconds: a busy page draws its plots in their new size later."""
    end = time.monotonic() + 5.0
    while (found := look(page)) and time.monotonic() < end:
        page.wait_for_timeout(100)
    return found


def small(page: Any) -> list[str]:
    """Return the buttons, fields, and tabs that are too small for fingers: below 44 px."""
    found: list[str] = page.evaluate(_SMALL)
    return found


def broad(page: Any) -> list[str]:
    """Return the buttons that are as broad as a form, which is for phones only."""
    found: list[str] = page.evaluate(_BROAD)
    return found


def alike(page: Any) -> list[str]:
    """Return the controls of a page whose accessible name another one of the same group has, too."""
    found: list[str] = page.evaluate(_ALIKE)
    return found


def watch_states(page: Any) -> None:
    """Watch every change of a page for `states`, until it is loaded again."""
    page.evaluate(_WATCH)


def states(page: Any) -> list[str]:
    """Return each moment since `watch_states` at which a card, or the page of a study, had two states."""
    found: list[str] = page.evaluate("() => window.tooManyStates")
    return found


def keyboard(page: Any, size: tuple[int, int] = DESKTOP) -> list[str]:
    """Return the controls that Tab reaches out of order, without a visible focus, behind a bar, or not at all."""
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.emulate_media(reduced_motion="reduce")  # a border has its width at once
    settle(page)
    found: list[str] = []
    for _ in range(2):  # again if a part of the page was drawn again meanwhile: its controls are new
        page.evaluate(_TO_START)
        found = []
        for _ in range(MOST_CONTROLS):
            page.keyboard.press("Tab")
            problem = page.evaluate(_FOCUSED)
            if problem == "all":
                break
            found += [problem] if problem else []
        found += page.evaluate(_MISSED)
        if not found:
            break
    return found


def no_paths(page: Any, root: Path) -> list[str]:
    """Return the lines of a page that contain the absolute path of the lab's folder."""
    return [f"path: {line}" for line in page.locator("body").inner_text().splitlines() if str(root) in line]


def axe(page: Any, size: str) -> list[str]:
    """Return what axe-core finds in the light theme on a desktop, and in the dark one on a phone.

    If `REALITYGAP_PAGES` names a folder, a picture of each theme is written there, for review.
    """
    if not page.evaluate("() => 'axe' in window"):
        page.evaluate(_AXE.axe_script)
    theme = AXE_THEMES[size]
    page.emulate_media(color_scheme=theme)
    settle(page)
    _keep(page, f"{size}-{theme}")
    found = page.evaluate(_RUN_AXE)
    page.emulate_media(color_scheme="light")
    return [f"{theme}: {fault['impact']}: {fault['id']}: {fault['targets'][:3]}" for fault in found]


def faults(page: Any, root: Path) -> list[str]:
    """Return what is wrong with a page at any size; it has the size of a phone from then on.

    Args:
        page: A page, opened with `bypass_csp=True` so that axe-core can run in it.
        root: The lab's folder.
    """
    found = no_paths(page, root)
    for size, (width, height) in SIZES.items():
        page.set_viewport_size({"width": width, "height": height})
        settle(page)
        problems = [
            *_lasting(page, wide),
            *_lasting(page, cut),
            *(axe(page, size) if size in AXE_THEMES else []),
        ]
        if (width, height) == PHONE:
            problems += small(page)
        if (width, height) == DESKTOP:
            problems += broad(page) + alike(page)
        found += [f"{size}: {problem}" for problem in problems]
    return found


def _keep(page: Any, name: str) -> None:
    folder = os.environ.get("REALITYGAP_PAGES")
    if folder:
        place = urlsplit(page.url).path.strip("/").replace("/", "-") or "studies"
        number = len(list(Path(folder).glob("*.png")))
        page.screenshot(path=f"{folder}/{number:03}-{place}-{name}.png", full_page=True)
