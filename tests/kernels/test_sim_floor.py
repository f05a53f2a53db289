"""The floor under line sensors against the plain reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.sim import floor
from tests.kernels.sim_rows import PRECISIONS, TOLERANCE, poses, random_words, row
from tests.reference import senses as reference
from tests.reference.effort import cases

GRID = np.array([-0.2, 0.1, 10.0])


def sample(image: Any, x: Any, y: Any, real: Any = np.float64, grid: Any = GRID) -> np.ndarray:
    brightness = row(7.0, real)
    floor.sample_image(
        np.asarray(image, np.float32), np.asarray(grid), row(x, real), row(y, real), brightness
    )
    return brightness


def tape(pieces: Any, x: Any, y: Any, real: Any = np.float64) -> np.ndarray:
    brightness = row(1.0, real)
    floor.lay_tape(np.array(pieces, np.float64).reshape(-1, 6), row(x, real), row(y, real), brightness)
    return brightness


@pytest.mark.parametrize("real", PRECISIONS)
@pytest.mark.parametrize("size", [(1, 1), (1, 4), (5, 3)])
def test_an_image_is_read_between_its_pixels(real: Any, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    image = rng.uniform(0, 1, size).astype(np.float32)
    for _ in range(cases(20, 2)):
        x, y = rng.uniform(-0.5, 0.6, LANES), rng.uniform(-0.2, 0.9, LANES)
        answer = sample(image, x, y, real)
        for lane in range(LANES):
            plain = reference.image_at(image.tolist(), (-0.2, 0.1), 10.0, float(x[lane]), float(y[lane]))
            assert answer[lane] == pytest.approx(plain, abs=TOLERANCE[real])


def test_the_middle_of_a_pixel_is_that_pixel_and_no_image_is_white() -> None:
    image = np.array([[0.1, 0.2], [0.3, 0.4]])  # row 0 is lowest in y
    for row_, y in enumerate((0.15, 0.25)):
        for column, x in enumerate((-0.15, -0.05)):
            assert sample(image, x, y)[0] == pytest.approx(image[row_, column], abs=1e-7)
    assert (sample(np.zeros((0, 0)), 0.3, 0.3) == 1.0).all()


@pytest.mark.parametrize("real", PRECISIONS)
def test_tape_is_where_the_reference_has_it(real: Any) -> None:
    rng = np.random.default_rng(2)
    on = 0
    for _ in range(cases(40, 3)):
        pieces = [(*rng.uniform(0, 1, 4), rng.uniform(0.01, 0.4), shade) for shade in (0.2, 0.6)]
        pieces[1] = pieces[1][:2] + pieces[1][:2] + pieces[1][4:]  # a dot
        x, y = rng.uniform(0, 1, (2, LANES))
        answer = tape(pieces, x, y, real)
        for lane in range(LANES):
            point = float(x[lane]), float(y[lane])
            wider = [(*piece[:4], piece[4] * (1 + 1e-4)) for piece in pieces]
            thinner = [(*piece[:4], piece[4] * (1 - 1e-4)) for piece in pieces]
            within = [reference.on_tape(piece, *point) for piece in wider]
            if within != [reference.on_tape(piece, *point) for piece in thinner]:
                continue  # at an edge a rounding decides
            plain = 0.6 if within[1] else 0.2 if within[0] else 1.0  # the later piece lies on top
            assert answer[lane] == pytest.approx(plain, abs=1e-6)
            on += plain < 1
    assert on > cases(300, 20)


def test_a_sensor_looks_where_it_is_mounted() -> None:
    x, y = row(0.0, np.float64), row(0.0, np.float64)
    at = poses(0.5, 0.2, np.pi / 2, np.float64)
    floor.place_point(row(0.05, np.float64), row(0.01, np.float64), at, x, y)
    assert (x[0], y[0]) == pytest.approx((0.49, 0.25))  # ahead is +y, left is -x


def answer(
    brightness: Any, threshold: float, noise: float, words: np.ndarray, *, as_level: bool = False
) -> np.ndarray:
    real = np.float64
    reading = row(0.0, real)
    floor.answer_line(row(brightness, real), row(threshold, real), row(noise, real), words, as_level, reading)
    return reading


def test_below_the_threshold_is_a_line_and_a_level_says_how_dark() -> None:
    words = np.full(LANES, 2**31, np.uint32)
    levels = np.array([0.0, 0.3, 0.5, 1.0] * (LANES // 4))
    assert answer(levels, 0.5, 0.0, words)[:4].tolist() == [1.0, 1.0, 0.0, 0.0]
    assert answer(levels, 0.5, 0.0, words, as_level=True)[:4] == pytest.approx([1.0, 0.7, 0.5, 0.0])


def test_line_noise_misreads_as_often_as_stated() -> None:
    """Brightness one standard deviation above the threshold is read as dark in 15.87 % of readings; four standard
    errors: 1 in 16,000 by chance."""
    rng = np.random.default_rng(3)
    dark = np.concatenate([answer(0.6, 0.5, 0.1, random_words(rng, 1)[0]) for _ in range(cases(1_000, 20))])
    assert dark.mean() == pytest.approx(0.158655, abs=4 * np.sqrt(0.1335 / dark.size))
    assert set(dark) == {0.0, 1.0}
    noisy = np.concatenate([answer(0.1, 0.5, 0.5, random_words(rng, 1)[0], as_level=True) for _ in range(20)])
    assert noisy.min() == 0.0
    assert noisy.max() == 1.0
