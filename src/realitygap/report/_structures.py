"""Which networks evolved: how often each structure occurs in the last generation."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import polars as pl

from realitygap.report._tally import Tally, settings_of

_MOST_ORDERED = 6
"""Hidden nodes up to which all orders are compared; larger networks are ordered by their links alone."""

_MOST_LISTED = 6
"""Structures of the same inputs that are listed by themselves."""

Links = tuple[tuple[str, str], ...]
"""Enabled links from name to name, hidden nodes being named h1, h2, ..."""


@dataclass(frozen=True)
class Structure:
    """Networks that have the same enabled links, whatever their weights and node numbers.

    Attributes:
        inputs: names of the inputs.
        outputs: names of the outputs.
        links: enabled links, in order.
        n_hidden: hidden nodes that a link reaches.
        by_condition: how many networks of the last generation have it, by condition.
        example: the row of the one of highest coverage: condition, replicate, generation, individual, genome.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    links: Links
    n_hidden: int
    by_condition: Mapping[str, int]
    example: Mapping[str, Any]

    @property
    def n(self) -> int:
        """How many networks have it."""
        return sum(self.by_condition.values())

    @property
    def words(self) -> str:
        """The structure in words: which direct links there are, and what is added."""
        all_direct = set(itertools.product(self.inputs, self.outputs))
        direct = {link for link in self.links if link in all_direct}
        lacking = sorted(all_direct - direct)
        parts = ["all direct links" if not lacking else f"{len(direct)} of {len(all_direct)} direct links"]
        if lacking and len(lacking) <= 2:
            parts[0] = "all direct links but " + " and ".join(f"{a} → {b}" for a, b in lacking)
        chains = [f"{a} → {b}" for a, b in self.links if (a, b) not in all_direct]
        if chains:
            parts.append(", ".join(chains))
        return "; ".join(parts)


@dataclass(frozen=True)
class Structures:
    """Structures under one kind of selection, from the most frequent to the rarest.

    Attributes:
        selection: what decided who had children.
        inputs: names of the inputs.
        conditions: with that selection and these inputs.
        n_networks: in their last generations.
        found: all structures.
    """

    selection: str
    inputs: tuple[str, ...]
    conditions: tuple[str, ...]
    n_networks: int
    found: tuple[Structure, ...]

    @property
    def listed(self) -> tuple[Structure, ...]:
        """The most frequent ones."""
        return self.found[:_MOST_LISTED]


def selection_of(condition: Mapping[str, Any]) -> str:
    """What decided who had children, as the settings say."""
    return str(settings_of(condition).get("selection", "unknown")).encode("utf-8", "replace").decode()


def count_structures(tally: Tally) -> list[Structures]:
    """How often each structure occurs among the networks of each run's last generation, by selection."""
    rows = _last_generations(tally)
    groups: dict[tuple[str, tuple[str, ...]], list[str]] = {}
    for condition in tally.conditions:
        selection = selection_of(condition)
        groups.setdefault((selection, _input_names(condition)), []).append(condition["name"])
    found = []
    for (selection, inputs), conditions in groups.items():
        there = [name for name in conditions if name in rows]
        if there:
            found.append(_count(selection, inputs, {name: rows[name] for name in there}))
    return found


def _last_generations(tally: Tally) -> dict[str, pl.DataFrame]:
    """The rows of each condition's last generation."""
    measure = f"coverage_{tally.measure}"
    columns = ["condition", "replicate", "generation", "individual", measure, "genome"]
    parts: dict[str, list[pl.DataFrame]] = {}
    for frame in tally.folder.frames(columns=columns):
        last = frame.filter(pl.col("generation") == pl.col("generation").max().over("replicate"))
        parts.setdefault(frame["condition"][0], []).append(last.rename({measure: "coverage"}))
    return {name: pl.concat(frames) for name, frames in parts.items()}


def _input_names(condition: Mapping[str, Any]) -> tuple[str, ...]:
    settings = settings_of(condition)
    bias = dict(settings.get("task") or {}).get("bias_input", "with-novelty")
    with_bias = bias == "always" or (bias == "with-novelty" and settings.get("selection") == "novelty")
    return ("obstacle", "stall", "time", *(("bias",) if with_bias else ()))


def _count(selection: str, inputs: tuple[str, ...], rows: Mapping[str, pl.DataFrame]) -> Structures:
    outputs = ("move", "turn")
    names = dict(enumerate([*inputs, *outputs]))
    counts: dict[Links, Counter[str]] = {}
    examples: dict[Links, dict[str, Any]] = {}
    known: dict[tuple[tuple[int, int], ...], Links] = {}
    for condition, frame in rows.items():
        genome = frame["genome"].struct
        genes = zip(
            genome.field("source").to_list(),
            genome.field("target").to_list(),
            genome.field("enabled").to_list(),
            frame["coverage"].to_list(),
            strict=True,
        )
        for index, (sources, targets, enabled, coverage) in enumerate(genes):
            key = tuple(
                (source, target) for source, target, on in zip(sources, targets, enabled, strict=True) if on
            )
            links = known.get(key)
            if links is None:
                links = known.setdefault(key, _canonical(key, names))
            counts.setdefault(links, Counter())[condition] += 1
            if links not in examples or coverage > examples[links]["coverage"]:
                examples[links] = {"coverage": coverage, "condition": condition, "index": index}
    found = []
    for links, by_condition in counts.items():
        example = examples[links]
        row = rows[example["condition"]].row(example["index"], named=True)
        n_hidden = len({name for link in links for name in link if name not in names.values()})
        found.append(Structure(inputs, outputs, links, n_hidden, dict(by_condition), row))
    found.sort(key=lambda structure: (-structure.n, structure.n_hidden, structure.links))
    n_networks = sum(frame.height for frame in rows.values())
    return Structures(selection, inputs, tuple(rows), n_networks, tuple(found))


def _canonical(links: tuple[tuple[int, int], ...], names: Mapping[int, str]) -> Links:
    """The links by name, the same for networks that differ only in how their hidden nodes are numbered."""
    hidden = sorted({node for link in links for node in link} - set(names))
    orders: Any = itertools.permutations(hidden) if len(hidden) <= _MOST_ORDERED else [hidden]
    forms = []
    for order in orders:
        named = {**names, **{node: f"h{k + 1}" for k, node in enumerate(order)}}
        forms.append(tuple(sorted((named[source], named[target]) for source, target in links)))
    return min(forms)


def structures_frame(structures: Sequence[Structures]) -> pl.DataFrame:
    """All structures as a table: one row for each, with its share of the networks of its selection."""
    rows = [
        {
            "selection": group.selection,
            "inputs": len(group.inputs),
            "rank": rank,
            "structure": structure.words,
            "hidden": structure.n_hidden,
            "links": len(structure.links),
            "networks": structure.n,
            "of": group.n_networks,
            "share": structure.n / group.n_networks,
        }
        for group in structures
        for rank, structure in enumerate(group.found, 1)
    ]
    return pl.DataFrame(rows)
