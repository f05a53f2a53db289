"""MultiNEAT, NEAT in C++ called from Python, as the wheel `multineat` brings it: what `peers.py` times of it.

Rates are those of Stanley & Miikkulainen (2002), as far as it has them: weights are mutated by uniform steps,
distances are not divided by size, the threshold stays at 3, no traits. Python sets each fitness, and evaluates XOR
through the binding, which is how the library is used.
"""

from __future__ import annotations

import random
import time
from typing import Any

import work
from environments import Peer, answer_as_worker, repeated, spread

PEER = Peer(
    name="multineat",
    title="MultiNEAT",
    requirements=("multineat==0.12",),
    packages=("multineat",),
    figures=("run_us", "xor_ms", "large_ms", "pass_us"),
)
RUNS = 100
PASSES = 20_000
SETTINGS = {
    "DynamicCompatibility": False,
    "CompatTreshold": 3.0,
    "ExcessCoeff": 1.0,
    "DisjointCoeff": 1.0,
    "WeightDiffCoeff": 0.4,
    "NormalizeGenomeSize": False,
    "OverallMutationRate": 1.0,
    "MutateWeightsProb": 0.8,
    "MutateWeightsSevereProb": 0.0,
    "WeightMutationRate": 1.0,
    "WeightReplacementRate": 0.1,
    "WeightMutationMaxPower": 2.5,
    "WeightReplacementMaxPower": 2.5,
    "MaxWeight": 8.0,
    "MutateAddNeuronProb": 0.03,
    "MutateAddLinkProb": 0.05,
    "MutateNeuronTraitsProb": 0.0,
    "MutateLinkTraitsProb": 0.0,
    "RecurrentProb": 0.0,
    "AllowLoops": False,
    "CrossoverRate": 0.75,
    "InterspeciesCrossoverRate": 0.001,
    "SurvivalRate": 0.2,
    "SpeciesDropoffAge": 15,
    "MinActivationA": 4.9,
    "MaxActivationA": 4.9,
}


def _genome(n_inputs: int, n_outputs: int, settings: Any) -> Any:
    """Inputs fully wired to outputs; the last input is the constant one."""
    import multineat

    sigmoid = multineat.ActivationFunction.UNSIGNED_SIGMOID
    return multineat.Genome(0, n_inputs, 0, n_outputs, False, sigmoid, sigmoid, 0, settings, 1)


def _population(size: int, n_inputs: int, n_outputs: int, seed: int) -> Any:
    import multineat

    settings = multineat.Parameters()
    settings.PopulationSize = size
    for name, value in SETTINGS.items():
        setattr(settings, name, value)
    return multineat.Population(_genome(n_inputs, n_outputs, settings), settings, True, 1.0, seed)


def _individuals(population: Any) -> list[Any]:
    return [individual for species in population.Species for individual in species.Individuals]


def _tell(population: Any, fitness_of: Any) -> None:
    for individual in _individuals(population):
        individual.SetFitness(fitness_of(individual))
        individual.SetEvaluated()


def time_runs() -> dict[str, Any]:
    """Microseconds a run."""
    seeds = iter(range(1_000_000))

    def work_once() -> float:
        since = time.perf_counter()
        for _ in range(RUNS):
            population = _population(work.RUN_POPULATION, work.N_INPUTS, work.N_OUTPUTS, next(seeds))
            for generation in range(work.RUN_GENERATIONS):
                if generation:
                    population.Epoch()
                _tell(population, lambda _: 1.0)
        return (time.perf_counter() - since) / RUNS * 1e6

    return repeated(work_once)


def _xor_fitness(genome: Any) -> float:
    import multineat

    network = multineat.NeuralNetwork()
    genome.BuildPhenotype(network)
    genome.CalculateDepth()
    depth = genome.GetDepth()
    errors = 0.0
    for inputs, wanted in work.XOR_CASES:
        network.Flush()
        network.Input([*inputs, 1.0])
        for _ in range(depth):
            network.Activate()
        errors += abs(network.Output()[0] - wanted)
    return (4.0 - errors) ** 2


def time_xor() -> dict[str, Any]:
    """Milliseconds a generation."""
    seeds = iter(range(1, 1_000_000))

    def work_once() -> float:
        population = _population(work.XOR_POPULATION, 3, 1, next(seeds))
        since = time.perf_counter()
        for _ in range(work.XOR_GENERATIONS):
            _tell(population, _xor_fitness)
            population.Epoch()
        return (time.perf_counter() - since) / work.XOR_GENERATIONS * 1e3

    return repeated(work_once)


def time_large() -> dict[str, Any]:
    """Milliseconds of one `Epoch`."""
    draw = random.Random(1)
    population = _population(work.LARGE_POPULATION, work.N_INPUTS, work.N_OUTPUTS, 1)
    taken = []
    for _ in range(work.LARGE_GENERATIONS):
        _tell(population, lambda _: draw.random())
        since = time.perf_counter()
        population.Epoch()
        taken.append((time.perf_counter() - since) * 1e3)
    return {**spread(taken), "species": len(population.Species)}


def time_passes() -> dict[str, Any]:
    """Microseconds of input, one activation and output."""
    import multineat

    network = multineat.NeuralNetwork()
    _individuals(_population(work.RUN_POPULATION, work.N_INPUTS, work.N_OUTPUTS, 1))[0].BuildPhenotype(
        network
    )
    inputs = [0.1, 0.2, 1.0]

    def work_once() -> float:
        since = time.perf_counter()
        for _ in range(PASSES):
            network.Input(inputs)
            network.Activate()
            network.Output()
        return (time.perf_counter() - since) / PASSES * 1e6

    return repeated(work_once)


if __name__ == "__main__":
    answer_as_worker(
        PEER, {"run_us": time_runs, "xor_ms": time_xor, "large_ms": time_large, "pass_us": time_passes}
    )
