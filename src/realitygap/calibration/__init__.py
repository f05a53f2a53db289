"""Fits of a simulator to what was observed of a robot: arrays in, values out; no platform is run here."""

from ._abc import Effort, Posterior, fit_all
from ._evidence import Evidence, Vectors, evidence_of
from ._excitation import excitation, random_controllers, random_start
from ._prior import Effect, Parameter, numbers_of, ranges_of, scribbler_prior, standard_of, values_of

__all__ = [
    "Effect",
    "Effort",
    "Evidence",
    "Parameter",
    "Posterior",
    "Vectors",
    "evidence_of",
    "excitation",
    "fit_all",
    "numbers_of",
    "random_controllers",
    "random_start",
    "ranges_of",
    "scribbler_prior",
    "standard_of",
    "values_of",
]
