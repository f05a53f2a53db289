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
from ._operator import PATH_PARTS, Card, Operator, Verdict, WitnessOperator, cell_at, trial_seed
from ._physical import DrivenTrial, EndReason, TrialInterrupted, drive_trial
from ._preflight import Preflight, preflight
from ._repeats import retry_genomes
from ._scene import SceneTrack, simulate_case, simulate_file

__all__ = [
    "PATH_PARTS",
    "Card",
    "DrivenTrial",
    "EndReason",
    "JyroRobot",
    "NoiseKey",
    "Operator",
    "Preflight",
    "SceneTrack",
    "Trajectory",
    "TrialBatch",
    "TrialInterrupted",
    "Verdict",
    "WitnessOperator",
    "cell_at",
    "counters_of",
    "drive_trial",
    "jyro_rules",
    "jyro_scene",
    "poses_of",
    "preflight",
    "retry_genomes",
    "simulate_case",
    "simulate_file",
    "trace_genome",
    "trial_seed",
    "try_genomes",
]
