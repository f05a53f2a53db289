"""Serving the lab."""

from __future__ import annotations

import contextlib
import errno
import functools
import logging
import os
import secrets
import socket
import sys
import tempfile
import threading
import traceback
import webbrowser
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from realitygap._caller import called_by
from realitygap._foreign_text import script_text
from realitygap.errors import RealityGapError, StudyError, from_extra, whole_number
from realitygap.settings import shown

from ._access import LOOPBACK, Access

DEFAULT_PORT = 8321
SCHEME = "http"
LOST_S = 20.0
"""Time that a page may be out of reach, such as on a phone behind a wall, before it is loaded again [s]."""


THREADS = 32
"""Number of threads that wait for disks and ledgers. Some may wait long, and others must still be free."""


def open_lab(
    folder: str | Path = "results",
    *,
    port: int = DEFAULT_PORT,
    host: str | None = None,
    show: bool = True,
    tell: Callable[[str], None] = print,
    allow_code: bool = False,
    classroom: bool = False,
    robot: str = "",
    witness: str = "",
) -> None:
    """Serve the page of the studies in a folder until Ctrl-C.

    Args:
        folder: Of the studies' folders; made where it is not there. Nothing outside it is read or written.
        port: 0 to 65535; 0 takes one that is free.
        host: Address to answer at. Every visitor needs the token, which is printed with the address, also on this
            machine's loopback: any account of this machine can reach it. Default: 127.0.0.1; with a class 0.0.0.0.
        show: Whether to open the page in the browser.
        tell: Takes the lines for whoever started it.
        allow_code: Whether studies may run Python files of tasks, which are in the folder.
        classroom: Whether there is a class: students drive emulated robots from their phones, without the token.
        robot: Port of a robot that the students of the class drive in turns, such as /dev/rfcomm0; empty if each
            student has an emulated one.
        witness: HOST:PORT of that robot's witness, if it is an emulator in another program.

    Raises:
        StudyError: The folder cannot be made, or is the folder of one study; a robot without a class, or at a port
            that the lab does not open.
        RealityGapError: The address cannot be had, or the extra `lab` is not installed.
        ValueError: A port that there is not.
    """
    from_extra("nicegui", "lab")
    host = host or ("0.0.0.0" if classroom else "127.0.0.1")
    port = whole_number("port", port, 0, 65535)
    if (robot or witness) and not (robot and classroom):
        raise StudyError(
            f"{'--robot' if robot else '--witness'} needs {'--class' if robot else '--robot'}. Add it."
        )
    root = _root(Path(folder))
    if robot:
        from ._files import refuse_port

        refuse_port(root, robot)
    listener = _listen(host, port)
    token = secrets.token_urlsafe(16)
    with contextlib.closing(listener), contextlib.ExitStack() as while_served:
        addresses = [_address(name, listener, token) for name in _names(host)]
        is_local = host in LOOPBACK
        port = listener.getsockname()[1]
        if classroom:
            addresses = [address.replace("/?", "/class/board?") for address in addresses]
        students = addresses[0].partition("/board")[0] if classroom else ""
        lab, server = _prepare(
            root,
            token,
            port,
            is_local=is_local,
            allow_code=allow_code,
            students=students,
            robot=(robot, witness),
        )  # takes some seconds
        _tell_addresses(root, addresses, is_local, tell, students)
        if show:
            entry = while_served.enter_context(_entry(addresses[0], root))
            threading.Timer(0.5, _show, (entry, tell)).start()
        from ._mistakes import form_caller  # it imports all that the lab needs

        while_served.enter_context(called_by(form_caller()))
        try:
            server.run(sockets=[listener])
        finally:
            lab.close()


