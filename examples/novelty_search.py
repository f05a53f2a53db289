"""The paper's novelty search by hand: a population, trials in the arena, and the archive of behaviors.

Shows the parts that `realitygap run` puts together: `Population` makes genomes, `try_genomes` drives each of them
through the arena, `PaperArchive` says how novel the cells are that they visited. At the end the same run is
computed as a study does it, and must be equal in every trial.

    uv run python examples/novelty_search.py
"""

from realitygap import Condition, PaperArchive, Population
from realitygap.platforms import try_genomes
from realitygap.runs import run_replicates
from realitygap.trials import NoiseKey

REPLICATE = 0


def main() -> None:
    """One run of five generations."""
    condition = Condition(name="novelty-50", selection="novelty", noise=0.5)
    arena = condition.arena.arena()
    population = Population(
        n_inputs=3,  # largest noisy reading, stall, time; with novelty a constant input comes on top
        n_outputs=2,  # move, turn
        settings=condition.neat,
        key=condition.key,
        replicate=REPLICATE,
        bias=condition.has_bias_input,
    )
    archive = PaperArchive(condition.novelty)
    by_hand = []
    for generation in range(condition.neat.generations):
        genomes = population.ask()
        noise_key = NoiseKey(condition.key, REPLICATE, generation)
        trials = try_genomes(condition.on, arena, genomes, noise=condition.noise, noise_key=noise_key)
        novelty = archive.update([trials.behavior(k) for k in range(len(genomes))])
        by_hand += list(zip(novelty.tolist(), trials.coverage_line.tolist(), strict=True))
        print(
            f"generation {generation}: novelty up to {novelty.max():5.1f} cells, "
            f"coverage up to {trials.coverage_line.max():.3f}, {len(archive)} behaviors in the archive"
        )
        population.tell(novelty)

    rows = run_replicates(condition, REPLICATE, 1)
    as_study = list(zip(rows["novelty"].to_list(), rows["coverage_line"].to_list(), strict=True))
    n_equal = sum(mine == theirs for mine, theirs in zip(by_hand, as_study, strict=True))
    print(f"Equal to the study's run in {n_equal} of {len(rows)} trials.")
    if n_equal != len(rows):
        raise SystemExit("The two roads differ, which they must not.")


if __name__ == "__main__":
    main()
