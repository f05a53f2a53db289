"""Aseba's playground with one robot, in a separate network namespace.

The playground listens on all addresses and announces itself, so it must not see the network. A relay in its namespace
takes connections on a socket that was opened outside, on loopback, and passes their bytes on.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from realitygap.errors import RobotError
from realitygap.world import Pose

PROGRAMS = {"asebaplayground": "aseba", "dbus-daemon": "dbus", "ip": "iproute2", "busctl": "systemd"}
"""Programs that are needed, and the Debian packages that have them."""
INNER_PORT = 33333
START_S = 10.0
_BUS_NAME = "ch.epfl.mobots.AsebaPlayground"
_RELAY = Path(__file__).with_name("_relay.py")
_SCRIPT = """
ip link set lo up
export DBUS_SESSION_BUS_ADDRESS=unix:path=$HOME/bus QT_QPA_PLATFORM=offscreen XDG_RUNTIME_DIR=$HOME
dbus-daemon --session --nofork --address=$DBUS_SESSION_BUS_ADDRESS &
while [ ! -S "$HOME/bus" ]; do sleep 0.02; done
asebaplayground "$HOME/arena.playground" &
echo $! > "$HOME/process"
exec "$@"
"""
_SCENE = """<!DOCTYPE aseba-playground>
<aseba-playground>
  <color name="wall" r="0.9" g="0.9" b="0.9"/>
  <world w="{width}" h="{height}" color="wall"/>
  <robot type="thymio2" x="{x}" y="{y}" angle="{angle}" port="{port}" nodeId="1" name="t"/>
</aseba-playground>
"""


def why_not() -> str:
    """Return why no playground can be started here; empty if it can."""
    missing = [package for program, package in PROGRAMS.items() if shutil.which(program) is None]
    if missing:
        return f"The playground needs Debian packages: apt install {' '.join(missing)}."
    tried = subprocess.run([*_unshare(), "true"], capture_output=True, text=True, check=False)
    return f"No network namespace can be made: {tried.stderr.strip()}." if tried.returncode else ""


def _unshare() -> list[str]:
    return ["unshare", "-n"] if os.geteuid() == 0 else ["unshare", "-rn"]


class Playground:
    """A playground of an empty arena, which reports and sets the true pose of its robot.

    Args:
        width, height: Size of the arena [m].
        start: Pose at which the robot begins; the center if not given.
        port: Port on loopback to listen on; 0 for a free one.

    Attributes:
        port: Name of the robot's port, such as socket://127.0.0.1:43210.

    Raises:
        RobotError: It cannot be started; the message names what is missing.
    """

    def __init__(
        self, width: float = 1.0668, height: float = 0.6096, start: Pose | None = None, port: int = 0
    ) -> None:
        if reason := why_not():
            raise RobotError(reason)
        start = start or Pose(width / 2, height / 2, 0.0)
        self._folder = tempfile.TemporaryDirectory(prefix="playground-")
        self.folder = Path(self._folder.name)
        (self.folder / "arena.playground").write_text(
            _SCENE.format(
                width=width * 100,
                height=height * 100,
                x=start.x * 100,
                y=start.y * 100,
                angle=start.heading,
                port=INNER_PORT,
            )
        )
        with socket.create_server(("127.0.0.1", port)) as listener:
            self.port = f"socket://127.0.0.1:{listener.getsockname()[1]}"
            relay = [sys.executable, "-I", "-S", str(_RELAY), str(listener.fileno()), str(INNER_PORT)]
            self._process = subprocess.Popen(
                [*_unshare(), "sh", "-c", _SCRIPT, "sh", *relay],
                env={"PATH": os.environ.get("PATH", os.defpath), "HOME": str(self.folder)},
                pass_fds=(listener.fileno(),),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        try:
            self._path = self._find_robot()
        except BaseException:
            self.close()
            raise

    @property
    def process_id(self) -> int:
        """The number of the playground's process."""
        return int((self.folder / "process").read_text())

    def _find_robot(self) -> str:
        until = time.monotonic() + START_S
        while time.monotonic() < until and self._process.poll() is None:
            with contextlib.suppress(RobotError):
                found = self._call("/world", "EnkiWorld", "PhysicalObjectsByType", "s", "Thymio2")
                if found[1:2] == ["1"]:
                    return self._call("/world", "EnkiWorld", "PhysicalObject", "s", found[2])[1]
            time.sleep(0.05)
        raise RobotError(f"The playground did not start within {START_S:.0f} s.")

    def _busctl(self, *words: str) -> list[str]:
        command = ["busctl", f"--address=unix:path={self.folder}/bus", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RobotError(f"The playground does not answer: {done.stderr.strip()}.")
        return done.stdout.replace('"', "").split()

    def _call(self, path: str, interface: str, method: str, *words: str) -> list[str]:
        return self._busctl("call", _BUS_NAME, path, f"ch.epfl.mobots.{interface}", method, *words)

    @property
    def pose(self) -> Pose:
        """The true pose of the robot."""
        words = ("get-property", _BUS_NAME, self._path, "ch.epfl.mobots.EnkiPhysicalObject")
        x, y, angle = (float(self._busctl(*words, name)[1]) for name in ("x", "y", "angle"))
        return Pose(x / 100, y / 100, angle)

    def place(self, pose: Pose) -> None:
        """Put the robot, which must stand still, at a pose."""
        words = ("set-property", _BUS_NAME, self._path, "ch.epfl.mobots.EnkiPhysicalObject")
        values = {"x": pose.x * 100, "y": pose.y * 100, "angle": pose.heading}
        for name, value in values.items():
            self._busctl(*words, name, "d", "--", repr(value))

    def press(self, button: int, is_down: bool = True) -> None:
        """Press a button of the robot, or let it go; 2 is the one in the center."""
        self._call(
            f"{self._path}/thymio2", "PlaygroundThymio2", "SetButton", "ub", str(button), str(is_down).lower()
        )

    def close(self) -> None:
        """End the playground; safe to call twice."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
