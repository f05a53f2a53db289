"""The lab's robot, which the students of a class drive one after the other."""

from __future__ import annotations

from realitygap.robots import Label
from realitygap.world import Pose, paper_arena

from ._control import RobotControl, Visitor
from ._hand import Hand

CLASS = Visitor("class", "The class")
"""Operator of the robot while students drive it; no browser has this key."""


class SharedRobot:
    """The lab's robot, which one student at a time drives.

    Its process has the guardian of a robot that is driven by hand: the motors stop if commands, page, or lab end.

    Args:
        control: Control of the lab's robot.
        port: Its port.
        witness: HOST:PORT of the witness of an emulator in another program; empty if there is none.

    Attributes:
        path: Its poses since it was put at the start; only the start if nobody observes it.
        n_starts: Number of times that its path began.
    """

    def __init__(self, control: RobotControl, port: str, witness: str) -> None:
        self._control, self._port, self._witness = control, port, witness
        self._hand: Hand | None = None
        self._ready_at: int | None = 0
        self.path: list[Pose] = [Pose(*paper_arena().start)]
        self.n_starts = 1

    def connect(self) -> None:
        """Connect it, unless it is connected.

        Raises:
            StudyError: Something else uses the lab's robot.
        """
        if not self.has_process:
            self._control.connect(self._port, self._witness, CLASS)
            self._hand = self._control.hand

    @property
    def has_process(self) -> bool:
        """True if it is connected, or being connected."""
        return self._hand is not None and not self._hand.is_over

    @property
    def hand(self) -> Hand | None:
        """The connected robot; None if it is not connected, or a visitor of the lab has taken it over."""
        hand = self._hand
        is_ours = hand is not None and not hand.is_over and self._control.may_operate(CLASS)
        return hand if is_ours and hand is not None and hand.label else None

    @property
    def problem(self) -> str:
        """Why it cannot be driven; empty if it can."""
        hand = self._hand
        if hand is None or hand.is_over:
            return (hand.outcome if hand is not None else "") or "The robot is not connected."
        if not self._control.may_operate(CLASS):
            return f"{self._control.operator_name} has taken control of the robot, on the page Robot."
        if not hand.label:
            return f"Connecting to {hand.port}…"
        return "The robot does not answer. If it moves, switch it off." if hand.silent_s else ""

    @property
    def label(self) -> Label:
        """Label of the robot."""
        return "EMULATED" if self._hand is None or self._hand.label == "EMULATED" else "REAL"

    @property
    def is_observed(self) -> bool:
        """True if a witness observes its path and its cells, as for an emulated robot."""
        return self._hand is None or not self._hand.label or self._hand.arena is not None

    @property
    def cells(self) -> tuple[int, ...]:
        """Cells that its line has crossed, in the order of first visits."""
        hand = self.hand
        return () if hand is None or hand.senses is None else tuple(hand.senses.cells)

    @property
    def is_blocked(self) -> bool:
        """True if its motors run, and it does not move."""
        hand = self.hand
        return hand is not None and hand.senses is not None and hand.senses.moves and hand.senses.stalled

    @property
    def is_ready(self) -> bool:
        """True if it is at the start, and a reading has confirmed it."""
        hand = self.hand
        if hand is None or hand.doing is not None:
            return False
        if self._ready_at is None:
            self._ready_at = hand.n_live + 2  # the reading on its way is from before
            self.forget_path()
        return hand.n_live >= self._ready_at

    def put_at_start(self) -> None:
        """Put an observed robot at the start. The lecturer puts any other robot there."""
        if (hand := self.hand) is not None and hand.arena is not None:
            self._ready_at = None
            hand.want("place")
        else:
            self.forget_path()

    def forget_path(self) -> None:
        """Begin its path at the start."""
        self.path = [Pose(*paper_arena().start)]
        self.n_starts += 1

    def advance(self, now: float) -> None:
        """Add its present pose to its path."""
        hand = self.hand
        if hand is not None and hand.senses is not None and hand.senses.pose is not None and self.is_ready:
            self.path.append(Pose(*hand.senses.pose))

    def pull(self, move: float, turn: float) -> None:
        """Drive like this for a moment, if no other command arrives."""
        if (hand := self.hand) is not None and self.is_ready:
            hand.drive(move, turn, hand.n_stops)

    def release(self) -> None:
        """Stop the motors, because the pad was let go."""
        if (hand := self.hand) is not None:
            hand.release()

    def stop(self) -> None:
        """Stop the motors; a pad that is held must be let go before it drives again."""
        if (hand := self.hand) is not None:
            hand.stop_robot()

    def close(self) -> None:
        """Leave it connected for the others; the lab disconnects it at its end."""
