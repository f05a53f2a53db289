"""A playground for other programs: its robot on a TCP port, and its witness on another."""

from __future__ import annotations

import selectors

from realitygap._closed_on_exit import ClosedOnExit
from realitygap.emulator import WitnessDoor

from ._playground import Playground

LOOK_S = 0.2
"""Time between two looks at whether the playground still runs [s]."""


class PlaygroundServer(ClosedOnExit):
    """Serves the witness of a playground; its robot has a separate port.

    Args:
        playground: The playground.
        witness: Port of the witness, 0 for any that is free; None for no witness.

    Attributes:
        witness_address: Address of the witness, HOST:PORT; None without one.

    Raises:
        RobotError: The port cannot be used.
    """

    def __init__(self, playground: Playground, witness: int | None = None) -> None:
        self._playground = playground
        self._door = None if witness is None else WitnessDoor(playground, witness)
        self.witness_address = self._door.address if self._door else None
        self._selector = selectors.DefaultSelector()
        if self._door:
            self._door.watch(self._selector)
        self._is_stopped = False

    def run(self) -> None:
        """Serve until `stop`.

        Raises:
            RobotError: The playground has ended, as when its window is closed.
        """
        while not self._is_stopped:
            for key, _ in self._selector.select(LOOK_S):
                if self._door:
                    self._door.serve(key.fileobj)
            self._playground.pose()

    def stop(self) -> None:
        """Let `run` return; may be called from a signal handler."""
        self._is_stopped = True

    def close(self) -> None:
        """Let go of all who ask the witness."""
        if self._door:
            self._door.close()
        self._selector.close()
