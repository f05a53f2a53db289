"""Fits of infrared sensors to readings that the kernels of `sim` made, with numbers that are known."""

from __future__ import annotations

import numpy as np
import pytest

from realitygap.calibration import Placement, fit_sensor, independence
from realitygap.calibration._prior import place_of
from realitygap.calibration.infrared._mixture import MixtureReadings, resolution_of
from realitygap.calibration.infrared._parameters import AMPLITUDE, BURST, DECAY, DROP, GAIN, OUTLIER
from realitygap.calibration.infrared._pulses import PulseReadings
from realitygap.platforms import SimPlatform, SimRobot
from realitygap.robots import Command
from realitygap.trials import NoiseKey
from realitygap.world import INCH, Pose, load_robot

PULSES = (AMPLITUDE, DECAY, *DROP, BURST)
MIXTURE = (AMPLITUDE, DECAY, GAIN, *DROP, *OUTLIER)
WALL = 42 * INCH


def placements(
    robot: str,
    truth: dict[str, float],
    key: int,
    *,
    inches=(3, 6, 9, 12, 15, 18),
    times: int = 3,
    readings: int = 50,
    battery=(float("nan"),),
    per_volt: float = 0.0,
) -> list[Placement]:
    """What the middle range sensor of a simulated robot read before the arena's right wall."""
    base = load_robot(robot)
    rays = base.range[1].rays
    found = []
    for number in range(len(inches) * times):
        volts = battery[number % len(battery)]
        now = dict(truth)
        if per_volt:
            now["amplitude"] = truth["amplitude"] * np.exp(per_volt * (volts - np.mean(battery)))
        values = {f"range.1.{name}": value for name, value in now.items()}
        platform = SimPlatform(robot=base, steps=readings, precision="double", set=values)
        with SimRobot(platform, noise_key=NoiseKey(key, individual=number)) as simulated:
            away = inches[number % len(inches)] * INCH
            simulated.reset(Pose(WALL - base.range[1].x - away, 12 * INCH, 0.0))
            distances = simulated.distances[rays : 2 * rays].copy()
            read = []
            for _ in range(readings):
                read.append(simulated.readings[1])
                simulated.drive(Command(0.0, 0.0))
        found.append(Placement(distances, np.array(read), volts))
    return found


def drawn(parameters, rng) -> dict[str, float]:
    """Numbers drawn from what is thought possible."""
    return {parameter.name: float(parameter.prior.of(np.array(rng.random()))) for parameter in parameters}


@pytest.mark.slow
def test_intervals_cover_the_numbers_of_pulse_sensors_as_often_as_they_say():
    hits = []
    for run in range(10):
        rng = np.random.default_rng([1, run])
        truth = drawn(PULSES, rng)
        fit = fit_sensor(
            load_robot("scribbler-s2-fluke2"), 1, placements("scribbler-s2-fluke2", truth, run), rng
        )
        own = {each.name.rpartition(".")[2]: each for each in fit.fitted}
        hits += [own[name].low <= value <= own[name].high for name, value in truth.items()]
    # 60 intervals: 0.90 with a standard deviation of 0.039 if they were independent, so that chance alone fails some 1
    # in 100 keys; this key does not. 100 runs of 6 gave 0.913.
    assert 0.80 <= np.mean(hits) <= 0.99


