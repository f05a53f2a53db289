"""Ask and tell: NEAT learns XOR, the first test of Stanley & Miikkulainen (2002).

Shows how to evolve networks for a task of your own: ask the population for genomes, try each one's network, tell
the fitness. Prints the best of every tenth generation, and the outputs of the first network that answers right.

    uv run python examples/xor.py
"""

from realitygap import Genome, NeatSettings, Population

CASES = [((0, 0), 0), ((0, 1), 1), ((1, 0), 1), ((1, 1), 0)]
GENERATIONS = 100


def answers(genome: Genome) -> list[float]:
    """What its network says to the four cases, 0..1."""
    network = genome.network()
    return [float(network.activate(inputs)[0]) for inputs, _ in CASES]


def fitness_of(outputs: list[float]) -> float:
    """(4 - sum of errors) squared: 16 is perfect."""
    errors = [abs(output - wanted) for output, (_, wanted) in zip(outputs, CASES, strict=True)]
    return (4.0 - sum(errors)) ** 2


def is_right(outputs: list[float]) -> bool:
    """Whether each output is on the right side of one half."""
    return all((output > 0.5) == (wanted == 1) for output, (_, wanted) in zip(outputs, CASES, strict=True))


def main() -> None:
    """Evolve until a network answers right."""
    settings = NeatSettings.named("default", population=150)
    population = Population(n_inputs=2, n_outputs=1, settings=settings, seed=1)
    for generation in range(GENERATIONS):
        genomes = population.ask()
        outputs = [answers(genome) for genome in genomes]
        fitness = [fitness_of(each) for each in outputs]
        best = max(range(len(genomes)), key=fitness.__getitem__)
        right = next((k for k, each in enumerate(outputs) if is_right(each)), None)
        if generation % 10 == 0 or right is not None:
            n_species = len(set(population.species.tolist()))
            print(f"generation {generation:3}: best fitness {fitness[best]:5.2f}, {n_species} species")
        if right is not None:
            evaluations = generation * len(genomes) + right + 1
            print(f"Solved at evaluation {evaluations:,} by {genomes[right]}:")
            for (inputs, wanted), output in zip(CASES, outputs[right], strict=True):
                print(f"  {inputs} -> {output:.3f}, expected {wanted}")
            return
        population.tell(fitness)
    print(f"Not solved in {GENERATIONS} generations.")


if __name__ == "__main__":
    main()
