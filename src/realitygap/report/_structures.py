"""Structures of the evolved networks, and the number of each in the last generation."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import polars as pl

from realitygap.report._tally import Names, Tally, declared, selection_of, settings_of

_MOST_ORDERED = 6
"""Hidden nodes up to which all orders are compared; larger networks are ordered by their links alone."""

_MOST_LISTED = 6
"""Structures of the same inputs that are listed by themselves."""

Links = tuple[tuple[str, str], ...]
"""Enabled links from name to name, hidden nodes being named h1, h2, ..."""


class Example(NamedTuple):
    """The numbers of an individual that has a structure."""

    condition: str
    replicate: int
    generation: int
    individual: int


@dataclass(frozen=True)
class Structure:
    """Networks that have the same enabled links, whatever their weights and node numbers.

    Attributes:
        inputs: Names of the inputs.
        outputs: Names of the outputs.
        links: Enabled links, in order.
        n_hidden: Hidden nodes that a link reaches.
        by_condition: Number of networks of the last generation with it, by condition.
        example: Network of highest coverage with it.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    links: Links
    n_hidden: int
    by_condition: Mapping[str, int]
    example: Example

    @property
    def n(self) -> int:
        """Number of networks that have the structure."""
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
        selection: Rule that selected parents.
        inputs: Names of the inputs.
        conditions: Conditions with that selection and these inputs.
        n_networks: Number of networks in their last generations.
        found: Found structures.
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


def count_structures(tally: Tally) -> list[Structures]:
    """Count how often each structure occurs among the networks of each run's last generation, by selection."""
    genes = _count_genes(tally)
    groups: dict[tuple[str, tuple[Names, Names]], list[str]] = {}
    for condition in tally.conditions:
        key = selection_of(condition), declared(settings_of(condition))
        groups.setdefault(key, []).append(condition["name"])
    counted = []
    for (selection, names), conditions in groups.items():
        present = [name for name in conditions if name in genes]
        if present:
            counted.append(_count(tally, selection, names, {name: genes[name] for name in present}))
    return counted


_ROW = ("replicate", "generation", "individual")


def _count_genes(tally: Tally) -> dict[str, pl.DataFrame]:
    """The kinds of genes that networks of a condition's last generations have, those of each chunk apart.

    A row for each: `source`, `target` and `enabled` of the genes, `n` networks, and of the one of highest
    coverage, the first of several alike, `coverage`, `replicate`, `generation` and `individual`, which order
    the rows.
    """
    measure = tally.coverage_column
    parts: dict[str, list[pl.DataFrame]] = {}
    best = pl.col("coverage").arg_max()
    for frame in tally.folder.frames(columns=["condition", *_ROW, measure, "genome"]):
        kinds = (
            frame.filter(pl.col("generation") == pl.col("generation").max().over("replicate"))
            .select(
                pl.col("genome").struct.field("source", "target", "enabled"),
                pl.col(measure).alias("coverage"),
                *_ROW,
            )
            .group_by("source", "target", "enabled", maintain_order=True)
            .agg(pl.len().alias("n"), pl.col("coverage", *_ROW).get(best))
        )
        parts.setdefault(frame["condition"][0], []).append(kinds)
    return {name: pl.concat(frames).sort(_ROW) for name, frames in parts.items()}


def _count(
    tally: Tally, selection: str, declaration: tuple[Names, Names], genes: Mapping[str, pl.DataFrame]
) -> Structures:
    inputs, outputs = declaration
    names = dict(enumerate([*inputs, *outputs]))
    counts: dict[Links, Counter[str]] = {}
    examples: dict[Links, tuple[Example, float]] = {}
    known: dict[tuple[tuple[int, int], ...], Links] = {}
    for condition, kinds in genes.items():
        for kind in kinds.iter_rows(named=True):
            gene = zip(kind["source"], kind["target"], kind["enabled"], strict=True)
            key = tuple((source, target) for source, target, on in gene if on)
            links = known.get(key)
            if links is None:
                links = known.setdefault(key, _canonical(key, names))
            counts.setdefault(links, Counter())[condition] += kind["n"]
            if links not in examples or kind["coverage"] > examples[links][1]:
                examples[links] = Example(condition, *(kind[key] for key in _ROW)), kind["coverage"]
    structures = []
    for links, by_condition in counts.items():
        n_hidden = len({name for link in links for name in link if name not in names.values()})
        example, _ = examples[links]
        structures.append(Structure(inputs, outputs, links, n_hidden, dict(by_condition), example))
    structures.sort(key=lambda structure: (-structure.n, structure.n_hidden, structure.links))
    n_networks = sum(structure.n for structure in structures)
    return Structures(selection, inputs, tuple(genes), n_networks, tuple(structures))


def _canonical(links: tuple[tuple[int, int], ...], names: Mapping[int, str]) -> Links:
    """The links by name, the same for networks that differ only in how their hidden nodes are numbered."""
    hidden = sorted({node for link in links for node in link} - set(names))
    orders: Iterable[Sequence[int]] = [hidden]
    if len(hidden) <= _MOST_ORDERED:
        orders = itertools.permutations(hidden)
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
