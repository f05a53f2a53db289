"""Responses of range sensors against the plain reference; cones; tables; words that no two uses share."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.kernels.math import philox
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import ranges
from realitygap.kernels.sim import words as words_kernels
from tests.kernels.sim_rows import PRECISIONS, TOLERANCE, row, rows
from tests.reference import senses as reference
from tests.reference.effort import cases
from tests.reference.philox import Stream

REACH = 0.5
LORENTZ = ("amplitude", "half_width", "peak")


def respond(
    kind: str, distances: Any, real: Any = np.float64, reach: Any = REACH, **numbers: Any
) -> np.ndarray:
    """(LANES,) readings without noise to distances (rays, LANES)."""
    near, rate, reading = (row(0.0, real) for _ in range(3))
    rays = np.asarray(distances, real)
    ranges.nearest_ray(rays, near)
    if kind == "linear":
        ranges.linear_response(near, row(reach, real), reading)
    elif kind == "ir":
        ranges.rate_of(row(numbers["decay"], real), rate)
        ranges.ir_response(rays, row(reach, real), row(numbers["amplitude"], real), rate, reading)
    elif kind in ("lorentz", "lorentz_edges"):
        ranges.widening_of(row(numbers["cone"] / (2 * np.pi), real), rate)
        of_law = [row(value, real) for value in (reach, *(numbers[name] for name in LORENTZ))]
        ranges.lorentz_response(rays, *of_law, rate, reading)
        if kind == "lorentz_edges":
            ranges.add_edges(rays, near, *of_law, reading)
    else:
        entries = rows(itertools.chain(*numbers["table"]), real)
        ranges.prepare_table(entries)
        ranges.table_response(near, entries, reading)
    return reading


@pytest.mark.parametrize("real", PRECISIONS)
@pytest.mark.parametrize("n_rays", [1, 3, 7])
def test_responses_equal_the_reference_with_other_numbers_in_each_lane(real: Any, n_rays: int) -> None:
    rng = np.random.default_rng(1)
    for _ in range(cases(40, 3)):
        reach = rng.uniform(0.1, 2.0, LANES)
        rays = np.minimum(rng.uniform(0, 1.3, (n_rays, LANES)) * reach, reach).astype(real)
        amplitude, decay = rng.uniform(0.2, 3.0, LANES), rng.uniform(0.01, 0.5, LANES)
        linear = respond("linear", rays, real, reach)
        infrared = respond("ir", rays, real, reach, amplitude=amplitude, decay=decay)
        for lane in range(LANES):
            seen = [float(d) for d in rays[:, lane]]
            one = float(real(reach[lane]))
            assert linear[lane] == pytest.approx(reference.linear(seen, one), abs=TOLERANCE[real])
            plain = reference.infrared(seen, one, amplitude[lane], decay[lane])
            assert infrared[lane] == pytest.approx(plain, abs=3 * TOLERANCE[real])


@pytest.mark.parametrize("real", PRECISIONS)
def test_tables_equal_the_reference_with_another_table_in_each_lane(real: Any) -> None:
    rng = np.random.default_rng(2)
    for n in (1, 2, 5):
        distances = np.sort(rng.uniform(0, 0.5, (n, LANES)), axis=0)
        readings = rng.uniform(0, 1, (n, LANES))
        near = rng.uniform(0, 0.6, (1, LANES))
        table = [(distances[k], readings[k]) for k in range(n)]
        answer = respond("table", near, real, table=table)
        for lane in range(LANES):
            entries = [(d[lane], r[lane]) for d, r in table]
            # A slope between entries that lie close magnifies what single precision drops of a distance.
            steepest = max(
                [1.0, *(abs((b[1] - a[1]) / (b[0] - a[0])) for a, b in itertools.pairwise(entries))]
            )
            plain = reference.table(near[0, lane], entries)
            assert answer[lane] == pytest.approx(plain, abs=steepest * TOLERANCE[real])


def test_the_later_of_two_entries_at_one_distance_adds_nothing() -> None:
    near = np.array([[0.1, 0.2, 0.3] + [0.0] * (LANES - 3)])
    answer = respond("table", near, table=[(0.0, 1.0), (0.2, 0.5), (0.2, 0.0), (0.4, 0.0)])
    assert answer[:3].tolist() == [0.75, 0.5, 0.5]


def test_nothing_within_reach_reads_zero() -> None:
    nothing = np.full((3, LANES), REACH)
    assert (respond("linear", nothing) == 0).all()
    assert (respond("ir", nothing, amplitude=2.0, decay=0.1) == 0).all()


def test_a_cone_of_light_adds_up_and_a_cone_of_echoes_takes_the_first() -> None:
    """One ray of three meets something: the first echo is all of it; of the light half or a full lobe returns."""
    for ray, weight in ((0, 0.5), (1, 1.0), (2, 0.5)):
        rays = np.full((3, LANES), REACH)
        rays[ray] = 0.1
        assert respond("linear", rays)[0] == pytest.approx(0.8)
        assert respond("ir", rays, amplitude=1.0, decay=0.1)[0] == pytest.approx(np.exp(-1) * weight / 2.0)
    everywhere = np.full((3, LANES), 0.1)
    assert respond("ir", everywhere, amplitude=1.0, decay=0.1)[0] == pytest.approx(np.exp(-1))


@pytest.mark.parametrize("real", PRECISIONS)
@pytest.mark.parametrize("n_rays", [1, 3])
def test_lorentz_equals_the_reference_with_other_numbers_in_each_lane(real: Any, n_rays: int) -> None:
    rng = np.random.default_rng(4)
    for _ in range(cases(40, 3)):
        reach = rng.uniform(0.1, 0.4, LANES).astype(real)
        rays = np.minimum(rng.uniform(0, 1.3, (n_rays, LANES)) * reach, reach).astype(real)
        numbers = {
            "amplitude": rng.uniform(0.2, 3.0, LANES),
            "half_width": rng.uniform(0.06, 0.3, LANES),
            "peak": rng.uniform(-0.05, 0.05, LANES),
            "cone": rng.uniform(0.0, 1.2, LANES),
        }
        answer = respond("lorentz", rays, real, reach, **numbers)
        with_edges = respond("lorentz_edges", rays, real, reach, **numbers)
        for lane in range(LANES):
            far = float(reach[lane]) - rays[n_rays // 2, lane] / math.cos(numbers["cone"][lane])
            if abs(far) < 1e-5:  # on the far edge rounding decides
                continue
            law = [float(reach[lane]), *(numbers[name][lane] for name in LORENTZ)]
            plain = reference.enki([float(d) for d in rays[:, lane]], numbers["cone"][lane], *law)
            assert answer[lane] == pytest.approx(plain, abs=100 * TOLERANCE[real])
            plain += reference.of_lost_rays([float(d) for d in rays[:, lane]], *law)
            assert with_edges[lane] == pytest.approx(plain, abs=100 * TOLERANCE[real])


def test_lorentz_of_a_facing_wall_is_that_of_the_middle_ray_up_to_the_far_edge() -> None:
    """Readings of Enki's Thymio in front of a wall: 4505 at most, 14 cm of range."""
    numbers = {
        "amplitude": 4505.0,
        "half_width": math.sqrt(73) / 100,
        "peak": 0.0003,
        "cone": math.radians(15),
    }
    middle = np.array([0.005, 0.04, 0.1, 0.13, 0.136, 0.139] + [0.14] * (LANES - 6))
    side = middle / math.cos(math.radians(15))
    rays = np.minimum([side, middle, side], 0.14)
    answer = respond("lorentz", rays, reach=0.14, **numbers)
    assert answer[:7] == pytest.approx([4491, 3704, 1907, 1363, 1279, 1239, 0], abs=3)
    rays[[0, 2]] = 0.14  # the middle ray alone: 0 after the limits of a reading
    assert (respond("lorentz", rays, reach=0.14, **numbers)[:4] < 0).all()


