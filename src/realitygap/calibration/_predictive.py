"""The posterior predictive check of a simulator against observations, and errors of predictions.

With enough trials, any robot differs significantly from any simulator. So the size of the difference counts: the share
of the observations' variance that the fitted simulator neither predicts nor reproduces by chance.

Source: posterior predictive checks, Gelman, Meng & Stern, Statistica Sinica 6 (1996). The limits in `TOLERATED` are
chosen on twins, see docs/explanations/inference.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._evidence import Evidence, Vectors
from ._prior import Floats

N_PREDICTIVE = 200  # robots from the posterior

TOLERATED = {
    "ahead": 0.08,
    "turn": 0.08,
    "turn at walls": 0.02,
    "reading": 0.15,
    "wheels": 0.15,
    "readings": 0.4,
    "command": 0.5,
    "coverage": 1.0,
}
"""Share of the variance of each kind of observation up to which a fit counts as well specified. Chance makes most of
the motion at walls, so the share that chance does not explain is small there."""

PREDICTED = ("ahead", "turn", "wheels", "reading", "readings", "command", "cell")
"""Kinds of observation that count when trials are predicted."""


@dataclass(frozen=True)
class Misfit:
    """The part of one kind of observation that a fitted simulator cannot reproduce.

    Attributes:
        kind: Kind of the observations, such as turn.
        share: Share of their variance that is neither predicted nor chance; noise can make it negative.
        tolerated: Up to which share the fit counts as well specified.
        p: Share of robots from the posterior whose own trials are as far off.
    """

    kind: str
    share: float
    tolerated: float
    p: float

    @property
    def is_too_large(self) -> bool:
        """True if the simulator cannot reproduce the observations."""
        return self.share > self.tolerated


def misfits(
    evidence: Sequence[Evidence],
    simulate: Callable[[Evidence, Mapping[str, Floats], int], Vectors],
    numbers: Mapping[str, Floats],
    *,
    key: int,
) -> list[Misfit]:
    """Return the part of each kind of observation that robots of the posterior cannot reproduce.

    Args:
        evidence: Observations.
        simulate: Function that simulates the trials.
        numbers: (m,) draws of the robot's numbers from the posterior, by dotted name.
        key: Key of the random numbers.
    """
    m = len(next(iter(numbers.values())))
    which = np.linspace(0, m - 1, N_PREDICTIVE).astype(int)
    some = {name: value[which] for name, value in numbers.items()}
    sums: dict[str, NDArray[np.float64]] = {}
    for k, one in enumerate(evidence):
        made = simulate(one, some, key + k)
        mean, variance = made.mean(axis=0), made.var(axis=0, ddof=1)
        expected = variance * (1 + 1 / len(made))
        off = ((one.seen - mean) ** 2).astype(np.float64)
        own = (made - mean) ** 2
        for kind, at in _parts_of(one):
            seen = one.seen[at].astype(np.float64)
            row = np.array(
                [
                    off[at].sum(),
                    expected[at].sum(),
                    ((seen - seen.mean()) ** 2).sum(),
                    *own[:, at].sum(axis=1),
                ]
            )
            sums[kind] = sums.get(kind, np.zeros(3 + len(made))) + row
    rows = []
    for kind, (off_sum, expected_sum, total, *own_sums) in sums.items():
        if kind in TOLERATED:
            share = (
                (off_sum - expected_sum) / total if total else 0.0
            )  # what never varied has none to predict
            p = float(np.mean(np.array(own_sums) >= off_sum))
            rows.append(Misfit(kind, float(share), TOLERATED[kind], p))
    return rows


def _parts_of(evidence: Evidence) -> Iterator[tuple[str, NDArray[np.bool_]]]:
    """Yield each kind of observation, and which entries are of it, (d,).

    A wall stops the wheels of a robot with weak motors, and those of `sim` slip. That is no fault of the robot's
    motion, so its wheels count away from walls only.
    """
    for kind in np.unique(evidence.kinds):
        at = evidence.kinds == kind
        yield str(kind), at & ~evidence.at_walls if kind == "wheels" else at
        if kind == "turn" and evidence.at_walls.any():
            yield "turn at walls", at & evidence.at_walls


def prediction_errors(
    held_out: Sequence[Evidence],
    every: Sequence[Evidence],
    simulate: Callable[[Evidence, Mapping[str, Floats], int], Vectors],
    numbers: Mapping[str, Floats],
    *,
    kinds: Sequence[str] = PREDICTED,
    key: int,
) -> dict[str, float]:
    """Return the share of the variance of each kind of observation that simulated robots do not predict.

    The prediction of each entry is its mean over the robots. A share of 0 is a perfect prediction. The mean of all
    trials, as a prediction, has a share of about 1. Chance keeps the share of the best prediction above 0.

    Args:
        held_out: The trials to predict.
        every: All trials, held out or not: variances are theirs, because few trials vary little by chance.
        simulate: Runs the trials in simulation.
        numbers: (m,) values of the robot's numbers for m robots, by dotted name.
        kinds: Kinds of observation that count.
        key: Key of the random numbers.
    """
    sums: dict[str, NDArray[np.float64]] = {}
    for k, part in enumerate(held_out):
        off = (part.seen - simulate(part, numbers, key + k).mean(axis=0, dtype=np.float64)) ** 2
        for kind in kinds:
            at = part.kinds == kind
            sums[kind] = sums.get(kind, np.zeros(2)) + np.array([off[at].sum(), at.sum()])
    errors = {}
    for kind, (off_sum, n) in sums.items():
        seen = np.concatenate([part.seen[part.kinds == kind] for part in every])
        variance = float(seen.var(dtype=np.float64)) if n else 0.0
        if variance:  # what never varied has none to predict
            errors[kind] = float(off_sum / n / variance)
    return errors