@pytest.mark.slow
def test_a_mixture_is_recovered_from_its_readings():
    truth = {
        **{"amplitude": 1.2, "decay": 0.15, "noise_gain": 0.03},
        **{"drop_most": 0.5, "drop_at": 0.23, "drop_width": 0.02},
        **{"outlier_most": 0.3, "outlier_at": 0.25, "outlier_width": 0.03},
    }
    rng = np.random.default_rng(3)
    fit = fit_sensor(load_robot("scribbler-s2-fluke1"), 1, placements("scribbler-s2-fluke1", truth, 11), rng)
    own = {each.name.rpartition(".")[2]: each for each in fit.fitted}
    # nine intervals of 90 %: fewer than six hold their number by chance alone once in a thousand keys
    assert sum(own[name].low <= value <= own[name].high for name, value in truth.items()) >= 6
    for parameter in MIXTURE:
        if own[parameter.name].identified:
            off = place_of(parameter, own[parameter.name].estimate) - place_of(
                parameter, truth[parameter.name]
            )
            assert abs(off) < 0.1 or abs(own[parameter.name].estimate / truth[parameter.name] - 1) < 0.05
    assert {name for name in ("amplitude", "decay", "noise_gain", "drop_most") if own[name].identified} == {
        "amplitude", "decay", "noise_gain", "drop_most",
    }  # fmt: skip
    assert fit.p > 0.05
    assert set(fit.numbers) == {f"range.1.{name}" for name in truth}
    assert all(len(values) == 500 for values in fit.draws.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robot", "parameters", "make"),
    [("scribbler-s2-fluke2", PULSES, "pulses"), ("scribbler-s2-fluke1", MIXTURE, "mixture")],
)
def test_the_likelihood_is_what_the_kernels_draw(robot, parameters, make):
    rng = np.random.default_rng(5)
    truth = drawn(parameters, rng) | {"amplitude": 1.1, "decay": 0.2}
    read = placements(robot, truth, 21, inches=(3, 9, 15), times=1, readings=4000)
    reach = load_robot(robot).range[1].reach
    model = PulseReadings(read, reach, 10) if make == "pulses" else MixtureReadings(read, reach)
    chances = model.probabilities(np.array([[truth[parameter.name] for parameter in parameters]]))[0]
    assert chances.sum(axis=1) == pytest.approx(1.0, abs=1e-5)
    expected = 4000 * chances
    off = (model.counts - expected) / np.sqrt(expected + 1.0)
    # some 60 bins: one beyond 4.5 standard deviations comes by chance once in 2,000 keys
    assert np.abs(off).max() < 4.5


def test_likelihoods_of_readings_add_up_to_one_where_a_sensor_is_saturated():
    # readings of 1 that were rounded to a step which does not divide 1 once counted as 0.99999, and not as censored
    read = [Placement(np.array([0.08, 0.08, 0.08]), np.array([1.0, 1.0, 0.73215, 0.73218, 0.0]))]
    model = MixtureReadings(read, 0.5)
    truth = {"amplitude": 3.0, "decay": 0.2, "noise_gain": 0.1} | {
        name: value
        for parameter in (*DROP, *OUTLIER)
        for name, value in [(parameter.name, parameter.prior.lowest)]
    }
    values = np.array([[truth[parameter.name] for parameter in MIXTURE]])
    saturated = model._rows[1] >= 1.0
    assert model._rows[2][saturated].tolist() == [2.0]
    certain = MixtureReadings([Placement(read[0].distances, np.ones(50))], 0.5)
    assert certain.log_likelihood(values)[0] == pytest.approx(0.0, abs=1e-3)


def test_readings_that_follow_each_other_count_less():
    rng = np.random.default_rng(7)
    apart, alike, held = [], [], []
    for _ in range(9):
        noise = rng.standard_normal(50)
        slow = np.convolve(rng.standard_normal(60), [0.6, 0.3, 0.2, 0.1], "valid")[:50]
        place = np.array([0.2, 0.2, 0.2])
        apart.append(Placement(place, 0.5 + 0.05 * noise))
        alike.append(Placement(place, 0.5 + 0.05 * slow))
        held.append(Placement(place, 0.5 + 0.05 * noise + 0.1 * rng.standard_normal()))
    plain = independence(apart, rng)
    assert plain.weight == 1.0
    assert abs(plain.correlation) < 0.12  # of 450, with a standard deviation of 0.047
    slow_ones = independence(alike, rng)
    assert slow_ones.correlation_p == 0.001
    assert slow_ones.correlation == pytest.approx(
        0.56, abs=0.15
    )  # .6*.3 + .3*.2 + .2*.1 over .36 + .09 + .04 + .01
    assert slow_ones.effective < 225
    placed = independence(held, rng)
    assert placed.between_p == 0.001
    assert placed.between > 0.5
    assert placed.effective < 30


