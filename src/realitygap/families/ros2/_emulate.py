"""`realitygap emulate ros2`."""

from __future__ import annotations

import contextlib
import selectors
import time
from importlib.util import find_spec
from typing import Annotated

import typer

from realitygap.emulator import SECOND, DirectWitness, WitnessDoor, open_arena
from realitygap.emulator import command as served
from realitygap.emulator.command import ArenaOption, QuietOption, WitnessOption
from realitygap.errors import RobotError

from ._address import read_address
from ._emulator import SCAN_TICKS, TICK_S, EmulatedRos2
from ._link import NEEDS_EXTRA
from ._messages import ODOMETRY, SCAN, TWIST, TWIST_STAMPED, full_topic
from ._robot import DEFAULT_ROBOT

SLOW_TICKS = 5
"""Ticks between two messages of sensors."""
PERIODS = {ODOMETRY: 1, SCAN: SCAN_TICKS}
"""Ticks between two messages of other types."""
FOREVER_S = 1e6
"""Life of a command of a robot that keeps the last one [s]."""


def emulate(
    robot: Annotated[
        str, typer.Option(metavar="NAME", help="Robot by name, or a file, whose [driver] has its topics.")
    ] = DEFAULT_ROBOT,
    body: Annotated[
        str,
        typer.Option(metavar="FILE", help="Robot file that moves instead, such as one with weaker motors."),
    ] = "",
    arena: ArenaOption = "paper",
    namespace: Annotated[str, typer.Option(metavar="NAME", help="Namespace of its topics.")] = "/",
    domain: Annotated[
        int | None, typer.Option(min=0, max=232, help="DDS domain. Default: ROS_DOMAIN_ID, or 0.")
    ] = None,
    interface: Annotated[
        str, typer.Option(metavar="NAME", help="Network interface. Default: only this machine.")
    ] = "",
    stamped: Annotated[
        bool, typer.Option("--stamped", help="Take TwistStamped instead of Twist, as robots since Jazzy do.")
    ] = False,
    tcp: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=65535,
            metavar="PORT",
            help="Serve realitygap at a TCP port of this machine, without DDS; 0 for any.",
        ),
    ] = None,
    witness: WitnessOption = None,
    quiet: QuietOption = False,
) -> None:
    """Emulate a robot on ROS 2, for your own ROS programs or for realitygap.

    It takes commands, and publishes odometry, scans, and what else its robot file names. The first line is its address.
    It is on this machine only unless you name an interface. Whoever is in that network can drive it.

    Example: realitygap emulate ros2 --robot turtlebot3-burger

    Example: realitygap emulate ros2 --namespace /robot1 --stamped --witness 7002

    In Python: realitygap.families.ros2.EmulatedRos2(realitygap.load_arena("paper"))
    """
    options = [f"domain={domain}"] * (domain is not None) + [f"interface={interface}"] * bool(interface)
    address = read_address(namespace + ("?" + "&".join(options) if options else ""))
    emulator = EmulatedRos2(open_arena(arena), robot, body, address.namespace)
    if tcp is not None:
        served.serve(emulator, tcp=tcp, witness=witness)
        return
    if find_spec("cyclonedds") is None:
        raise RobotError(NEEDS_EXTRA)
    server = DdsServer(
        emulator, address.domain, address.interface, TWIST_STAMPED if stamped else TWIST, witness
    )
    more = "".join(f"&{option}" for option in options).replace("&", "?", 1)
    with served.ended_by_signals(server.stop):
        served.report(f"ros2:{address.namespace}{more}", server.witness_address)
        server.run()


class DdsServer:
    """An emulated robot in a DDS domain, in real time.

    Args:
        emulator: The robot.
        domain: Number of the domain.
        interface: Network interface.
        kind: Type of the commands that it takes.
        witness: The port on which its witness is served, 0 for any; None for not at all.

    Raises:
        RobotError: The interface or the port cannot be used.
    """

    def __init__(
        self, emulator: EmulatedRos2, domain: int, interface: str, kind: str, witness: int | None
    ) -> None:
        from ._dds import Node

        self._emulator, self._kind = emulator, kind
        self._door = None if witness is None else WitnessDoor(DirectWitness(emulator), witness)
        self.witness_address = self._door.address if self._door else None
        try:
            self._node = Node(domain, interface)
        except ValueError as error:
            raise RobotError(str(error)) from error
        self._command = full_topic(emulator.namespace, emulator.wiring.command)
        self._node.subscribe(self._command, kind)
        self._is_stopped = False

    def run(self) -> None:
        """Serve until `stop`."""
        with selectors.DefaultSelector() as selector:
            if self._door:
                self._door.watch(selector)
            began, ticks = time.monotonic(), 0
            while not self._is_stopped:
                ticks += 1
                due = began + ticks * TICK_S
                while (left := due - time.monotonic()) > 0:
                    self._serve(selector, left)
                self._take()
                self._emulator.advance_to(round(ticks * TICK_S * SECOND))
                self._publish(ticks)
        if self._door:
            self._door.close()
        self._node.close()

    def _serve(self, selector: selectors.BaseSelector, seconds: float) -> None:
        """Answer the witness's clients for a while."""
        if self._door is None:
            time.sleep(seconds)
            return
        for key, _ in selector.select(seconds):
            self._door.serve(key.fileobj)

    def _take(self) -> None:
        for _, message in self._node.take():
            twist = message.twist if self._kind == TWIST_STAMPED else message
            life_s = self._emulator.timeout_s or FOREVER_S
            with contextlib.suppress(ValueError):  # of a number that is infinite or NaN
                self._emulator.command(twist.linear.x, twist.angular.z, life_s)

    def _publish(self, ticks: int) -> None:
        for topic, (kind, message) in self._emulator.messages().items():
            if ticks % PERIODS.get(kind, SLOW_TICKS) == 0:
                self._node.publish(topic, kind, message)

    def stop(self) -> None:
        """Let `run` return; may be called from a signal handler."""
        self._is_stopped = True
