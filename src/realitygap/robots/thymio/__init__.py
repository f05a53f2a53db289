"""The Thymio II, driven over its own protocol (Aseba). It was tried on Aseba's playground, never on a robot."""

from ._ports import find_ports
from ._robot import Thymio, ThymioInfo

__all__ = ["Thymio", "ThymioInfo", "find_ports"]
