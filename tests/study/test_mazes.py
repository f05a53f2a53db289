"""Novelty and objective in mazes, beside the published results."""

from __future__ import annotations

import json
import statistics
import threading

import numpy as np
import pytest

from realitygap.errors import StudyError
from realitygap.runs import MazeRun
from realitygap.study import Progress, measure_maze
from realitygap.study._mazes import summarize_maze_runs
from realitygap.tasks import MAZE_TASKS
from tests.commands import run_command
from tests.reference.effort import COMPILED, cases

pytestmark = pytest.mark.slow


def test_figures_of_both_rewards_have_their_keys_and_do_not_depend_on_threads() -> None:
    told: list[Progress] = []
    changes = {"population": cases(40, 3), "generations": cases(30, 2)}
    seeds = cases(4, 2)
    figures = measure_maze("maze-hard", seeds=seeds, seed=3, changes=changes, threads=1, tell=told.append)
    limit = changes["population"] * changes["generations"]
    assert list(figures) == ["task", "settings", "limit", "novelty", "objective", "source"]
    assert (figures["task"], figures["limit"]) == ("maze-hard", limit)
    for reward in ("novelty", "objective"):
        found = figures[reward]
        assert list(found) == [
            "solved", "seeds", "mean_evaluations", "median_evaluations", "sd_evaluations", "evaluations", "published",
        ]  # fmt: skip
        assert found["seeds"] == len(found["evaluations"]) == seeds
        assert found["mean_evaluations"] == statistics.fmean(each or limit for each in found["evaluations"])
        assert found["mean_evaluations"] <= limit
    assert (told[0].n_done, told[-1].n_done, told[-1].n_runs) == (0, 2 * seeds, 2 * seeds)
    assert figures == measure_maze("maze-hard", seeds=seeds, seed=3, changes=changes, threads=3)
    json.dumps(figures)


def test_an_unsolved_run_counts_as_its_limit() -> None:
    nothing = np.empty((0, 2))
    runs = [MazeRun(True, 100, 0, nothing, None), MazeRun(False, 900, 0, nothing, None)]
    figures = summarize_maze_runs(runs, 1000)
    assert (figures["solved"], figures["seeds"]) == (1, 2)
    assert figures["evaluations"] == [100, None]
    assert figures["mean_evaluations"] == figures["median_evaluations"] == 550
    assert figures["sd_evaluations"] == statistics.stdev([100, 1000])
    assert summarize_maze_runs(runs[:1], 1000)["sd_evaluations"] is None


def test_wrong_arguments_are_refused_by_name() -> None:
    with pytest.raises(StudyError, match=r"Unknown maze 'maze-hrd'\. Did you mean 'maze-hard'"):
        measure_maze("maze-hrd")
    with pytest.raises(StudyError, match="crossover: expected at most"):
        measure_maze("maze-hard", changes={"crossover": 2})
    with pytest.raises(StudyError, match="Unknown NEAT settings 'stanley'"):
        measure_maze("maze-hard", "stanley")
    with pytest.raises(ValueError, match="seeds"):
        measure_maze("maze-hard", seeds=0)


@pytest.mark.skipif(not COMPILED, reason="takes minutes as plain Python")
def test_runs_end_soon_after_an_interruption() -> None:
    def interrupt(progress: Progress) -> None:
        if progress.n_done:
            raise KeyboardInterrupt

    changes = {"population": 250, "generations": 40}
    with pytest.raises(KeyboardInterrupt):
        measure_maze("maze-hard", seeds=200, changes=changes, threads=2, tell=interrupt)
    left = [thread for thread in threading.enumerate() if thread.name.startswith("run")]
    for thread in left:
        thread.join(5)
        assert not thread.is_alive()


@pytest.mark.skipif(not COMPILED, reason="takes minutes as plain Python")
def test_novelty_needs_fewer_evaluations_than_the_objective_in_the_medium_maze() -> None:
    """By chance alone, were both alike, 10 pairs of runs would come out so about once in a hundred seeds."""
    figures = measure_maze("maze-medium", seeds=10, seed=1, changes={"generations": 400})
    assert figures["novelty"]["solved"] >= 9
    assert 2 * figures["novelty"]["mean_evaluations"] < figures["objective"]["mean_evaluations"]


def test_the_command_prints_both_beside_the_published_ones() -> None:
    words = ["bench", "maze-hard", "--seeds", "1", "--change", "population=3", "--change", "generations=2"]
    done = run_command(*words)
    lines = done.stdout.splitlines()
    assert lines[0] == "maze-hard, default population=3 generations=2, seed 1; at most 6 evaluations a run"
    assert lines[1].split() == ["novelty", "published", "objective", "published"]
    assert lines[4].split() == ["mean", "evaluations", "6", "35,109", "6", "-"]
    figures = json.loads(run_command(*words, "--json").stdout)
    assert figures["novelty"]["mean_evaluations"] == figures["objective"]["mean_evaluations"] == 6
    assert figures["novelty"]["published"] == dict(MAZE_TASKS["maze-hard"].published["novelty"])
