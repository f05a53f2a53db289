"""A lab in a process of its own, and pages of it in a real browser.

Every test also fails on any message of the console and on any request but to the lab.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import pytest

from realitygap.lab import _child
from tests.browsers import Visitors, open_browser

from .forked_children import FOR_CHILDREN, Forking
from .served import LOG, begin

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright: uv sync --extra dev")
expect = playwright.expect
"""Waits for what it expects: a page on a busy machine shows it later."""

DESKTOP, PHONE = (1440, 900), (390, 844)
PATIENCE_MS = 120_000
expect.set_options(timeout=PATIENCE_MS)
OUTAGE = ("net::ERR", "Failed to fetch", "WebSocket connection", "reloading because", "status of 403")
"""What a browser says of a page whose lab is gone, or was started again with another token."""

ENDLESS_CHECKS = """
import sys
if "realitygap.lab._work" in sys.orig_argv:
    import time
    from realitygap.lab import _checks
    check = _checks._check
    def slow(root, text, **options):
        time.sleep(300 if "endless" in text else 0)
        return check(root, text, **options)
    _checks._check = slow
"""


class RunningLab:
    """A lab of a folder; `address` is that of its first page, `cookie` what lets a browser in.

    Args:
        root: The folder.
        is_forking: Whether its child processes are forked instead of new Pythons.
        limits: Limits of its process, such as `resource.RLIMIT_NOFILE`, and their values.
        port: Where it listens; 0 for any free port.
        has_class: Whether it has a class.
    """

    def __init__(
        self,
        root: Path,
        *,
        is_forking: bool = True,
        limits: dict[int, int] | None = None,
        port: int = 0,
        has_class: bool = False,
    ) -> None:
        self.root = root
        self._is_forking = is_forking
        self._limits = limits
        self._has_class = has_class
        self.address = ""
        self.token = ""
        self._port = port
        self._process: BaseProcess | None = None

    def start(self) -> None:
        self._process, printed = begin(
            self.root,
            self._port,
            is_forking=self._is_forking,
            limits=self._limits,
            has_class=self._has_class,
        )
        self.address, _, self.token = printed.replace("class/board", "").partition("?token=")
        self._port = int(self.address.rstrip("/").rpartition(":")[2])

    @property
    def cookie(self) -> dict[str, Any]:
        named = {"name": f"realitygap_lab_{self._port}", "value": self.token, "url": self.address}
        return {**named, "httpOnly": True, "sameSite": "Strict"}

    def entry(self, path: str = "") -> str:
        """The address of a page with the token."""
        return f"{self.address}{path}?token={self.token}"

    def lag(self) -> float:
        """The most that its event loop was late since this was asked last [s]."""
        return float(self._get("lag"))

    def list_port(self, name: str) -> None:
        """Have its pages list this port only."""
        self._get(f"list-port{name}")

    def slow_counts(self) -> None:
        """Have its pages change before whoever enters a count hears of it."""
        self._get("slow-counts")

    def post(self, path: str) -> bytes:
        """Send a request without a body; the answer."""
        return self._get(path, method="POST")

    def read(self, path: str) -> str:
        """The text of a page, with its elements, as a browser gets it."""
        return self._get(path).decode()

    def _get(self, path: str, method: str = "GET") -> bytes:
        cookie = f"{self.cookie['name']}={self.token}"
        request = Request(self.address + path, headers={"Cookie": cookie}, method=method)
        with urlopen(request, timeout=PATIENCE_MS / 1000) as answer:
            content: bytes = answer.read()
            return content

    def make_checks_endless(self) -> None:
        """Have every check of a study file with the word "endless" take longer than its limit."""
        folder = self.root.parent / FOR_CHILDREN
        folder.mkdir()
        (folder / "sitecustomize.py").write_text(ENDLESS_CHECKS)

    def kill(self) -> None:
        """End drive as a power cut does."""
        assert self._process is not None
        self._process.kill()
        self._process.join()

    def stop(self) -> None:
        """End drive as Ctrl-C does."""
        process = self._process
        assert process is not None
        assert process.pid is not None
        if process.is_alive():
            os.kill(process.pid, signal.SIGINT)
            process.join(PATIENCE_MS / 1000)
        if process.is_alive():
            os.kill(process.pid, signal.SIGABRT)  # which says where it hangs
            process.join()
            raise AssertionError(f"the lab does not end: {self.said}")

    @property
    def said(self) -> str:
        """What it said to its terminal."""
        return (self.root.parent / LOG).read_text("utf-8")


NEW_PYTHONS = pytest.mark.parametrize("lab", ["new Pythons"], indirect=True)
"""Marks a test whose lab starts its child processes as it does for a user."""


@pytest.fixture(scope="package")
def lab_port() -> Iterator[int]:
    """A port for all labs of this process, so that a browser need not compile their scripts again.

    A socket that is bound, and does not listen, keeps it from other processes; a lab can listen there nevertheless.
    """
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        yield holder.getsockname()[1]


@pytest.fixture
def lab(tmp_path: Path, request: pytest.FixtureRequest, lab_port: int) -> Iterator[RunningLab]:
    if "emulated" in request.fixturenames:  # a lab that ends waits for its robot, so the robot ends after it
        request.getfixturevalue("emulated")
    running = RunningLab(tmp_path / "studies", is_forking=not hasattr(request, "param"), port=lab_port)
    running.start()
    yield running
    running.stop()
    assert "Traceback" not in running.said


@pytest.fixture
def forked_children(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have child processes of the lab's parts in this process be forked."""
    monkeypatch.setattr(_child, "subprocess", Forking())


