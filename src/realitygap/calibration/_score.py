"""Long vectors pressed into few numbers that tell of the parameters, learned from simulations.

Source: score compression (Alsing & Wandelt, MNRAS 476, 2018): of a vector whose entries are normal with a mean and a
variance that follow from the parameters, the derivative of the log-likelihood at a point has all that it tells near
there. Differs: means, variances and their slopes are regressions over simulations; slopes that noise explains shrink
(James & Stein), and entries count at most as much as one that is `MOST_OFF` standard deviations off, so that what the
simulator cannot make does not outvote the rest.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ._evidence import Vectors
from ._one_thread import one_blas_thread

Floats = NDArray[np.float64]

MOST_OFF = 4.0
SHRINK = 4.0  # slopes of up to this many squared standard errors count as 0
COLUMNS = 4096  # of vectors, in one block


@dataclass(frozen=True)
class Compression:
    """The compression of vectors, (m, d), to summaries, (m, 2 p): the score of means, and of variances.

    Attributes:
        center: (d,) expected at the middle of the simulations.
        scale: (d,) standard deviation there.
        of_means, of_variances: (d, p) weights.
    """

    center: Vectors
    scale: Vectors
    of_means: Vectors
    of_variances: Vectors

    def __call__(self, vectors: Vectors) -> Floats:
        """Return summaries of vectors (m, d), (m, 2 p)."""
        p = self.of_means.shape[1]
        made = np.zeros((len(vectors), 2 * p))
        for part in _parts(vectors.shape[1]):
            off = (vectors[:, part] - self.center[part]) / self.scale[part]
            np.clip(off, -MOST_OFF, MOST_OFF, out=off)
            made[:, :p] += off @ self.of_means[part]
            made[:, p:] += (off * off) @ self.of_variances[part]
        return made


def learn_compression(places: Floats, vectors: Vectors, finest: Vectors) -> Compression:
    """Learn the compression from vectors and the parameters that produced them.

    Args:
        places: (m, p) values of the parameters, with m well above p.
        vectors: (m, d) made with them.
        finest: (d,) the least standard deviation of an entry.
    """
    m, p = places.shape
    design = np.column_stack([np.ones(m), places - places.mean(axis=0)])
    inverse = np.linalg.inv(design.T @ design)
    project = (inverse @ design.T).astype(np.float32)
    spread = np.diag(inverse)[1:, None].astype(np.float32)
    d = vectors.shape[1]
    made = Compression(
        *(np.zeros(d, np.float32) for _ in range(2)), *(np.zeros((d, p), np.float32) for _ in range(2))
    )
    for part in _parts(d):
        some = vectors[:, part]
        means = project @ some
        left = some - design.astype(np.float32) @ means
        variance = (left * left).mean(axis=0) * (m / (m - p - 1)) + finest[part] ** 2
        scale = np.sqrt(variance)
        made.center[part] = means[0]
        made.scale[part] = scale
        made.of_means[part] = (_shrunk(means[1:], spread * variance) / scale).T
        squares = np.minimum(left * left / variance, MOST_OFF**2)
        slopes = (project @ squares)[1:]
        noise = squares.var(axis=0) + 1e-3
        made.of_variances[part] = (_shrunk(slopes, spread * noise) / noise).T
    return made


@one_blas_thread()
def information_of(places: Floats, vectors: Vectors, finest: Vectors) -> Floats:
    """Return the Fisher information of a trial's expected observations about the parameters, (p, p).

    Args:
        places: (m, p) parameters of robots from the posterior.
        vectors: (m, d) observations of each robot in the trial.
        finest: (d,) the least standard deviation of an entry.
    """
    weights = learn_compression(places, vectors, finest).of_means.astype(np.float64)
    return np.asarray(weights.T @ weights)


def _shrunk(slopes: Vectors, variance: Vectors) -> Vectors:
    shrink = 1.0 - SHRINK * variance / np.maximum(slopes * slopes, 1e-30)
    return np.asarray(slopes * np.maximum(shrink, 0.0))


def _parts(d: int) -> Iterator[slice]:
    for first in range(0, d, COLUMNS):
        yield slice(first, min(first + COLUMNS, d))