@pytest.mark.slow
def test_fewer_independent_readings_widen_intervals():
    read = placements("scribbler-s2-fluke2", {"drop_most": 0.4, "drop_at": 0.15, "drop_width": 0.03}, 31)
    rows = [Placement(each.distances, np.repeat(each.readings, 4)) for each in read]
    robot = load_robot("scribbler-s2-fluke2")

    def width(placements: list[Placement]) -> float:
        fit = fit_sensor(robot, 1, placements, np.random.default_rng(1))
        own = {each.name: each for each in fit.fitted}["range.1.drop_most"]
        return own.high - own.low

    # four times the readings, and no more told: half as wide if they were taken for independent ones
    assert width(rows) > 0.8 * width(read)


@pytest.mark.slow
def test_a_battery_that_varied_is_told_from_distance():
    truth = {"amplitude": 1.0, "decay": 0.2, "noise_gain": 0.03, "drop_most": 0.0, "outlier_most": 0.0}
    read = placements(
        "scribbler-s2-fluke1", truth, 41, times=2, battery=(7.2, 6.4, 6.0, 6.9), per_volt=0.3, readings=25
    )
    fit = fit_sensor(load_robot("scribbler-s2-fluke1"), 1, read, np.random.default_rng(2))
    own = {each.name: each for each in fit.fitted}["range.1.battery_per_v"]
    assert own.identified
    assert own.low < 0.3 < own.high
    assert "range.1.battery_per_v" not in fit.numbers  # a robot's file has no such number


def test_a_battery_that_did_not_vary_is_not_identified():
    truth = {"amplitude": 1.0, "decay": 0.2}
    read = placements("scribbler-s2-fluke2", truth, 43, times=1, battery=(6.6,), readings=20)
    fit = fit_sensor(load_robot("scribbler-s2-fluke2"), 1, read, np.random.default_rng(2))
    own = {each.name: each for each in fit.fitted}["range.1.battery_per_v"]
    assert not own.identified
    assert "full and with a nearly empty battery" in own.advice


@pytest.mark.slow
def test_readings_that_the_model_cannot_make_are_flagged():
    read = placements("scribbler-s2-fluke2", {}, 51)
    # a sensor that answers 2 pulses more or 2 less than it should, half of the time each
    rng = np.random.default_rng(9)
    swung = [
        Placement(each.distances, np.clip(each.readings + rng.choice([-0.2, 0.2], 50), 0, 1)) for each in read
    ]
    robot = load_robot("scribbler-s2-fluke2")
    right, wrong = (fit_sensor(robot, 1, rows, rng) for rows in (read, swung))
    assert right.p > 0.05
    assert right.misfit < 0.02
    assert wrong.p < 0.01
    assert wrong.misfit > 0.1


def test_no_readings_are_refused():
    rng = np.random.default_rng(0)
    blank = [Placement(np.array([0.2]), np.empty(0))]
    with pytest.raises(ValueError, match=r"There are no readings of range\.1"):
        fit_sensor(load_robot("scribbler-s2-fluke2"), 1, blank, rng)


def test_the_step_of_a_sensor_is_what_its_readings_are_multiples_of():
    assert resolution_of(np.array([0.0, 0.3, 0.4, 0.9])) == pytest.approx(0.1)
    assert resolution_of(np.array([0.0, 0.3137, 0.4, 0.9])) < 1e-4


def test_placements_that_were_to_be_the_same_are_compared_wherever_a_camera_saw_them():
    """Told apart by distances to a tenth of a millimeter, no two were of one place, and nothing was between them."""
    rng = np.random.default_rng(4)
    placements = []
    for place in range(4):
        for _ in range(3):
            level = 0.2 + 0.1 * place + rng.normal(0, 0.05)  # as it was put down, and stays for all readings
            distances = np.array([0.1 + 0.05 * place + rng.normal(0, 0.002)])
            readings = np.clip(rng.normal(level, 0.02, 40), 0, 1)
            placements.append(Placement(distances, readings, place=(0.1 * place, 0.0, 0.0)))
    found = independence(placements, rng)
    assert found.between > 0.5
    assert found.between_p < 0.05
