"""One controller on one robot, or a population on a platform."""

from ._jyro import (
    NoiseKey,
    Trajectory,
    TrialBatch,
    counters_of,
    jyro_rules,
    jyro_scene,
    poses_of,
    trace_genome,
    try_genomes,
)
from ._jyro_robot import JyroRobot
from ._repeats import retry_genomes
from ._scene import SceneTrack, simulate_case, simulate_file

__all__ = [
    "JyroRobot",
    "NoiseKey",
    "SceneTrack",
    "Trajectory",
    "TrialBatch",
    "counters_of",
    "jyro_rules",
    "jyro_scene",
    "poses_of",
    "retry_genomes",
    "simulate_case",
    "simulate_file",
    "trace_genome",
    "try_genomes",
]
