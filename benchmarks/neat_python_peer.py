"""neat-python, NEAT in Python: what `peers.py` times of it.

Rates are those of Stanley & Miikkulainen (2002), as far as it has them: every node has a bias in place of a
constant input, weights move by normal steps, structural mutations are drawn apart, a link is never deleted.
"""

from __future__ import annotations

import random
import tempfile
import time
from pathlib import Path
from typing import Any

import work
from environments import Peer, answer_as_worker, repeated, spread

PEER = Peer(
    name="neat_python",
    title="neat-python",
    requirements=("neat-python==2.0.0",),
    packages=("neat-python",),
    figures=("run_us", "xor_ms", "large_ms", "pass_us"),
)
RUNS = 20
PASSES = 20_000
SETTINGS = """
[NEAT]
fitness_criterion = max
fitness_threshold = 1e9
no_fitness_termination = True
pop_size = {population}
reset_on_extinction = False

[DefaultGenome]
activation_default = sigmoid
activation_mutate_rate = 0.0
activation_options = sigmoid
aggregation_default = sum
aggregation_mutate_rate = 0.0
aggregation_options = sum
bias_init_mean = 0.0
bias_init_stdev = 1.0
bias_init_type = gaussian
bias_max_value = 8.0
bias_min_value = -8.0
bias_mutate_power = 1.0
bias_mutate_rate = 0.8
bias_replace_rate = 0.1
compatibility_disjoint_coefficient = 1.0
compatibility_weight_coefficient = 0.4
conn_add_prob = 0.05
conn_delete_prob = 0.0
enabled_default = True
enabled_mutate_rate = 0.0
enabled_rate_to_true_add = 0.0
enabled_rate_to_false_add = 0.0
feed_forward = True
initial_connection = full_direct
node_add_prob = 0.03
node_delete_prob = 0.0
num_hidden = 0
num_inputs = {inputs}
num_outputs = {outputs}
response_init_mean = 1.0
response_init_stdev = 0.0
response_init_type = gaussian
response_max_value = 30.0
response_min_value = -30.0
response_mutate_power = 0.0
response_mutate_rate = 0.0
response_replace_rate = 0.0
single_structural_mutation = False
structural_mutation_surer = default
weight_init_mean = 0.0
weight_init_stdev = 1.0
weight_init_type = gaussian
weight_max_value = 8.0
weight_min_value = -8.0
weight_mutate_power = 1.0
weight_mutate_rate = 0.8
weight_replace_rate = 0.1

[DefaultSpeciesSet]
compatibility_threshold = 3.0

[DefaultStagnation]
species_fitness_func = max
max_stagnation = 15
species_elitism = 2

[DefaultReproduction]
elitism = 1
survival_threshold = 0.2
min_species_size = 1
"""


def _settings(population: int, inputs: int, outputs: int) -> Any:
    import neat

    text = SETTINGS.format(population=population, inputs=inputs, outputs=outputs)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "neat.ini"
        path.write_text(text, "utf-8")
        return neat.Config(
            neat.DefaultGenome,
            neat.DefaultReproduction,
            neat.DefaultSpeciesSet,
            neat.DefaultStagnation,
            str(path),
        )


def _tell_ones(genomes: Any, settings: Any) -> None:
    for _, genome in genomes:
        genome.fitness = 1.0


def time_runs() -> dict[str, Any]:
    """Microseconds a run; `run` breeds after each generation, so the last is told outside it."""
    import neat

    settings = _settings(work.RUN_POPULATION, work.N_INPUTS, work.N_OUTPUTS)
    seeds = iter(range(1_000_000))

    def work_once() -> float:
        since = time.perf_counter()
        for _ in range(RUNS):
            population = neat.Population(settings, seed=next(seeds))
            population.run(_tell_ones, work.RUN_GENERATIONS - 1)
            _tell_ones(population.population.items(), settings)
        return (time.perf_counter() - since) / RUNS * 1e6

    return repeated(work_once)


def _tell_xor(genomes: Any, settings: Any) -> None:
    import neat

    for _, genome in genomes:
        network = neat.nn.FeedForwardNetwork.create(genome, settings)
        errors = sum(abs(network.activate(inputs)[0] - wanted) for inputs, wanted in work.XOR_CASES)
        genome.fitness = (4.0 - errors) ** 2


def time_xor() -> dict[str, Any]:
    """Milliseconds a generation."""
    import neat

    settings = _settings(work.XOR_POPULATION, 2, 1)
    seeds = iter(range(1, 1_000_000))

    def work_once() -> float:
        population = neat.Population(settings, seed=next(seeds))
        since = time.perf_counter()
        population.run(_tell_xor, work.XOR_GENERATIONS)
        return (time.perf_counter() - since) / work.XOR_GENERATIONS * 1e3

    return repeated(work_once)


def time_large() -> dict[str, Any]:
    """Milliseconds between the end of one evaluation and the start of the next."""
    import neat

    settings = _settings(work.LARGE_POPULATION, work.N_INPUTS, work.N_OUTPUTS)
    population = neat.Population(settings, seed=1)
    draw = random.Random(1)
    began, ended = [], []

    def tell(genomes: Any, settings: Any) -> None:
        began.append(time.perf_counter())
        for _, genome in genomes:
            genome.fitness = draw.random()
        ended.append(time.perf_counter())

    population.run(tell, work.LARGE_GENERATIONS + 1)
    taken = [(until - since) * 1e3 for since, until in zip(ended, began[1:], strict=False)]
    return {**spread(taken), "species": len(population.species.species)}


def time_passes() -> dict[str, Any]:
    """Microseconds of one activation."""
    import neat

    settings = _settings(work.RUN_POPULATION, work.N_INPUTS, work.N_OUTPUTS)
    genome = next(iter(neat.Population(settings, seed=1).population.values()))
    network = neat.nn.FeedForwardNetwork.create(genome, settings)
    inputs = [0.1, 0.2, 1.0]

    def work_once() -> float:
        since = time.perf_counter()
        for _ in range(PASSES):
            network.activate(inputs)
        return (time.perf_counter() - since) / PASSES * 1e6

    return repeated(work_once)


if __name__ == "__main__":
    answer_as_worker(
        PEER, {"run_us": time_runs, "xor_ms": time_xor, "large_ms": time_large, "pass_us": time_passes}
    )
