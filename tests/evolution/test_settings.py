"""NEAT's settings: the values that their descriptions quote, and the form that kernels read."""

from __future__ import annotations

import pytest

from realitygap.evolution import NAMED_SETTINGS, NeatSettings
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import IDENTITY, SIGMOID, TANH


def test_stanley_2002_holds_the_numbers_of_the_paper() -> None:
    """EC02, sections 3.3 and 4.1."""
    settings = NeatSettings.named("stanley-2002")
    assert settings.population == 150
    assert (settings.activation, settings.activation_slope) == ("sigmoid", 4.9)
    assert (settings.mutate_weights, settings.replace_weight) == (0.8, 0.1)
    assert (settings.add_node, settings.add_link) == (0.03, 0.05)
    assert (settings.crossover, settings.interspecies, settings.stay_disabled) == (0.75, 0.001, 0.75)
    assert (settings.excess_coefficient, settings.disjoint_coefficient) == (1.0, 1.0)
    assert (settings.weight_coefficient, settings.threshold) == (0.4, 3.0)
    assert (settings.champion_from, settings.champion_counts) == (6, "members")
    assert (settings.stagnation, settings.stagnation_factor, settings.population_stagnation) == (15, 0.0, 20)
    assert (settings.assign, settings.representative, settings.target_species) == ("first", "random", 0)
    assert settings.average_weights == 0.0
    assert not settings.node_bias
    assert not settings.recurrent
    assert settings.normalize_genes == "large"


def test_rosenzweig_remy_holds_table_1() -> None:
    settings = NeatSettings.named("rosenzweig-remy")
    assert (settings.population, settings.generations) == (8, 5)
    assert (settings.add_link, settings.add_node) == (0.1, 0.05)
    assert settings.activation == "tanh"


def test_settings_without_a_name_are_the_default_ones() -> None:
    """They were called 'default' too, and differed from that set in three values."""
    assert NeatSettings() == NeatSettings.named("default")


@pytest.mark.parametrize("name", NAMED_SETTINGS)
def test_named_settings_know_their_name_and_can_be_changed(name: str) -> None:
    assert NeatSettings.named(name).settings == name
    changed = NeatSettings.named(name, population=9, add_link=0.5)
    assert (changed.population, changed.add_link) == (9, 0.5)
    assert NeatSettings.model_validate(changed.model_dump()) == changed


def test_an_unknown_name_and_an_impossible_value_are_refused() -> None:
    with pytest.raises(ValueError, match="Did you mean 'stanley-2002'"):
        NeatSettings.named("stanley-2020")
    wrong = {
        "population": 1,
        "add_node": 1.5,
        "threshold": 0.0,
        "weight_limit": float("inf"),
        "activation": "relu",
        "mutation": 0.5,
        "champion_from": 0,
    }
    for name, value in wrong.items():
        with pytest.raises(ValueError, match=name):
            NeatSettings.named("default", **{name: value})


def test_rules_are_the_settings_as_kernels_read_them() -> None:
    rules = NeatSettings.named("default").rules(4, 2, bias_input=3)
    assert (rules.n_inputs, rules.n_outputs, rules.bias_input) == (4, 2, 3)
    assert NeatSettings().rules(1, 1).bias_input == -1
    settings = NeatSettings.named("default")
    same = set(NeatRules._fields) & set(NeatSettings.model_fields)
    assert len(same) > 25
    for name in same - {"activation"}:
        assert getattr(rules, name) == getattr(settings, name), name

    def changed(name: str, **values: object) -> list[object]:
        return [
            getattr(NeatSettings.model_validate({key: value}).rules(1, 1), name)
            for key, options in values.items()
            for value in options  # type: ignore[attr-defined]
        ]

    assert changed("activation", activation=["tanh", "sigmoid", "identity"]) == [TANH, SIGMOID, IDENTITY]
    assert changed("start_random", start_topology=["random", "full"]) == [True, False]
    assert changed("start_layer", start_topology=["layer", "full"]) == [True, False]
    assert changed("one_structural_mutation", structural_mutations=["one", "independent"]) == [True, False]
    assert changed("disabled_bit_inherited", disabled_rule=["inherit", "coin"]) == [True, False]
    assert changed("equal_parents_mix", equal_parents=["mix", "smaller"]) == [True, False]
    assert changed("normalize_from", normalize_genes=["large", "always"]) == [20, 1]
    assert changed("nearest_species", assign=["nearest", "first"]) == [True, False]
    assert changed("champion_represents", representative=["champion", "random"]) == [True, False]
    assert changed("champion_by_members", champion_counts=["members", "offspring"]) == [True, False]
    assert changed("clip_negative", negative_fitness=["clip", "shift"]) == [True, False]
    assert NeatSettings(normalize_genes="never").rules(1, 1).normalize_from > 10**9
    assert all(type(value) in (int, float, bool) for value in settings.rules(1, 1))


def test_whole_numbers_given_for_shares_do_not_make_another_kernel() -> None:
    """Kernels are compiled for types: 1 in place of 1.0 would have all of them compiled again."""
    one = NeatSettings(add_node=1, threshold=3, bias_value=1).rules(2, 1)
    other = NeatSettings().rules(2, 1)
    assert list(map(type, one)) == list(map(type, other))


@pytest.mark.parametrize("name", NAMED_SETTINGS)
def test_a_set_that_is_named_fills_in_its_values(name: str) -> None:
    """`NeatSettings(settings="stanley-2002")` had the values of 'default' under the name of the other."""
    assert NeatSettings(settings=name) == NeatSettings.named(name)
    assert NeatSettings(settings=name, add_link=0.5) == NeatSettings.named(name, add_link=0.5)


def test_a_set_that_is_not_there_or_named_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="Did you mean 'stanley-2002'"):
        NeatSettings(settings="stanley-2020")
    with pytest.raises(ValueError, match="The set is named twice: 'default' and 'stanley-2002'"):
        NeatSettings.named("default", settings="stanley-2002")
    with pytest.raises(ValueError, match="Unknown NEAT settings"):
        NeatSettings.named([])  # type: ignore[arg-type]
