"""The posterior of a robot's parameters from whole trials, by simulation alone.

The method is approximate Bayesian computation in rounds. Parameters are drawn from the prior within a box, and trials
are simulated with them. Vectors of the observations are compressed to summaries (`_score.py`), on which the parameters
are regressed. Then the box shrinks to the posterior.

Sources: semi-automatic summaries, Fearnhead & Prangle, JRSS B 74 (2012); regression adjustment, Beaumont, Zhang &
Balding, Genetics 162 (2002); rounds whose proposals are the prior cut to where the posterior can be, so that no
weights are needed: truncated sequential estimation, Deistler, Goncalves & Macke, NeurIPS 2022; predictions without the
predicted, Allen, Technometrics 16 (1974).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from realitygap.world import RobotModel

from ._evidence import Evidence, Vectors
from ._one_thread import one_blas_thread
from ._posterior import N_DRAWS
from ._prior import Floats, Parameter, numbers_of, values_of
from ._score import learn_compression

Effort = Literal["least", "small", "full"]
SimulateVectors = Callable[[Evidence, Mapping[str, Floats], int], Vectors]
"""A function that simulates trials with m sets of numbers and a key of random numbers, and returns vectors, (m, d)."""

N_LEARN = {"least": 600, "small": 800, "full": 1500}
N_REGRESS = {"least": 600, "small": 800, "full": 1500}
N_LAST = {"least": 1000, "small": 2000, "full": 5000}
ROUNDS = {"least": 3, "small": 4, "full": 7}
MOST_OWN = 0.9  # of a prediction, that is taken for a row's own
END = 4.0  # standard deviations of the prior beyond which nothing is
MARGIN = 0.3  # share of its width by which the box is larger than the posterior, to each side
CUT = 0.005  # quantile of the posterior that the box leaves out to each side, before the margin


@dataclass(frozen=True)
class Posterior:
    """The part of the prior that agrees with trials.

    Attributes:
        places: (n, p) draws on the scale on which the prior is standard normal.
        values: (n,) draws of each parameter.
        off: (p,) summaries of what was observed, less what was expected, in standard deviations of simulations nearby.
        n_simulated: Sets of numbers tried.
    """

    places: Floats
    values: dict[str, Floats]
    off: Floats
    n_simulated: int


@one_blas_thread()
def fit_all(
    evidence: Sequence[Evidence],
    simulate: SimulateVectors,
    prior: Sequence[Parameter],
    robot: RobotModel,
    *,
    seed: int,
    effort: Effort = "full",
    tell: Callable[[str], None] | None = None,
) -> Posterior:
    """Return the posterior of all parameters together.

    Args:
        evidence: Observations, and trials to simulate.
        simulate: Carries it out.
        prior: Prior of each parameter.
        robot: Robot whose numbers the parameters change.
        seed: Seed of all random numbers.
        effort: Number of simulations: least, small, or full.
        tell: Called with a line after each round.
    """
    rng = np.random.default_rng(seed)
    p = len(prior)
    groups = _groups(prior)
    low, high = np.full(p, -END), np.full(p, END)
    seen = [part.seen[None] for part in evidence]
    n_simulated = 0
    draws = np.zeros((0, p))
    off = np.zeros(p)

    def make(n: int) -> tuple[Floats, list[Vectors]]:
        nonlocal n_simulated
        n_simulated += n
        places = _draw(rng, low, high, n)
        numbers = numbers_of(prior, values_of(prior, places), robot)
        key = int(rng.integers(2**62))
        return places, [simulate(part, numbers, key + k) for k, part in enumerate(evidence)]

    for turn in range(ROUNDS[effort]):
        is_last = turn == ROUNDS[effort] - 1
        places, vectors = make(N_LEARN[effort])
        learned = [
            learn_compression(places, some, part.finest) for some, part in zip(vectors, evidence, strict=True)
        ]
        del vectors
        places, vectors = make(N_LAST[effort] if is_last else N_REGRESS[effort])
        summaries = np.concatenate([press(v) for press, v in zip(learned, vectors, strict=True)], axis=1)
        del vectors
        observed = np.concatenate([press(v) for press, v in zip(learned, seen, strict=True)], axis=1)[0]
        draws, off = _adjusted(rng, places, summaries, observed, groups)
        if tell is not None:
            tell(
                f"round {turn + 1} of {ROUNDS[effort]}: {np.mean(high - low) / (2 * END):.0%} of the prior's width"
            )
        if not is_last:
            low, high = _next_box(draws)
    keep = draws[rng.permutation(len(draws))[:N_DRAWS]]
    return Posterior(keep, values_of(prior, keep), off, n_simulated)


def mixed(first: Posterior, second: Posterior, prior: Sequence[Parameter], *, share: int) -> Posterior:
    """Return draws of two posteriors by turns, `share` of the first for each of the other, as many as either has."""
    n, p = min(len(first.places), len(second.places)) // (share + 1), len(prior)
    turns = [first.places[: share * n].reshape(n, share, p), second.places[:n].reshape(n, 1, p)]
    places = np.concatenate(turns, axis=1).reshape(-1, p)
    off = (share * first.off + second.off) / (share + 1)
    return Posterior(places, values_of(prior, places), off, first.n_simulated + second.n_simulated)


def _groups(prior: Sequence[Parameter]) -> list[NDArray[np.int64]]:
    """Separate the sensors from other parameters: readings at a pose do not depend on the motion to it."""
    of_sensors = np.array([parameter.name.startswith("range.") for parameter in prior])
    return [at for at in (np.flatnonzero(~of_sensors), np.flatnonzero(of_sensors)) if len(at)]


def _draw(rng: np.random.Generator, low: Floats, high: Floats, n: int) -> Floats:
    """Draw from the prior within a box, stratified along each parameter (Latin hypercube), (n, p)."""
    ranks = np.argsort(rng.uniform(size=(len(low), n)), axis=1).T
    u = (ranks + rng.uniform(size=ranks.shape)) / n
    return np.asarray(
        scipy.special.ndtri(
            np.clip(
                scipy.special.ndtr(low) + u * (scipy.special.ndtr(high) - scipy.special.ndtr(low)),
                scipy.special.ndtr(-END),
                scipy.special.ndtr(END),
            )
        )
    )


def _adjusted(
    rng: np.random.Generator,
    places: Floats,
    summaries: Floats,
    observed: Floats,
    groups: Sequence[NDArray[np.int64]],
) -> tuple[Floats, Floats]:
    """Return draws from the posterior: parameters moved by their regression on the summaries to what was observed.

    First all simulations say which combination of summaries tells of each parameter; then, for each group of
    parameters, those nearest in these combinations say how parameters scatter around.
    """
    n, p = places.shape
    scale = summaries.std(axis=0) + 1e-12
    middle = summaries.mean(axis=0)
    scaled, here = (summaries - middle) / scale, np.clip((observed - middle) / scale, -6, 6)
    draws, off = np.empty((4 * N_DRAWS, p)), np.empty(p)
    for group in groups:
        mine = places[:, group]
        predicted, observed_prediction = _predict(scaled, mine, here)
        spread = (mine - predicted).std(axis=0) + 1e-9
        distance = (((predicted - observed_prediction) / spread) ** 2).sum(axis=1)
        n_near = int(max(n // 4, min(n, 15 * len(group))))
        reach = np.partition(distance, n_near - 1)[n_near - 1]
        weight = np.maximum(1.0 - distance / (reach * 1.0001 + 1e-12), 0.0)
        near = weight > 0
        moved = _local(predicted[near], mine[near], weight[near], observed_prediction)
        which = rng.choice(near.sum(), len(draws), p=weight[near] / weight.sum())
        draws[:, group] = np.clip(moved[which], -END, END)
        off[group] = (observed_prediction - predicted[near].mean(axis=0)) / (
            predicted[near].std(axis=0) + 1e-9
        )
    return draws, off


def _predict(summaries: Floats, places: Floats, here: Floats) -> tuple[Floats, Floats]:
    """Return the ridge regression of places on summaries and their curvature, for the simulations and for the observed.

    Each simulation is predicted by the regression without it, which follows from the whole one (Allen 1974). A
    regression overfits its own data, which the observations are not part of. Means and the first predictions, whose
    squares are the curvature, are those of all, because one simulation hardly changes them.
    """
    mean = places.mean(axis=0)
    slopes, _ = _ridge(summaries, places - mean)
    first, first_here = summaries @ slopes, here @ slopes
    scale = first.std(axis=0) + 1e-9
    first, first_here = first / scale, np.clip(first_here / scale, -4, 4)
    row_of, column_of = np.triu_indices(places.shape[1])
    if len(row_of) * 4 > len(places):
        row_of = column_of = np.arange(places.shape[1])
    squares = first[:, row_of] * first[:, column_of]
    design = np.column_stack([summaries, squares - squares.mean(axis=0)])
    row = np.concatenate([here, first_here[row_of] * first_here[column_of] - squares.mean(axis=0)])
    slopes, own = _ridge(design, places - mean)
    predicted = mean + design @ slopes
    return predicted - (places - predicted) * (own / (1.0 - own))[:, None], mean + row @ slopes


def _ridge(design: Floats, wanted: Floats) -> tuple[Floats, Floats]:
    """Return slopes, and (n,) how much of what is predicted of each row is its own."""
    gram = design.T @ design
    gram = gram + 1e-3 * np.diag(np.diag(gram) + 1e-9)
    own = (design * np.linalg.solve(gram, design.T).T).sum(axis=1)
    return np.asarray(np.linalg.solve(gram, design.T @ wanted)), np.minimum(own, MOST_OWN)


def _local(predicted: Floats, places: Floats, weight: Floats, here: Floats) -> Floats:
    """Return places moved to `here` along a weighted linear regression on the summaries."""
    design = np.column_stack([np.ones(len(predicted)), predicted - here])
    weighed = design * weight[:, None]
    gram = design.T @ weighed + 1e-6 * weight.sum() * np.diag([0.0, *predicted.var(axis=0) + 1e-12])
    slopes = np.linalg.solve(gram, weighed.T @ places)
    rest = places - design @ slopes
    n = weight.sum() ** 2 / (weight**2).sum()  # as many of weight 1
    return np.asarray(slopes[0] + rest * np.sqrt(n / max(n - design.shape[1], 1.0)))


def _next_box(draws: Floats) -> tuple[Floats, Floats]:
    low, high = np.quantile(draws, [CUT, 1 - CUT], axis=0)
    margin = MARGIN * (high - low) + 0.02
    return np.maximum(low - margin, -END), np.minimum(high + margin, END)
