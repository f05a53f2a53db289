"""One controller on one robot, or a population on a platform."""

from ._jyro import (
    NoiseKey,
    Trajectory,
    TrialOutcome,
    jyro_rules,
    jyro_scene,
    trace_genome,
    try_genomes,
)

__all__ = [
    "NoiseKey",
    "Trajectory",
    "TrialOutcome",
    "jyro_rules",
    "jyro_scene",
    "trace_genome",
    "try_genomes",
]
