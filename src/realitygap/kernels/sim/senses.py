"""The readings of all sensors of a robot of the platform `sim`, in lanes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.compile.decorators import inlined, kernel, stage
from realitygap.kernels.math.lanes import LANES, Rows, Words, copy_row, fill, zeros
from realitygap.kernels.math.philox import (
    PURPOSE_ENCODER,
    PURPOSE_LIGHT,
    PURPOSE_LINE,
    PURPOSE_NOISE,
    PURPOSE_PULSES,
    PURPOSE_RANGE,
)

from .encoders import read_encoder, reckon
from .floor import answer_line, lay_tape, place_point, sample_image
from .light import add_light, answer_light, look_to, prepare_light
from .noise import PER_BLOCK, count_pulses, gain_noise, mixture, pulse_words, second_word, uniform_noise
from .ranges import (
    add_edges,
    compress,
    ir_response,
    limit,
    linear_response,
    lorentz_response,
    nearest_ray,
    prepare_table,
    rate_of,
    slanted_response,
    table_response,
    widening_of,
)
from .shape import (
    BUMP,
    HALF_SHADOWS,
    IDLER,
    IR,
    LIGHT,
    LINE,
    LINEAR,
    LORENTZ,
    LORENTZ_EDGES,
    NO_SHADOWS,
    PULSES,
    RANGE,
    RANGE_NUMBERS,
    TABLE,
)
from .sight import answer_bump, gap_of_point, shade_light
from .stall import idler_stall, prepare_stall
from .words import blocks_of, draw_words_of

N_RANGE = len(RANGE_NUMBERS)
# Places in RANGE_NUMBERS
(
    CONE,
    REACH,
    AMPLITUDE,
    DECAY,
    UNIFORM,
    GAIN,
    DROP,
    DROP_WIDTH,
    OUTLIER,
    OUTLIER_WIDTH,
    BURST,
    INCIDENCE,
    HALF_WIDTH,
    PEAK,
    COMPRESSION,
) = (
    RANGE_NUMBERS.index(name)
    for name in (
        "cone",
        "reach",
        "amplitude",
        "decay",
        "noise_uniform",
        "noise_gain",
        "drop_most",
        "drop_width",
        "outlier_most",
        "outlier_width",
        "burst",
        "incidence",
        "half_width",
        "peak",
        "compression",
    )
)


class Senses(NamedTuple):
    """The memory of the sensors of a block of trials, and values derived from their numbers."""

    range_rates: (
        Rows  # (3 * s,) of the response, of dropouts, of outliers [1/m]; of lorentz 1 / cos(cone) first
    )
    noisy: NDArray[np.int32]  # (3,) whether any trial has the paper's noise, gain noise, a mixture
    slanted: NDArray[np.int32]  # (1,) whether any trial has walls that send back less at a slant
    compressed: NDArray[np.int32]  # (1,) whether any trial has sensors that compress
    near: Rows  # (s,) distance to what is nearest [m]
    dim: Rows  # (s,) the distance at which it would send back as little if it were faced [m]
    lobes: Rows  # (4 * l,) of `prepare_light`
    words: Words
    value: NDArray[np.uint32]  # (LANES,) room
    spare: Rows  # (6,) room
    was: Rows  # (4,) pose at the last step, of `idler_stall`
    idled: Rows  # (3,) averages of `idler_stall`, and what a step leaves of them
    idled_wheels: Rows  # (2,) what the wheels had driven at the last step [m]
    encoded_wheels: Rows  # (2,)
    counted: Rows  # (2,) what the encoders say [m]
    counted_step: Rows  # (2,) what they say of the last step [m]
    reckoned: Rows  # (3,) the pose from the encoders, from the start: x, y [m], heading [turns]


@inlined
def mixture_words(sensors):
    """Return the number of random words of the mixture of `sensors` range sensors."""
    return 4 * ((sensors + PER_BLOCK - 1) // PER_BLOCK)


def make_senses(shape, dtype):
    """Return memory for the senses of a block of trials in a precision."""
    s = shape.row_range.size
    pulses = int(shape.range_pulses.max(initial=0))
    words = max(
        4 * blocks_of(n)
        for n in (mixture_words(s), *np.diff(shape.first_reading)[RANGE + 1 :], 2, pulse_words(pulses))
    )

    def rows(n):
        return zeros((n, LANES), dtype)

    return Senses(
        range_rates=rows(3 * s),
        noisy=np.zeros(3, np.int32),
        slanted=np.zeros(1, np.int32),
        compressed=np.zeros(1, np.int32),
        near=rows(s),
        dim=rows(s),
        lobes=rows(4 * (shape.first_reading[LIGHT + 1] - shape.first_reading[LIGHT])),
        words=zeros((words, LANES), np.uint32),
        value=zeros(LANES, np.uint32),
        spare=rows(6),
        was=rows(4),
        idled=rows(3),
        idled_wheels=rows(2),
        encoded_wheels=rows(2),
        counted=rows(2),
        counted_step=rows(2),
        reckoned=rows(3),
    )


@kernel
def _any(row):
    for lane in range(LANES):
        if row[lane] != 0.0:
            return np.int32(1)
    return np.int32(0)


@kernel
def _start_range(shape, p, senses):
    for k in range(senses.noisy.size):
        senses.noisy[k] = 0
    senses.slanted[0] = 0
    senses.compressed[0] = 0
    for s in range(shape.row_range.size):
        row = shape.row_range[s]
        rate_of(p[row + DECAY], senses.range_rates[3 * s])
        rate_of(p[row + DROP_WIDTH], senses.range_rates[3 * s + 1])
        rate_of(p[row + OUTLIER_WIDTH], senses.range_rates[3 * s + 2])
        if shape.range_response[s] == TABLE:
            prepare_table(p[row + N_RANGE : row + N_RANGE + 2 * shape.range_table[s]])
        if shape.range_response[s] == LORENTZ or shape.range_response[s] == LORENTZ_EDGES:
            widening_of(p[row + CONE], senses.range_rates[3 * s])
        senses.noisy[0] |= _any(p[row + UNIFORM])
        senses.slanted[0] |= _any(p[row + INCIDENCE])
        if shape.range_response[s] == IR:
            senses.compressed[0] |= _any(p[row + COMPRESSION])
        if shape.range_response[s] != PULSES:
            senses.noisy[1] |= _any(p[row + GAIN])
            senses.noisy[2] |= _any(p[row + DROP]) | _any(p[row + OUTLIER])


@kernel
def start_senses(shape, rules, lanes):
    """Prepare the senses of a block, with robots at their starts and their numbers in `lanes.p`."""
    real = lanes.low.dtype.type
    p, senses = lanes.p, lanes.senses
    _start_range(shape, p, senses)
    first = shape.first_reading[LIGHT]
    for k in range(shape.first_reading[LIGHT + 1] - first):
        row, lobe = shape.row_sensor[first + k], 4 * k
        lobes = senses.lobes
        prepare_light(p[row + 2], p[row + 3], lobes[lobe], lobes[lobe + 1], lobes[lobe + 2], lobes[lobe + 3])
    prepare_stall(p[shape.row_stall + 2], rules.step_s, senses.idled[2])
    for lane in range(LANES):
        senses.was[0, lane] = lanes.pose.sine[lane]
        senses.was[1, lane] = lanes.pose.cosine[lane]
        senses.was[2, lane] = lanes.pose.x[lane]
        senses.was[3, lane] = lanes.pose.y[lane]
    for k in range(2):
        fill(senses.idled[k], real(0.0))
        fill(senses.idled_wheels[k], real(0.0))
        fill(senses.encoded_wheels[k], real(0.0))
        fill(senses.counted[k], real(0.0))
        fill(senses.counted_step[k], real(0.0))
    for k in range(3):
        fill(senses.reckoned[k], real(0.0))
    for k in range(lanes.readings.shape[0]):
        fill(lanes.readings[k], real(0.0))


@stage
def _respond(shape, lanes, senses):
    """Compute the readings of the range sensors without noise."""
    p = lanes.p
    for s in range(shape.row_range.size):
        row = shape.row_range[s]
        rays = lanes.distances[shape.first_ray[s] : shape.first_ray[s + 1]]
        near, reading = senses.near[s], lanes.readings[s]
        nearest_ray(rays, near)
        if senses.slanted[0] > 0:
            copy_row(near, senses.dim[s])
        kind = shape.range_response[s]
        if kind == LINEAR:
            linear_response(near, p[row + REACH], reading)
        elif kind == TABLE:
            table_response(near, p[row + N_RANGE : row + N_RANGE + 2 * shape.range_table[s]], reading)
        elif kind == LORENTZ or kind == LORENTZ_EDGES:
            law = p[row + REACH], p[row + AMPLITUDE], p[row + HALF_WIDTH], p[row + PEAK]
            lorentz_response(rays, law[0], law[1], law[2], law[3], senses.range_rates[3 * s], reading)
            if kind == LORENTZ_EDGES:
                add_edges(rays, near, law[0], law[1], law[2], law[3], reading)
        elif senses.slanted[0] > 0:
            slanted_response(
                rays, lanes.rates[shape.first_ray[s] : shape.first_ray[s + 1]], p[row + REACH], p[row + AMPLITUDE],
                senses.range_rates[3 * s], p[row + INCIDENCE], near, senses.spare[0], senses.dim[s], reading,
            )  # fmt: skip
        elif kind == IR or kind == PULSES:
            ir_response(rays, p[row + REACH], p[row + AMPLITUDE], senses.range_rates[3 * s], reading)


@stage
def _mix(shape, key, lanes, senses, step):
    """Apply gain noise, compression, dropouts, and outliers. Three sensors share a block of four words."""
    p, words, value, n = lanes.p, senses.words, senses.value, shape.row_range.size
    seen_from = senses.dim if senses.slanted[0] > 0 else senses.near
    draw_words_of(PURPOSE_RANGE, step, mixture_words(n), lanes.counters, key, words)
    for s in range(n):
        row, reading = shape.row_range[s], lanes.readings[s]
        if shape.range_response[s] != PULSES:
            block, place = 4 * (s // PER_BLOCK), s % PER_BLOCK
            second_word(words[block + place], words[block + 3], place, value)
            if senses.noisy[1] > 0:
                gain_noise(value, p[row + GAIN], reading)
            if senses.compressed[0] > 0 and shape.range_response[s] == IR:
                compress(p[row + COMPRESSION], reading)
            if senses.noisy[2] > 0:
                mixture(
                    seen_from[s], words[block + place], value, p[row + DROP : row + DROP + 2],
                    senses.range_rates[3 * s + 1], p[row + OUTLIER : row + OUTLIER + 2],
                    senses.range_rates[3 * s + 2], reading,
                )  # fmt: skip
            else:
                limit(reading)


@stage
def _count_all_pulses(shape, key, lanes, senses, step):
    """Count pulses. Sensor k takes its words from reading step * sensors + k of the stream."""
    p, spare, n = lanes.p, senses.spare, shape.row_range.size
    seen_from = senses.dim if senses.slanted[0] > 0 else senses.near
    for s in range(n):
        if shape.range_response[s] == PULSES:
            row, pulses = shape.row_range[s], shape.range_pulses[s]
            draw_words_of(
                PURPOSE_PULSES, step * n + s, pulse_words(pulses), lanes.counters, key, senses.words
            )
            count_pulses(
                seen_from[s], pulses, senses.words, p[row + DROP : row + DROP + 2],
                senses.range_rates[3 * s + 1], p[row + BURST], spare[0], spare[1], lanes.readings[s],
            )  # fmt: skip


@stage
def _sense_range(shape, rules, key, lanes, senses, step):
    p, n = lanes.p, shape.row_range.size
    _respond(shape, lanes, senses)
    if senses.noisy[1] + senses.noisy[2] > 0:
        _mix(shape, key, lanes, senses, step)
    elif senses.compressed[0] > 0:
        for s in range(n):
            if shape.range_response[s] == IR:
                compress(p[shape.row_range[s] + COMPRESSION], lanes.readings[s])
    _count_all_pulses(shape, key, lanes, senses, step)
    if senses.noisy[0] > 0:
        draw_words_of(PURPOSE_NOISE, step, n, lanes.counters, key, senses.words)
        for s in range(n):
            uniform_noise(senses.words[s], p[shape.row_range[s] + UNIFORM], lanes.readings[s])
    for s in range(n):
        if rules.clip or shape.range_response[s] != LINEAR:
            limit(lanes.readings[s])


@stage
def _sense_light(shape, key, lanes, senses, step, first, n):
    real = lanes.low.dtype.type
    p, spare, lobes = lanes.p, senses.spare, senses.lobes
    draw_words_of(PURPOSE_LIGHT, step, n, lanes.counters, key, senses.words)
    for k in range(n):
        row, lobe, reading = shape.row_sensor[first + k], 4 * k, lanes.readings[first + k]
        fill(reading, real(0.0))
        for lamp in range(shape.n_lights):
            light = shape.row_lamp + 3 * lamp
            look_to(p[light], p[light + 1], p[row], p[row + 1], lanes.pose, spare[0], spare[1], spare[2])
            if shape.light_shadows == NO_SHADOWS:
                fill(spare[3], real(1.0))
            else:
                place_point(p[row], p[row + 1], lanes.pose, spare[4], spare[5])
                shade = 0.5 if shape.light_shadows == HALF_SHADOWS else 0.0
                shade_light(shape, p, spare[4], spare[5], p[light], p[light + 1], shade, spare[3])
            add_light(
                spare[0], spare[1], spare[2], p[light + 2], lobes[lobe], lobes[lobe + 1], lobes[lobe + 2],
                lobes[lobe + 3], spare[3], reading,
            )  # fmt: skip
        answer_light(p[row + 4], p[row + 5], senses.words[k], reading)


@stage
def _sense_floor(shape, key, lanes, senses, step, first, n):
    p, spare = lanes.p, senses.spare
    draw_words_of(PURPOSE_LINE, step, n, lanes.counters, key, senses.words)
    for k in range(n):
        row = shape.row_sensor[first + k]
        place_point(p[row], p[row + 1], lanes.pose, spare[0], spare[1])
        sample_image(shape.floor, shape.floor_grid, spare[0], spare[1], spare[2])
        lay_tape(shape.tapes, spare[0], spare[1], spare[2])
        answer_line(
            spare[2], p[row + 2], p[row + 3], senses.words[k], shape.line_levels[k], lanes.readings[first + k]
        )


@stage
def _sense_bumps(shape, lanes, senses, first, n):
    p, spare = lanes.p, senses.spare
    for k in range(n):
        row = shape.row_sensor[first + k]
        place_point(p[row], p[row + 1], lanes.pose, spare[0], spare[1])
        gap_of_point(shape, p, spare[0], spare[1], spare[2], spare[3], spare[4])
        answer_bump(spare[4], p[row + 2], lanes.readings[first + k])


@stage
def answer(shape, rules, key, lanes, step):
    """Write the readings of all sensors into `lanes.readings`.

    Args:
        shape, rules, key: Structure, rules of the trials, and key of the random numbers.
        lanes: Block; `distances` along the rays, poses, and the numbers of each trial are read.
        step: Number of the reading: 0 at the start, k after k commands.
    """
    senses, first = lanes.senses, shape.first_reading
    # One after the other: a loop over the kinds takes 6 % more time of a whole trial.
    if shape.row_range.size > 0:
        _sense_range(shape, rules, key, lanes, senses, step)
    if first[LIGHT + 1] > first[LIGHT]:
        _sense_light(shape, key, lanes, senses, step, first[LIGHT], first[LIGHT + 1] - first[LIGHT])
    if first[LINE + 1] > first[LINE]:
        _sense_floor(shape, key, lanes, senses, step, first[LINE], first[LINE + 1] - first[LINE])
    if first[BUMP + 1] > first[BUMP]:
        _sense_bumps(shape, lanes, senses, first[BUMP], first[BUMP + 1] - first[BUMP])


@stage
def _tell(said, stalled, n_stalls):
    for lane in range(LANES):
        before = stalled[lane]
        n_stalls[lane] = np.int32(n_stalls[lane] + np.int32(said[lane]) - np.int32(before))
        stalled[lane] = said[lane]


@stage
def feel_motion(shape, rules, key, lanes, step):
    """Update the encoders' counts and pose after a command, and on an S2 the stall sensor.

    Args:
        shape, rules, key, lanes: Arguments of `answer`; `wheels` and `pose` are read, `stalled` is changed.
        step: Number of the command, from 0 on.
    """
    p, senses, words = lanes.p, lanes.senses, lanes.senses.words
    if shape.stall == IDLER:
        row = shape.row_stall
        idler_stall(
            senses.was, lanes.pose, lanes.wheels, senses.idled_wheels, p[row], p[row + 1], senses.idled[2],
            senses.idled[0], senses.idled[1], senses.spare[0],
        )  # fmt: skip
        _tell(senses.spare[0], lanes.stalled, lanes.n_stalls)
    if shape.encoders:
        row, drive = shape.row_encoder, shape.row_drive
        draw_words_of(PURPOSE_ENCODER, step, 2, lanes.counters, key, words)
        for k in range(2):
            read_encoder(
                lanes.wheels[k], senses.encoded_wheels[k], p[row + k], p[row + 2], words[k], senses.counted[k],
                senses.counted_step[k],
            )  # fmt: skip
        reckon(
            senses.counted_step[0],
            senses.counted_step[1],
            p[drive + 1],
            p[drive + 2],
            p[row + 3],
            senses.reckoned,
        )
