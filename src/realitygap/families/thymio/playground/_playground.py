"""Aseba's playground with one robot, in a separate network namespace.

The playground listens on all addresses and announces itself, so it must not see the network. A relay in its namespace
takes connections on a socket that was opened outside, on loopback, and passes their bytes on.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.emulator import cells_at_times
from realitygap.errors import RobotError
from realitygap.world import Arena, Pose, cells_along, paper_arena

from ._bus import Bus
from ._scene import CM, corner_of, scene_of

PROGRAMS = {"asebaplayground": "aseba", "dbus-daemon": "dbus", "ip": "iproute2", "unshare": "util-linux"}
"""Programs that are needed, and the Debian packages that have them."""
FASTEST = 8.0
"""Largest speed with which a playground was found to keep up, on two cores."""
LACKS = (
    "Aseba's playground differs from a Thymio: it reports targets as the speeds of the wheels, so there are no "
    "encoders and no stall; at a wall the robot slides and does not turn; infrared sensors do not see colors, "
    "and a ray that has lost a wall keeps its last reading; its noise has no seed, so a "
    "trial cannot be repeated exactly."
)
INNER_PORT = 33333
START_S = 10.0
STAND_S = 0.06
"""Time after which the pose of a robot at rest is constant [s of its time]."""
STAND_TRIES = 50
LOOKS = 3
"""Times that the pose is read for each try: a program that was held up answers first, then moves its robot."""
SAMPLE_S = 0.05
"""Time between two points of the path [s of the robot's time]."""
_BUS_NAME = "ch.epfl.mobots.AsebaPlayground"
_BODY = "ch.epfl.mobots.EnkiPhysicalObject"
_PROPERTIES = "org.freedesktop.DBus.Properties"
_RELAY = Path(__file__).with_name("_relay.py")
_SCRIPT = """
ip link set lo up
export DBUS_SESSION_BUS_ADDRESS=unix:path=$HOME/bus XDG_RUNTIME_DIR=$HOME
dbus-daemon --session --nofork --address=$DBUS_SESSION_BUS_ADDRESS < /dev/null &
while [ ! -S "$HOME/bus" ]; do sleep 0.02; done
if [ -n "$PLAYGROUND_PRELOAD" ]; then export LD_PRELOAD=$PLAYGROUND_PRELOAD; fi
asebaplayground "$HOME/arena.playground" < /dev/null &
echo $! > "$HOME/process"
unset LD_PRELOAD FAKETIME
exec "$@"
"""


def why_not(speed: float = 1.0) -> str:
    """Return why no playground can be started here at a speed; empty if it can."""
    missing = [
        package for program, package in PROGRAMS.items() if shutil.which(program, path=_path()) is None
    ]
    if speed != 1.0 and _faketime() is None:
        missing.append("faketime")
    if missing:
        return f"Aseba's playground needs Debian packages: apt-get install {' '.join(missing)}."
    tried = subprocess.run([*_unshare(), "true"], capture_output=True, text=True, check=False)
    if tried.returncode:
        return f"Aseba's playground needs a network namespace, which cannot be made here: {tried.stderr.strip()}."
    return ""


def _path() -> str:
    """Return the path for programs, with the folder of `ip`, which other users than root often lack."""
    return f"{os.environ.get('PATH', os.defpath)}:/usr/sbin:/sbin"


def _unshare() -> list[str]:
    return ["unshare", "-n"] if os.geteuid() == 0 else ["unshare", "-rn"]


def _faketime() -> Path | None:
    """Return the library that lets time pass faster."""
    found = sorted(Path("/usr/lib").glob("*/faketime/libfaketimeMT.so.1"))
    return found[0] if found else None


class Playground(ClosedOnExit):
    """A playground with a Thymio in an arena; the witness of it, too.

    Its time is that of its robot: seconds since it was started, times its speed. Its random numbers cannot be chosen.

    Args:
        arena: The walls and obstacles, and the start of the robot; the paper's if not given.
        speed: Seconds of the playground per second of real time, 0.1 to 8.
        port: Port on loopback to listen on; 0 for a free one.
        window: True to show its window.

    Attributes:
        port: Name of the robot's port, such as socket://127.0.0.1:43210.
        folder: Folder of its files.

    Raises:
        RobotError: It cannot be started; the message names what is missing.
    """

    def __init__(
        self, arena: Arena | None = None, *, speed: float = 1.0, port: int = 0, window: bool = False
    ) -> None:
        if not 0.1 <= speed <= FASTEST:
            raise RobotError(
                f"speed is {speed:g}, expected 0.1 to {FASTEST:g}: it may not keep up with more."
            )
        if window and not os.environ.get("DISPLAY"):
            raise RobotError("There is no display for the playground's window. Leave the window out.")
        if reason := why_not(speed):
            raise RobotError(reason)
        self._arena, self._speed = arena or paper_arena(), speed
        self._left, self._low = corner_of(self._arena)
        self._scene = scene_of(self._arena, INNER_PORT)
        self._folder = tempfile.TemporaryDirectory(prefix="playground-")
        self.folder = Path(self._folder.name)
        (self.folder / "arena.playground").write_text(self._scene)
        self._began = time.monotonic()
        self._bus: Bus | None = None
        self._lock = threading.RLock()
        self._points: list[tuple[float, float, float, float]] = []
        self._is_open = True
        self._process = self._start(port, window)
        try:
            self._path = self._find_robot()
        except BaseException:
            self.close()
            raise
        self._note()
        threading.Thread(target=self._follow, daemon=True).start()

    def _start(self, port: int, window: bool) -> subprocess.Popen[bytes]:
        try:
            listener = socket.create_server(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            self._folder.cleanup()
            raise RobotError(
                f"Port {port} cannot be used on 127.0.0.1 ({error}). Choose another, or 0 for any that is free."
            ) from error
        environment = {"PATH": _path(), "HOME": str(self.folder)}
        if window:
            home = Path(os.environ.get("HOME", "/"))
            environment["DISPLAY"] = os.environ["DISPLAY"]
            environment["XAUTHORITY"] = os.environ.get("XAUTHORITY", str(home / ".Xauthority"))
        else:
            environment["QT_QPA_PLATFORM"] = "offscreen"
        if self._speed != 1.0:
            environment |= {"PLAYGROUND_PRELOAD": str(_faketime()), "FAKETIME": f"+0 x{self._speed:g}"}
        with listener:
            self.port = f"socket://127.0.0.1:{listener.getsockname()[1]}"
            relay = [sys.executable, "-I", "-S", str(_RELAY), str(listener.fileno()), str(INNER_PORT)]
            return subprocess.Popen(
                [*_unshare(), "sh", "-c", _SCRIPT, "sh", *relay],
                env=environment,
                pass_fds=(listener.fileno(),),
                stdin=subprocess.PIPE,  # it ends with this program, however that ends
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )

    @property
    def process_id(self) -> int:
        """The number of the playground's process."""
        return int((self.folder / "process").read_text())

    def ended_by(self) -> str:
        """Return the name of the signal that ended the playground, such as SIGSEGV; empty if none did."""
        try:
            fields = Path(f"/proc/{self.process_id}/stat").read_text().rpartition(") ")[2].split()
            return signal.Signals(int(fields[-1]) & 127).name if fields[0] == "Z" else ""
        except (OSError, ValueError):
            return ""

    def _find_robot(self) -> str:
        until = time.monotonic() + START_S
        while time.monotonic() < until and self._process.poll() is None:
            with contextlib.suppress(RobotError):
                self._bus = self._bus or Bus(self.folder / "bus", _BUS_NAME)
                world = "/world", "ch.epfl.mobots.EnkiWorld"
                (names,) = self._bus.call(*world, "PhysicalObjectsByType", "s", "Thymio2")
                if names:
                    return str(self._bus.call(*world, "PhysicalObject", "s", names[0])[0])
            time.sleep(0.02)
        raise RobotError(f"The playground did not start within {START_S:.0f} s.")

    def _call(self, path: str, interface: str, member: str, signature: str, *values: object) -> Sequence[Any]:
        if self._bus is None:
            raise RobotError("The playground has ended.")
        try:
            return self._bus.call(path, interface, member, signature, *values)
        except RobotError as error:
            if name := self.ended_by():
                raise RobotError(
                    f"The playground was ended by the signal {name}. Start it again; if that happens often, report it "
                    "to the makers of Aseba."
                ) from error
            raise

    # the witness

    @property
    def waits(self) -> bool:
        """False: its time passes by itself, and cannot be held."""
        return False

    def release(self) -> None:
        """Do nothing: its time was not held."""

    def now(self) -> float:
        """Return the robot's time [s]; the path gets a point at it."""
        return self._note()

    def _note(self) -> float:
        with self._lock:
            pose, now = self.pose(), (time.monotonic() - self._began) * self._speed
            self._points.append((now, *pose))
            return now

    def _follow(self) -> None:
        """Add a point to the path again and again while the robot moves."""
        with contextlib.suppress(RobotError):
            while self._is_open:
                time.sleep(SAMPLE_S / self._speed)
                with self._lock:
                    if self.pose() != Pose(*self._points[-1][1:]):
                        self._note()

    def pose(self) -> Pose:
        """Return the true pose of the robot."""
        (properties,) = self._call(self._path, _PROPERTIES, "GetAll", "s", _BODY)
        x, y, angle = (properties[name][1] for name in ("x", "y", "angle"))  # each is a type and a value
        return Pose(x / CM + self._left, y / CM + self._low, angle)

    def place(self, pose: Pose, seed: int = 0) -> None:
        """Put the robot, whose motors are off, at a pose; the path begins again.

        Args:
            pose: The pose.
            seed: Not used: the playground's random numbers cannot be chosen.

        Raises:
            RobotError: The robot does not stand still.
        """
        wanted = Pose(*map(float, pose))
        values = {
            "x": (wanted.x - self._left) * CM,
            "y": (wanted.y - self._low) * CM,
            "angle": (wanted.heading + np.pi) % (2 * np.pi) - np.pi,
        }
        for _ in range(STAND_TRIES):
            for name, value in values.items():
                self._call(self._path, _PROPERTIES, "Set", "ssv", _BODY, name, ("d", float(value)))
            for _ in range(LOOKS):
                time.sleep(STAND_S / LOOKS / self._speed)
                found = self.pose()
            turned = abs((found.heading - wanted.heading + np.pi) % (2 * np.pi) - np.pi)
            if max(abs(found.x - wanted.x), abs(found.y - wanted.y), turned) < 1e-6:
                with self._lock:
                    self._points.clear()
                    self._note()
                return
        raise RobotError(
            f"The Thymio in the playground cannot be put at x {wanted.x:.3f}, y {wanted.y:.3f} m: it is driving, or "
            "something stands there."
        )

    def arena(self) -> Arena:
        """Return the arena in which it drives."""
        return self._arena

    def identity(self) -> str:
        """Return a text that is equal for playgrounds of equal scenes."""
        return f"playground {self._arena.name} {hashlib.sha256(self._scene.encode()).hexdigest()[:12]}"

    def motors(self) -> tuple[float, float]:
        """Return the speeds of the wheels between the last two points of the path, left and right [m/s]; 0 at rest."""
        with self._lock:
            now = (time.monotonic() - self._began) * self._speed
            last = self._points[-1]
            if now - last[0] > 2 * SAMPLE_S and self.pose() == Pose(*last[1:]):
                return 0.0, 0.0
        (before, x1, y1, heading), (after, x2, y2, turned) = [*self._points, *self._points][-2:]
        seconds = max(after - before, SAMPLE_S)
        ahead = ((x2 - x1) * np.cos(heading) + (y2 - y1) * np.sin(heading)) / seconds
        turn = ((turned - heading + np.pi) % (2 * np.pi) - np.pi) / seconds * 0.047
        return float(ahead - turn), float(ahead + turn)

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m] and heading [rad] since the robot was placed, (t, 4)."""
        with self._lock:
            return np.array(self._points, np.float64).reshape(-1, 4)

    def cells(self) -> tuple[int, ...]:
        """Return cells of the arena's grid along the driven line, in order of first visits."""
        return cells_along(self.path()[:, 1:3], self._arena.grid)

    def cells_at(self, times: Sequence[float]) -> tuple[int, ...]:
        """Return cells of the grid in which the robot was at given times [s], in order of first visits."""
        return cells_at_times(self.path(), self._arena.grid, times)

    # the robot's parts

    def press(self, button: int, is_down: bool = True) -> None:
        """Press a button of the robot, or let it go; 2 is the one in the center."""
        thymio = f"{self._path}/thymio2", "ch.epfl.mobots.PlaygroundThymio2"
        self._call(*thymio, "SetButton", "ub", button, is_down)

    def close(self) -> None:
        """End the playground; safe to call twice."""
        self._is_open = False
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()
        if self._bus is not None:
            self._bus.close()
        self._folder.cleanup()