def test_lorentz_reads_its_amplitude_nearer_than_its_peak_and_where_it_has_no_width() -> None:
    rays = np.array([[0.0, 0.01, 0.02, 0.03] * (LANES // 4)])
    numbers = {"amplitude": 0.9, "cone": 0.0}
    near = respond("lorentz", rays, half_width=0.05, peak=0.02, **numbers)
    assert near[:3] == pytest.approx([0.9] * 3)
    assert near[3] < 0.9
    flat = respond("lorentz", rays, half_width=0.01, peak=0.02, **numbers)
    assert flat[:4] == pytest.approx([0.9, 0.9, 0.9, 0.0])
    assert np.isfinite(respond("lorentz", rays, half_width=0.0, peak=0.0, **numbers)).all()


def test_the_edges_of_a_cone_of_a_half_plane_take_nothing_off() -> None:
    rays = np.full((3, LANES), 0.1)
    numbers = {"amplitude": 1.0, "half_width": 0.1, "peak": 0.0}
    assert respond("lorentz", rays, cone=math.pi / 2 + 0.1, **numbers)[0] == pytest.approx(1.5)
    assert respond("lorentz", rays, cone=0.0, **numbers)[0] == pytest.approx(0.5)


def test_a_decay_of_zero_sees_nothing_but_what_touches() -> None:
    rays = np.array([[0.0, 1e-9, 0.1] + [0.2] * (LANES - 3)])
    assert respond("ir", rays, amplitude=1.0, decay=0.0)[:3] == pytest.approx([1.0, 0.0, 0.0], abs=1e-37)


number = st.floats(0.02, 2.0)


@settings(max_examples=cases(60, 10), deadline=None)
@given(
    near=number,
    far=number,
    amplitude=number,
    decay=number,
    kind=st.sampled_from(["linear", "ir", "table", "lorentz"]),
)
def test_a_farther_wall_never_reads_more(
    near: float, far: float, amplitude: float, decay: float, kind: str
) -> None:
    near, far = sorted([near, far])
    table = [(0.0, 1.0), (0.3, 0.6), (1.0, 0.05), (2.0, 0.0)]
    rays = np.array([[near, far] * (LANES // 2)])
    law = {"half_width": decay, "peak": 0.01, "cone": 0.0}
    answer = respond(kind, rays, reach=2.5, amplitude=amplitude, decay=decay, table=table, **law)
    assert answer[0] >= answer[1]


@settings(max_examples=cases(20, 5), deadline=None)
@given(seed=st.integers(0, 2**31), kind=st.sampled_from(["linear", "ir"]), real=st.sampled_from(PRECISIONS))
def test_a_lane_depends_on_no_other_and_not_on_its_place(seed: int, kind: str, real: Any) -> None:
    rng = np.random.default_rng(seed)
    rays = rng.uniform(0, REACH, (3, LANES)).astype(real)
    amplitude, decay = rng.uniform(0.1, 2, (2, LANES))
    answer = respond(kind, rays, real, amplitude=amplitude, decay=decay)
    order = rng.permutation(LANES)
    moved = respond(kind, rays[:, order], real, amplitude=amplitude[order], decay=decay[order])
    assert (moved == answer[order]).all()
    rays[:, 0] = REACH
    assert (respond(kind, rays, real, amplitude=amplitude, decay=decay)[1:] == answer[1:]).all()


def test_words_of_a_step_are_those_of_the_purposes_stream() -> None:
    rng = np.random.default_rng(3)
    counters = np.zeros((3, LANES), np.uint32)
    counters[0] = np.arange(LANES, dtype=np.uint32) * 256 + int(philox.PURPOSE_NOISE)
    counters[2] = 9
    words = np.zeros((8, LANES), np.uint32)
    for _ in range(cases(20, 3)):
        step, n = int(rng.integers(0, 5_000)), int(rng.integers(1, 9))
        blocks = -(-n // 4)
        words_kernels.draw_words_of(
            philox.PURPOSE_RANGE, np.int64(step), np.int64(n), counters, np.uint64(77), words
        )
        for lane in (0, LANES - 1):
            stream = Stream(77, replicate=9, generation=0, individual=lane, repeat=0, purpose=7)
            for k in range(4 * blocks):
                assert words[k, lane] == stream.words(step * blocks + k // 4)[k % 4]
