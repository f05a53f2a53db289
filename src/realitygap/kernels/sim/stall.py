"""Stall as the firmware of an S2 computes it: an idler wheel that turns too slowly for what the drive wheels do.

While a motor turns, the firmware compares the sum of the drive wheels' speeds with the idler wheel's over the last
1.6 s. So a robot that turns on the spot never stalls, one that presses against a wall with slipping wheels does
after a while, and one that slides along it does where it is slow enough. The firmware's other sign, the motors'
current, is not modeled: in `sim` wheels turn as commanded.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.elementary import exp
from realitygap.kernels.math.lanes import LANES

COUNT = 2.5e-4  # of an S2's encoders [m]; less than that is no difference


@stage
def prepare_stall(window, step_s, keep):
    """Compute the factor by which a step keeps the averages: e^(-step / window), 0 without a window.

    Args:
        window: (LANES,) [s].
        step_s: [s].
        keep: Written.
    """
    real = keep.dtype.type
    for lane in range(LANES):
        one = window[lane]
        none = not one > real(0.0)
        kept = exp(-real(step_s) / (real(1.0) if none else one))
        keep[lane] = real(0.0) if none else kept


@stage
def idler_stall(was, now, wheels, before, idler, share, keep, driven, rolled, stalled):
    """1 where the idler wheel went less than a share of what the drive wheels went, averaged over the last steps.

    Both are averaged with weights that fall by e in each window; the idler's way is its straight one in a step.

    Args:
        was: Sine, cosine, x and y of the poses at the last step, rows (4, LANES); changed to those of `now`.
        now: Poses.
        wheels: (2, LANES) driven by each wheel since the start [m].
        before: (2, LANES) the same at the last step; changed to `wheels`.
        idler: (LANES,) how far ahead of the origin the idler wheel is, below 0 behind it [m].
        share: 0..1; 0 never stalls.
        keep: Of `prepare_stall`.
        driven, rolled: (LANES,) the averages; changed.
        stalled: Written.
    """
    real = stalled.dtype.type
    x, y, sine, cosine = now.x, now.y, now.sine, now.cosine
    was_sine, was_cosine, was_x, was_y = was[0], was[1], was[2], was[3]
    left, right, before_left, before_right = wheels[0], wheels[1], before[0], before[1]
    for lane in range(LANES):
        to_x = x[lane] - was_x[lane] + idler[lane] * (cosine[lane] - was_cosine[lane])
        to_y = y[lane] - was_y[lane] + idler[lane] * (sine[lane] - was_sine[lane])
        way = np.sqrt(to_x * to_x + to_y * to_y)
        go = real(0.5) * ((left[lane] - before_left[lane]) + (right[lane] - before_right[lane]))
        kept = keep[lane]
        new_driven = kept * driven[lane] + (real(1.0) - kept) * abs(go)
        new_rolled = kept * rolled[lane] + (real(1.0) - kept) * way
        driven[lane] = new_driven
        rolled[lane] = new_rolled
        turning = (left[lane] != before_left[lane]) | (right[lane] != before_right[lane])
        slow = new_rolled + real(COUNT) < share[lane] * new_driven
        stalled[lane] = real(1.0) if slow & turning else real(0.0)
    for lane in range(LANES):
        was_sine[lane] = sine[lane]
        was_cosine[lane] = cosine[lane]
        was_x[lane] = x[lane]
        was_y[lane] = y[lane]
        before_left[lane] = left[lane]
        before_right[lane] = right[lane]
