"""CartPole of Gymnasium by ask and tell: NEAT learns to balance a pole, genomes being tried in parallel."""

from concurrent.futures import ProcessPoolExecutor

import gymnasium

from realitygap import Genome, NeatSettings, Population


def steps_balanced(genome: Genome, starts: range = range(5)) -> float:
    """Mean steps, 500 at most, for which its network keeps the pole up from the same few starts."""
    env, network, steps = gymnasium.make("CartPole-v1"), genome.network(), 0
    for start in starts:
        observation, over = env.reset(seed=start)[0], False
        while not over:
            observation, _, fell, timed_out, _ = env.step(int(network.activate(observation)[0] > 0.5))
            steps, over = steps + 1, fell or timed_out
    return steps / len(starts)


if __name__ == "__main__":
    population, best = Population(4, 1, NeatSettings(population=20), seed=1), 0.0
    with ProcessPoolExecutor() as pool:
        while best < 500 and population.generation < 50:
            fitness = list(pool.map(steps_balanced, genomes := population.ask()))
            best, champion = max(fitness), genomes[fitness.index(max(fitness))]
            print(f"generation {population.generation}: {best:.0f} steps")
            population.tell(fitness)
    print(f"{champion}: {steps_balanced(champion, range(1000, 1100)):.0f} steps from 100 other starts")
