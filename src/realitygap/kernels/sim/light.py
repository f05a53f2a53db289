"""Light sensors of the platform `sim`: several lights, a directional lobe, the inverse square, shadows.

A sensor answers gain * sum over lights of strength * lobe * lit / d^2, times 1 + noise * N, limited to 0..1. The
lobe is (cos a - cos w) / (1 - cos w), a the angle between the sensor's direction and the light: 1 straight ahead, 0
from the half-width w on (w a quarter turn gives cos a). `lit` is 1, or in the shadow of a wall or an obstacle what
the robot's description says: one half (as in Jyro) or 0.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.elementary import normal, sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES

NEAREST = 1e-6  # squared [m2]: a light is no nearer than 1 mm, where 1/d^2 would have no end


@stage
def prepare_light(direction, width, cosine, sine, edge, scale):
    """The direction of a sensor and the edge of its lobe as cosines; 1 / (1 - cos w).

    Args:
        direction, width: (LANES,) [turns]; the width above 0, at most one half.
        cosine, sine, edge, scale: Written.
    """
    real = direction.dtype.type
    for lane in range(LANES):
        s, c = sin_cos_of_turns(direction[lane])
        cosine[lane] = c
        sine[lane] = s
        _, e = sin_cos_of_turns(width[lane])
        edge[lane] = e
        one = real(1.0) - e
        scale[lane] = real(1.0) / (one if one > real(0.0) else real(1.0))


@stage
def look_to(light_x, light_y, mount_x, mount_y, pose, ahead, left, distance):
    """Compute the direction and the distance [m] of a light from a mount: unit vector in the body's frame.

    Args:
        light_x, light_y: (LANES,) [m].
        mount_x, mount_y: Ahead and left in the body's frame [m].
        pose: Where the robots are.
        ahead, left, distance: Written.
    """
    real = distance.dtype.type
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for lane in range(LANES):
        dx = light_x[lane] - x[lane]
        dy = light_y[lane] - y[lane]
        to_x = dx * cosine[lane] + dy * sine[lane] - mount_x[lane]
        to_y = dy * cosine[lane] - dx * sine[lane] - mount_y[lane]
        square = to_x * to_x + to_y * to_y
        d = np.sqrt(square if square > real(NEAREST) else real(NEAREST))
        ahead[lane] = to_x / d
        left[lane] = to_y / d
        distance[lane] = d


@stage
def add_light(ahead, left, distance, strength, cosine, sine, edge, scale, lit, reading):
    """Add what a sensor receives of one light.

    Args:
        ahead, left, distance: Of `look_to`.
        strength: (LANES,) of the light: what arrives at 1 m.
        cosine, sine, edge, scale: Of `prepare_light`.
        lit: 1, or the part of the light that arrives in a shadow.
        reading: Changed.
    """
    real = reading.dtype.type
    for lane in range(LANES):
        facing = ahead[lane] * cosine[lane] + left[lane] * sine[lane]
        lobe = (facing - edge[lane]) * scale[lane]
        lobe = lobe if lobe > real(0.0) else real(0.0)
        d = distance[lane]
        so_far = reading[lane]
        reading[lane] = so_far + strength[lane] * lobe * lit[lane] / (d * d)


@stage
def answer_light(gain, noise, word, reading):
    """Gain * reading * (1 + noise * N(0, 1)), limited to 0..1, by a word a lane."""
    real = reading.dtype.type
    for lane in range(LANES):
        one = gain[lane] * reading[lane] * (real(1.0) + noise[lane] * normal(word[lane], noise[lane]))
        one = one if one < real(1.0) else real(1.0)
        reading[lane] = one if one > real(0.0) else real(0.0)
