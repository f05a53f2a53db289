"""The two poles against Lagrange's equations, and against what must hold of any such cart."""

from __future__ import annotations

import random

import numpy as np
import pytest

from realitygap.kernels.neat.network import decode, make_networks
from realitygap.kernels.tasks import double_pole
from realitygap.study import task_settings
from tests.kernels.genome_arrays import grown, rules_of, to_arrays
from tests.reference import double_pole as reference
from tests.reference.effort import cases
from tests.reference.neat import Neat, Recurrent, feed_forward

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")

FIRST = np.int64(0)
HALF = np.float64(0.5)

# Gains on the inputs (x, v, long angle and speed, short angle and speed, constant) of a network that balances:
# those of a linear-quadratic regulator of the equations at rest, for the slope of the sigmoid at its middle.
BALANCING = [-0.333, -0.294, -1.424, -1.45, 1.036, 0.356, 0.0]


def random_state(rng: random.Random) -> list[float]:
    return [rng.uniform(-size, size) for size in (2.4, 3.0, 0.6, 3.0, 0.6, 6.0)]


def test_accelerations_equal_those_of_lagrange() -> None:
    for seed in range(cases(500, 50)):
        rng = random.Random(seed)
        state, force = random_state(rng), rng.uniform(-10, 10)
        _, cart, _, pole_1, _, pole_2 = reference.slopes(state, force)
        found = double_pole.accelerations(force, *state[2:])
        assert found == pytest.approx((cart, pole_1, pole_2), rel=1e-10, abs=1e-9)


def test_a_mirrored_cart_moves_as_a_mirror_image() -> None:
    for seed in range(20):
        rng = random.Random(seed)
        state, force = random_state(rng), rng.uniform(-10, 10)
        forth = double_pole.cart_step(force, 0.01, *state)
        back = double_pole.cart_step(-force, 0.01, *(-value for value in state))
        assert back == tuple(-value for value in forth)


def test_nothing_moves_where_all_stands_upright_without_force() -> None:
    assert double_pole.cart_step(0.0, 0.01, 1.0, *[0.0] * 5) == (1.0, *[0.0] * 5)


def test_energy_is_kept_but_for_friction_and_the_error_is_of_fourth_order() -> None:
    """Half a second of free fall: halving the step must divide the error by about 16."""
    start = [0.1, 0.3, 0.2, -0.4, 0.1, 0.5]

    def end(n_steps: int) -> list[float]:
        state = tuple(start)
        for _ in range(n_steps):
            state = double_pole.cart_step(0.0, 0.5 / n_steps, *state)
        return list(state)

    exact = end(4000)
    errors = [np.abs(np.subtract(end(n), exact)).max() for n in (100, 200, 400)]
    assert 12 < errors[0] / errors[1] < 20
    assert 12 < errors[1] / errors[2] < 20
    lost = reference.energy(start) - reference.energy(exact)
    assert 0.0 < lost < 1e-3


class Trial:
    """A genome tried by the kernel and by the reference."""

    def __init__(self, neat: Neat, genome, *, velocities: bool) -> None:
        self.neat, self.genome, self.velocities = neat, genome, velocities
        self.rules = rules_of(neat)
        arrays = to_arrays(neat, [genome])
        room, hidden_room = arrays.innovation.shape[1], arrays.hidden.shape[1]
        self.networks = make_networks(np.int64(1), self.rules, room, hidden_room)
        decode(arrays, FIRST, self.rules, self.networks, FIRST)
        self.values = np.full(neat.first_hidden + hidden_room, 9.0)  # a trial must not see what was there
        self.before = np.zeros_like(self.values)
        self.shaking = np.zeros(double_pole.SHAKE_ACTIONS)

    def actions(self, most: int, start: tuple[float, ...]) -> int:
        return double_pole.balance(
            self.networks,
            FIRST,
            self.rules,
            HALF,
            self.velocities,
            np.int64(most),
            start,
            self.values,
            self.before,
            self.shaking,
        )

    def generalization(self) -> int:
        return double_pole.generalization(
            self.networks, FIRST, self.rules, HALF, self.values, self.before, self.shaking
        )

    def path(self, most: int, start: tuple[float, ...]) -> list[list[float]]:
        recurrent = Recurrent(self.neat, self.genome)

        def controller(state: list[float]) -> float:
            seen = [*reference.inputs(state, velocities=self.velocities), 0.5]
            if self.neat.settings.recurrent:
                return recurrent.step(seen)[0]
            return feed_forward(self.neat, self.genome, seen)[0]

        return reference.balance(controller, most, start)


def some_neat(*, velocities: bool) -> Neat:
    name = "double-pole" if velocities else "double-pole-no-velocity"
    n_inputs = 7 if velocities else 4
    return Neat(task_settings(name), n_inputs, 1, n_inputs - 1)


@pytest.mark.parametrize("velocities", [True, False])
def test_trials_of_random_networks_equal_the_reference(velocities: bool) -> None:
    neat = some_neat(velocities=velocities)
    lengths = set()
    for seed in range(cases(150, 10)):
        rng = random.Random(seed)
        trial = Trial(neat, grown(neat, seed, rng.randint(0, 12)), velocities=velocities)
        start = tuple(rng.uniform(-size, size) for size in (1.0, 0.5, 0.1, 0.3))
        path = trial.path(300, start)
        assert trial.actions(300, start) == len(path)
        lengths.add(len(path))
        if len(path) >= 100:
            shaking = [sum(map(abs, state[:4])) for state in path]
            expected = [shaking[k] for k in sorted(range(len(path) - 100, len(path)), key=lambda k: k % 100)]
            assert trial.shaking == pytest.approx(expected, rel=1e-6)
    assert len(lengths) > cases(15, 3)


def balancing(*, velocities: bool = True) -> Trial:
    """A trial of the network with the gains above, which needs the velocities."""
    neat = some_neat(velocities=velocities)
    genome = grown(neat, 0, 0)
    for gene, gain in zip(genome.genes.values(), BALANCING, strict=True):
        gene.weight, gene.enabled = gain, True
    return Trial(neat, genome, velocities=velocities)


def test_a_network_that_balances_is_let_go_after_the_last_action() -> None:
    n = cases(1000, 150)
    trial = balancing()
    start = double_pole.first_start()
    assert trial.actions(n, start) == n
    assert trial.actions(7, start) == 7
    path = trial.path(n, start)
    assert len(path) == n
    fitness = double_pole.gruau_fitness(n, trial_shaking(trial, n, start))
    assert fitness == pytest.approx(reference.gruau_fitness(path), rel=1e-6)


def trial_shaking(trial: Trial, n: int, start: tuple[float, ...]) -> np.ndarray:
    trial.actions(n, start)
    return trial.shaking


@pytest.mark.parametrize("n", [0, 1, 99, 100])
def test_short_trials_count_for_their_length_alone(n: int) -> None:
    shaking = np.full(double_pole.SHAKE_ACTIONS, np.nan)
    assert double_pole.gruau_fitness(n, shaking) == pytest.approx(n / 10_000)


def test_a_cart_at_rest_has_a_finite_fitness() -> None:
    assert np.isfinite(double_pole.gruau_fitness(1000, np.zeros(double_pole.SHAKE_ACTIONS)))
