"""Strategies that find out on the target what of a repertoire works."""

from __future__ import annotations

import json

import numpy as np
import pytest

from realitygap.errors import RecordError, StudyError
from realitygap.gap import PriorProcess
from realitygap.platforms import JyroPlatform, SimPlatform, SimTarget
from realitygap.study import choose_condition, transfer
from realitygap.study._transfer.attempt import Simulation
from realitygap.study._transfer.repertoire import (
    MOST_EVALUATIONS,
    evolve_repertoire,
    joined,
    repertoire_condition,
    tried_under,
)
from realitygap.study._transfer.simulated import evolve_champions, rank_genomes
from realitygap.study._transfer.trial_and_error import damaged_conditions, suspected_damages
from realitygap.world import load_robot, paper_arena

pytestmark = pytest.mark.slow

SMALL = {"runs": 8, "repeats": 2, "fresh_trials": 2}
WEAK = {"drive.gain_left": 0.3}


def target(**numbers):
    return SimTarget(SimPlatform(set=numbers), paper_arena(), key=5, name="other")


@pytest.fixture(scope="module")
def condition():
    return choose_condition("sim-paper", None, 1)


@pytest.mark.parametrize("n_trials", [1, 200, 1000, 256 * 40, 3 * MOST_EVALUATIONS])
def test_a_repertoire_costs_as_many_trials_as_the_champions(n_trials, condition):
    made = repertoire_condition(condition, n_trials)
    trials = made.neat.population * made.neat.generations * made.repeats
    assert trials == pytest.approx(n_trials, rel=0.15)
    assert made.neat.population * made.neat.generations <= MOST_EVALUATIONS * 1.01
    parts = repertoire_condition(condition, n_trials, 4)
    assert parts.neat.population * parts.neat.generations * parts.repeats == pytest.approx(
        max(1, n_trials // 4), rel=0.15
    )


def test_scores_of_a_repertoire_are_those_of_fresh_trials(condition):
    made = repertoire_condition(condition, 3000)
    repertoire = evolve_repertoire(made, 2)
    simulated = [each.simulated for each in repertoire.champions]
    assert simulated == sorted(simulated, reverse=True)
    assert repertoire.simulated.tolist() == [simulated]
    assert (repertoire.descriptors >= 0).all()
    assert (repertoire.descriptors <= 1).all()
    cells = {tuple(np.minimum(each * made.archive.cells, np.array(made.archive.cells) - 1).astype(int))
             for each in repertoire.descriptors}  # fmt: skip
    assert len(cells) == len(simulated)
    # 64 other fresh trials of each: a mean over 20 elites differs by 0.02 once in 10,000 times
    again = rank_genomes(made, [each.genome for each in repertoire.champions[:20]], 77)
    assert np.mean([each.simulated for each in again]) == pytest.approx(np.mean(simulated[:20]), abs=0.02)


def test_pooled_elites_are_tried_under_every_condition(condition):
    conditions = [condition, damaged_conditions(condition)[1]]
    simulation = Simulation(4, 2)
    each = [simulation.repertoire(one, 0, 2) for one in conditions]
    both = tried_under(joined(each), conditions, 0)
    assert both.simulated.shape == (2, len(both.champions))
    assert both.descriptors.shape == (len(both.champions), each[0].descriptors.shape[1])
    best_intact = both.simulated[:, 0]
    assert best_intact[0] > best_intact[1] + 0.2, "a dead wheel changes nothing"


def test_damages_are_of_every_wheel_and_sensor(condition):
    damages = suspected_damages(condition.on.model)
    changed = {name for each in damages.values() for name in each}
    assert changed >= {"drive.gain_left", "drive.gain_right", "range.0.amplitude", "range.2.amplitude"}
    assert damages["intact"] == {}
    names = [each.name for each in damaged_conditions(condition)]
    assert len(set(names)) == len(names) == len(damages)


@pytest.mark.parametrize(
    ("robot", "number"),
    [("pioneer", "range.15.reach"), ("khepera", "range.7.amplitude"), ("scribbler-s2", None)],
)
def test_a_blind_sensor_sees_nothing_whatever_its_response(robot, number):
    damages = suspected_damages(load_robot(robot))
    blind = {name for each in damages.values() for name in each if name.startswith("range.")}
    assert blind == set() if number is None else number in blind
    for each in damages.values():
        load_robot(robot).with_numbers(each)


def test_a_repertoire_sees_what_the_networks_of_its_condition_see():
    novelty = choose_condition("sim-paper", "novelty-sim", 1)
    assert repertoire_condition(novelty, 1000).network_inputs == novelty.network_inputs


def test_a_suspected_damage_is_recognized_and_costs_less(tmp_path, condition):
    """One wheel has 30 % of its speed. The champions of intact robots turn in circles."""
    strategies = ["plain", "trial-and-error-damage"]
    found = transfer(
        "sim-paper", target(**WEAK), strategies, 10, out=tmp_path, runs=100, repeats=4, fresh_trials=10
    )
    plain, damage = found.strategies
    assert damage.quality.value > plain.quality.value + 0.05


def test_trial_and_error_ends_where_the_rule_says(tmp_path):
    arguments = ("sim-paper", target(), ["trial-and-error"], 8)
    found = transfer(*arguments, out=tmp_path / "rule", stop_at=0.5, **SMALL)
    assert [each.spent for each in found.champions] == [1]
    whole = transfer(*arguments, out=tmp_path / "whole", **SMALL)
    assert [each.spent for each in whole.champions] == [8]
    with pytest.raises(RecordError, match=r"stop_at was None, is 0\.5"):
        transfer(*arguments, out=tmp_path / "whole", stop_at=0.5, **SMALL)


ARCHIVE = """
[study]
name = "archive"
replicates = 1
[neat]
population = 64
generations = 10
[[condition]]
name = "elites"
platform = "sim"
selection = "map-elites"
[condition.archive]
descriptor = ["mean_turn", "stall_share"]
cells = [10, 5]
"""


def test_a_study_of_an_archive_is_transferred_with_its_own_elites(tmp_path):
    file = tmp_path / "archive.toml"
    file.write_text(ARCHIVE)
    strategies = ["plain", "select", "halving", "trial-and-error"]
    found = transfer(file, target(), strategies, 4, out=tmp_path / "t", **SMALL)
    assert [row.strategy for row in found.strategies] == strategies
    elites = evolve_repertoire(choose_condition(file, None, 1), 0)
    champion = json.loads((tmp_path / "t" / "champions" / "plain-0-0.json").read_text())
    assert champion == json.loads(elites.champions[0].genome.to_json())
    with pytest.raises(StudyError, match="Strategy 'direct' has a selection of its own"):
        transfer(file, target(), ["direct"], 4, out=tmp_path / "other", **SMALL)
    with pytest.raises(StudyError, match="elites in place of champions"):
        evolve_champions(choose_condition(file, None, 1), range(1), repeats=1)


def test_the_paper_s_simulator_has_repertoires_and_no_damages(tmp_path):
    found = transfer("paper", SimTarget(JyroPlatform(), paper_arena(), key=1, name="jyro"), ["trial-and-error"], 2,
                     out=tmp_path / "a", **SMALL)  # fmt: skip
    assert found.strategies[0].quality.value > 0
    with pytest.raises(StudyError, match="'trial-and-error-damage' changes numbers"):
        transfer("paper", target(), ["trial-and-error-damage"], 2, out=tmp_path / "b", **SMALL)


def test_a_search_is_the_same_with_the_same_trials():
    """As a transfer that goes on after a break takes it: the trials that are there lead to the same next one."""
    random = np.random.default_rng(2)
    x, prior, scores = random.random((200, 3)), random.random((5, 200)), random.random(200)
    chosen = []
    for _ in range(2):
        process = PriorProcess(x, prior, spread=0.1, offset=0.2, noise=0.01)
        for _ in range(12):
            process.tell(k := process.choose(), scores[k])
        chosen.append(process.tried)
    assert chosen[0] == chosen[1]
