"""Light sensors against the plain reference: lobe, inverse square, several lights, noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import light
from tests.kernels.sim_rows import PRECISIONS, TOLERANCE, poses, random_words, row
from tests.reference import senses as reference
from tests.reference.effort import cases


def receive(
    x: Any,
    y: Any,
    heading: Any,
    mount: Any,
    direction: Any,
    width: Any,
    lamps: Sequence[Any],
    real: Any = np.float64,
) -> np.ndarray:
    """(LANES,) light before gain and noise; lamps are x, y, strength, lit."""
    lobe = [row(0.0, real) for _ in range(4)]
    turn = 2 * np.pi
    light.prepare_light(row(np.asarray(direction) / turn, real), row(np.asarray(width) / turn, real), *lobe)
    ahead, left, distance, reading = (row(0.0, real) for _ in range(4))
    for lamp_x, lamp_y, strength, lit in lamps:
        light.look_to(
            row(lamp_x, real), row(lamp_y, real), row(mount[0], real), row(mount[1], real),
            poses(x, y, heading, real), ahead, left, distance,
        )  # fmt: skip
        light.add_light(ahead, left, distance, row(strength, real), *lobe, row(lit, real), reading)
    return reading


@pytest.mark.parametrize("real", PRECISIONS)
def test_light_equals_the_reference_with_other_numbers_in_each_lane(real: Any) -> None:
    rng = np.random.default_rng(1)
    for n_lamps in (1, 3):
        for _ in range(cases(20, 2)):
            x, y, heading = rng.uniform(-1, 1, (3, LANES))
            heading *= np.pi
            mount = rng.uniform(-0.1, 0.1, (2, LANES))
            direction, width = rng.uniform(-np.pi, np.pi, LANES), rng.uniform(0.3, np.pi, LANES)
            lamps = [
                (*rng.uniform(-1.5, 1.5, (2, LANES)), rng.uniform(0, 1, LANES), rng.uniform(0, 1, LANES))
                for _ in range(n_lamps)
            ]
            answer = receive(x, y, heading, mount, direction, width, lamps, real)
            for lane in range(LANES):
                plain = reference.light(
                    (x[lane], y[lane], heading[lane]), (mount[0, lane], mount[1, lane]), direction[lane], width[lane],
                    [reference.Lamp(*(one[lane] for one in lamp)) for lamp in lamps],
                )  # fmt: skip
                nearest = min(np.hypot(lamp[0][lane] - x[lane], lamp[1][lane] - y[lane]) for lamp in lamps)
                scale = 1 + plain / max(nearest - 0.15, 0.01) ** 2  # the nearer, the steeper
                assert answer[lane] == pytest.approx(plain, abs=30 * TOLERANCE[real] * scale)


def test_twice_as_far_is_a_quarter_and_lights_add_up() -> None:
    def ahead(*distances: float) -> float:
        lamps = [(distance, 0.0, 0.1, 1.0) for distance in distances]
        return float(receive(0.0, 0.0, 0.0, (0.0, 0.0), 0.0, np.pi / 2, lamps)[0])

    assert ahead(1.0) == pytest.approx(0.1)
    assert ahead(2.0) == pytest.approx(0.025)
    assert ahead(1.0, 2.0) == pytest.approx(0.125)


def test_the_lobe_is_a_cosine_that_ends_at_its_width() -> None:
    for width in (np.pi / 6, np.pi / 2, np.pi):
        for angle in np.linspace(0, np.pi, 13):
            lamp = (np.cos(angle), np.sin(angle), 1.0, 1.0)
            seen = receive(0.0, 0.0, 0.0, (0.0, 0.0), 0.0, width, [lamp])[0]
            mirrored = receive(0.0, 0.0, 0.0, (0.0, 0.0), 0.0, width, [(lamp[0], -lamp[1], 1.0, 1.0)])[0]
            wanted = max((np.cos(angle) - np.cos(width)) / (1 - np.cos(width)), 0.0)
            assert seen == pytest.approx(wanted, abs=1e-12)
            assert mirrored == pytest.approx(seen, abs=1e-12)


def test_light_noise_has_the_stated_spread() -> None:
    """Mean and variance within four standard errors: 1 in 8,000 by chance."""
    rng = np.random.default_rng(2)
    answers = []
    for _ in range(cases(1_000, 20)):
        reading = row(0.25, np.float64)
        light.answer_light(row(2.0, np.float64), row(0.1, np.float64), random_words(rng, 1)[0], reading)
        answers.append(reading)
    seen = np.concatenate(answers)
    assert seen.mean() == pytest.approx(0.5, abs=4 * 0.05 / np.sqrt(seen.size))
    assert seen.var() == pytest.approx(0.05**2, abs=4 * 0.05**2 * np.sqrt(2 / seen.size))


@settings(max_examples=cases(50, 8), deadline=None)
@given(
    x=st.floats(-2, 2), y=st.floats(-2, 2), strength=st.floats(0, 10), gain=st.floats(0, 100), noise=st.floats(0, 3),
    width=st.floats(0.01, np.pi), seed=st.integers(0, 2**31), real=st.sampled_from(PRECISIONS),
)  # fmt: skip
def test_readings_stay_between_nothing_and_all(
    x: float, y: float, strength: float, gain: float, noise: float, width: float, seed: int, real: Any
) -> None:
    reading = receive(x, y, 0.0, (0.0, 0.0), 0.0, width, [(0.0, 0.0, strength, 1.0)], real)
    word = random_words(np.random.default_rng(seed), 1)[0]
    light.answer_light(row(gain, real), row(noise, real), word, reading)
    assert ((reading >= 0) & (reading <= 1)).all()
