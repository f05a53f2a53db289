"""The commands `realitygap emulate ROBOT` of all families: their options, a robot served until the end, and its client.

Some old clients set DTR when they open a port. A pseudo-terminal has no such line, the call fails (ENOTTY), and they
wait for ever. Python looks for a module `sitecustomize` when it starts; the one written here, for the child
program only, lets such a call do nothing. It is written for Python 2 and 3, and for every pyserial.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Protocol, Self

import typer

from realitygap._terminal import echo
from realitygap.errors import RobotError

from ._emulated import EmulatedRobot
from ._serve import PtyChannel, Server, TcpChannel

if TYPE_CHECKING:
    from types import FrameType, TracebackType

ArenaOption = Annotated[str, typer.Option(metavar="NAME", help="Arena by name, or a TOML or SVG file.")]
LinkOption = Annotated[
    Path | None, typer.Option(metavar="PATH", help="Symbolic link to make to the pseudo-terminal.")
]
TcpOption = Annotated[
    int | None,
    typer.Option(
        metavar="PORT",
        min=0,
        max=65535,
        help="TCP port of this machine, instead of a pseudo-terminal; 0 for any.",
    ),
]
SpeedOption = Annotated[
    float,
    typer.Option(
        min=0,
        max=1000,
        help="Seconds of the robot per real second. 0: the witness sets the time, as fast as possible.",
    ),
]
WitnessOption = Annotated[
    int | None,
    typer.Option(
        metavar="PORT", min=0, max=65535, help="Serve pose, path and cells on this TCP port; 0 for any."
    ),
]
ExecOption = Annotated[
    str | None,
    typer.Option(
        "--exec",
        metavar="COMMAND",
        help="Run this program with its port in {port} and REALITYGAP_PORT, and end with it.",
    ),
]
QuietOption = Annotated[
    bool,
    typer.Option("--quiet", help="Print only the port, and the witness's address if there is one."),
]


class View(Protocol):
    """A live view of an emulated robot in the terminal."""

    def show(self) -> None:
        """Draw the current picture."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def serve(
    emulator: EmulatedRobot,
    *,
    link: Path | None = None,
    tcp: int | None = None,
    speed: float = 1.0,
    witness: int | None = None,
    command: str | None = None,
    view: Callable[[str], View] | None = None,
) -> None:
    """Serve an emulated robot until a signal, or until a client program has ended, whose status is then returned.

    Args:
        emulator: The robot.
        link: Symbolic link to make to the pseudo-terminal.
        tcp: TCP port, instead of a pseudo-terminal.
        speed: Seconds of the robot per real second; 0: the witness lets time pass.
        witness: TCP port of the witness.
        command: Client program to run.
        view: Maker of a live view, from the name of the channel. It is used only in a terminal.

    Raises:
        RobotError: Options exclude each other, or a port cannot be used.
    """
    if speed == 0 and witness is None:
        raise RobotError(
            "With --speed 0 a witness lets time pass. Add --witness PORT, or give another speed."
        )
    if link is not None and tcp is not None:
        raise RobotError(
            "--link goes with a pseudo-terminal, and --tcp asks for a TCP port. Give one of them."
        )
    channel = PtyChannel(link) if tcp is None else TcpChannel(tcp)
    with ExitStack() as stack:
        shown = None
        if view is not None and sys.stdout.isatty() and command is None:
            shown = view(channel.name)
        server = Server(emulator, channel, speed=speed, witness=witness, watch=shown.show if shown else None)
        if command is not None:
            stack.enter_context(_exit_on_sigterm())
        stack.enter_context(server)
        if command is None:
            stack.enter_context(ended_by_signals(server.stop))
        report(server.name, server.witness_address)
        if command is not None:
            server.start()
            raise typer.Exit(run_client(command, server.name))
        if shown:
            stack.enter_context(shown)
        server.run()


def report(port: str, witness_address: str | None) -> None:
    """Print the name of the port, and the address of the witness if there is one."""
    echo(port)
    if witness_address:
        echo(f"witness {witness_address}")
    sys.stdout.flush()


@contextmanager
def _exit_on_sigterm() -> Iterator[None]:
    """Let SIGTERM leave the program as an exception does, so that the link is removed."""

    def leave(number: int, frame: FrameType | None) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextmanager
def ended_by_signals(end: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end a server like a normal end."""

    def stop(number: int, frame: FrameType | None) -> None:
        end()

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


PORT_VARIABLE = "REALITYGAP_PORT"

PATCH = """\
# Written for the client of an emulated robot: a pseudo-terminal has no modem lines, and setting one does nothing.
import errno
import os
import sys

try:
    import fcntl
    import termios

    _ioctl = fcntl.ioctl
    _lines = (termios.TIOCMBIS, termios.TIOCMBIC, termios.TIOCMSET)

    def _forgiving(fd, request, *args):
        try:
            return _ioctl(fd, request, *args)
        except (IOError, OSError) as error:
            if request not in _lines or error.errno != errno.ENOTTY:
                raise
            return 0

    fcntl.ioctl = _forgiving
except (ImportError, AttributeError):
    pass

# another sitecustomize is loaded as before
_here = os.path.dirname(os.path.abspath(__file__))
sys.path[:] = [_place for _place in sys.path if os.path.abspath(_place) != _here]
_this = sys.modules.pop("sitecustomize", None)
try:
    import sitecustomize
except ImportError:
    if _this is not None:
        sys.modules["sitecustomize"] = _this
"""


@contextmanager
def client_environment(port: str) -> Iterator[dict[str, str]]:
    """Yield the environment of a client program: the port's name in REALITYGAP_PORT, and the patch."""
    with tempfile.TemporaryDirectory(prefix="realitygap-client-") as folder:
        (Path(folder) / "sitecustomize.py").write_text(PATCH, encoding="utf-8")
        others = os.environ.get("PYTHONPATH")
        paths = os.pathsep.join([folder, others] if others else [folder])
        yield {**os.environ, "PYTHONPATH": paths, PORT_VARIABLE: port}


def run_client(command: str, port: str) -> int:
    """Run a client program in a shell until it ends, and return its status.

    Args:
        command: Command to run; {port} in it is replaced by the port's name.
        port: Port for the client.

    Raises:
        RobotError: It cannot be started.
    """
    with client_environment(port) as environment:
        try:
            return subprocess.run(
                command.replace("{port}", port), shell=True, env=environment, check=False
            ).returncode
        except OSError as error:
            raise RobotError(f"{command!r} cannot be started ({error.strerror}).") from error
