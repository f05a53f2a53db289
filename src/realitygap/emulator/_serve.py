"""Serving an emulator to other programs, on a pseudo-terminal or a TCP port of this machine."""

from __future__ import annotations

import contextlib
import errno
import os
import selectors
import socket
import time
from collections.abc import Callable
from pathlib import Path
from threading import Event, RLock, Thread

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.errors import RobotError, check_finite

from ._emulated import SECOND, EmulatedRobot, nanoseconds
from ._witness import DirectWitness, ServedWitness, answer_witness

HOST = "127.0.0.1"
PIECE = 1 << 16
LONGEST_REQUEST = 1 << 16  # bytes of a line that a witness may send
SILENT_S = 0.002  # for so long a client says nothing that waits for more of an answer
ANSWER_S = 5.0  # within which an answer comes, by the emulator's time
LONGEST_S = 0.05  # of real time that the physics may take in one piece
PASSED_AT_ONCE_NS = SECOND // 4  # of the emulator's time, before it is looked whether they took so long
IDLE_S = 0.5  # while the wheels turn, physics are computed at least so often


class PtyChannel:
    """A pseudo-terminal. The emulator keeps its other side open, so that clients may come and go.

    Args:
        link: Path of a symbolic link to it.

    Raises:
        RobotError: There are no pseudo-terminals here, or the link cannot be made.
    """

    def __init__(self, link: Path | None = None) -> None:
        try:
            import tty
        except ImportError as error:
            raise RobotError("There are no pseudo-terminals on this system; use --tcp PORT.") from error
        self._master, self._slave = os.openpty()
        self._sides: tuple[int, ...] = (self._master, self._slave)
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.name = os.ttyname(self._slave)
        self._link: Path | None = None
        if link is not None:
            try:
                self._make_link(link)
            except RobotError:
                self.close()
                raise

    def _make_link(self, link: Path) -> None:
        if link.exists() and not link.is_symlink():
            raise RobotError(f"{link} exists and is not a link; choose another --link, or remove it.")
        beside = link.with_name(f".{link.name}.{os.getpid()}")
        try:
            beside.symlink_to(self.name)
            beside.replace(link)
        except OSError as error:
            with contextlib.suppress(OSError):
                beside.unlink()
            raise RobotError(f"{link}: no link can be made ({error.strerror}).") from error
        self._link = link

    def watch(self, selector: selectors.BaseSelector) -> None:
        """The master side brings bytes."""
        selector.register(self._master, selectors.EVENT_READ, self)

    def read(self, ready: object) -> bytes:
        """Return the bytes that a client sent."""
        try:
            return os.read(self._master, PIECE)
        except BlockingIOError:
            return b""
        except OSError as error:
            if error.errno == errno.EIO:
                return b""
            raise

    def write(self, data: bytes) -> int:
        """Write bytes and return how many the terminal took. It holds a few thousand if no client reads."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0

    def want_write(self, selector: selectors.BaseSelector, *, wanted: bool) -> None:
        """Choose whether the selector wakes when the terminal takes more."""
        selector.modify(self._master, selectors.EVENT_READ | (selectors.EVENT_WRITE if wanted else 0), self)

    def hang_up(self) -> None:
        """Interrupt the link: a pseudo-terminal goes silent, and bytes in transit are lost."""
        with contextlib.suppress(OSError):
            import termios

            termios.tcflush(self._slave, termios.TCIOFLUSH)

    def close(self) -> None:
        """Remove the link if it is still ours, and close both sides."""
        if self._link is not None:
            with contextlib.suppress(OSError):
                if str(self._link.readlink()) == self.name:
                    self._link.unlink()
            self._link = None
        sides, self._sides = self._sides, ()  # a closed descriptor's number soon belongs to something else
        for side in sides:
            with contextlib.suppress(OSError):
                os.close(side)


class TcpChannel:
    """A port on this machine, for one client at a time.

    Args:
        port: Number of the port; 0 for any free one.

    Raises:
        RobotError: The port cannot be had.
    """

    def __init__(self, port: int = 0) -> None:
        self._listening = listen(port)
        self.name = f"socket://{HOST}:{self._listening.getsockname()[1]}"
        self._client: socket.socket | None = None
        self._selector: selectors.BaseSelector | None = None

    def watch(self, selector: selectors.BaseSelector) -> None:
        """Register the port for new clients with the selector."""
        self._selector = selector
        selector.register(self._listening, selectors.EVENT_READ, self)

    def read(self, ready: object) -> bytes:
        """Return the bytes that the client sent. A second client is refused while there is a first."""
        if ready is self._listening:
            self._accept()
            return b""
        client = self._client
        if client is None:
            return b""
        try:
            data = client.recv(PIECE)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data:
            self.hang_up()
        return data

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            client, _ = self._listening.accept()
            if self._client is not None:
                client.close()
                return
            client.setblocking(False)
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._client = client
            if self._selector is not None:
                self._selector.register(client, selectors.EVENT_READ, self)

    def write(self, data: bytes) -> int:
        """Send bytes and return how many the client took. Without a client, all bytes are lost."""
        if self._client is None:
            return len(data)
        try:
            return self._client.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            self.hang_up()
            return len(data)

    def want_write(self, selector: selectors.BaseSelector, *, wanted: bool) -> None:
        """Choose whether the selector wakes when the client takes more."""
        if self._client is not None:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if wanted else 0)
            selector.modify(self._client, events, self)

    def hang_up(self) -> None:
        """Let go of the client."""
        if self._client is not None:
            if self._selector is not None:
                with contextlib.suppress(KeyError, ValueError):
                    self._selector.unregister(self._client)
            self._client.close()
            self._client = None

    def close(self) -> None:
        """Let go of the client and the port."""
        self.hang_up()
        self._listening.close()


Channel = PtyChannel | TcpChannel
"""A place to which a client connects."""


def listen(port: int) -> socket.socket:
    """Return a socket that listens on this machine only.

    Raises:
        RobotError: The port cannot be had.
    """
    listening = socket.socket()
    try:
        if os.name == "posix":
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((HOST, port))
        listening.listen(4)
        listening.setblocking(False)
    except (OSError, OverflowError) as error:
        listening.close()
        raise RobotError(
            f"Port {port} cannot be used on {HOST} ({error}). Choose another, or 0 for any that is free."
        ) from error
    return listening


class WitnessDoor:
    """Serves an emulator's witness as lines of JSON on a TCP port of this machine.

    Args:
        witness: Witness that answers.
        port: Number of the port; 0 for any free one.
    """

    def __init__(self, witness: ServedWitness, port: int = 0) -> None:
        self._witness = witness
        self._listening = listen(port)
        self.address = f"{HOST}:{self._listening.getsockname()[1]}"
        self._selector: selectors.BaseSelector | None = None
        self._clients: dict[socket.socket, bytearray] = {}
        self._holder: socket.socket | None = None  # who holds an emulator's time that passes by itself

    def watch(self, selector: selectors.BaseSelector) -> None:
        """Register the port for new clients with the selector."""
        self._selector = selector
        selector.register(self._listening, selectors.EVENT_READ, self)

    def serve(self, ready: object) -> None:
        """Accept a client, or answer one."""
        if ready is self._listening:
            with contextlib.suppress(OSError):
                client, _ = self._listening.accept()
                client.settimeout(5.0)
                self._clients[client] = bytearray()
                if self._selector is not None:
                    self._selector.register(client, selectors.EVENT_READ, self)
        elif isinstance(ready, socket.socket):
            try:
                self._answer(ready)
            except OSError:
                self._forget(ready)

    def _answer(self, client: socket.socket) -> None:
        data = client.recv(PIECE)
        held = self._clients[client]
        held += data
        if not data or len(held) > LONGEST_REQUEST:
            self._forget(client)
            return
        while b"\n" in held:
            line, _, rest = bytes(held).partition(b"\n")
            held[:] = rest
            waited = self._witness.waits
            answer = answer_witness(self._witness, line)
            if self._witness.waits and not waited:
                self._holder = client
            client.sendall(answer)

    def _forget(self, client: socket.socket) -> None:
        if self._selector is not None:
            with contextlib.suppress(KeyError, ValueError):
                self._selector.unregister(client)
        self._clients.pop(client, None)
        if client is self._holder:
            self._holder = None
            self._witness.release()
        client.close()

    def close(self) -> None:
        """Let go of everybody."""
        for client in list(self._clients):
            self._forget(client)
        self._listening.close()


class Server(ClosedOnExit):
    """Carries bytes between an emulator and a channel, in real time or a multiple of it.

    Args:
        emulator: The robot.
        channel: Channel for clients.
        speed: Seconds of the emulator in one of real time; 0: its time passes only while it answers, and when its
            witness lets it.
        witness: The port on which its witness is served, 0 for any; None for not at all.
        watch: Called about every `watch_s`.
        watch_s: Time between two calls of `watch` [s].

    Attributes:
        name: Name that a client opens.
        witness: The witness, in this process.
        witness_address: Address of the served witness, host:port.
    """

    def __init__(
        self,
        emulator: EmulatedRobot,
        channel: Channel,
        *,
        speed: float = 1.0,
        witness: int | None = None,
        watch: Callable[[], None] | None = None,
        watch_s: float = 0.125,
    ) -> None:
        check_finite({"speed": speed, "watch_s": watch_s})
        self.emulator, self._channel, self._speed = emulator, channel, speed
        self.name = channel.name
        self._lock = RLock()
        self.witness = DirectWitness(emulator, self._lock, waits=speed == 0, speed=speed)
        self._watch, self._watch_s, self._watched = watch, watch_s, 0.0
        try:
            self._door = None if witness is None else WitnessDoor(self.witness, witness)
        except RobotError:
            channel.close()
            raise
        self.witness_address = self._door.address if self._door else None
        self._selector = selectors.DefaultSelector()
        channel.watch(self._selector)
        if self._door:
            self._door.watch(self._selector)
        self._wake_read, self._wake_write = socket.socketpair()
        self._selector.register(self._wake_read, selectors.EVENT_READ, None)
        self._waiting = b""
        self._asked = 0  # when a client said something that may still be answered [ns]
        self._is_asked = False
        if self._door:
            self.witness.cells()  # compiled code takes a while to load, and time would run on meanwhile
        self._stopped = False
        self._is_away = False
        self._thread: Thread | None = None
        self._ended = Event()
        self._begun: float | None = None  # when its time would have begun; None while it waits

    @property
    def _waits(self) -> bool:
        return self.witness.waits

    def start(self) -> Server:
        """Serve in a separate thread until `close`."""
        self._thread = Thread(target=self.run, daemon=True)
        self._thread.start()
        return self

    def run(self) -> None:
        """Serve until `stop`."""
        try:
            while not self._stopped:
                ready = self._selector.select(self._pause())
                for key, _ in ready:
                    self._take(key.data, key.fileobj)
                if self._waits:
                    self._answer(is_silent=not ready)
                self._exchange()
        finally:
            self._ended.set()

    def stop(self) -> None:
        """Let `run` return; may be called from another thread or a signal handler."""
        self._stopped = True
        with contextlib.suppress(OSError):
            self._wake_write.send(b"!")

    def close(self) -> None:
        """Stop, and let go of the channel."""
        self.stop()
        if self._thread is not None:
            self._ended.wait(5.0)  # no join: a signal may have come before the thread began
        self._channel.close()
        if self._door:
            self._door.close()
        self._selector.close()
        self._wake_read.close()
        self._wake_write.close()

    def _pause(self) -> float | None:
        """Return the time until there is work again [s], or None while only a client can change anything."""
        with self._lock:
            due = self.emulator.next_event()
            turning = self.emulator.is_turning
        times = []
        if self._waits:
            if due is not None and self._is_asked and not self._waiting:
                times.append(SILENT_S)
        elif due is not None and not self._waiting:
            times.append((due - self.emulator.now_ns) / SECOND / self._speed - self._behind())
        if turning and not self._waits:
            times.append(IDLE_S)
        if self._watch:
            times.append(self._watched + self._watch_s - time.monotonic())
        if self.emulator.may_hang_up:
            times.append(IDLE_S)
        return max(0.0, min(times)) if times else None

    def _behind(self) -> float:
        """Return the delay of the emulator's time [s of real time]."""
        return (
            0.0 if self._begun is None else time.monotonic() - self._begun - self.emulator.now / self._speed
        )

    def _take(self, who: object, ready: object) -> None:
        if who is None:
            with contextlib.suppress(OSError):
                self._wake_read.recv(64)
        elif who is self._door and self._door is not None:
            with self._lock:
                self._catch_up()
            self._door.serve(ready)
        else:
            data = self._channel.read(ready)
            if data:
                with self._lock:
                    self._catch_up()
                    self.emulator.receive(data)
                    self._asked, self._is_asked = self.emulator.now_ns, True

    def _answer(self, *, is_silent: bool) -> None:
        """Let the time of an emulator that waits pass until it has answered.

        Args:
            is_silent: True if the client has waited for a while for further bytes.
        """
        with self._lock:
            while self._is_asked and (is_silent or self.emulator.is_talking):
                due = self.emulator.next_event()
                if due is None or due > self._asked + nanoseconds(ANSWER_S):
                    self._is_asked = False
                    break
                self.emulator.advance_to(due)
                self._waiting += self.emulator.transmit()
                is_silent = False

    def _catch_up(self) -> None:
        if self._waits:
            self._begun = None
            return
        if self._begun is None:
            self._begun = time.monotonic() - self.emulator.now / self._speed
        until = nanoseconds((time.monotonic() - self._begun) * self._speed)
        latest = time.monotonic() + LONGEST_S
        while self.emulator.now_ns < until:
            self.emulator.advance_to(min(until, self.emulator.now_ns + PASSED_AT_ONCE_NS))
            self.emulator.compute_motion()
            if (
                time.monotonic() > latest
            ):  # its body takes longer: time passes as fast as that can, and it answers
                self._begun = time.monotonic() - self.emulator.now / self._speed
                return

    def _exchange(self) -> None:
        """Let time pass, and transmit the output."""
        with self._lock:
            self._catch_up()
            self._follow_link()
            had = bool(self._waiting)
            self._waiting = self._waiting or self.emulator.transmit()
            if self._waiting:
                self._waiting = self._waiting[self._channel.write(self._waiting) :]
            if had or self._waiting:
                self._channel.want_write(self._selector, wanted=bool(self._waiting))
        if self._watch and time.monotonic() >= self._watched + self._watch_s:
            self._watched = time.monotonic()
            with self._lock:
                self._watch()

    def _follow_link(self) -> None:
        """Disconnect the client when the emulated link is interrupted."""
        is_away = not self.emulator.is_connected
        if is_away and not self._is_away:
            self._waiting = b""
            self._channel.hang_up()
        self._is_away = is_away


def serve_pty(
    emulator: EmulatedRobot, link: Path | None = None, *, speed: float = 1.0, witness: int | None = None
) -> Server:
    """Return an emulator on a pseudo-terminal, served by a thread until the server is closed.

    Args:
        emulator: The robot.
        link: Path of a symbolic link to it.
        speed: Seconds of the emulator in one of real time.
        witness: The port on which its witness is served, 0 for any; None for not at all.
    """
    return Server(emulator, PtyChannel(link), speed=speed, witness=witness).start()


def serve_tcp(
    emulator: EmulatedRobot, port: int = 0, *, speed: float = 1.0, witness: int | None = None
) -> Server:
    """Return an emulator on a TCP port of this machine, 0 for any, served by a thread until the server is closed."""
    return Server(emulator, TcpChannel(port), speed=speed, witness=witness).start()
