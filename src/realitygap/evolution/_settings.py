"""NEAT's settings: every number and every choice, by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from realitygap.errors import did_you_mean
from realitygap.kernels.neat.genome import NeatRules
from realitygap.kernels.neat.network import IDENTITY, SIGMOID, TANH
from realitygap.settings import Settings

_NEVER = 2**31 - 1

ACTIVATIONS = {"tanh": TANH, "sigmoid": SIGMOID, "identity": IDENTITY}
"""The kernels' numbers of the activation functions, by name."""


class NeatSettings(Settings):
    """NEAT after Stanley & Miikkulainen (2002), with the choices that the paper leaves open settled by name.

    The marks in the descriptions: *EC02*, the paper (Evolutionary Computation 10(2), with its section);
    *C++*, Stanley's own release 1.2.1, where it is the only source; *JAIR04*, Stanley & Miikkulainen (2004),
    appendix. If none of them settles a choice, it is ours, and the description says so.

    These rules have no setting. A genome is a list of node genes and a list of connection genes. Structures that
    arise twice in a generation get the same innovation numbers, which are forgotten after it (EC02 3.2). A split
    leaves the old gene disabled, with weight 1 into the new node and the old weight out of it (3.1). Fitness is
    shared within a species. A species gets children in proportion to its mean fitness (3.3). The whole population
    is replaced (3.3). Its size is exact, by largest remainder (ours: C++ gives the missing children to the largest
    species). A link out of an output node counts as recurrent (C++).

    Differs from C++: no traits; the weight of a new link is sampled even if another genome made the same link in
    the generation; no "severe" half in weight mutation; no worst species marked for removal every 30 generations;
    interspecies mating takes the champion of a species drawn uniformly.
    """

    settings: str = Field(
        "default", description="Named set that gives the value of each setting that is not given."
    )
    population: int = Field(
        150, ge=2, le=1_000_000, description="Individuals in each generation (EC02 4.1: 150)."
    )
    generations: int = Field(
        100, ge=1, le=1_000_000, description="Number of generations, including the first."
    )

    recurrent: bool = Field(
        False,
        description="Allow recurrent links. A recurrent network makes one pass per step. In it, each node gets the "
        "values that the other nodes had one step before (C++).",
    )
    activation: Literal["tanh", "sigmoid", "identity"] = Field(
        "sigmoid",
        description="Function of slope * x that hidden and output nodes compute. EC02 4.1: sigmoid, "
        "1 / (1 + exp(-4.9 x)). tanh has the range -1 to 1; tanh(2.45 x) is that sigmoid stretched to this range. "
        "identity is x and ignores the slope.",
    )
    activation_slope: float = Field(4.9, gt=0, le=100, description="Slope of the activation (EC02 4.1: 4.9).")
    node_bias: bool = Field(
        False,
        description="Give each output and hidden node its own bias, which mutates like a weight, as in neat-python. "
        "EC02 has a constant input instead.",
    )
    bias_value: float = Field(
        1.0,
        description="Value of the constant input, if the task has one (EC02: 1; double pole in C++: 0.5).",
    )

    start_hidden: int = Field(
        0,
        ge=0,
        le=1000,
        description="Number of hidden nodes at the start. Each is wired from all inputs and to all outputs (EC02 3.4: "
        "0; without growth, 4.4: 10).",
    )
    start_topology: Literal["full", "layer", "random"] = Field(
        "full",
        description="Links of the first genomes. 'full': each input is wired to each output. 'layer': only the "
        "constant input is. 'random': each genome has from 0 to all of the hidden nodes, drawn uniformly. Each link, "
        "also between hidden nodes, is made with a chance of 30 % (C++; EC02 4.4, for comparison).",
    )
    initial_weight: float = Field(
        5.0,
        ge=0,
        le=100,
        description="Largest size of a weight at the start and of a new link. Such weights are uniform within +- this "
        "(C++: 1).",
    )
    mutate_weights: float = Field(
        1.0, ge=0, le=1, description="Share of mutated children whose weights mutate (EC02 4.1: 0.8)."
    )
    replace_weight: float = Field(
        0.1,
        ge=0,
        le=1,
        description="Share of weights that are replaced in a child whose weights mutate (EC02 4.1: 0.1). The others "
        "are moved.",
    )
    weight_step: float = Field(
        1.0,
        ge=0,
        le=100,
        description="Largest step of a moved weight. Steps are uniform within +- this (EC02: not given; C++: 2.5).",
    )
    replaced_weight: float = Field(
        8.0,
        ge=0,
        le=100,
        description="Largest size of a replaced weight. Such weights are uniform within +- this (EC02: not given; "
        "C++: equal to the step).",
    )
    weight_limit: float = Field(
        8.0, gt=0, le=1e6, description="Largest size of a weight after a mutation (C++: 8)."
    )

    add_node: float = Field(
        0.03, ge=0, le=1, description="Share of mutated children that split a link (EC02 4.1: 0.03)."
    )
    add_link: float = Field(
        0.6,
        ge=0,
        le=1,
        description="Share of mutated children that add a link (EC02 4.1: 0.05; 0.3 in large populations).",
    )
    add_link_tries: int = Field(
        20,
        ge=1,
        le=10_000,
        description="Number of node pairs to try before a child gets no new link (C++: 20).",
    )
    structural_mutations: Literal["one", "independent"] = Field(
        "independent",
        description="'one': a child with a new node or link gets no other mutation (C++). 'independent': node, link, "
        "and weight mutations are drawn independently, as in neat-python.",
    )
    split_bias_links: bool = Field(
        False, description="Allow a split of links out of the constant input (C++: no)."
    )
    reenable: float = Field(
        0.2,
        ge=0,
        le=1,
        description="Share of mutated children whose oldest disabled gene is switched on (C++: 0; in the task "
        "without velocities 0.05).",
    )

    crossover: float = Field(
        0.5,
        ge=0,
        le=1,
        description="Share of children with two parents (EC02 4.1: 25 % come from mutation alone). If both draws pick "
        "the same parent, as in a species with a single parent, the child comes from mutation alone.",
    )
    crossover_only: float = Field(
        0.0, ge=0, le=1, description="Share of children with two parents that are not mutated (C++: 0.2)."
    )
    average_weights: float = Field(
        0.2,
        ge=0,
        le=1,
        description="Share of crossovers that average matching weights instead of choosing one of the two (EC02: 0; "
        "C++ and JAIR04: 0.4).",
    )
    interspecies: float = Field(
        0.001, ge=0, le=1, description="Share of crossovers with another species (EC02 4.1: 0.001)."
    )
    equal_parents: Literal["mix", "smaller"] = Field(
        "mix",
        description="Disjoint and excess genes of equally fit parents. 'mix': a coin decides on each gene of both "
        "(EC02, figure 4). 'smaller': those of the smaller genome (C++). A gene that would close a cycle is left out.",
    )
    stay_disabled: float = Field(
        0.75,
        ge=0,
        le=1,
        description="Chance that a gene disabled in either parent is disabled in the child (EC02 4.1: 0.75).",
    )
    disabled_rule: Literal["coin", "inherit"] = Field(
        "coin",
        description="State of such a gene in the remaining cases. 'coin': enabled. 'inherit': as in the parent that it "
        "came from (C++). With the default chance it is then disabled in 0.875 of the cases if one parent has it "
        "disabled, and always if both have.",
    )

    excess_coefficient: float = Field(
        1.0, ge=0, le=1e6, description="c1 of the compatibility distance (EC02 4.1: 1)."
    )
    disjoint_coefficient: float = Field(
        1.0, ge=0, le=1e6, description="c2 of the compatibility distance (EC02 4.1: 1)."
    )
    weight_coefficient: float = Field(
        0.4,
        ge=0,
        le=1e6,
        description="c3 of the compatibility distance (EC02 4.1: 0.4). Genomes without a gene in common are never "
        "compatible, unless c3 is 0. If c1, c2, and c3 are 0, there is one species.",
    )
    normalize_genes: Literal["never", "large", "always"] = Field(
        "never",
        description="Division of the numbers of excess and disjoint genes by the size of the larger genome. 'never' "
        "(C++, JAIR04), 'large': from 20 genes on (EC02 3.3 allows 1 below), or 'always'.",
    )
    threshold: float = Field(
        3.0, gt=0, le=1e6, description="Distance below which genomes are compatible (EC02 4.1: 3)."
    )
    assign: Literal["first", "nearest"] = Field(
        "first",
        description="Species that a genome joins: the first compatible one (EC02 3.3), or the nearest (neat-python).",
    )
    representative: Literal["random", "champion"] = Field(
        "random",
        description="Genome with which others are compared: a random member of the species in the generation before "
        "(EC02 3.3), or its champion (C++).",
    )
    target_species: int = Field(
        10,
        ge=0,
        le=1_000_000,
        description="Number of species that a moving threshold aims at. 0: the threshold is fixed (EC02). JAIR04: 10.",
    )
    threshold_step: float = Field(
        0.3,
        ge=0,
        le=1e6,
        description="Change of a moving threshold per generation. The threshold stays at 0.3 or above (C++).",
    )

    survival: float = Field(
        0.2,
        ge=0,
        le=1,
        description="Share of a species that may become parents, floor(share * size + 1) of them "
        "(EC02: not given; C++: 0.2).",
    )
    champion_from: int = Field(
        6,
        ge=1,
        le=1_000_000,
        description="Minimum size of a species whose champion is copied unchanged (EC02 4.1: more than five).",
    )
    champion_counts: Literal["members", "offspring"] = Field(
        "offspring",
        description="Size that counts for this: members of the species (EC02), or its children in the next generation "
        "(C++).",
    )
    stagnation: int = Field(
        15,
        ge=1,
        le=1_000_000,
        description="Number of generations without a better best fitness after which a species is stagnant "
        "(EC02 4.1: 15).",
    )
    stagnation_factor: float = Field(
        0.01,
        ge=0,
        le=1,
        description="Factor for the fitness of a stagnant species (EC02: 0, no children; C++: 0.01).",
    )
    best_species_spared: bool = Field(
        True,
        description="Never treat the species with the fittest individual as stagnant (EC02: no).",
    )
    population_stagnation: int = Field(
        20,
        ge=1,
        le=2**31 - 1,
        description="Number of generations without a better best fitness after which only the two best species have "
        "children (EC02 3.3: 20).",
    )
    negative_fitness: Literal["shift", "clip"] = Field(
        "shift",
        description="Treatment of negative fitness, which sharing cannot use. 'shift': raise all values by the lowest "
        "(ours). 'clip': replace negative values by 0.0001 (C++).",
    )

    @model_validator(mode="before")
    @classmethod
    def _fill_in_the_named_set(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        name = data.get("settings", "default")
        return {**NAMED_SETTINGS[name], **data} if _is_known(name) else data

    @field_validator("settings")
    @classmethod
    def _set_is_known(cls, name: str) -> str:
        if not _is_known(name):
            raise ValueError(f"Unknown NEAT settings {name!r}. {did_you_mean(name, NAMED_SETTINGS)}")
        return name

    @classmethod
    def named(cls, name: str, **changes: Any) -> NeatSettings:
        """Return a named set of settings with changes, like `NeatSettings(settings=name, **changes)`.

        Args:
            name: 'default', 'stanley-2002', 'rosenzweig-remy' or 'rosenzweig-remy-neat-python'.
            changes: Settings by name.

        Raises:
            ValueError: The set is unknown or named twice, or a setting is unknown or out of range.
        """
        if "settings" in changes:
            raise ValueError(
                f"The set is named twice: {name!r} and {changes['settings']!r}. Leave out `settings`."
            )
        if not _is_known(name):
            raise ValueError(f"Unknown NEAT settings {name!r}. {did_you_mean(str(name), NAMED_SETTINGS)}")
        return cls(settings=name, **changes)

    def rules(
        self, n_inputs: int, n_outputs: int, *, bias_input: int = -1, drives_wheels: bool = False
    ) -> NeatRules:
        """Return the settings in the form that the kernels read.

        Args:
            n_inputs, n_outputs: Number of nodes, including the constant input.
            bias_input: Index of the constant input; -1 if there is none.
            drives_wheels: True if the outputs are wheel speeds, left and right, instead of move and turn.
        """
        # a whole number that was given for one with a fraction would compile the kernels a second time
        same: dict[str, Any] = {
            name: float(getattr(self, name)) if field.annotation is float else getattr(self, name)
            for name, field in type(self).model_fields.items()
            if name in NeatRules._fields
        }
        return NeatRules(
            **same
            | {
                "n_inputs": n_inputs,
                "n_outputs": n_outputs,
                "bias_input": bias_input,
                "activation": ACTIVATIONS[self.activation],
                "start_random": self.start_topology == "random",
                "start_layer": self.start_topology == "layer",
                "one_structural_mutation": self.structural_mutations == "one",
                "disabled_bit_inherited": self.disabled_rule == "inherit",
                "equal_parents_mix": self.equal_parents == "mix",
                "normalize_from": {"never": _NEVER, "large": 20, "always": 1}[self.normalize_genes],
                "nearest_species": self.assign == "nearest",
                "champion_represents": self.representative == "champion",
                "champion_by_members": self.champion_counts == "members",
                "clip_negative": self.negative_fitness == "clip",
                "drives_wheels": drives_wheels,
            }
        )


def _is_known(name: object) -> bool:
    return isinstance(name, str) and name in NAMED_SETTINGS


# The paper's text alone; where it is silent, Stanley's C++ or what was fitted to its results on XOR (the sizes of
# weights, re-enabling, mutation after every crossover). Every value in which `default` may differ.
_STANLEY: dict[str, Any] = {
    "settings": "stanley-2002",
    "population": 150,
    "generations": 100,
    "initial_weight": 1.0,
    "mutate_weights": 0.8,
    "replace_weight": 0.1,
    "weight_step": 3.0,
    "replaced_weight": 5.0,
    "weight_limit": 5.0,
    "add_node": 0.03,
    "add_link": 0.05,
    "structural_mutations": "one",
    "split_bias_links": False,
    "reenable": 0.05,
    "crossover": 0.75,
    "crossover_only": 0.0,
    "average_weights": 0.0,
    "equal_parents": "mix",
    "weight_coefficient": 0.4,
    "normalize_genes": "large",
    "threshold": 3.0,
    "representative": "random",
    "target_species": 0,
    "survival": 0.2,
    "champion_from": 6,
    "champion_counts": "members",
    "stagnation": 15,
    "stagnation_factor": 0.0,
    "best_species_spared": False,
}

# Table 1 on top, and the C++ where both papers are silent; its words are those of an old neat-python, whose
# networks answered from -1 to 1.
_ROSENZWEIG: dict[str, Any] = {
    **_STANLEY,
    "settings": "rosenzweig-remy",
    "weight_step": 2.5,
    "replaced_weight": 2.5,
    "weight_limit": 8.0,
    "reenable": 0.0,
    "crossover_only": 0.2,
    "population": 8,
    "generations": 5,
    "add_link": 0.1,
    "add_node": 0.05,
    "activation": "tanh",
    "activation_slope": 2.45,
}

NAMED_SETTINGS: Mapping[str, Mapping[str, Any]] = {
    "default": {"settings": "default"},
    "stanley-2002": _STANLEY,
    "rosenzweig-remy": _ROSENZWEIG,
    "rosenzweig-remy-neat-python": {
        **_ROSENZWEIG,
        "settings": "rosenzweig-remy-neat-python",
        "node_bias": True,
        "activation_slope": 2.5,
        "structural_mutations": "independent",
        "split_bias_links": True,
    },
}
