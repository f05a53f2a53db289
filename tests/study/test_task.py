"""NEAT on the classical tasks: what is measured, and that NEAT solves them."""

from __future__ import annotations

import statistics

import pytest

from realitygap.errors import StudyError
from realitygap.runs import TaskRun
from realitygap.study import Progress, measure_task, task_settings
from realitygap.study._task import summarize_runs
from realitygap.tasks import CLASSICAL_TASKS
from tests.reference.effort import COMPILED

KEYS = [
    "task",
    "settings",
    "seeds",
    "solved",
    "mean_evaluations",
    "median_evaluations",
    "sd_evaluations",
    "worst_evaluations",
    "mean_hidden",
    "mean_connections",
    "published",
]
SMALL = {"population": 4, "generations": 2}

compiled_only = pytest.mark.skipif(not COMPILED, reason="takes minutes as plain Python")


@pytest.mark.slow
@pytest.mark.parametrize("task", CLASSICAL_TASKS)
def test_figures_have_their_keys_and_the_published_ones_beside(task: str) -> None:
    told: list[Progress] = []
    figures = measure_task(task, seeds=3, changes=SMALL, threads=2, tell=told.append)
    expected = KEYS
    if task == "double-pole-no-velocity":
        expected = [*KEYS[:-1], "mean_generalization", "sd_generalization", KEYS[-1]]
    assert list(figures) == expected
    assert (figures["task"], figures["seeds"]) == (task, 3)
    assert figures["settings"] == "default population=4 generations=2"
    assert figures["published"]["n"] >= 20
    assert set(figures["published"]) <= {*figures, "n", "source"}
    assert told[0].n_done == 0
    assert (told[-1].n_done, told[-1].n_runs) == (3, 3)


def test_figures_are_over_the_runs_that_solved_the_task() -> None:
    task = CLASSICAL_TASKS["double-pole-no-velocity"]
    lost = TaskRun(False, 9_000, 9, 0, 0, 0)
    runs = [TaskRun(True, 1_000, 1, 1, 5, 300), lost, TaskRun(True, 4_000, 4, 2, 8, 251)]
    figures = summarize_runs(task, "default", runs)
    assert (figures["seeds"], figures["solved"]) == (3, 2)
    assert figures["mean_evaluations"] == figures["median_evaluations"] == 2_500
    assert figures["sd_evaluations"] == statistics.stdev([1_000, 4_000])
    assert figures["worst_evaluations"] == 4_000
    assert (figures["mean_hidden"], figures["mean_connections"]) == (1.5, 6.5)
    assert figures["mean_generalization"] == 275.5
    assert figures["sd_generalization"] == statistics.stdev([300, 251])
    nothing = summarize_runs(task, "default", [lost])
    assert nothing["solved"] == 0
    assert nothing["mean_evaluations"] is nothing["sd_evaluations"] is nothing["worst_evaluations"] is None
    assert summarize_runs(task, "default", runs[:1])["sd_evaluations"] is None


@pytest.mark.slow
def test_runs_do_not_depend_on_threads_and_differ_by_seed() -> None:
    changes = {"population": 20 if COMPILED else 8, "generations": 60 if COMPILED else 3}
    one = measure_task("xor", seeds=5, seed=3, changes=changes, threads=1)
    assert one == measure_task("xor", seeds=5, seed=3, changes=changes, threads=4)
    if COMPILED:
        assert one != measure_task("xor", seeds=5, seed=4, changes=changes)


def test_settings_are_of_the_set_then_of_the_task_then_changed() -> None:
    settings = task_settings("double-pole-no-velocity", "rosenzweig-remy")
    assert (settings.population, settings.recurrent, settings.bias_value) == (1000, True, 0.5)
    assert settings.activation == "tanh"
    assert task_settings("xor", changes={"population": 7, "crossover": 0}).population == 7
    source = task_settings("double-pole-no-velocity", "stanley-2002")
    assert (source.add_link, source.weight_coefficient, source.threshold) == (0.3, 3.0, 4.0)
    assert (source.add_node, source.weight_step, source.weight_limit, source.survival) == (
        0.01,
        1.8,
        8.0,
        0.4,
    )
    xor = task_settings("xor", "stanley-2002")
    assert (xor.add_node, xor.add_link, xor.survival) == (0.03, 0.05, 0.2)


@pytest.mark.parametrize(
    ("task", "settings", "changes", "text"),
    [
        ("xr", "default", {}, "Unknown task 'xr'. Did you mean 'xor'?"),
        ("xor", "stanley", {}, "Did you mean 'stanley-2002'?"),
        ("xor", "default", {"crosover": 0}, "crosover: unknown setting. Did you mean 'crossover'?"),
        ("xor", "default", {"settings": "stanley-2002"}, "The set is 'default' already"),
        ("xor", "default", {"crossover": 2}, "crossover: expected at most 1.0"),
    ],
)
def test_wrong_settings_are_refused_with_a_hint(
    task: str, settings: str, changes: dict[str, object], text: str
) -> None:
    with pytest.raises(StudyError) as caught:
        measure_task(task, settings, changes=changes)
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("name", "number", "error", "text"),
    [
        ("seeds", 0, ValueError, "expected 1 to"),
        ("seeds", "3", TypeError, "expected a whole number"),
        ("threads", 0, ValueError, "expected at least 1"),
        ("seed", -1, ValueError, "expected 0 to"),
        ("seed", 2**63, ValueError, "expected 0 to"),
        ("seed", 1.5, TypeError, "expected a whole number"),
    ],
)
def test_counts_and_seeds_that_cannot_be_are_refused(
    name: str, number: object, error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=f"{name} is {number!r}, {text}"):
        measure_task("xor", **{name: number})  # type: ignore[arg-type]


@pytest.mark.slow
@compiled_only
@pytest.mark.parametrize(
    ("task", "settings", "seeds", "lost", "low", "high"),
    [
        ("xor", "default", 30, 0, 1_000, 3_000),
        ("xor", "stanley-2002", 30, 2, 3_400, 7_700),
        ("double-pole", "default", 20, 0, 900, 3_700),
        ("double-pole-no-velocity", "default", 4, 1, 1_500, 62_000),
    ],
)
def test_neat_solves_the_classical_tasks_in_few_evaluations(
    task: str, settings: str, seeds: int, lost: int, low: int, high: int
) -> None:
    """Each end lies four standard errors from the mean on the page of the classical tasks, or nearly.

    The lowest is 3.3 of them away, and the means of four runs are seldom so low, being lopsided upward. So chance
    alone fails each in less than 1 in 1,000 choices of seeds. As many runs as `lost` may be left unsolved, where
    1 of 100 is. Random search or selection without effect is
    far off: it does not solve the second pole at all.
    """
    figures = measure_task(task, settings, seeds=seeds, seed=40)
    assert figures["solved"] >= seeds - lost
    assert low < figures["mean_evaluations"] < high
    if "mean_generalization" in figures:
        assert 200 <= figures["mean_generalization"] <= 625
