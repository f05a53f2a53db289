"""Tables of arrays in checkpoints: what is saved, and what is checked before kernels trust it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.kernels.neat.genome import Genomes, NeatRules, make_genomes

from ._genome import Genome

MOST_NUMBER = 2**31 - 2**16
"""Numbers of genes, nodes and species have 32 bits. A run never counts this far."""

Arrays = dict[str, NDArray[Any]]

_ROOM = ("reached", "cursor", "numbers", "shares")
"""Arrays of tables that kernels write before they read them."""


def arrays_of(tables: Mapping[str, Any]) -> Arrays:
    """Return the arrays of named tables, such as `genomes.weight`, without those that are only room; views."""
    return {
        f"{prefix}.{name}": array
        for prefix, table in tables.items()
        for name, array in table._asdict().items()
        if name not in _ROOM
    }


def check_shapes(arrays: Arrays, own: Arrays, n_outputs: int) -> None:
    """Raise an error if arrays are not like one's own; only the room for genes may differ.

    Args:
        arrays: What a file holds.
        own: What it has to be like. Genomes are tables whose name ends in `genomes`.
        n_outputs: Outputs of a genome.

    Raises:
        ValueError: Names, types, or sizes differ.
    """
    if arrays.keys() != own.keys():
        raise ValueError(f"it lacks {sorted(own.keys() - arrays.keys())} or holds something else")
    for name, array in arrays.items():
        if array.dtype != own[name].dtype or array.ndim != own[name].ndim:
            raise ValueError(f"{name} is {array.dtype} with {array.ndim} dimensions")
        expected = own[name].shape
        table, _, part = name.rpartition(".")
        if table.endswith("genomes") and array.ndim == 2:
            room, hidden_room = (arrays[f"{table}.{other}"].shape[-1] for other in ("innovation", "hidden"))
            width = {"hidden": hidden_room, "bias": n_outputs + hidden_room}.get(part, room)
            expected = (expected[0], width)
        if array.shape != expected:
            raise ValueError(f"{name} has shape {array.shape}, expected {expected}")


def table_of(like: Any, prefix: str, arrays: Arrays) -> Any:
    """Return a table with the arrays of a file; those that are only room are its own."""
    names = [name for name in like._fields if f"{prefix}.{name}" in arrays]
    return like._replace(**{name: np.ascontiguousarray(arrays[f"{prefix}.{name}"]) for name in names})


def genomes_of(
    like: Genomes,
    prefix: str,
    arrays: Arrays,
    rules: NeatRules,
    counters: NDArray[Any],
    rows: Sequence[int] | None = None,
) -> Genomes:
    """Return the genomes of a file. Kernels trust indices, so everything is checked here.

    Args:
        like: Genomes of one's own.
        prefix: Name of the table.
        arrays: All arrays of the file, of the right shapes.
        rules: Rules of the genomes.
        counters: The next innovation number and the next node.
        rows: Rows that hold genomes; all if not given.

    Raises:
        RecordError: A genome is not one that evolution can make.
        ValueError: Numbers do not fit.
    """
    read = table_of(like, prefix, arrays)
    room, hidden_room = read.innovation.shape[1], read.hidden.shape[1]
    genomes: Genomes = Genomes(**read._asdict() | {"reached": np.zeros(room + 1, np.int32)})
    for count, most in ((genomes.n_connections, room), (genomes.n_hidden, hidden_room)):
        if count.min() < 0 or count.max() > most:
            raise ValueError("a genome has more genes than room")
    for row in range(len(genomes.n_connections)) if rows is None else rows:
        Genome.from_dict(Genome(genomes, row, rules).to_dict())
    next_number, next_node = (int(number) for number in counters[:2])
    if not (genomes.innovation.max(initial=0) < next_number < MOST_NUMBER):
        raise ValueError(f"the next innovation number is {next_number}")
    if not (genomes.hidden.max(initial=0) < next_node < MOST_NUMBER):
        raise ValueError(f"the next node is {next_node}")
    return genomes


def widened(genomes: Genomes, n_outputs: int, room: int, hidden_room: int) -> Genomes:
    """Return the same genomes with more room for genes and hidden nodes."""
    wide: Genomes = make_genomes(len(genomes.n_connections), n_outputs, room, hidden_room)
    for name in ("n_connections", "n_hidden"):
        getattr(wide, name)[:] = getattr(genomes, name)
    for name in ("innovation", "source", "target", "weight", "enabled", "hidden", "bias"):
        narrow = getattr(genomes, name)
        getattr(wide, name)[:, : narrow.shape[1]] = narrow
    return wide
