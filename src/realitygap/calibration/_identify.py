"""Identified parameters, inseparable ones, and the trials to record to identify them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from realitygap.records import CALIBRATES, Observe

from ._prior import ENDS, PRIOR_PRECISION, Known, Parameter, is_identified, place_of
from ._simulate import Floats

LEARNED = 20.0  # times the prior's precision: a parameter that would be known if the others were
UNLEARNED = 6.0  # times the prior's precision along a direction: below it that direction is not known
TOGETHER = 0.1  # share of a direction from which on a parameter belongs to it


@dataclass(frozen=True)
class Identified:
    """The identification of a parameter.

    Attributes:
        ratio: Width of its posterior interval in parts of the prior's.
        identified: True if the ratio is less than half.
        partners: Parameters that cannot be distinguished from it: only a combination of them is known.
    """

    ratio: float
    identified: bool
    partners: tuple[str, ...] = ()


def collinear_groups(sensitivities: Floats, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return groups of parameters that the observations know only together.

    Args:
        sensitivities: (n, p) derivatives of what was observed, in standard deviations of its noise, by each parameter
            in parts of what was thought possible.
        names: (p,) names of the parameters.

    Source: eigenvectors of the Fisher information, as in the profile of sloppy models (Gutenkunst et al. 2007).
    """
    information = sensitivities.T @ sensitivities
    sizes, directions = np.linalg.eigh(information)
    groups = []
    for size, direction in zip(sizes, directions.T, strict=True):
        if size >= UNLEARNED * PRIOR_PRECISION:
            continue
        group = tuple(
            names[k]
            for k in range(len(names))
            if direction[k] ** 2 >= TOGETHER**2 and information[k, k] >= LEARNED * PRIOR_PRECISION
        )
        if len(group) > 1:
            groups.append(group)
    return groups


def identify_from(
    draws: Mapping[str, Floats], known: Known, sensitivities: Floats, free: Sequence[Parameter]
) -> dict[str, Identified]:
    """Return the identification of each parameter, from samples of its posterior."""
    groups = collinear_groups(sensitivities.reshape(-1, len(free)), [parameter.name for parameter in free])
    identified = {}
    for name, values in draws.items():
        low, high = np.quantile(values, ENDS)
        low_place, high_place = place_of(known[name], np.array([low, high]))
        ratio = float(high_place - low_place) / (ENDS[1] - ENDS[0])
        partners = sorted({other for group in groups if name in group for other in group} - {name})
        identified[name] = Identified(ratio, is_identified(ratio, 1.0), tuple(partners))
    return identified


WHEELS = "record the wheels' encoders (observe = encoders)"
CAMERA = "record poses with a camera (observe = track)"

RUNS = "drive straight, and turn in place, for longer"
CHANGES = "change the command at every step, to and fro"
SLOW = "give slow commands, one after the other"
SPEEDS = "repeat runs at full and at low speed"
ANGLES = "drive into walls at angles of 20 to 70 degrees, on both sides"
LONG = "let trials last 100 commands"

ADVICE: dict[str, tuple[str, str, str]] = {
    "drive.gain": (f"drive straight from one wall to the other, or {WHEELS}", RUNS, RUNS),
    "drive.asymmetry": (WHEELS, RUNS, RUNS),
    "drive.track": (f"turn in place next to a wall for a whole trial, or {CAMERA}", CAMERA, RUNS),
    "drive.axle": (CAMERA, CAMERA, "turn in place, in both directions"),
    "drive.lag": (WHEELS, f"{CHANGES}, with shorter steps", f"{CHANGES}, with shorter steps"),
    "drive.delay": (WHEELS, CHANGES, CHANGES),
    "drive.delay_jitter": (WHEELS, f"{CHANGES}, in more trials", f"{CHANGES}, in more trials"),
    "drive.dead_band": (f"{WHEELS} under slow commands", SLOW, SLOW),
    "drive.soft_dead_band": (f"{WHEELS} under slow commands", SLOW, SLOW),
    "drive.slip": (f"{WHEELS} and poses", CAMERA, f"{WHEELS} besides the poses"),
    "drive.drift_per_m": (CAMERA, CAMERA, RUNS),
    "drive.travel_noise_per_m": (CAMERA, CAMERA, "repeat long straight runs"),
    "drive.heading_noise_per_m": (CAMERA, CAMERA, SPEEDS),
    "drive.heading_noise_per_s": (CAMERA, CAMERA, SPEEDS),
    "drive.battery_sag": (f"{WHEELS} in trials of 100 commands", LONG, LONG),
    "contact.friction": (CAMERA, CAMERA, ANGLES),
    "contact.lat": (CAMERA, CAMERA, "scrape along walls, turning into them"),
    "contact.ang": (CAMERA, CAMERA, ANGLES),
    "contact.saturation": (CAMERA, CAMERA, "press against walls with wheels that turn unequally"),
}
"""Data to record for each parameter, by the kind of observation: cells, encoders, or a track."""


def advice_for(name: str, observe: Observe, partners: Sequence[str] = ()) -> str:
    """Return the trials to record to identify a parameter, for an observation level."""
    what = ADVICE[name][CALIBRATES.index(observe)]
    first = f"Identified only together with {' and '.join(partners)}" if partners else "Not identified"
    return f"{first}: {what}."
