"""The token, and files that somebody else may have written, in a real browser."""

from __future__ import annotations

import http.server
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.browsers import Visitors

from .conftest import OUTAGE, PATIENCE_MS

LOADED = "new"
"""A page that needs no study."""


@pytest.fixture
def newcomer(visitors: Visitors) -> Iterator[Any]:
    """A page of a browser that has never seen the lab."""
    context = visitors.browser.new_context()
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    yield page
    context.close()


def check_is_in(page: Any) -> None:
    page.get_by_role("link", name="realitygap lab").wait_for()
    assert "token" not in page.url


def test_printed_address_and_the_file_with_it_open_the_lab(lab, newcomer, tmp_path):
    newcomer.goto(lab.entry(LOADED))
    newcomer.wait_for_url(lab.address + LOADED)
    check_is_in(newcomer)
    newcomer.goto(lab.address)
    check_is_in(newcomer)
    cookie = next(each for each in newcomer.context.cookies() if each["name"].startswith("realitygap_lab"))
    assert cookie["httpOnly"]
    assert cookie["sameSite"] == "Strict"
    newcomer.context.clear_cookies()
    entry = tmp_path / "entry.html"
    entry.write_text(f'<!doctype html><meta http-equiv="refresh" content="0; url={lab.entry()}">')
    newcomer.goto(entry.as_uri())
    check_is_in(newcomer)


@pytest.mark.slow
def test_browser_without_the_token_sees_where_it_is_and_can_paste_it_or_the_address(lab, newcomer):
    for what in (lab.token, lab.entry()):
        newcomer.context.clear_cookies()
        answer = newcomer.goto(lab.address + LOADED)
        assert answer.status == 403
        newcomer.get_by_role("heading", name="The lab needs its token").wait_for()
        field = newcomer.get_by_label("Or paste the address or the token here")
        field.fill("wrong")
        newcomer.get_by_role("button", name="Open the lab").click()
        newcomer.get_by_text("The token is not the one of this lab.").wait_for()
        field.fill(what)
        newcomer.get_by_role("button", name="Open the lab").click()
        check_is_in(newcomer)


@pytest.mark.slow
def test_page_of_a_lab_that_was_started_again_tells_that_the_token_is_new(lab, visit):
    page = visit(LOADED, forgive=OUTAGE)
    lab.stop()
    lab.start()
    page.get_by_role("heading", name="The lab needs its token").wait_for()
    page.context.add_cookies([lab.cookie])
    page.get_by_role("link", name="load this page again").click()
    check_is_in(page)


@pytest.fixture
def elsewhere() -> Iterator[Callable[[str], str]]:
    """Serves a page at another port of this machine, as another account may: elsewhere(html) is its address."""
    pages: dict[str, bytes] = {}

    class Answer(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = pages.get(self.path, b"")
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: Any) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Answer) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()

        def serve(text: str) -> str:
            pages["/page"] = text.encode()
            return f"http://127.0.0.1:{server.server_address[1]}/page"

        yield serve
        server.shutdown()


ATTACK = """<!doctype html><title>trying</title><script>
const lab = "LAB", got = [];
const note = (what, value) => got.push(`${what}: ${value || "nothing"}`);
const soon = () => new Promise((end) => setTimeout(end, 1500));
const tried = (what, promise) => Promise.race([promise, soon()]).then(
  (value) => note(what, value), () => note(what, ""));
const read = (what, act) => { try { note(what, act()); } catch { note(what, ""); } };
const socket = () => new Promise((end) => {
  const open = new WebSocket(lab.replace("http", "ws") + "_nicegui_ws/socket.io/?EIO=4&transport=websocket");
  open.onmessage = () => end("a message");
  open.onerror = () => end("nothing");
});
const image = (address) => new Promise((end) => {
  const shown = new Image();
  shown.onload = () => end("an image");
  shown.onerror = () => end("nothing");
  shown.src = address;
});
(async () => {
  await tried("page", fetch(lab, { credentials: "include" }).then((answer) => answer.text()));
  await tried("stop", fetch(lab + "stop", { method: "POST", credentials: "include" }).then((answer) => answer.text()));
  await tried("websocket", socket());
  await tried("figure", image(lab + "figures/foreign/coverage-wide.svg"));
  read("cookie", () => document.cookie);
  read("storage", () => localStorage.length + " items");
  read("parent", () => parent !== window && parent.document.title);
  read("opener", () => opener && opener.document.title);
  document.title = got.join("; ");
})();
</script><form action="LABstop" method="post" target="_self"><button>Send</button></form>
<a href="LAB" target="_top">Leave</a>"""
NOTHING = "; ".join(
    f"{what}: nothing"
    for what in ("page", "stop", "websocket", "figure", "cookie", "storage", "parent", "opener")
)


@pytest.mark.slow
def test_page_at_another_port_gets_nothing(lab, newcomer, elsewhere):
    newcomer.context.add_cookies([lab.cookie])
    newcomer.goto(elsewhere(ATTACK.replace("LAB", lab.address)))
    newcomer.wait_for_function("document.title !== 'trying'")
    assert newcomer.title() == NOTHING.replace("storage: nothing", "storage: 0 items")  # its own


def make_report(root: Path, text: str) -> None:
    """A foreign study with this report."""
    folder = root / "foreign"
    folder.mkdir(parents=True)
    (folder / "study.json").write_text("{}")
    (folder / "report.html").write_text(text)


@pytest.mark.slow
def test_hostile_report_gets_nothing_in_a_tab_or_a_frame(lab, visit):
    make_report(lab.root, ATTACK.replace("LAB", lab.address))
    page = visit(LOADED, forgive=[""])  # the browser says what it refused
    frame = '<iframe src="/reports/foreign"></iframe>'
    page.evaluate("frame => document.body.insertAdjacentHTML('beforeend', frame)", frame)
    framed = page.query_selector("iframe").content_frame()
    framed.wait_for_url("**/reports/foreign")
    tab = page.context.new_page()
    tab.goto(lab.address + "reports/foreign")
    for shown in (framed, tab):
        shown.wait_for_function("document.title !== 'trying'", timeout=PATIENCE_MS)
        assert shown.title() == NOTHING
        shown.get_by_role("button", name="Send").evaluate("button => button.click()")
        shown.get_by_role("link", name="Leave").evaluate("link => link.click()")
    page.wait_for_timeout(500)
    assert page.url == lab.address + LOADED
