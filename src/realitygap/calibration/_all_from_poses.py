"""All parameters of a robot from whole trials with poses.

With poses, each command, each reading, and each stall can be predicted separately from the robot's observed pose. So
likelihoods replace the summaries of whole simulations (`fit_all`): of motion (`_single_commands.py`), of readings
(`infrared/_pulses.py`, `infrared/_mixture.py`), and of stalls.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from realitygap.platforms import SimEnsemble
from realitygap.records import TrialRecord
from realitygap.world import Arena, RobotModel

from ._all_from_simulation import Posterior
from ._one_thread import one_blas_thread
from ._posterior import N_DRAWS, sample_posterior
from ._prior import OFF_ENDS, Floats, Parameter, place_of, standard_of, values_at
from ._shots import Shooter, Shots, shots_of
from ._single_commands import BLOCK, SLIP, MotionOfCommands
from .infrared._mixture import MixtureReadings
from .infrared._pulses import PulseReadings
from .infrared._readings import Placement, rays_of

N_READINGS = 3000  # of all that were made
N_PARTICLES = 150
FINEST_PLACE = 1e-3  # of a parameter of sensors: likelihoods of pulses have steps
STRAY = 0.01  # probability of any reading at all: what no parameter explains must not decide
SHARES = 31  # of stalls, from the least to the most that is thought possible
N_ROBOTS = 24  # that say how often each of them stalls
N_STALLS = 200  # draws
LEAST_WAY = 0.02  # of the wheels in a command that tells of their slip [m]
LEAST_COMMANDS = 20
SURELY = 0.03  # least probability of a stall, and of none


@one_blas_thread()
def fit_from_poses(
    trials: Sequence[TrialRecord],
    ensemble: SimEnsemble,
    prior: Sequence[Parameter],
    robot: RobotModel,
    arena: Arena,
    *,
    seed: int,
    tell: Callable[[str], None] | None = None,
) -> Posterior:
    """Return the posterior of all parameters.

    Args:
        trials: Trials with poses.
        ensemble: Simulator of the trials.
        prior: Prior of each parameter.
        robot: Robot whose numbers the parameters change.
        arena: Arena of the trials.
        seed: Seed of all random numbers.
        tell: Called with a line after each part.
    """
    say = tell or (lambda _: None)
    rng = np.random.default_rng(seed)
    shots = shots_of(trials, robot, arena)
    shooter = Shooter(shots, ensemble, prior, robot)
    motion = MotionOfCommands(shooter, rng)
    values = motion.fit(own_places(robot, motion.mean), N_DRAWS)
    say(f"motion: {shots.known.sum()} commands, {shots.touching[shots.known].mean():.0%} near walls")
    n_simulated = motion.n_simulated
    sensors = [parameter for parameter in prior if parameter.name.startswith("range.")]
    if sensors:
        values |= sensors_of(shots, sensors, robot, arena, rng)
        say(f"readings: {', '.join(parameter.name for parameter in sensors)}")
    for parameter in prior:
        if parameter.name == SLIP:
            values[SLIP] = np.zeros(N_DRAWS)
    for parameter in prior:
        if parameter.name == "stall.share":
            values[parameter.name] = _share(shooter, parameter, values, rng)
            n_simulated += SHARES * N_ROBOTS
            say("stalls")
    _spread_slip(prior, values, shots, rng)
    places = standard_of(prior, values)
    return Posterior(places, values, np.zeros(len(prior)), n_simulated)


def own_places(robot: RobotModel, parameters: Sequence[Parameter]) -> Floats:
    """Return the places of the robot's own numbers for parameters, (p,); the middle if it has none."""
    numbers = robot.centers()
    own = {
        "drive.gain": numbers["drive.gain_left"],
        "drive.asymmetry": 0.0,
        "body.length": 1.0,
        "body.width": 1.0,
    }
    own |= {p.name: numbers[p.expand[0].number] for p in parameters if p.name.startswith("range.")}
    own |= numbers
    places = [float(place_of(p, own[p.name])) if p.name in own else 0.5 for p in parameters]
    return np.clip(places, *OFF_ENDS)


