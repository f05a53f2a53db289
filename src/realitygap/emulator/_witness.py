"""The operator's eyes and hands for an emulated robot."""

from __future__ import annotations

import json
import socket
from collections.abc import Sequence
from threading import Lock, RLock
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from realitygap._closed_on_exit import ClosedOnExit
from realitygap._limits import parse_json
from realitygap.errors import RobotError
from realitygap.world import Arena, Grid, Pose

from ._emulated import EmulatedRobot


class Witness(Protocol):
    """An observer that places an emulated robot and records where it drives.

    Headings are those of the end that is ahead at present, for a robot that can drive with either end ahead.
    """

    def now(self) -> float:
        """Return the emulator's time [s], which is that of `path`."""
        ...

    def place(self, pose: Pose, seed: int) -> None:
        """Place the robot at a pose with its motors off; the pen path and the sensor noise restart."""
        ...

    def arena(self) -> Arena:
        """Return the arena in which the robot drives and whose cells are counted."""
        ...

    def identity(self) -> str:
        """Return a description of what is emulated. It is equal for equal robots, whatever their ports."""
        ...

    def pose(self) -> Pose:
        """Return the present pose."""
        ...

    def motors(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel [m/s]."""
        ...

    def path(self) -> NDArray[np.float64]:
        """Return time [s], x [m], y [m] and heading [rad] of the pen since it was placed, (t, 4)."""
        ...

    def cells(self) -> tuple[int, ...]:
        """Return cells of the arena's grid along the driven line, in order of first visits."""
        ...

    def cells_at(self, times: Sequence[float]) -> tuple[int, ...]:
        """Return cells of the grid that the pen was in at given times [s], in order of first visits."""
        ...


class ServedWitness(Witness, Protocol):
    """A witness that can be served to other programs."""

    @property
    def waits(self) -> bool:
        """True if the emulator's time passes only when a program advances it."""
        ...

    def release(self) -> None:
        """Stop holding the time, if it was held."""
        ...


class DirectWitness:
    """The witness of an emulator in the same process.

    Args:
        emulator: Whom to watch.
        lock: Held while doing so.
        waits: True if the emulator's time passes only when a program advances it.
        speed: Seconds of the emulator per second of real time, if they pass automatically; 0: as fast as possible.
    """

    def __init__(
        self, emulator: EmulatedRobot, lock: RLock | None = None, *, waits: bool = False, speed: float = 0.0
    ) -> None:
        self._emulator = emulator
        self._lock = lock or RLock()
        self._speed = speed
        self.waits = waits

    def hold(self) -> float:
        """Let the emulator's time pass from now on only with `advance`, and while it answers.

        Returns:
            Speed at which time would pass: seconds of the emulator per second of real time; 0: as fast as possible.
        """
        self.waits = True
        return self._speed

    def release(self) -> None:
        """Stop holding the time."""
        self.waits = False

    def advance(self, seconds: float) -> None:
        """Let the time of an emulator that waits pass.

        Raises:
            ValueError: It passes by itself, or does not run backwards.
        """
        if not self.waits:
            raise ValueError("its time passes by itself; hold it first")
        with self._lock:
            self._emulator.advance(seconds)

    def now(self) -> float:
        """Return the emulator's time [s]."""
        return self._emulator.now

    def place(self, pose: Pose, seed: int) -> None:
        """Put the robot somewhere, motors off."""
        with self._lock:
            self._emulator.place(Pose(*pose), seed)

    def arena(self) -> Arena:
        """Return the arena in which the robot drives."""
        return self._emulator.arena

    def identity(self) -> str:
        """Return a description of what is emulated."""
        return self._emulator.identity

    def pose(self) -> Pose:
        """Return the present pose."""
        with self._lock:
            return self._emulator.pose

    def motors(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel [m/s]."""
        with self._lock:
            return self._emulator.wheel_speeds()

    def path(self) -> NDArray[np.float64]:
        """Return the path of the pen, (t, 4)."""
        with self._lock:
            return self._emulator.path()

    def cells(self) -> tuple[int, ...]:
        """Return cells along the driven line."""
        with self._lock:
            return self._emulator.cells()

    def cells_at(self, times: Sequence[float]) -> tuple[int, ...]:
        """Return cells at given times."""
        return cells_at_times(self.path(), self._emulator.arena.grid, times)


def cells_at_times(path: NDArray[np.float64], grid: Grid, times: Sequence[float]) -> tuple[int, ...]:
    """Return the cells in which a path (t, 4) was at given times [s], in order of first visits."""
    from realitygap.kernels.tasks.coverage import to_grid  # compiled code takes a while to import

    found = np.searchsorted(path[:, 0], np.asarray(times, dtype=float) + 1e-9, side="right") - 1
    cells: dict[int, None] = {}
    for row in path[np.maximum(found, 0)]:
        column, line = (int(to_grid(row[k], (grid.x, grid.y)[k - 1], grid.cell) // 1) for k in (1, 2))
        if 0 <= column < grid.columns and 0 <= line < grid.rows:
            cells[grid.columns * line + column] = None
    return tuple(cells)


def answer_witness(witness: Witness, line: bytes) -> bytes:
    """Return the answer to a request, a line of JSON: {"do": "place", "pose": [x, y, heading], "seed": 1}."""
    try:
        request = parse_json(line)
        result = _do(witness, request["do"], request)
    except (ValueError, KeyError, TypeError, ArithmeticError, RecursionError) as error:
        reply: dict[str, Any] = {"error": f"{type(error).__name__}: {error}"}
    else:
        reply = {"result": result}
    return json.dumps(reply).encode() + b"\n"


def _do(witness: Witness, what: str, request: dict[str, Any]) -> Any:
    if what == "place":
        return witness.place(Pose(*map(float, request["pose"])), int(request["seed"]))
    if what == "waits":
        return bool(getattr(witness, "waits", False))
    if what == "hold":
        return witness.hold() if isinstance(witness, DirectWitness) else None
    if what == "advance" and isinstance(witness, DirectWitness):
        return witness.advance(float(request["seconds"]))
    if what == "cells_at":
        return witness.cells_at([float(time) for time in request["times"]])
    if what == "path":
        return witness.path().tolist()
    if what == "arena":
        return witness.arena().to_dict()
    if what in ("now", "identity", "pose", "motors", "cells"):
        return getattr(witness, what)()
    raise ValueError(f"cannot do {what!r}")


class RemoteWitness(ClosedOnExit):
    """The witness of an emulator in another process, over TCP.

    Args:
        address: Host and port, as in 127.0.0.1:7002.
        timeout_s: Maximum time to wait for an answer [s].

    Raises:
        RobotError: Nobody answers there.
    """

    def __init__(self, address: str, timeout_s: float = 30.0) -> None:
        self._address = address
        host, _, port = address.rpartition(":")
        if not (port.isdecimal() and 0 < int(port) < 65536):
            raise RobotError(
                f"No witness at {address!r}, expected HOST:PORT such as 127.0.0.1:7002, as `realitygap emulate "
                "ROBOT --witness PORT` prints it."
            )
        try:
            self._socket = socket.create_connection((host or "127.0.0.1", int(port)), timeout=timeout_s)
        except OSError as error:
            raise RobotError(
                f"No witness at {address} ({error}). Start realitygap emulate ROBOT --witness PORT, and "
                "give 127.0.0.1:PORT."
            ) from error
        self._file = self._socket.makefile("rb")
        # of a question and its answer: a page that shows a trial looks from a thread of its own
        self._lock = Lock()

    def _ask(self, what: str, **values: Any) -> Any:
        try:
            with self._lock:
                self._socket.sendall(json.dumps({"do": what, **values}).encode() + b"\n")
                line = self._file.readline()
        except OSError as error:
            raise RobotError(f"The witness at {self._address} does not answer ({error}).") from error
        if not line:
            raise RobotError(f"The witness at {self._address} has gone; is the emulator still running?")
        reply = parse_json(line)
        if "error" in reply:
            raise RobotError(f"The witness at {self._address} says: {reply['error']}")
        return reply["result"]

    @property
    def waits(self) -> bool:
        """True if the emulator's time passes only when a program advances it."""
        return bool(self._ask("waits"))

    def hold(self) -> float | None:
        """Hold the time like `DirectWitness.hold`, until this connection ends. Return None if that is impossible."""
        speed = self._ask("hold")
        return None if speed is None else float(speed)

    def advance(self, seconds: float) -> None:
        """Let the time of an emulator that waits pass."""
        self._ask("advance", seconds=seconds)

    def now(self) -> float:
        """Return the emulator's time [s]."""
        return float(self._ask("now"))

    def place(self, pose: Pose, seed: int) -> None:
        """Put the robot somewhere, motors off."""
        self._ask("place", pose=list(pose), seed=seed)

    def arena(self) -> Arena:
        """Return the arena in which the robot drives."""
        return Arena.from_dict(self._ask("arena"))

    def identity(self) -> str:
        """Return a description of what is emulated."""
        return str(self._ask("identity"))

    def pose(self) -> Pose:
        """Return the present pose."""
        return Pose(*self._ask("pose"))

    def motors(self) -> tuple[float, float]:
        """Return the speeds of the left and the right wheel [m/s]."""
        left, right = self._ask("motors")
        return left, right

    def path(self) -> NDArray[np.float64]:
        """Return the path of the pen, (t, 4)."""
        return np.array(self._ask("path"), dtype=float).reshape(-1, 4)

    def cells(self) -> tuple[int, ...]:
        """Return cells along the driven line."""
        return tuple(self._ask("cells"))

    def cells_at(self, times: Sequence[float]) -> tuple[int, ...]:
        """Return cells at given times."""
        return tuple(self._ask("cells_at", times=list(times)))

    def close(self) -> None:
        """Let go of the connection."""
        self._file.close()
        self._socket.close()


def connect_witness(address: str) -> RemoteWitness:
    """Return the witness that `realitygap emulate ROBOT --witness PORT` serves, by 127.0.0.1:PORT."""
    return RemoteWitness(address)
