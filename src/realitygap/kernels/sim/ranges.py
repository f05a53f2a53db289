"""The reading of a range sensor of the platform `sim` from the distances along its rays, before noise.

A reading is 0 where nothing is within reach, and grows to 1 as things come near. A cone is several rays, evenly
spaced from one edge of it to the other. What measures a time of flight (`linear`, `table`) answers the nearest
ray: the first echo. What measures how much light returns (`ir`, `pulses`) adds the rays up, weighted by a lobe
that has half its power at the edge of the cone. `lorentz` adds three rays up as Enki does.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import LOG2_E, exp2, log, sin_cos_of_turns
from realitygap.kernels.math.lanes import LANES, fill

STEEP = 1e30  # [1/m]: any distance times it is beyond the limits of `exp2`


@inlined
def unit_of(word, like):
    """A number in (0, 1) from the upper 23 bits of a word, centered, exact in the precision of `like`."""
    real = type(like)
    return (real(np.int32(word >> np.uint32(9))) + real(0.5)) * real(1.0 / (1 << 23))


@stage
def rate_of(width, rate):
    """log2(e) / width: what `exp2` wants for e^(d / width). A width of 0 makes a step of it.

    Args:
        width: (LANES,) [m].
        rate: Written [1/m].
    """
    real = width.dtype.type
    for lane in range(LANES):
        one = width[lane]
        none = one == real(0.0)
        divisor = real(1.0) if none else one
        rate[lane] = real(STEEP) if none else real(LOG2_E) / divisor


@stage
def nearest_ray(distances, near):
    """The least of distances (rays, LANES) [m]."""
    for lane in range(LANES):
        near[lane] = distances[0, lane]
    for ray in range(1, distances.shape[0]):
        for lane in range(LANES):
            one = distances[ray, lane]
            least = unmasked(near[lane])
            near[lane] = one if one < least else least


@stage
def linear_response(near, reach, reading):
    """(R - d) / R, the paper's.

    Args:
        near: (LANES,) d, distance to what is nearest [m], not above the reach.
        reach: R [m].
        reading: Written.
    """
    for lane in range(LANES):
        reading[lane] = (reach[lane] - near[lane]) / reach[lane]


@inlined
def lobe_of(ray, rays):
    """The weight of a ray of a cone: 1 in the middle, half at its edges."""
    part = 2.0 * ray / (rays - 1) - 1.0 if rays > 1 else 0.0
    return 1.0 - 0.5 * part * part


@stage
def _add_return(distance, reach, rate, weight, reading):
    real = reading.dtype.type
    for lane in range(LANES):
        d = distance[lane]
        back = real(weight) * exp2(-d * rate[lane])
        so_far = unmasked(reading[lane])
        reading[lane] = so_far + back if d < reach[lane] else so_far


@stage
def _one_return(distance, reach, amplitude, rate, reading):
    real = reading.dtype.type
    for lane in range(LANES):
        d = distance[lane]
        back = amplitude[lane] * exp2(-d * rate[lane])
        reading[lane] = back if d < reach[lane] else real(0.0)


@stage
def _add_slanted(distance, cosine, reach, rate, incidence, weight, faced, reading):
    real = reading.dtype.type
    for lane in range(LANES):
        d = distance[lane]
        c = cosine[lane]
        back = real(weight) * exp2(-d * rate[lane])
        back = back if d < reach[lane] else real(0.0)
        faced[lane] = faced[lane] + back
        reading[lane] = reading[lane] + back * (c / (c + incidence[lane] * (real(1.0) - c)))


@stage
def slanted_response(distances, cosines, reach, amplitude, rate, incidence, near, faced, dim, reading):
    """`ir_response` of walls that send back less where a ray meets them at a slant: c / (c + k (1 - c)) of it.

    c is the cosine between ray and normal; k = 1 is Lambert's law of matt surfaces, 0 none, more falls off faster.

    Args:
        distances, reach, amplitude, rate: As in `ir_response`.
        cosines: (rays, LANES) c, above 0.
        incidence: k.
        near: (LANES,) distance to what is nearest [m].
        faced: Room.
        dim: Written: where what is nearest would send back as little if it were faced [m].
        reading: Written.
    """
    real = reading.dtype.type
    rays = distances.shape[0]
    fill(reading, real(0.0))
    fill(faced, real(0.0))
    whole = 0.0
    for ray in range(rays):
        weight = lobe_of(ray, rays)
        whole += weight
        _add_slanted(distances[ray], cosines[ray], reach, rate, incidence, weight, faced, reading)
    for lane in range(LANES):
        all_of_it = faced[lane]
        less = reading[lane]
        some = (all_of_it > real(0.0)) & (less > real(0.0))
        ratio = (all_of_it if some else real(1.0)) / (less if some else real(1.0))
        dim[lane] = near[lane] + log(ratio) * real(LOG2_E) / rate[lane]
        reading[lane] = less * (amplitude[lane] * real(1.0 / whole))


@stage
def ir_response(distances, reach, amplitude, rate, reading):
    """A * e^(-d / L), the mean over the rays by their weights; a ray that meets nothing within reach adds 0.

    Args:
        distances: (rays, LANES) d [m].
        reach: [m].
        amplitude: A, 1 for full scale. Not limited here: a sensor may be saturated up to some distance.
        rate: log2(e) / L [1/m].
        reading: Written.
    """
    real = reading.dtype.type
    rays = distances.shape[0]
    if rays == 1:  # the same, in one go
        _one_return(distances[0], reach, amplitude, rate, reading)
        return
    fill(reading, real(0.0))
    whole = 0.0
    for ray in range(rays):
        weight = lobe_of(ray, rays)
        whole += weight
        _add_return(distances[ray], reach, rate, weight, reading)
    for lane in range(LANES):
        reading[lane] = reading[lane] * (amplitude[lane] * real(1.0 / whole))


@stage
def compress(compression, reading):
    """ln(1 + c x) / c of a reading x: less is added the more light there is. 0 leaves it as it is.

    Args:
        compression: (LANES,) c.
        reading: Changed; one below 0 becomes 0 where c is above 0.
    """
    real = reading.dtype.type
    for lane in range(LANES):
        c = compression[lane]
        x = reading[lane]
        is_on = c > real(0.0)
        light = x if x > real(0.0) else real(0.0)
        pressed = log(real(1.0) + c * light) / (c if is_on else real(1.0))
        reading[lane] = pressed if is_on else x


@stage
def widening_of(cone, widening):
    """The length of a ray at the edge of a cone before a wall that faces it, as a part of the middle ray's.

    Args:
        cone: (LANES,) half the angle of the cone [turns].
        widening: Written: 1 / cos(cone); 0 for a cone of a half-plane or more, whose edges meet no such wall.
    """
    real = cone.dtype.type
    for lane in range(LANES):
        _, cosine = sin_cos_of_turns(cone[lane])
        meets = cosine > real(0.0)
        widening[lane] = real(1.0) / (cosine if meets else real(1.0)) if meets else real(0.0)


@inlined
def _uncut_lorentz_of(d, amplitude, half_width, peak):
    """F(d) of `lorentz_response`, also beyond the reach."""
    real = type(d)
    past = d - peak
    width = half_width * half_width - peak * peak
    width = width if width > real(0.0) else real(0.0)
    below = past * past + width
    is_near = (past <= real(0.0)) | (below <= real(0.0))
    share = width / (real(1.0) if is_near else below)
    share = real(1.0) if is_near else share
    return amplitude * share


@inlined
def _lorentz_of(d, reach, amplitude, half_width, peak):
    """F(d) of `lorentz_response`."""
    real = type(d)
    uncut = _uncut_lorentz_of(d, amplitude, half_width, peak)
    return uncut if d < reach else real(0.0)


@stage
def _add_lorentz(distance, reach, amplitude, half_width, peak, reading):
    for lane in range(LANES):
        reading[lane] = reading[lane] + _lorentz_of(
            distance[lane], reach[lane], amplitude[lane], half_width[lane], peak[lane]
        )


@stage
def _take_off_twice(distance, widening, reach, amplitude, half_width, peak, reading):
    """Less what the edges of the cone would read before a wall that faces the sensor."""
    real = reading.dtype.type
    for lane in range(LANES):
        wide = widening[lane]
        far = distance[lane] * wide if wide > real(0.0) else reach[lane]
        edge = _lorentz_of(far, reach[lane], amplitude[lane], half_width[lane], peak[lane])
        reading[lane] = reading[lane] - (edge + edge)


@stage
def lorentz_response(distances, reach, amplitude, half_width, peak, widening, reading):
    """F of one ray; of three rays F(left) + F(right) + F(middle) - 2 F(middle / cos(cone)).

    F(d) = A (W^2 - P^2) / (d^2 - 2 P d + W^2) up to the far edge, A nearer than P, 0 from the reach on.

    Source: Enki (S. Magnenat), interactions/IRSensor.h, with m = A, c = W^2 and x0 = P.

    Args:
        distances: (1 or 3, LANES) d [m].
        reach: [m].
        amplitude: A, the reading at P.
        half_width: W [m].
        peak: P, the distance at which a reading is largest [m]; less than W.
        widening: 1 / cos(cone), by `widening_of`.
        reading: Written. Not limited here: below 0 where one of three rays alone meets something.
    """
    real = reading.dtype.type
    rays = distances.shape[0]
    fill(reading, real(0.0))
    for ray in range(rays):
        _add_lorentz(distances[ray], reach, amplitude, half_width, peak, reading)
    if rays > 1:
        _take_off_twice(distances[rays >> 1], widening, reach, amplitude, half_width, peak, reading)


@stage
def add_edges(distances, near, reach, amplitude, half_width, peak, reading):
    """Add F(reach) of `lorentz_response` for each ray that meets nothing, if another ray meets something.

    Source: Enki 1.6.99 (S. Magnenat), where such a ray keeps the last value that it had.
    Differs: The last value is taken at the reach, where most rays lose a wall.

    Args:
        distances: (1 or 3, LANES) d [m].
        near: (LANES,) the least of them [m].
        reach, amplitude, half_width, peak: As in `lorentz_response`.
        reading: Changed.
    """
    real = reading.dtype.type
    for ray in range(distances.shape[0]):
        for lane in range(LANES):
            is_lost = (distances[ray, lane] >= reach[lane]) & (near[lane] < reach[lane])
            edge = _uncut_lorentz_of(reach[lane], amplitude[lane], half_width[lane], peak[lane])
            reading[lane] = reading[lane] + (edge if is_lost else real(0.0))


@stage
def prepare_table(table):
    """Turn a table's readings into what `table_response` adds per meter, in place.

    Args:
        table: (2 * entries, LANES) distance [m] and reading in turn, distances rising.

    The first reading stays what it is; reading k becomes the slope that leads to it, 0 where two distances are equal.
    """
    real = table.dtype.type
    for k in range(table.shape[0] // 2 - 1, 0, -1):
        for lane in range(LANES):
            across = table[2 * k, lane] - table[2 * k - 2, lane]
            up = table[2 * k + 1, lane] - table[2 * k - 1, lane]
            none = not across > real(0.0)
            divisor = real(1.0) if none else across
            table[2 * k + 1, lane] = real(0.0) if none else up / divisor


@stage
def table_response(near, table, reading):
    """Compute the response from a table of measured readings, straight between its entries and level beyond them.

    Args:
        near: (LANES,) distance to what is nearest [m].
        table: (2 * entries, LANES) of `prepare_table`.
        reading: Written.
    """
    real = reading.dtype.type
    for lane in range(LANES):
        reading[lane] = table[1, lane]
    for k in range(1, table.shape[0] // 2):
        for lane in range(LANES):
            start = table[2 * k - 2, lane]
            past = near[lane] - start
            most = table[2 * k, lane] - start
            past = past if past < most else most
            past = past if past > real(0.0) else real(0.0)
            reading[lane] = reading[lane] + table[2 * k + 1, lane] * past


@stage
def limit(reading):
    """Limited to 0..1."""
    real = reading.dtype.type
    for lane in range(LANES):
        one = reading[lane]
        one = one if one < real(1.0) else real(1.0)
        reading[lane] = one if one > real(0.0) else real(0.0)