def sensors_of(
    shots: Shots,
    parameters: Sequence[Parameter],
    robot: RobotModel,
    arena: Arena,
    rng: np.random.Generator,
    n_readings: int = N_READINGS,
) -> dict[str, Floats]:
    """Return draws of each parameter that range sensors share, (N_DRAWS,), by at most `n_readings` of the readings."""
    first = next(sensor for sensor in robot.range if sensor.response in ("ir", "pulses"))
    placements: list[Placement] = []
    poses = shots.poses[:, :-1][shots.known]
    for k, sensor in enumerate(robot.range):
        if (sensor.response, sensor.rays, sensor.pulses) == (first.response, first.rays, first.pulses):
            distances, cosines = rays_of(sensor, poses, arena)
            read = shots.readings[..., k][shots.known]
            placements += [
                Placement(lengths, reading, cosines=at_walls)
                for lengths, reading, at_walls in zip(distances, read[:, None], cosines, strict=True)
            ]
    some = rng.permutation(len(placements))[:n_readings]
    chosen = [placements[k] for k in some]
    model = (
        PulseReadings(chosen, first.reach, first.pulses)
        if first.response == "pulses"
        else MixtureReadings(chosen, first.reach)
    )
    names = [parameter.name for parameter in model.parameters]
    free = [p for p in parameters if p.name.removeprefix("range.") in names]
    own = robot.centers()
    k = robot.range.index(first)

    def values_of_model(places: Floats) -> Floats:
        values = values_at(free, places)
        columns = []
        for name in names:
            center = own.get(f"range.{k}.{name}", 0.0)
            columns.append(values.get(f"range.{name}", np.full(len(places), center)))
        return np.stack(columns, axis=1)

    places = sample_posterior(
        lambda at: model.log_likelihood(values_of_model(at), STRAY), len(free), rng, N_PARTICLES
    )
    which = rng.integers(len(places), size=N_DRAWS)
    drawn = places[which] + FINEST_PLACE * rng.standard_normal((N_DRAWS, len(free)))
    draws = values_at(free, np.clip(drawn, 0.0, 1.0))
    for parameter in parameters:
        if parameter.name not in draws:
            draws[parameter.name] = np.asarray(parameter.prior.of(rng.uniform(size=N_DRAWS)))
    return draws


WITH_SLIP = {
    "drive.gain": -1.0,
    "drive.asymmetry": -1.0,
    "drive.rise": 1.0,
    "stall.share": 1.0,
    "drive.travel_noise_per_m": 0.5,
    "drive.heading_noise_per_m": 0.5,
}
"""Power of (1 - slip) by which each parameter that was fitted without slip is multiplied."""


def _spread_slip(
    prior: Sequence[Parameter], values: dict[str, Floats], shots: Shots, rng: np.random.Generator
) -> None:
    """Spread slip, from encoders or from the prior, and compensate for it with `gain`."""
    for parameter in prior:
        if parameter.name == SLIP:
            slips = _slips(parameter, shots, float(np.median(values.get("drive.axle", 0.0))), rng)
            values[SLIP] = slips
            for name, power in WITH_SLIP.items():
                if name in values:
                    values[name] = values[name] * (1 - slips) ** power


def _slips(parameter: Parameter, shots: Shots, axle: float, rng: np.random.Generator) -> Floats:
    """Return draws of slip, (N_DRAWS,): the share of the wheels' distance that the middle of their axle lacks.

    The middle of the axle moves along an arc, whose chord is shorter. If the axle is not at the origin, the origin
    moves farther in turns.

    Args:
        parameter: Slip, with its prior.
        shots: Commands.
        axle: Position of the axle, ahead of the origin [m].
        rng: Random numbers.
    """
    turned = np.abs(np.diff(shots.wheels, axis=1)).mean(axis=2)
    some = shots.known & ~shots.touching & np.isfinite(turned) & (turned > LEAST_WAY)
    forward = some & (np.prod(np.sign(np.nan_to_num(np.diff(shots.wheels, axis=1))), axis=2) > 0)
    if forward.sum() < LEAST_COMMANDS:
        return np.asarray(parameter.prior.of(rng.uniform(size=N_DRAWS)))
    ahead, aside, turn = shots.moved[forward].T
    chord = np.hypot(ahead + axle * (np.cos(turn) - 1), aside + axle * np.sin(turn))
    lost = 1.0 - chord / np.sinc(turn / (2 * np.pi)) / turned[forward]
    n = len(lost)
    medians = [np.median(lost[rng.integers(n, size=n)]) for _ in range(N_STALLS)]
    draws = np.clip(np.array(medians), parameter.prior.lowest, parameter.prior.highest)
    return np.asarray(draws[rng.integers(N_STALLS, size=N_DRAWS)])


def _share(
    shooter: Shooter, parameter: Parameter, values: Mapping[str, Floats], rng: np.random.Generator
) -> Floats:
    """Return samples, (N_DRAWS,), of the share of its wheels' distance below which a robot stalls."""
    shots = shooter.shots
    shares = parameter.prior.lowest + np.linspace(0.0, 1.0, SHARES) * (
        parameter.prior.highest - parameter.prior.lowest
    )
    which = rng.integers(N_DRAWS, size=N_ROBOTS)
    some = {name: value[which] for name, value in values.items()}
    block, n_blocks = shots.blocks(BLOCK)
    logs = np.empty((SHARES, n_blocks))
    for k, share in enumerate(shares):
        chance = shooter.stalls({**some, parameter.name: np.full(N_ROBOTS, share)}, key=5)
        chance = SURELY + (1 - 2 * SURELY) * chance
        log = np.where(shots.known, np.log(np.where(shots.stalled, chance, 1 - chance)), 0.0)
        logs[k] = np.bincount(block.reshape(-1), log.reshape(-1), minlength=n_blocks)
    best = np.argmax(logs @ rng.exponential(size=(n_blocks, N_STALLS)), axis=0)
    apart = shares[1] - shares[0]
    draws = shares[best] + rng.uniform(-0.5, 0.5, N_STALLS) * apart
    draws = np.clip(draws, parameter.prior.lowest, parameter.prior.highest)
    return np.asarray(draws[rng.integers(N_STALLS, size=N_DRAWS)])
