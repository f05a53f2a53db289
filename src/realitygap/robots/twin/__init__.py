"""Twins: robots of real wheels, motors and sensors in MuJoCo, as pseudo-reality unlike `sim`."""

from ._body import TwinBody
from ._camera import TwinCamera
from ._families import EVERY, FAMILIES, Family, FamilyRow, Range, family_rows, sample_twin
from ._ir import places_of
from ._model import TwinModel, load_twin
from ._picture import outline_of, twin_picture
from ._robot import TwinRobot

__all__ = [
    "EVERY",
    "FAMILIES",
    "Family",
    "FamilyRow",
    "Range",
    "TwinBody",
    "TwinCamera",
    "TwinModel",
    "TwinRobot",
    "family_rows",
    "load_twin",
    "outline_of",
    "places_of",
    "sample_twin",
    "twin_picture",
]
