"""Tables of scores: the published ones of SIMPLER, ragged trials against plain references, and refusals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import TableError
from realitygap.gap import Comparison, GapSide, compare_scores, mean_maximum_rank_violation, measure_gap
from realitygap.gap._ranks import ties_on_one_side
from realitygap.logs import ScoreRow, read_scores
from realitygap.stats import (
    boschloo_p,
    exact_share_interval,
    holm,
    mcnemar_p,
    paired_success_difference,
    success_difference,
)

SIMPLER = Path(__file__).parent.parent / "data" / "simpler" / "scores.csv"
"""Scores in `simpler_env/utils/metrics.py` of simpler-env/SimplerEnv, commit 4ab7178; Li et al. (2024)."""

HOW = Comparison("sim", "real")
EXPECTED = {
    # policies, Pearson, Spearman, MMRV, MMRV with arguments swapped, level, RMS; the first four by its own functions
    "google_robot_pick_coke_can": (6, 0.9754, 0.7714, 0.0313, 0.0618, 0.1247, 0.1427),
    "google_robot_move_near": (6, 0.8561, 0.9429, 0.1110, 0.0027, 0.1303, 0.1847),
    "google_robot_open_drawer": (6, 0.9832, 1.0, 0.0, 0.0, 0.1655, 0.1843),
    "google_robot_close_drawer": (6, 0.7712, 0.7714, 0.1233, 0.1133, 0.0368, 0.2005),
    "google_robot_place_apple_in_closed_top_drawer": (6, 0.9692, 0.9852, 0.0, 0.0108, 0.0677, 0.0970),
    "widowx_spoon_on_towel": (3, 0.8269, 1.0, 0.0, 0.0, 0.0510, 0.1242),
    "widowx_carrot_on_plate": (3, 0.5714, 0.5, 0.1113, 0.0093, 0.0370, 0.0997),
    "widowx_stack_cube": (3, 1.0, 1.0, 0.0, 0.0, 0.0277, 0.0479),
    "widowx_put_eggplant_in_basket": (3, 0.9894, 1.0, 0.0, 0.0, -0.1167, 0.1430),
}


@pytest.fixture(scope="module")
def simpler():
    return {gap.task: gap for gap in compare_scores(read_scores(SIMPLER), HOW)}


def test_published_tables_of_simpler_come_out_to_four_decimals(simpler):
    assert list(simpler) == list(EXPECTED)
    for task, (n, pearson, spearman, mmrv, swapped, level, rms) in EXPECTED.items():
        gap = simpler[task]
        result = gap.result
        assert (len(gap.controllers), result.trials) == (n, (0, 0))
        found = [result.pearson, result.srcc, result.mmrv, result.level, result.raw_rms]
        assert [each.value for each in found] == pytest.approx(
            [pearson, spearman, mmrv, level, rms], abs=5.1e-5
        ), task
        other = mean_maximum_rank_violation(gap.target.means[None], gap.source.means[None], "simpler")[0]
        assert other == pytest.approx(swapped, abs=5.1e-5), task


@pytest.mark.parametrize("ties", ["both", "simpler"])
def test_no_published_value_depends_on_ties(ties):
    for gap in compare_scores(read_scores(SIMPLER), replace(HOW, ties=ties)):
        assert gap.result.mmrv.value == pytest.approx(EXPECTED[gap.task][3], abs=5.1e-5)


def test_means_and_few_controllers_carry_no_verdict_on_order(simpler):
    three = simpler["widowx_spoon_on_towel"].result
    assert three.srcc.value == 1.0
    assert three.srcc.low is None
    assert three.verdict.endswith("Too few controllers to judge the ranking.")
    for name in ("rms", "noise_ceiling", "srcc_disattenuated", "mmrv_floor", "energy", "a12"):
        assert getattr(simpler["google_robot_move_near"].result, name).value is None, name


def test_worst_pair_is_the_largest_difference_in_wrong_order(simpler):
    gap = simpler["google_robot_move_near"]
    better, worse, violation = gap.worst_pair
    assert (gap.controllers[better].name, gap.controllers[worse].name) == ("octo-base", "rt-1-begin")
    assert violation == pytest.approx(0.333)
    assert simpler["google_robot_open_drawer"].worst_pair is None


TIES = {
    "two in simulation": ((0.2, 0.5, 0.5, 0.8), (0.1, 0.3, 0.7, 0.6), 0.225, 0.125, 1),
    "all in simulation": ((0.5, 0.5, 0.5), (0.1, 0.2, 0.9), 2.3 / 3, 0.3, 3),
    "on both": ((0.5, 0.5, 0.7), (0.3, 0.3, 0.9), 0.0, 0.0, 0),
    "on the target": ((0.4, 0.5, 0.7), (0.3, 0.3, 0.9), 0.0, 0.0, 1),
    "but for the last bit": ((0.1 + 0.2, 0.3, 0.7), (0.2, 0.3, 0.9), 0.2 / 3, 0.1 / 3, 1),
}


@pytest.mark.parametrize(("sim", "real", "both", "simpler_", "n"), TIES.values(), ids=list(TIES))
def test_a_tie_on_one_platform_counts_for_both_controllers(sim, real, both, simpler_, n):
    pair = np.array([sim]), np.array([real])
    assert mean_maximum_rank_violation(*pair)[0] == pytest.approx(both)
    assert mean_maximum_rank_violation(-pair[0], -pair[1])[0] == pytest.approx(both)
    assert mean_maximum_rank_violation(*pair, "simpler")[0] == pytest.approx(simpler_)
    assert ties_on_one_side(pair[0][0], pair[1][0]) == n


# trials


def rows_of(scores, platform, blocks=None):
    """Rows of trials: a list of scores for each controller."""
    return [
        ScoreRow(
            "", name, platform, "", "" if blocks is None else str(blocks[k]), str(k), float(score), None, 3
        )
        for name, trials in scores.items()
        for k, score in enumerate(trials)
    ]


def ragged(c, rng, least=2, most=9):
    quality = rng.uniform(0.3, 0.7, c)
    return [
        {
            f"c{k}": q + shift + rng.uniform(-0.1, 0.1, rng.integers(least, most))
            for k, q in enumerate(quality)
        }
        for shift in (0.0, 0.1)
    ]


def test_equal_numbers_of_trials_give_what_measure_gap_gives():
    rng = np.random.default_rng(1)
    sim, real = ({f"c{k}": rng.uniform(0, 1, 5) for k in range(7)} for _ in range(2))
    (gap,) = compare_scores([*rows_of(sim, "sim"), *rows_of(real, "real")], replace(HOW, margin=0.1))
    sides = [
        GapSide(name, label, np.array(list(side.values())), score_range=(0, 1))
        for name, label, side in (("sim", "SIM", sim), ("real", "REAL", real))
    ]
    assert replace(measure_gap(*sides, margin=0.1), score="score").to_dict() == gap.result.to_dict()


def test_ragged_trials_have_the_variance_of_their_own_controller():
    sim, real = ragged(8, np.random.default_rng(2))
    (gap,) = compare_scores([*rows_of(sim, "sim"), *rows_of(real, "real")], HOW)
    squares = [
        (np.mean(real[name]) - np.mean(sim[name])) ** 2
        - np.var(real[name], ddof=1) / len(real[name])
        - np.var(sim[name], ddof=1) / len(sim[name])
        for name in sim
    ]
    assert gap.result.rms.value == pytest.approx(np.sqrt(np.mean(squares)))
    assert gap.result.level.value == pytest.approx(np.mean([np.mean(real[n]) - np.mean(sim[n]) for n in sim]))
    a12 = [np.mean(np.sign(np.subtract.outer(real[n], sim[n])) / 2 + 0.5) for n in sim]
    assert gap.result.a12.value == pytest.approx(np.mean(a12))
    numbers = [len(trials) for trials in sim.values()]
    assert (gap.result.trials[0], gap.result.most_trials[0]) == (min(numbers), max(numbers))
    for name in ("rms", "level", "srcc", "noise_ceiling", "mmrv", "mmrv_floor", "a12"):
        estimate = getattr(gap.result, name)
        assert estimate.low <= estimate.value <= estimate.high, name


def test_a_controller_with_more_trials_has_a_narrower_interval_of_its_own():
    rng = np.random.default_rng(3)
    side = GapSide.of_trials("sim", "SIM", [rng.normal(0.5, 0.1, n) for n in (4, 40, 4, 40)])
    low, high = side.intervals()
    assert (high - low)[[1, 3]].max() < (high - low)[[0, 2]].min()


@pytest.mark.slow
def test_ragged_trials_cover_the_level_as_often_as_claimed():
    # 300 studies: of a coverage of 95 %, 24 or more misses come in 1 of 400 tries
    rng, missed = np.random.default_rng(4), 0
    for _ in range(300):
        gaps = rng.normal(0.05, 0.05, 12)
        quality = rng.normal(0.5, 0.1, 12)
        sides = [
            GapSide.of_trials("p", "SIM", [rng.normal(q, 0.1, rng.integers(2, 9)) for q in means])
            for means in (quality, quality + gaps)
        ]
        level = measure_gap(*sides, resamples=300).level
        missed += not level.low <= 0.05 <= level.high
    assert missed < 32  # percentiles of 12 controllers cover 93 %


def test_one_trial_of_some_controllers_leaves_noise_unknown():
    sim, real = ragged(6, np.random.default_rng(5))
    sim["c0"] = sim["c0"][:1]
    (gap,) = compare_scores([*rows_of(sim, "sim"), *rows_of(real, "real")], HOW)
    assert gap.result.rms.value is None
    assert "With one trial of some controllers" in gap.result.rms.refused
    assert gap.result.raw_rms.value is not None


def test_shared_blocks_take_out_only_the_noise_that_they_leave():
    rng = np.random.default_rng(6)
    means = rng.uniform(0.4, 0.6, 30)[:, None] + rng.normal(0, 0.1, (30, 10))
    # the same start on both platforms, a little noise, and a true gap of 0.03 of each controller
    sides = [
        {f"c{k}": trials for k, trials in enumerate(means + gap + rng.normal(0, 0.01, means.shape))}
        for gap in (0.0, 0.03)
    ]
    shuffled = {name: trials[::-1] for name, trials in sides[1].items()}
    rows = [*rows_of(sides[0], "sim", range(10)), *rows_of(shuffled, "real", range(9, -1, -1))]
    how = replace(HOW, score_range=(-1.0, 2.0))
    (paired,), (unpaired,) = (compare_scores(rows, replace(how, uses_blocks=uses)) for uses in (True, False))
    assert paired.result.paired
    assert paired.result.rms.value == pytest.approx(0.03, abs=0.005)
    assert unpaired.result.rms.value < 0.02  # the starts count as noise of each side


@pytest.mark.slow
def test_level_of_pairs_has_the_interval_of_paired_differences():
    # 200 studies whose starts add noise of 0.3 to both platforms; differences vary by 0.02 over controllers
    rng, missed, widths = np.random.default_rng(8), 0, []
    for _ in range(200):
        quality = rng.normal(0.5, 0.1, (15, 1)) + rng.normal(0, 0.3, (15, 6))
        gap = rng.normal(0.05, 0.02, (15, 1))
        sides = [
            GapSide(name, "SIM", values + rng.normal(0, 0.02, (15, 6)))
            for name, values in (("sim", quality), ("real", quality + gap))
        ]
        level = measure_gap(*sides, paired=True, resamples=300).level
        missed += not level.low <= 0.05 <= level.high
        widths.append(level.high - level.low)
    assert np.mean(widths) < 0.04  # without pairs 0.15, from the noise of starts
    assert missed < 24  # of a coverage of 94 %, 24 misses of 200 come in 1 of 1,000 tries


# refusals


def means(**platforms):
    return [
        ScoreRow(f"line {k}", name, platform, "", "", "", score, None, 3)
        for platform, scores in platforms.items()
        for k, (name, score) in enumerate(scores.items())
    ]


SIX = {f"c{k}": 0.1 * k for k in range(6)}


def refusal(rows, how=HOW):
    with pytest.raises(TableError) as refused:
        compare_scores(rows, how)
    return str(refused.value)


def test_unmatched_controllers_are_listed_and_left_out_only_if_asked():
    rows = means(sim=SIX, real=SIX | {"new": 0.5})
    assert "1 controller is on one platform only: new." in refusal(rows)
    (gap,) = compare_scores(rows, replace(HOW, shared=True))
    assert gap.left_out == ("new",)
    assert len(gap.controllers) == 6
    assert any("new" in reason for reason in gap.reasons)


def test_two_controllers_with_means_are_refused():
    two = dict(list(SIX.items())[:2])
    assert "expected at least 3" in refusal(means(sim=two, real=two))


def test_one_controller_with_trials_has_a_difference_without_a_verdict():
    sim, real = ({"push": np.random.default_rng(k).normal(0.5, 0.01, 20)} for k in range(2))
    (gap,) = compare_scores([*rows_of(sim, "sim"), *rows_of(real, "real")], HOW)
    assert gap.result.level.value == pytest.approx(real["push"].mean() - sim["push"].mean())
    assert gap.result.level.low is None
    assert gap.result.srcc.value is None


def test_duplicate_rows_are_refused():
    rows = means(sim=SIX, real=SIX)
    assert "occurs twice" in refusal([*rows, rows[0]])


@pytest.mark.parametrize(("score", "hint"), [(71.0, "range"), (-0.1, "LOW:HIGH")])
def test_scores_out_of_range_are_refused_and_percent_is_not_guessed(score, hint):
    assert hint in refusal(means(sim=SIX | {"c0": score}, real=SIX))


def test_a_constant_side_has_no_correlation():
    (gap,) = compare_scores(means(sim=dict.fromkeys(SIX, 0.5), real=SIX), HOW)
    for estimate in (gap.result.pearson, gap.result.srcc, gap.result.mmrv):
        assert "On sim all controllers do equally well" in estimate.refused


def test_tasks_are_compared_apart_even_with_different_controllers():
    rows = [replace(row, task=task) for task in ("pick", "push") for row in means(sim=SIX, real=SIX)]
    rows = [row for row in rows if (row.task, row.controller) != ("push", "c0")]
    assert [(gap.task, len(gap.controllers)) for gap in compare_scores(rows, HOW)] == [
        ("pick", 6),
        ("push", 5),
    ]


def test_a_platform_without_tasks_has_the_only_task_of_the_other():
    rows = [replace(row, task="pick") if row.platform == "sim" else row for row in means(sim=SIX, real=SIX)]
    assert [gap.task for gap in compare_scores(rows, HOW)] == ["pick"]
    rows.append(replace(rows[0], task="push"))
    assert "The scores of real have no task, and those of sim have 2. Choose one: " in refusal(rows)


def test_trials_and_means_of_one_platform_are_refused_together():
    sim, real = ragged(5, np.random.default_rng(7))
    rows = [*rows_of(sim, "sim"), *rows_of(real, "real")]
    mean = ScoreRow("line 9", "c0", "sim", "", "", "", 0.5, None, 3)
    assert "a mean of c0 on sim, which also has trials" in refusal([*rows, mean])
    others = [row for row in rows if (row.controller, row.platform) != ("c0", "sim")]
    assert "On sim, c0 has a mean alone" in refusal([*others, mean])


def test_blocks_of_one_platform_only_are_refused_with_both_ways_out():
    sim, real = ({f"c{k}": [0.1 * k, 0.2, 0.3] for k in range(5)} for _ in range(2))
    rows = [*rows_of(sim, "sim", "abc"), *rows_of(real, "real", "abd")]
    message = refusal(rows)
    assert "2 blocks of c0 are on one platform only: c and d" in message
    (gap,) = compare_scores(rows, replace(HOW, shared=True))
    assert gap.result.trials == (2, 2)
    assert compare_scores(rows, replace(HOW, uses_blocks=False))[0].result.trials == (3, 3)


# successes

BINARY = replace(HOW, is_binary=True, score="success")


def successes(counts, platform):
    return rows_of({name: [1] * k + [0] * (n - k) for name, (k, n) in counts.items()}, platform)


SIM_COUNTS = {"a": (17, 20), "b": (3, 30), "c": (10, 10), "d": (0, 12), "e": (5, 9)}
REAL_COUNTS = {"a": (14, 20), "b": (9, 30), "c": (9, 10), "d": (6, 12), "e": (4, 9)}


def test_successes_have_exact_intervals_and_corrected_p():
    (gap,) = compare_scores([*successes(SIM_COUNTS, "sim"), *successes(REAL_COUNTS, "real")], BINARY)
    assert [each.ends for each in gap.source.estimates] == [
        exact_share_interval(*count).ends for count in SIM_COUNTS.values()
    ]
    counts = [(*SIM_COUNTS[name], *REAL_COUNTS[name]) for name in SIM_COUNTS]
    assert [each.ends for each in gap.differences] == [success_difference(*each).ends for each in counts]
    p = holm(np.array([boschloo_p(*each) for each in counts]))
    assert [each.more["p"] for each in gap.differences] == pytest.approx(p)
    assert "Boschloo" in gap.remarks[-1]


def test_means_of_n_successes_are_the_same_as_their_trials():
    rows = [
        ScoreRow("", name, platform, "", "", "", round(k / n, 3), n, 3)
        for platform, counts in (("sim", SIM_COUNTS), ("real", REAL_COUNTS))
        for name, (k, n) in counts.items()
    ]
    trials = [*successes(SIM_COUNTS, "sim"), *successes(REAL_COUNTS, "real")]
    found, expected = (compare_scores(each, BINARY)[0] for each in (rows, trials))
    assert found.to_dict() == expected.to_dict()
    k, n = SIM_COUNTS["a"]
    assert found.source.noise[0] == pytest.approx(k / n * (1 - k / n) / (n - 1))
    (means,) = compare_scores(rows, HOW)  # continuous scores have a noise that n does not tell
    assert means.result.rms.value is None


def test_pairs_of_successes_have_the_tests_of_pairs():
    sim = {name: [1, 1, 0, 0, 1, 0] for name in "abc"}
    real = {name: [1, 0, 0, 0, 0, 1] for name in "abc"}
    (gap,) = compare_scores([*rows_of(sim, "sim", range(6)), *rows_of(real, "real", range(6))], BINARY)
    assert gap.differences[0].ends == paired_success_difference(1, 2, 6).ends
    assert gap.differences[0].more["p"] == min(1, 3 * mcnemar_p(1, 2))
    assert "McNemar" in gap.remarks[-1]


def test_successes_without_the_option_get_a_hint():
    (gap,) = compare_scores([*successes(SIM_COUNTS, "sim"), *successes(REAL_COUNTS, "real")], HOW)
    assert "For exact intervals and tests" in gap.remarks[-1]
    assert all("p" not in each.more for each in gap.differences)


def test_what_is_no_success_is_refused():
    rows = rows_of({name: [0.5, 1.0] for name in "abc"}, "sim") + rows_of({n: [1, 0] for n in "abc"}, "real")
    assert "expected 0 or 1 with" in refusal(rows, BINARY)
    few = [ScoreRow("line 2", "a", "sim", "", "", "", 0.857, 75, 3)]
    others = [ScoreRow("", n, p, "", "", "", 0.0, 75, 3) for p in ("sim", "real") for n in "bcd"]
    match = refusal([*few, ScoreRow("", "a", "real", "", "", "", 0.0, 75, 3), *others], BINARY)
    assert "0.857 of 75 trials is no whole number of successes. The nearest share is 0.8533" in match


def test_a_refusal_names_twelve_and_counts_the_others():
    more = SIX | {f"d{k}": 0.5 for k in range(20)}
    assert refusal(means(sim=more, real=SIX)).count(", d") == 11
    assert "d11 and 8 more" in refusal(means(sim=more, real=SIX))
