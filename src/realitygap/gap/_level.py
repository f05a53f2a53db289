"""The size of the difference in quality: mean, root mean square without noise, and A12."""

from __future__ import annotations

import numpy as np

from ._side import Values


def mean_difference(source: Values, target: Values) -> Values:
    """Return the mean over controllers of the difference of means, target minus source, (b,).

    Args:
        source: (b, c, r) and
        target: (b, c, q) quality of each trial of b samples.
    """
    return np.asarray((target.mean(axis=2) - source.mean(axis=2)).mean(axis=1))


def square_differences(source: Values, target: Values) -> Values:
    """Return unbiased estimates of the square of each controller's true difference, (b, c), which may be negative.

    The square of a difference of means is too large by the variance of both means, which is taken out:
    d² - s²/r - t²/q. A controller without a gap gives 0 on average.

    Args:
        source: (b, c, r) and
        target: (b, c, q), r and q at least 2.

    Raises:
        ValueError: Some side has one trial a controller, which says nothing of noise.
    """
    if min(source.shape[2], target.shape[2]) < 2:
        raise ValueError("The noise of trials needs at least 2 of each controller on both sides.")
    difference = target.mean(axis=2) - source.mean(axis=2)
    noise = source.var(axis=2, ddof=1) / source.shape[2] + target.var(axis=2, ddof=1) / target.shape[2]
    return np.asarray(difference**2 - noise)


def rms_of(squares: Values) -> Values:
    """Return the root of a mean square; 0 for a negative one, which an unbiased estimate may be."""
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


def shares_above(source: Values, target: Values) -> Values:
    """Return the probability that a trial on the target is above one in simulation, (c,); ties count half.

    Args:
        source: (c, r) and
        target: (c, q).

    Source: A12 of Vargha & Delaney (2000), Journal of Educational and Behavioral Statistics 25(2), 101-132, within
    each controller.
    """
    one, other = target[:, :, None], source[:, None, :]
    return np.asarray(((one > other).mean(axis=(1, 2)) + (one >= other).mean(axis=(1, 2))) / 2)
