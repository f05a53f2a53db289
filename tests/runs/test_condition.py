"""A condition as resolved."""

import pytest

from realitygap.errors import RecordVersionError
from realitygap.runs import Condition, run_replicates


def test_settings_give_the_condition_again():
    condition = Condition(
        name="a", selection="novelty", noise=0.5, arena={"start": [0.3, 0.3, 1.0]}, pair=False
    )
    again = Condition.from_settings("a", condition.settings())
    assert again == condition
    assert again.hash() == condition.hash()


def test_settings_that_are_not_all_there_are_refused():
    """What was missing was filled in with a default, and the trials of another condition were shown."""
    whole = Condition(name="a", noise=0.5).settings()
    no_noise = {key: value for key, value in whole.items() if key != "noise"}
    no_steps = {**whole, "jyro": {key: value for key, value in whole["jyro"].items() if key != "steps"}}
    for part, text in (
        (no_noise, "noise is missing"),
        (no_steps, r"jyro\.steps is missing"),
        ({}, "platform is missing"),
        ({**whole, "flux": 3}, "flux"),
        ({**whole, "noise": -1}, "noise"),
    ):
        with pytest.raises(RecordVersionError, match=rf"settings of condition 'a' .*{text}"):
            Condition.from_settings("a", part)


def test_every_setting_changes_the_hash():
    base = Condition(name="a")
    changed = [
        Condition(name="a", **change)
        for change in (
            {"selection": "random"},
            {"noise": 0.2},
            {"seed": 2},
            {"pair": False},
            {"arena": {"start": "center"}},
            {"task": {"cells": "ends"}},
            {"novelty": {"archive_size": 9}},
            {"jyro": {"steps": 88}},
            {"neat": base.neat.model_copy(update={"add_node": 0.06})},
        )
    ]
    assert len({condition.hash() for condition in [base, *changed]}) == len(changed) + 1


def test_the_name_counts_only_where_random_numbers_depend_on_it():
    assert Condition(name="a").hash() == Condition(name="b").hash()
    assert Condition(name="a").key == Condition(name="b").key
    assert Condition(name="a", pair=False).hash() != Condition(name="b", pair=False).hash()
    assert Condition(name="a", pair=False).key != Condition(name="b", pair=False).key


@pytest.mark.parametrize("start", [[0.05, 0.3, 0.0], [0.1, 0.1, 0.7], [0.5, 0.55, 0.0]])
def test_a_robot_that_does_not_fit_at_the_start_is_refused(start):
    with pytest.raises(ValueError, match="does not fit at the start"):
        Condition(name="a", arena={"start": start})


@pytest.mark.parametrize(
    ("selection", "bias_input", "has"),
    [
        ("coverage", "with-novelty", False),
        ("novelty", "with-novelty", True),
        ("random", "with-novelty", False),
        ("coverage", "always", True),
        ("novelty", "never", False),
    ],
)
def test_the_constant_input_comes_with_novelty(selection, bias_input, has):
    condition = Condition(name="a", selection=selection, task={"bias_input": bias_input})
    assert condition.has_bias_input is has
    assert condition.neat_rules.n_inputs == 3 + has
    assert condition.neat_rules.bias_input == (3 if has else -1)


@pytest.mark.parametrize("name", ["", "a b", "../a", ".a", "a/b", "ä"])
def test_a_name_must_fit_into_a_file_name(name):
    with pytest.raises(ValueError, match=r"Condition.name: expected letters, digits"):
        Condition(name=name)


def test_a_run_that_no_memory_holds_is_refused():
    """A million individuals over a million generations ended in a traceback."""
    many = Condition(name="x").neat.model_copy(update={"population": 5000, "generations": 1000})
    assert Condition(name="a", neat=many).neat == many
    with pytest.raises(ValueError, match="expected at most 5,000,000"):
        Condition(name="a", neat=many.model_copy(update={"generations": 1001}))


def test_simulated_conditions_keep_their_hashes():
    """Results in people's folders go by them; a platform that is not in use has no settings."""
    assert Condition(name="a").hash() == "88619d669239056ab8f0db6e344ff21f35594cafedf7367f54ba1db22536a7f7"
    assert "scribbler" not in Condition(name="a").settings()
    with pytest.raises(ValueError, match="scribbler: of no meaning here, the condition's platform is 'jyro'"):
        Condition(name="a", scribbler={"steps": 5})


def test_a_condition_on_a_robot_has_the_robots_settings():
    condition = Condition(name="a", platform="scribbler")
    assert condition.is_physical
    assert (condition.noise, condition.label) == (0.0, "not driven")
    assert "jyro" not in condition.settings()
    assert Condition.from_settings("a", condition.settings()) == condition
    assert condition.hash() != Condition(name="a").hash()
    assert Condition(name="a", platform="scribbler", scribbler={"wait_s": 0.4}).hash() != condition.hash()


def test_settings_without_a_meaning_on_a_robot_are_refused():
    with pytest.raises(ValueError, match=r"noise is 0\.1, expected none with platform 'scribbler'"):
        Condition(name="a", platform="scribbler", noise=0.1)
    with pytest.raises(ValueError, match="expected 'line' with platform 'scribbler'"):
        Condition(name="a", platform="scribbler", task={"cells": "ends"})
    with pytest.raises(ValueError, match="is tried on a robot, expected one that is computed"):
        run_replicates(Condition(name="a", platform="scribbler"), 0, 1)
