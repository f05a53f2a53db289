"""Trials of one controller on one robot, or of a population on a platform."""

from . import _picture  # noqa: F401  # registers the picture of a trajectory
from ._batch import (
    MOST_TEAMS,
    REAL,
    NoiseKey,
    PlatformTrials,
    ResultsRoom,
    Trajectory,
    TrialBatch,
    Tried,
    check_genomes,
    counters_of,
    counters_of_individuals,
    counters_of_robot,
    kind_of,
    paper_inputs,
    poses_of,
)
from ._carry_out import carry_out_on_robot
from ._draws import Draws
from ._loop import TrialInterrupted, controller_of, drive_trial, run_trial
from ._maze_scene import maze_exit, maze_rules, maze_scene
from ._observer import PortObserver, RobotObserver
from ._operator import Card, Led, Operator, Verdict, start_words
from ._preflight import Preflight, preflight
from ._scene import simulate_case, simulate_file
from ._sheet_observer import SheetObserver
from ._target import RepeatableTarget, Target, TellTrial, TrialPlan, check_plans
from ._target_robot import OnLost, Pulse, RobotTarget
from ._witness_observer import WitnessObserver, own_witness

__all__ = [
    "MOST_TEAMS",
    "REAL",
    "Card",
    "Draws",
    "Led",
    "NoiseKey",
    "OnLost",
    "Operator",
    "PlatformTrials",
    "PortObserver",
    "Preflight",
    "Pulse",
    "RepeatableTarget",
    "ResultsRoom",
    "RobotObserver",
    "RobotTarget",
    "SheetObserver",
    "Target",
    "TellTrial",
    "Trajectory",
    "TrialBatch",
    "TrialInterrupted",
    "TrialPlan",
    "Tried",
    "Verdict",
    "WitnessObserver",
    "carry_out_on_robot",
    "check_genomes",
    "check_plans",
    "controller_of",
    "counters_of",
    "counters_of_individuals",
    "counters_of_robot",
    "drive_trial",
    "kind_of",
    "maze_exit",
    "maze_rules",
    "maze_scene",
    "own_witness",
    "paper_inputs",
    "poses_of",
    "preflight",
    "run_trial",
    "simulate_case",
    "simulate_file",
    "start_words",
]
