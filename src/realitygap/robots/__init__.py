"""The contract of a robot, and what drivers of all families share: ports, recordings, guardians, clocks."""

from . import twin
from ._bases import PortDriver, ProgramRobot
from ._clock import HEAR_S, Clock, SystemClock, VirtualClock
from ._contract import (
    Command,
    Label,
    Observation,
    Robot,
    channels_of,
    check_command,
    check_observation,
    select_channels,
)
from ._guardian import EXITS, Guardian, descriptor_of
from ._guardian_process import GIVE_UP_S, SILENT_S
from ._ports import (
    Port,
    PortGuess,
    Terminal,
    is_in_this_program,
    is_pseudo_terminal,
    list_ports,
    open_on,
    reason_of,
    serial_port,
    split_port,
    typed_port,
)
from ._recorded_robot import RecordedRobot
from ._recording import Recording, read_recording
from ._recording_mcap import export_mcap
from ._stall import StallRule

__all__ = [
    "EXITS",
    "GIVE_UP_S",
    "HEAR_S",
    "SILENT_S",
    "Clock",
    "Command",
    "Guardian",
    "Label",
    "Observation",
    "Port",
    "PortDriver",
    "PortGuess",
    "ProgramRobot",
    "RecordedRobot",
    "Recording",
    "Robot",
    "StallRule",
    "SystemClock",
    "Terminal",
    "VirtualClock",
    "channels_of",
    "check_command",
    "check_observation",
    "descriptor_of",
    "export_mcap",
    "is_in_this_program",
    "is_pseudo_terminal",
    "list_ports",
    "open_on",
    "read_recording",
    "reason_of",
    "select_channels",
    "serial_port",
    "split_port",
    "twin",
    "typed_port",
]