def _root(folder: Path) -> Path:
    if (folder / "study.json").exists():
        raise StudyError(
            f"{folder} is the folder of one study. Name the folder that it is in: {folder.resolve().parent}"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(
            f"{folder} cannot be a folder of studies: {error.strerror or error}. Name another one."
        ) from error
    return folder.resolve()


def _listen(host: str, port: int) -> socket.socket:
    try:
        family, kind, proto, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listener = socket.socket(family, kind, proto)
    except OSError as error:
        raise RealityGapError(
            f"--host {host}: {error.strerror or error}. Name an address of this machine."
        ) from error
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind(address)
        listener.listen(128)
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRNOTAVAIL:
            raise RealityGapError(
                f"--host {host} is no address of this machine. Name an address that it has, such as 0.0.0.0."
            ) from error
        raise RealityGapError(
            f"The lab cannot answer at {host}, port {port}: {error.strerror or error}. Is a lab running there? Name "
            "another port (--port N; 0 takes a free one)."
        ) from error
    return listener


def _names(host: str) -> list[str]:
    """Return the host names that reach the lab."""
    if host not in ("0.0.0.0", "::"):
        return [host]
    outward = ""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing: the system says by which address it would
        outward = probe.getsockname()[0]
    return [outward or socket.gethostname()]


def _address(name: str, listener: socket.socket, token: str) -> str:
    shown = f"[{name}]" if ":" in name else name
    return f"{SCHEME}://{shown}:{listener.getsockname()[1]}/?token={token}"


def _tell_addresses(
    root: Path, addresses: list[str], is_local: bool, tell: Callable[[str], None], students: str
) -> None:
    tell(f"The lab shows the studies in {root}. Ctrl-C ends it.")
    for address in addresses:
        tell(f"Open {address}")
        if not is_local and not students:
            tell(_qr_code(address))
    if students:
        tell(f"Students open {students} without the token. The page of the class shows its code.")
    tell("Everyone who has the address with the token can start studies and drive the robot. Keep it secret.")


def _qr_code(text: str) -> str:
    import io

    drawn = io.StringIO()
    from_extra("segno", "lab").make(text, error="l").terminal(drawn, compact=True, border=2)
    return drawn.getvalue().rstrip("\n")


def _prepare(
    root: Path,
    token: str,
    port: int,
    *,
    is_local: bool,
    allow_code: bool,
    students: str = "",
    robot: tuple[str, str] = ("", ""),
) -> tuple[Any, Any]:
    """The lab, and what will serve it."""
    import uvicorn
    from fastapi import FastAPI
    from nicegui import app as nicegui_app
    from nicegui import run, ui

    from ._class import Classroom
    from ._class_turns import Turns
    from ._connections import Strangers, end_lost_sockets, guarded_protocol, most_strangers
    from ._lab import Lab
    from ._shared_robot import SharedRobot
    from .pages import add_pages

    lab = Lab(root, allow_code=allow_code)
    if students:
        shared = SharedRobot(lab.robot, *robot) if robot[0] else None
        lab.classroom = Classroom(root, students) if shared is None else Turns(root, students, shared)
    run.thread_pool = ThreadPoolExecutor(THREADS)
    nicegui_app.config.quasar_config["loadingBar"]["skipHijack"] = (
        True  # pages show by themselves how far an upload is
    )
    _clean_pages()
    end_lost_sockets()
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    add_pages(lab)
    ui.run_with(
        app,
        title="realitygap lab",
        viewport="width=device-width, initial-scale=1, interactive-widget=resizes-content",
        tailwind=False,
        show_welcome_message=False,
        language="en-US",
        dark=None,
        reconnect_timeout=LOST_S,
    )
    logging.getLogger("uvicorn.error").addFilter(_is_news)
    for name in ("nicegui", "asyncio", "uvicorn.error", "engineio.server", "socketio.server"):
        logging.getLogger(name).addFilter(_in_one_line)
    most = most_strangers()
    config = uvicorn.Config(
        Access(app, token, port=port, is_local=is_local, has_class=bool(students)),
        http=guarded_protocol(Strangers(most)),
        backlog=most,  # so many are accepted together, before the first of them can be closed
        log_level="warning",
        access_log=False,
        ws_max_size=2**20,
        ws_per_message_deflate=False,  # costs more than it saves: messages are small, and the network is near
        server_header=False,
        timeout_graceful_shutdown=2,
    )
    return lab, uvicorn.Server(config)


def _clean_pages() -> None:
    """Let no text on a page control it; NiceGUI has no other place through which all of them go."""
    import nicegui.json

    write = nicegui.json.dumps
    if not hasattr(write, "of_lab"):

        @functools.wraps(write)
        def write_clean(*arguments: Any, **options: Any) -> str:
            return script_text(write(*arguments, **options))

        write_clean.of_lab = True  # type: ignore[attr-defined]  # marks our own, to install it once
        nicegui.json.dumps = write_clean


def _is_news(record: logging.LogRecord) -> bool:
    """Return True if a message of the server is of interest; a page that was closed while it was served is not."""
    return "ASGI callable returned without" not in record.getMessage()


def _in_one_line(record: logging.LogRecord) -> bool:
    """A failure in a page is one line: what, and where."""
    if record.exc_info and (error := record.exc_info[1]) is not None:
        places = traceback.extract_tb(error.__traceback__)
        where = f" ({Path(places[-1].filename).name}, line {places[-1].lineno})" if places else ""
        record.msg = "A page sent an invalid message, or this is a mistake in realitygap: %s"
        record.args, record.exc_info = (f"{shown(error)}{where}",), None
    return True


@contextlib.contextmanager
def _entry(address: str, root: Path) -> Iterator[str]:
    """The address that the browser opens.

    On Linux, every account can read the arguments of a program. There, the browser opens a file that only its owner can
    read and that leads to the address. It is in the lab's folder, because browsers in a sandbox of their own (snap,
    flatpak) see neither the system's folder for such files nor hidden ones.
    """
    if not sys.platform.startswith("linux"):
        yield address
        return
    folder = root if os.access(root, os.W_OK) else None
    with tempfile.NamedTemporaryFile("w", prefix="open-lab-", suffix=".html", dir=folder) as file:
        file.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={address}">')
        file.flush()
        yield Path(file.name).as_uri()


def _show(address: str, tell: Callable[[str], None]) -> None:
    opened: Any = False
    with contextlib.suppress(webbrowser.Error, OSError):
        opened = webbrowser.open(address)
    if not opened:
        tell("No browser could be opened here; the address above opens the lab.")
