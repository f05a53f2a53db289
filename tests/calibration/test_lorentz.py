"""Readings with the response `lorentz`, fitted."""

import numpy as np
import pytest

from realitygap.calibration import Placement, fit_sensor
from realitygap.platforms import SimPlatform
from realitygap.world import Pose, load_robot, paper_arena

ARENA = paper_arena()
WALL = 1.0668
NOISE = 0.0011


def placements_before_the_wall(robot, gaps):
    """Rays of the middle sensor, and its readings in `sim` with noise."""
    model = load_robot("thymio").with_numbers({"range.2.amplitude": 0.9, "range.2.half_width": 0.07})
    simulated = SimPlatform(robot=model, noise=False, precision="double").open_robot(ARENA)
    front, rng = model.range[2].x, np.random.default_rng(0)
    for gap in gaps:
        simulated.reset(Pose(WALL - front - gap, 0.3048, 0.0))
        noise = rng.uniform(-NOISE, NOISE, 20)
        yield Placement(np.array(simulated.distances[6:9]), simulated.observe().readings[2] + noise)


@pytest.mark.slow
def test_amplitude_width_and_noise_are_found_again():
    """120 readings fix the noise within 7 %, one standard deviation, and the other numbers far better."""
    robot = load_robot("thymio")
    placements = list(placements_before_the_wall(robot, (0.01, 0.03, 0.05, 0.08, 0.11, 0.13)))
    fit = fit_sensor(robot, 2, placements, np.random.default_rng(1))
    found = {each.name: each for each in fit.fitted}
    assert list(found) == ["range.2.amplitude", "range.2.half_width", "range.2.noise_uniform"]
    assert found["range.2.amplitude"].estimate == pytest.approx(0.9, rel=0.02)
    assert found["range.2.half_width"].estimate == pytest.approx(0.07, rel=0.02)
    assert found["range.2.noise_uniform"].estimate == pytest.approx(NOISE, rel=0.3)
    assert all(each.identified for each in fit.fitted)
    assert fit.p > 0.01
    assert np.all(np.diff(fit.curve["mean"][:20]) <= 1e-9)
