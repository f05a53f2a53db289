"""A port on which a robot is looked for, in its own process: the robot is asked for its name and let go."""

from __future__ import annotations

from importlib import import_module

from realitygap.robots import is_in_this_program, open_on

from ._channel import Channel, Message


def work(channel: Channel, order: Message) -> None:
    """Open the port, identify the robot, and close the port.

    Args:
        channel: To the server.
        order: `port`.
    """
    port = str(order["port"])
    if is_in_this_program(port):
        import_module("realitygap.emulator")  # which tells pyserial of such ports
    terminal, robot = open_on(port)
    with robot:
        facts = {key: str(value) for key, value in terminal.info(robot).items() if value not in (None, "")}
        channel.say("met", label=robot.label, facts=facts)
