"""Evolution of several robots in one arena."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from typing import Any

import numpy as np
import polars as pl
import pytest

from realitygap.errors import RecordError
from realitygap.platforms import trace_genomes
from realitygap.runs import Condition, genome_of, replay, run_replicates
from realitygap.runs._teams import draw_teams, mean_of_teams
from realitygap.trials import NoiseKey

SMALL = {"generations": 3, "population": 10}
EACH = {"robots": 3, "networks": "each"}
AVOID = {"kind": "avoid", "inputs": ["range.0", "range.1", "bias"]}


def condition(**values: Any) -> Condition:
    """A small one on `sim` with three robots."""
    return Condition.model_validate(
        {
            "name": "a",
            "platform": "sim",
            "arena": {"robots": 3},
            "neat": SMALL,
            "sim": {"steps": 30},
            "noise": 0.1,
            **values,
        }
    )


def test_settings_of_one_robot_are_those_of_before() -> None:
    one = Condition(name="a", platform="sim")
    assert (
        Condition.model_validate(
            {"name": "a", "platform": "sim", "arena": {"robots": 1, "other_starts": [], "networks": "one"}}
        ).hash()
        == one.hash()
    )
    assert set(one.settings()["arena"]) == {"preset", "start"}
    assert one.arena.arena().others == ()


def test_settings_of_several_robots_are_read_again() -> None:
    several = condition(arena=EACH)
    again = Condition.from_settings("a", several.settings())
    assert again.settings() == several.settings()
    assert again.hash() == several.hash()
    assert len({condition().hash(), several.hash(), condition(arena={"robots": 2}).hash()}) == 3
    starts = [[0.5, 0.3, 0.0], [0.8, 0.4, 1.0]]
    given = condition(arena={"robots": 3, "other_starts": starts})
    assert [list(pose) for pose in given.arena.arena().others] == starts
    assert type(given.arena.arena()).from_dict(given.arena.arena().to_dict()) == given.arena.arena()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"platform": "jyro", "sim": {}}, "sim: of no meaning here"),
        ({"arena": {"networks": "each"}}, "'each', which is only for several robots. Set"),
        ({"arena": EACH, "selection": "novelty"}, "expected 'one' with selection 'novelty'"),
        ({"arena": EACH, "neat": {"population": 2}}, "population is 2, expected 3 to 1,048,576"),
        ({"arena": {"robots": 3, "other_starts": [[0.5, 0.3, 0.0]]}}, "has 1 starts, expected 2"),
        ({"arena": {"other_starts": [[0.5, 0.3, 0.0]]}}, "has 1 starts, expected 0"),
        ({"arena": {"robots": 17}}, "less than or equal to 16"),
        ({"arena": {"robots": 12}}, "overlap at their starts .* Lower arena.robots"),
        ({"selection": "novelty", "novelty": {"distance": "final"}}, "where one robot ends"),
        ({"sim": {"set": {"arena.start.x": {"uniform": [0.2, 0.3]}}}}, "expected plain numbers"),
        ({"sim": {"set": {"body.0.radius": {"uniform": [0.0, 0.01]}}}}, "expected plain numbers"),
    ],
)  # fmt: skip
def test_mistakes_are_reported(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        condition(**values)


@pytest.mark.parametrize("platform", ["jyro", "scribbler"])
def test_other_platforms_take_one_robot(platform: str) -> None:
    with pytest.raises(
        ValueError, match=f"arena.robots is 3, expected 1 with platform '{platform}'.*such as sim"
    ):
        Condition.model_validate({"name": "a", "platform": platform, "arena": {"robots": 3}})


@pytest.mark.parametrize(("population", "n_robots"), [(3, 3), (7, 2), (50, 5)])
def test_each_individual_drives_once_in_each_place(population: int, n_robots: int) -> None:
    teams = draw_teams(7, 2, 5, population, n_robots)
    assert teams[:, 0].tolist() == list(range(population))
    for place in teams.T:
        assert sorted(place.tolist()) == list(range(population))
    assert all(len(set(team)) == n_robots for team in teams.tolist())
    scores = np.random.default_rng(1).random(population)
    plain = [np.mean([scores[k] for k, team in enumerate(teams) if i in team]) for i in range(population)]
    assert mean_of_teams(scores, teams) == pytest.approx(plain, rel=1e-15)


def test_partners_are_drawn_for_each_generation_and_run() -> None:
    drawn = [draw_teams(7, *numbers, 30, 3).tolist() for numbers in ((0, 0), (0, 1), (1, 0), (0, 0))]
    assert drawn[0] == drawn[3]
    assert drawn[0] != drawn[1] != drawn[2] != drawn[0]
    assert draw_teams(8, 0, 0, 30, 3).tolist() != drawn[0]


@pytest.mark.slow
@pytest.mark.parametrize("values", [{}, {"arena": EACH}, {"arena": EACH, "task": AVOID}], ids=str)
def test_rows_do_not_depend_on_the_block(monkeypatch: pytest.MonkeyPatch, values: dict[str, Any]) -> None:
    several = condition(**values)
    whole = run_replicates(several, 0, 9)
    monkeypatch.setattr("realitygap.runs._staged.BLOCK_TRIALS", 8)
    monkeypatch.setattr("realitygap.runs._staged.LEAST_RUNS", 2)
    monkeypatch.setattr("realitygap.platforms._try.TRACE_BYTES", 1)
    assert run_replicates(several, 0, 9).equals(whole)
    alone = run_replicates(several, 7, 1)
    assert alone.equals(whole.filter(pl.col("replicate") == 7))


@pytest.mark.slow
def test_rows_are_the_same_in_another_process() -> None:
    several = condition(arena=EACH, task=AVOID)
    code = (
        "from tests.runs.test_several_robots import condition, AVOID, EACH, run_replicates, fingerprint\n"
        "print(fingerprint(run_replicates(condition(arena=EACH, task=AVOID), 2, 2)))"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.strip() == fingerprint(run_replicates(several, 2, 2))


def fingerprint(frame: pl.DataFrame) -> str:
    """A hash of all values of a frame."""
    return hashlib.sha256(frame.write_json().encode()).hexdigest()


@pytest.mark.slow
@pytest.mark.parametrize("values", [{}, {"arena": EACH}, {"selection": "novelty"}], ids=str)
def test_trials_are_recomputed_from_their_rows(values: dict[str, Any]) -> None:
    several = condition(**values)
    frame = run_replicates(several, 1, 1)
    for row in frame.filter(pl.col("generation") == 2).iter_rows(named=True):
        trial = replay(several, row)
        assert len(trial.robots) == 3
        assert list(trial.cells) == row["cells"]


@pytest.mark.slow
def test_trial_with_other_partners_does_not_fit_its_row() -> None:
    several = condition(arena=EACH)
    rows = list(run_replicates(several, 1, 1).iter_rows(named=True))
    with pytest.raises(RecordError, match=r"come out|visits other cells|is .* when run again"):
        replay(several, {**rows[0], "partners": rows[5]["partners"]})
    without = {key: value for key, value in rows[0].items() if key != "partners"}
    with pytest.raises(RecordError, match="lacks partners"):
        replay(several, without)


@pytest.mark.slow
def test_fitness_is_the_mean_of_the_teams_of_a_network() -> None:
    several = condition(arena=EACH)
    frame = run_replicates(several, 4, 1)
    for generation in range(3):
        part = frame.filter(pl.col("generation") == generation)
        teams = draw_teams(several.key, 4, generation, 10, 3)
        assert part["fitness"].to_numpy() == pytest.approx(
            mean_of_teams(part["coverage_line"].to_numpy(), teams)
        )
        genomes = part["genome"].to_list()
        for team, partners in zip(teams.tolist(), part["partners"].to_list(), strict=True):
            assert partners == [genomes[k] for k in team[1:]]


@pytest.mark.slow
def test_avoidance_is_the_mean_of_the_robots() -> None:
    several = condition(task=AVOID)
    row = run_replicates(several, 0, 1).row(13, named=True)
    key = NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"])
    traces = trace_genomes(
        several.on,
        several.arena.arena(),
        [genome_of(several, row)],
        noise=0.1,
        noise_key=key,
        inputs=several.network_inputs,
    )
    scores = several.task_of_trials.fitness(traces, traces.arena)
    assert len(scores) == 3
    assert row["task_fitness"] == row["fitness"] == pytest.approx(scores.mean(), rel=1e-15)
