"""One controller on one robot, or a population on a platform."""

from ._attendant import Attendant, RobotsOwnSenses, WitnessAttendant
from ._batch import (
    REAL,
    NoiseKey,
    PlatformTrials,
    Trajectory,
    TrialBatch,
    counters_of,
    paper_inputs,
    poses_of,
)
from ._carry_out import Onlooker, TrialStopped, carry_out_on_robot
from ._draws import Draws
from ._ensemble import Play, Rehearsal, SimEnsemble
from ._jyro import JyroTrials, jyro_rules, jyro_scene
from ._jyro_robot import JyroRobot
from ._maze_scene import maze_exit, maze_rules, maze_scene
from ._onlooker import RobotOnlooker
from ._open_twin import SimTwin, open_twin
from ._operator import PATH_PARTS, Card, Operator, Verdict, WitnessOperator, cell_at, start_words, trial_seed
from ._physical import (
    DrivenTrial,
    EndReason,
    TrialInterrupted,
    drive_trial,
    is_taken_back,
    is_whole,
    taken_back,
    those_that_count,
)
from ._preflight import Preflight, preflight
from ._processors import usable_processors
from ._repeats import retry_genomes
from ._scene import SceneTrack, simulate_case, simulate_file
from ._sim import SimTrials, sim_rules
from ._sim_robot import SimRobot
from ._sim_scene import SimScene, sim_scene
from ._sim_world import SimWorld
from ._sim_world_robot import SimWorldRobot
from ._target import Target, TrialPlan
from ._target_recorded import RecordedTarget
from ._target_robot import OnLost, PacedRobot, RobotTarget
from ._target_sim import SimTarget
from ._target_twin import TwinTarget
from ._try import open_trials, trace_genome, trace_genomes, trajectories_of, try_genomes
from ._twin_fleet import TwinRobots
from ._twin_trials import close_twins, release_twins

__all__ = [
    "PATH_PARTS",
    "REAL",
    "Attendant",
    "Card",
    "Draws",
    "DrivenTrial",
    "EndReason",
    "JyroRobot",
    "JyroTrials",
    "NoiseKey",
    "OnLost",
    "Onlooker",
    "Operator",
    "PacedRobot",
    "PlatformTrials",
    "Play",
    "Preflight",
    "RecordedTarget",
    "Rehearsal",
    "RobotOnlooker",
    "RobotTarget",
    "RobotsOwnSenses",
    "SceneTrack",
    "SimEnsemble",
    "SimRobot",
    "SimScene",
    "SimTarget",
    "SimTrials",
    "SimTwin",
    "SimWorld",
    "SimWorldRobot",
    "Target",
    "Trajectory",
    "TrialBatch",
    "TrialInterrupted",
    "TrialPlan",
    "TrialStopped",
    "TwinRobots",
    "TwinTarget",
    "Verdict",
    "WitnessAttendant",
    "WitnessOperator",
    "carry_out_on_robot",
    "cell_at",
    "close_twins",
    "counters_of",
    "drive_trial",
    "is_taken_back",
    "is_whole",
    "jyro_rules",
    "jyro_scene",
    "maze_exit",
    "maze_rules",
    "maze_scene",
    "open_trials",
    "open_twin",
    "paper_inputs",
    "poses_of",
    "preflight",
    "release_twins",
    "retry_genomes",
    "sim_rules",
    "sim_scene",
    "simulate_case",
    "simulate_file",
    "start_words",
    "taken_back",
    "those_that_count",
    "trace_genome",
    "trace_genomes",
    "trajectories_of",
    "trial_seed",
    "try_genomes",
    "usable_processors",
]