@pytest.fixture(scope="package")
def visitors() -> Iterator[Visitors]:
    """A browser for all tests of the lab, and pages in it."""
    with open_browser() as browser:
        yield Visitors(browser)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Add what the pages show to the report of a failed test."""
    report = yield
    visitors = getattr(item, "funcargs", {}).get("visitors")
    if report.when == "call" and report.failed and visitors is not None:
        report.sections.append(("Pages", visitors.state()))
    return report


@pytest.fixture
def visit(visitors: Visitors, lab: RunningLab) -> Iterator[Callable[..., Any]]:
    """Opens a page of the lab, in a browser of its own: visit("new")."""

    def open_page(path: str = "", size: tuple[int, int] = DESKTOP, **options: Any) -> Any:
        allowed = (lab.address, lab.address.replace("http", "ws"), "data:", "blob:")
        page = visitors.open_page(size, allowed, PATIENCE_MS, cookies=[lab.cookie], **options)
        page.goto(lab.address + path)
        # Before its handshake with the server a page may swap two events that are 10 ms apart.
        page.wait_for_function("() => window.did_handshake !== false")
        return page

    yield open_page
    visitors.leave(lab.address.rstrip("/"))


@pytest.fixture
def emulated() -> Iterator[tuple[str, str]]:
    """The port and the witness of an emulated robot in a process of its own.

    Each test has its own: a lab that has just ended may hold its port for a moment longer.
    """
    command = ["-m", "realitygap", "emulate", "scribbler", "--tcp", "0", "--witness", "0", "--quiet"]
    with subprocess.Popen([sys.executable, *command], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        port, witness = (process.stdout.readline().split()[-1] for _ in range(2))
        yield port, witness
        process.terminate()


def open_advanced(page, field) -> None:
    """Open the section Advanced, unless the field is seen."""
    advanced = page.get_by_text("Advanced", exact=True)
    advanced.or_(field).first.wait_for()
    if not field.is_visible():
        advanced.first.click()
    field.wait_for()


def open_fold(page, title) -> None:
    """Open a section of the page Trials, unless it is open."""
    fold = page.locator(f'[data-fold="{title}"]')
    fold.wait_for()
    if "q-expansion-item--expanded" not in (fold.get_attribute("class") or ""):
        fold.locator(".lab-fold").click()
    expect(fold.locator(".q-expansion-item__content").first).to_be_visible()


def enter(page, label, text) -> None:
    """Enter a text in a field; if the field offers texts, choose it, or type one that is not offered."""
    field = page.get_by_label(label, exact=True).first
    picker = page.locator(".lab-picker", has=field).first
    field.wait_for()
    if picker.count() == 0:
        field.fill(text)
        return
    select = picker.locator("select")
    offered = select.evaluate("it => [...it.options].map(({value}) => value)")
    if text in offered:
        select.select_option(text)
        return
    select.select_option(index=len(offered) - 1)
    picker.locator("input").fill(text)


def wait_connected(page: Any, port: str) -> None:
    """Wait until a robot is connected. If it did not answer in time, the page says so, and is told to try again."""
    connected, retry = page.get_by_text(f"Connected to {port}"), page.get_by_role("button", name="Retry")
    for _ in range(40):
        connected.or_(retry).first.wait_for()
        if connected.is_visible():
            return
        with contextlib.suppress(playwright.Error):  # it connects at this moment
            retry.click(timeout=1000)
    raise AssertionError(page.locator("main").inner_text())
