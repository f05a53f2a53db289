"""Chromium as installed on the machine, driven by Playwright, for tests of pages."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator, Sequence
from typing import Any

import pytest

PROGRAMS = (
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
)
"""The first one has no window, and needs two thirds of the processor time of the others. Any of them will do."""
CHROMIUM = next(filter(None, map(shutil.which, PROGRAMS)), None)
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
LOCAL = ("file:", "data:")
"""How addresses of pages in files begin, and of what is in them."""
RECORD = """() => {
  window.presses = [];
  const text = ({ target }) => (target.textContent || target.ariaLabel || "").trim().slice(0, 40);
  for (const kind of ["pointerdown", "pointerup", "click", "keydown"])
    addEventListener(kind, (event) => {
      const at = [performance.now(), event.clientX, event.clientY].map(Math.round).join(" ");
      presses.push(`${at} ${kind} ${event.key ?? ""} ${event.target.tagName} ${text(event)}`);
    }, true);
}"""
"""Keeps what was pressed: time since the page was loaded [ms], place, and element."""
STORED = "local_storage,indexeddb,cache_storage,service_workers"


@contextlib.contextmanager
def open_browser() -> Iterator[Any]:
    """Open a browser. In this thread, nothing else can run an event loop until it is closed."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: uv sync --extra dev")
    if CHROMIUM is None:
        pytest.skip("needs Chromium or Chrome on the PATH")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


class Visitors:
    """Contexts of a browser, each like a browser of its own, which later tests use again once they are empty.

    A page in a new context fetches and compiles its scripts again, for most of a second of a processor. The empty first
    page of each context keeps the process that has compiled them.
    """

    def __init__(self, browser: Any) -> None:
        self.browser = browser
        self._free: dict[str, list[Any]] = {}
        self._used: list[tuple[str, Any]] = []
        self._closed: list[Any] = []
        self._allowed: tuple[str, ...] = ()
        self.complaints: list[str] = []
        """Messages of the consoles of pages, their errors, and their requests elsewhere."""

    def open_page(
        self,
        size: tuple[int, int],
        allowed: tuple[str, ...],
        patience_ms: float,
        *,
        forgive: Sequence[str] = (),
        cookies: Sequence[dict[str, Any]] = (),
        **options: Any,
    ) -> Any:
        """Return an empty page in a context of its own.

        Args:
            size: Width and height [px].
            allowed: How addresses of requests may begin.
            patience_ms: Time until an action has failed [ms].
            forgive: Parts of messages that are no complaint.
            cookies: Cookies of the context.
            **options: Options of the context.
        """
        self._allowed = allowed
        context = self._context(viewport={"width": size[0], "height": size[1]}, **options)
        context.add_cookies(cookies)
        page = context.new_page()
        page.set_default_timeout(patience_ms)

        def complain(text: str) -> None:
            if not any(part in text for part in forgive):
                self.complaints.append(text)

        page.on("console", lambda message: complain(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: complain(str(error)))
        return page

    def leave(self, origin: str) -> None:
        """Empty all contexts, of which pages stored something at one origin, and expect that nothing was wrong."""
        used, self._used = self._used, []
        for kind, context in used:
            if context in self._closed:
                continue
            empty, *pages = context.pages
            for page in pages:
                page.close()
            session = context.new_cdp_session(empty)
            session.send("Storage.clearDataForOrigin", {"origin": origin, "storageTypes": STORED})
            session.detach()
            context.clear_cookies()
            context.clear_permissions()
            context.set_offline(False)
            self._free[kind].append(context)
        complaints, self.complaints = self.complaints, []
        assert complaints == [], complaints

    def state(self) -> str:
        """Return what the open pages show, and what was pressed there, for the report of a test that failed."""
        shown = []
        for _, context in self._used:
            for page in context.pages[1:] if context not in self._closed else ():
                with contextlib.suppress(Exception):  # a page that is lost must not hide the failure
                    shown += [
                        page.url,
                        *page.evaluate(
                            "() => [document.body.className, document.body.innerText, ...presses.slice(-40)]"
                        ),
                    ]
        return "\n".join(shown + self.complaints)

    def _context(self, **options: Any) -> Any:
        kind = repr(sorted(options.items()))
        free = self._free.setdefault(kind, [])
        if free:
            context = free.pop()
        else:
            context = self.browser.new_context(**options)
            context.on("close", lambda closed: self._closed.append(closed))
            context.on("request", self._check)
            context.add_init_script(f"({RECORD})()")
            context.new_page()
        self._used.append((kind, context))
        return context

    def _check(self, request: Any) -> None:
        if not request.url.startswith(self._allowed):
            self.complaints.append(f"request: {request.url}")
