from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from realitygap.evolution import sorted_cells_distance
from realitygap.report import measure_variety
from realitygap.report._questions import (
    MOST_BEHAVIORS,
    chance_of_best,
    chances,
    mean_jaccard_distance,
    mean_sorted_distance,
    plateau_length,
    plateaus,
    spreads,
)
from realitygap.report._tally import read_tally
from realitygap.stats import exact_share_interval
from tests.report.results import describe, random_runs, settings, write_results

POINTS = np.array([(column, row) for column in range(12) for row in range(6)], float)


def _tally(out, coverages, **changes):
    conditions = [
        describe(name, settings=settings(noise=k / 10) | changes) for k, name in enumerate(coverages)
    ]
    return read_tally(write_results(out, conditions, coverages))


def test_a_plateau_is_no_better_trial_in_the_last_half_of_the_generations(out):
    rises = [[0.1], [0.2], [0.3], [0.3], [0.4]]
    stays = [[0.1], [0.2], [0.4], [0.3], [0.4]]
    falls = [[0.5], [0.2], [0.1], [0.1], [0.1]]
    tally = _tally(out, {"c": [rises, stays, falls]})
    assert plateau_length(5) == 2
    assert plateaus(tally, "c") == exact_share_interval(2, 3)


def test_one_generation_has_no_plateau(out):
    assert plateaus(_tally(out, {"c": random_runs(4, generations=1)}), "c") is None


def test_share_has_the_exact_interval():
    # Clopper & Pearson's bounds for 0 of 10: 1 - 0.025^(1/10)
    low, high = exact_share_interval(0, 10).ends
    assert low == 0
    assert high == pytest.approx(1 - 0.025**0.1)


def test_spreads_are_against_the_first_noise_level_of_a_selection(out):
    narrow = [[[k / 72]] for k in [20, 21, 22, 23, 24, 25] * 3]
    wide = [[[k / 72]] for k in [15, 18, 21, 24, 27, 30] * 3]
    first, second = spreads(_tally(out, {"a": narrow, "b": wide}))
    assert (first.reference, second.reference) == ("a", "a")
    assert first.ratio.value is None
    assert second.ratio.value == pytest.approx(3)
    assert second.robust_ratio.value == pytest.approx(3)
    assert second.ratio.low <= 3 <= second.ratio.high
    assert second.deviation == pytest.approx(np.std([row[0][0] for row in wide], ddof=1))


def test_few_runs_have_a_ratio_and_no_interval(out):
    _, second = spreads(_tally(out, {"a": random_runs(3), "b": random_runs(3, seed=1)}))
    assert second.ratio.value > 0
    assert second.ratio.ends is None
    assert second.robust_ratio.ends is None


def _behaviors(seed, n=9):
    """Which cells are visited, sorted by x, then y; and their numbers, columns * row + column."""
    visited = np.random.default_rng(seed).random((n, 72)) < 0.3
    numbers = (POINTS[:, 1] * 12 + POINTS[:, 0]).astype(int)
    return visited, [numbers[row] for row in visited]


def test_distance_of_sorted_cells_is_the_one_that_novelty_uses():
    visited, cells = _behaviors(1)
    visited[3] = False
    cells[3] = np.empty(0, int)
    expected = [sorted_cells_distance(one, other) for one, other in itertools.combinations(cells, 2)]
    assert mean_sorted_distance(visited, POINTS, math.hypot(11, 5)) == pytest.approx(np.mean(expected))


def test_jaccard_is_the_share_of_cells_of_one_alone():
    visited, cells = _behaviors(2)
    sets = [set(row.tolist()) for row in cells]
    expected = [1 - len(a & b) / len(a | b) for a, b in itertools.combinations(sets, 2)]
    assert mean_jaccard_distance(visited) == pytest.approx(np.mean(expected))
    assert mean_jaccard_distance(np.zeros((3, 72), bool)) == 0.0


def test_variety_is_measured_run_by_run(tiny_study):
    found = {each.condition: each for each in measure_variety(tiny_study)}
    assert list(found) == ["coverage", "novelty", "turn", "ends"]
    rows = tiny_study.read("novelty", [2], ["cells"])["cells"].to_list()
    pairs = [sorted_cells_distance(one, other) for one, other in itertools.combinations(rows, 2)]
    assert found["novelty"].n == 7
    assert found["novelty"].n_behaviors == 24
    assert found["novelty"].sorted_cells[2] == pytest.approx(np.mean(pairs))
    assert ((found["novelty"].jaccard > 0) & (found["novelty"].jaccard < 1)).all()


def test_large_runs_are_sampled_and_small_ones_left_out(out):
    large = write_results(
        out / "large", [describe("c")], {"c": random_runs(2, generations=6, individuals=20)}
    )
    (found,) = measure_variety(large)
    assert found.n_behaviors == MOST_BEHAVIORS
    single = write_results(
        out / "single", [describe("c")], {"c": random_runs(2, generations=1, individuals=1)}
    )
    assert measure_variety(single)[0].n == 0


def test_chance_of_best_is_that_of_all_draws():
    samples = [np.array([1, 2, 5]) / 72, np.array([2, 3]) / 72, np.array([0, 4]) / 72]
    wins = np.zeros(3)
    draws = [list(itertools.product(sample, repeat=2)) for sample in samples]
    for picks in itertools.product(*draws):
        sums = np.round([sum(pick) * 72 for pick in picks])
        best = sums == sums.max()
        wins += best / best.sum()
    expected = wins / np.prod([len(draw) for draw in draws])
    assert chance_of_best(samples, 2) == pytest.approx(expected)


def test_chance_of_best_is_one_in_k_for_one_distribution_and_sure_when_apart():
    same = np.random.default_rng(0).integers(0, 72, 50) / 72
    assert chance_of_best([same] * 4, 3) == pytest.approx([0.25] * 4)
    assert chance_of_best([same, same + 1], 1) == pytest.approx([0, 1])
    assert chance_of_best([same, same[::-1], same + 1 / 72], 100).sum() == pytest.approx(1)


def test_chances_need_three_levels_of_noise(out):
    runs = {name: random_runs(10, seed=k) for k, name in enumerate("abc")}
    (found,) = chances(_tally(out / "three", runs))
    assert found.conditions == ("a", "b", "c")
    assert found.best.sum() == pytest.approx(1)
    assert found.best_if_equal == pytest.approx(1 / 3)
    assert chances(_tally(out / "two", {name: runs[name] for name in "ab"})) == []


def test_values_without_a_unit_are_refused():
    with pytest.raises(ValueError, match="multiples of 1/N"):
        chance_of_best([np.array([math.pi]), np.array([0.5])], 3)
