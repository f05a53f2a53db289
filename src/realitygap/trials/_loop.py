"""One trial on one robot: the loop of sensing, computing, and driving, until the trial ends."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence

import numpy as np

from realitygap.errors import RobotError, RobotStopped
from realitygap.evolution import ControllerInterface, Network, inputs_of_robot, listed, paper_interface
from realitygap.records import EndReason, TrialRecord
from realitygap.robots import (
    Clock,
    Command,
    Observation,
    Robot,
    SystemClock,
    channels_of,
    check_observation,
    select_channels,
)
from realitygap.world import Pose

Controller = Callable[[Observation, int], Command]
"""Returns the command of a step from the observation before it and the step's number, which counts from 0."""

Look = Callable[[int], None]
"""Called with the number of the step before each command, and with the number of all steps after the last."""

Watch = Callable[[int, Observation, Command], bool]
"""Called with the step's number, the observation, and the command before that is sent; True aborts the trial."""


class TrialInterrupted(KeyboardInterrupt):
    """The program is being stopped in the middle of a trial; the motors are stopped as far as the wire allows.

    Attributes:
        trial: The trial up to there.
    """

    def __init__(self, trial: TrialRecord) -> None:
        super().__init__("the program was stopped in the middle of a trial")
        self.trial = trial


def run_trial(
    robot: Robot,
    controller: Controller,
    n_steps: int,
    *,
    start: Pose | None = None,
    begin: Callable[[], None] | None = None,
    look: Look | None = None,
    watch: Watch | None = None,
    sees_end: bool = False,
    channels: Sequence[str] = (),
) -> TrialRecord:
    """Run one trial on a robot. Its motors are always stopped at the end.

    Args:
        robot: Connected robot. A physical robot must already be at its start.
        controller: Makes a command of each observation.
        n_steps: Number of commands in a whole trial, >= 1.
        start: Pose at which a simulated robot is put; the robot's own start if not given.
        begin: Called once the robot is reset.
        look: Function that is called after each observation, and once when the robot is at rest at the end.
        watch: Called at each step, before its command is sent.
        sees_end: True to observe the robot once more after the last command.
        channels: Names of the sensors that the controller sees besides range sensors.

    Returns:
        The trial. If the robot, `begin`, or `look` fails, it ended as LOST.
        If the operator stops the robot by its button, it ended as ABORTED.

    Raises:
        TrialInterrupted: Instead of a KeyboardInterrupt or SystemExit, which is its cause.

    Source: Rosenzweig & Remy, sections 2.1 to 2.3.
    """
    clock: Clock = getattr(robot, "clock", None) or SystemClock()
    looks: list[tuple[float, Observation]] = []
    commands: list[Command] = []

    def record(end: EndReason, problem: str = "") -> TrialRecord:
        t = len(commands)
        n = len(looks) if end is EndReason.STEP_LIMIT else t
        seen = [observation for _, observation in looks[:n]]
        readings = np.array([each.readings for each in seen], np.float64).reshape(n, robot.n_sensors)
        stalled = np.array([each.stalled for each in seen], np.bool_)
        return TrialRecord(
            start=start or (0.0, 0.0, 0.0),
            step_s=robot.step_s,
            commands=np.array(commands, np.float64).reshape(t, 2),
            readings=readings[:t],
            stalled=stalled[:t],
            end=str(end),
            last_readings=readings[t:].reshape(-1),
            last_stalled=bool(stalled[t:].any()),
            times=np.array([time for time, _ in looks[:n]], np.float64),
            raw=np.array([each.raw for each in seen], np.float64).reshape(n, -1 if n else 0),
            problem=problem,
        )

    try:
        select_channels(robot, channels)
        robot.reset(start)
        if begin is not None:
            begin()
        began = clock.now()
        for number in range(n_steps):
            seen = check_observation(robot.observe())
            time = clock.now() - began
            if look is not None:
                look(number)
            command = controller(seen, number)
            if watch is not None and watch(number, seen, command):
                return record(EndReason.ABORTED, f"aborted by the operator before step {number + 1}")
            looks.append((time, seen))
            commands.append(command)
            robot.drive(command)
        robot.stop()
        if sees_end:
            seen = check_observation(robot.observe())
            looks.append((clock.now() - began, seen))
        if look is not None:
            look(n_steps)
        return record(EndReason.STEP_LIMIT)
    except RobotStopped as error:
        return record(EndReason.ABORTED, str(error))
    except RobotError as error:
        return record(EndReason.LOST, str(error))
    except (KeyboardInterrupt, SystemExit) as error:
        raise TrialInterrupted(record(EndReason.INTERRUPTED, "the program was stopped")) from error
    finally:
        with contextlib.suppress(RobotError):
            robot.stop()


def drive_trial(
    robot: Robot,
    network: Network,
    n_steps: int,
    *,
    interface: ControllerInterface | None = None,
    watch: Watch | None = None,
    sees_end: bool = False,
) -> TrialRecord:
    """Run one trial of a network on a robot that is at its start.

    The network sees what its interface names. A constant input is part of the network.

    Args:
        robot: Connected, and placed at the start.
        network: Has as many inputs as the interface, and two outputs.
        n_steps: Number of commands in a whole trial, >= 1.
        interface: Names of the inputs; the paper's largest reading, stall and step / steps if not given.
        watch: Called at each step, before its command is sent.
        sees_end: True to observe the robot once more after the last command.

    Returns:
        The trial. If the robot fails, it ended as LOST.

    Raises:
        ControllerError: The robot lacks an input.
        ValueError: The network has another number of inputs or outputs.
        TrialInterrupted: Instead of a KeyboardInterrupt or SystemExit, which is its cause.
    """
    interface = interface or paper_interface(constant=False)
    interface.check(inputs_of_robot(robot.n_sensors, channels_of(robot)), "The network", "the robot")
    controller = controller_of(network, interface, n_steps)
    return run_trial(robot, controller, n_steps, watch=watch, sees_end=sees_end, channels=interface.channels)


def controller_of(
    network: Network,
    interface: ControllerInterface,
    n_steps: int,
    note: Callable[[list[float]], None] | None = None,
) -> Controller:
    """Return the controller that a network is: outputs outside of -1..1 are limited, and NaN is 0.

    The network is compiled here, before the robot moves: a watchdog would take that for silence.

    Args:
        network: The network.
        interface: Names of its inputs and outputs.
        n_steps: Number of commands in a whole trial.
        note: Called with the inputs of each step, without the constant one.

    Raises:
        ValueError: The network has another number of inputs or outputs than its interface names.
    """
    expected = (len(interface.sensed), len(interface.outputs))
    if (network.n_inputs, network.n_outputs) != expected:
        raise ValueError(
            f"The network has {network.n_inputs} inputs and {network.n_outputs} outputs, expected {expected[0]} "
            f"({listed(interface.sensed)}) and {expected[1]} ({listed(interface.outputs)})."
        )
    sense = interface.bind(n_steps)
    network.activate([0.0] * network.n_inputs)
    network.reset()

    last = Command(0.0, 0.0)

    def controller(seen: Observation, step: int) -> Command:
        nonlocal last
        before = Command(0.0, 0.0) if step == 0 else last
        channels = {**seen.channels, "last_move": before.move, "last_turn": before.turn}
        inputs = sense(seen.readings, seen.stalled, step, channels)
        if note is not None:
            note(inputs)
        last = Command(*interface.commands(network.activate(inputs)).tolist())
        return last

    return controller


def replaying(commands: Sequence[Command]) -> Controller:
    """Return a controller that gives these commands, whatever it observes."""
    return lambda seen, step: commands[step]
