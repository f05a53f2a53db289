"""A trial shown again, from its row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from realitygap.errors import RecordError
from realitygap.evolution import Genome, genome_from_record
from realitygap.trials import NoiseKey, Trajectory, trace_genome

from ._condition import Condition


def genome_of(condition: Condition, row: Mapping[str, Any]) -> Genome:
    """The genome of a row of results."""
    return genome_from_record(row["genome"], condition.neat_rules, condition.neat.bias_value)


def replay(condition: Condition | Mapping[str, Any], row: Mapping[str, Any]) -> Trajectory:
    """Recompute the trial of a row of results, step by step.

    Args:
        condition: As resolved, or its settings as kept in `study.json`.
        row: The row, as `DataFrame.row(k, named=True)` gives it.

    Returns:
        The trajectory.

    Raises:
        RecordError: The trial comes out otherwise than the row says: the row and the condition do not
            belong together, or another version computed it.
    """
    if not isinstance(condition, Condition):
        condition = Condition.from_settings(row["condition"], dict(condition))
    trajectory = trace_genome(
        condition.jyro,
        condition.arena.arena(),
        genome_of(condition, row),
        noise=condition.noise,
        noise_key=NoiseKey(row["key"], row["replicate"], row["generation"], row["individual"]),
    )
    if list(trajectory.cells) != list(row["cells"]):
        raise RecordError(
            f"Condition {row['condition']!r}, replicate {row['replicate']}, generation {row['generation']}, "
            f"individual {row['individual']}: the trial visits {len(trajectory.cells)} cells when run "
            f"again, its row has {len(row['cells'])}. Was the row computed by another version, or changed?"
        )
    return trajectory
