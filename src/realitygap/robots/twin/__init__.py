"""Twins: robots of real wheels, motors and sensors in MuJoCo, as pseudo-reality unlike `sim`."""

from ._body import TwinBody
from ._families import FAMILIES, sample_twin
from ._file import load_twin
from ._model import TwinModel
from ._robot import TwinClock, TwinRobot

__all__ = ["FAMILIES", "TwinBody", "TwinClock", "TwinModel", "TwinRobot", "load_twin", "sample_twin"]
