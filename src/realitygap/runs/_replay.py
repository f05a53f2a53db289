"""A trial shown again, from its row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realitygap.errors import RecordError
from realitygap.evolution import Genome, GenomeRecord, genome_from_record
from realitygap.platforms import trace_genome
from realitygap.trials import NoiseKey, Trajectory

from ._condition import Condition
from ._evolution import named

_COLUMNS = (
    *("condition", "replicate", "generation", "individual", "genome", "key"),
    *("cells", "coverage_line", "coverage_ends", "stalls"),
)
"""Columns from which a trial is computed, and those of its result."""


def genome_of(condition: Condition, row: Mapping[str, Any]) -> Genome:
    """Return the genome of a row of results, whose inputs and outputs have the condition's names."""
    return _genome_from(condition, row["genome"])


def partners_of(condition: Condition, row: Mapping[str, Any]) -> list[Genome]:
    """Return the genomes of the other robots of a row's trial; none if all robots have the row's genome."""
    return [_genome_from(condition, partner) for partner in row.get("partners") or ()]


def _genome_from(condition: Condition, record: GenomeRecord) -> Genome:
    return named(genome_from_record(record, condition.neat_rules, condition.neat.bias_value), condition)


def replay(condition: Condition | Mapping[str, Any], row: Mapping[str, Any]) -> Trajectory:
    """Recompute the trial of a row of results, step by step.

    Args:
        condition: Condition as resolved, its entry in `study.json`, or the settings of this entry.
        row: The row, as `DataFrame.row(k, named=True)` gives it.

    Returns:
        The trajectory.

    Raises:
        RecordError: The row lacks a column, or genomes of the other robots. Or the trial comes out otherwise than
            the row says: the row and the condition do not belong together, or another version computed it. Cells in
            their order, both coverages, blocked steps and the key are compared.
        RecordVersionError: The settings are not those of this version.
        TypeError: The condition is something else.
    """
    lacking = [column for column in _COLUMNS if column not in row]
    if lacking:
        raise RecordError(
            f"The row lacks {', '.join(lacking)}: expected a row with all columns of the records."
        )
    if not isinstance(condition, Condition):
        if not isinstance(condition, Mapping):
            raise TypeError(
                f"condition is {condition!r}, expected a Condition, or its settings as in study.json."
            )
        named_in = condition.get("name", row["condition"]) if "settings" in condition else row["condition"]
        condition = Condition.from_settings(named_in, dict(condition.get("settings", condition)))
    if condition.name != row["condition"]:
        raise RecordError(
            f"The row belongs to condition {row['condition']!r}, and the condition is {condition.name!r}. Give "
            "the one of the row."
        )
    if condition.arena.networks == "each" and not row.get("partners"):
        raise RecordError("The row lacks partners: expected a row with the genomes of the other robots.")
    try:
        genome = genome_of(condition, row)
    except RecordError as error:
        raise RecordError(
            f"The network of the row does not fit the settings of the condition. Give those of condition "
            f"{row['condition']!r} of its study; if they are, the row was changed."
        ) from error
    trajectory = trace_row(condition, row, genome)
    difference = _difference(condition, trajectory, row)
    if difference:
        raise RecordError(
            f"Condition {row['condition']!r}, run {row['replicate']}, generation {row['generation']}, "
            f"individual {row['individual']}: {difference}. Does the row belong to this condition, and was it "
            "computed by this version and not changed?"
        )
    return trajectory


def trace_row(condition: Condition, row: Mapping[str, Any], genome: Genome) -> Trajectory:
    """Compute the trial of a row, with the noise of the row and any genome."""
    return trace_genome(
        condition.on,
        condition.arena.arena(),
        genome,
        noise=condition.noise,
        noise_key=NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"]),
        inputs=condition.network_inputs,
        partners=partners_of(condition, row),
    )


def _difference(condition: Condition, trajectory: Trajectory, row: Mapping[str, Any]) -> str:
    """Describe the difference between a repeated trial and its row; empty if they are equal."""
    if row["key"] != condition.key:
        return f"its random numbers have the key {row['key']}, those of the condition {condition.key}"
    cells = list(row["cells"])
    if list(trajectory.cells) != cells:
        pairs = zip(trajectory.cells, cells, strict=False)
        place = next(
            (k for k, (repeated, recorded) in enumerate(pairs) if repeated != recorded),
            min(len(cells), len(trajectory.cells)),
        )
        return (
            f"the trial visits other cells when run again than its row has (first difference at place {place} of "
            f"{len(trajectory.cells)} and {len(cells)})"
        )
    if tuple(row.get("drawn") or ()) != trajectory.drawn:
        return f"{', '.join(trajectory.drawn_names) or 'nothing'} is drawn otherwise when run again than its row has"
    again = {
        "coverage_line": trajectory.coverage_line,
        "coverage_ends": trajectory.coverage_ends,
        "stalls": trajectory.n_stalls,
    }
    differing = [
        f"{name} is {value} when run again, {row[name]} in its row"
        for name, value in again.items()
        if value != row[name]
    ]
    return "; ".join(differing)
