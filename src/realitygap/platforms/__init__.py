"""Platforms: named ways to run trials."""

from ._fleet import Array, Fleet, Outline, Points
from ._platform import Opening, Platform
from ._port import PortPlatform
from ._python import PYTHON, allow_code
from ._recorded import RecordedPlatform, RecordedTarget
from ._registry import (
    built_in_platforms,
    emulated_robot,
    emulated_robots,
    platform_class,
    platform_names,
    study_platforms,
)
from ._repeats import retry_genomes, score_genomes
from ._robot_file import RobotFilePlatform
from ._settings import PlatformSettings
from ._simulated import SimTarget
from ._spec import (
    base_robot_of,
    class_of,
    described_platform,
    is_physical,
    known_specs,
    names_a_port,
    open_target,
    platform_of,
    split_spec,
)
from ._try import (
    open_trials,
    scores_of,
    trace_genome,
    trace_genomes,
    traced_at_once,
    trajectories_of,
    try_genomes,
)
from .jyro._platform import JyroPlatform
from .jyro._robot import JyroRobot
from .jyro._trials import jyro_rules, jyro_scene
from .sim._ensemble import Play, Rehearsal, SimEnsemble
from .sim._platform import SimPlatform, as_sim
from .sim._robot import SimRobot
from .sim._settings import ARENA, DEFAULT_ROBOT, NOISE, as_numbers
from .sim._trials import SimTrials
from .sim._world import SimWorld, SimWorldRobot
from .twin._open import SimTwin, open_twin
from .twin._platform import TwinPlatform
from .twin._pooled import TwinTarget, close_twins, release_twins

__all__ = [
    "ARENA",
    "DEFAULT_ROBOT",
    "NOISE",
    "PYTHON",
    "Array",
    "Fleet",
    "JyroPlatform",
    "JyroRobot",
    "Opening",
    "Outline",
    "Platform",
    "PlatformSettings",
    "Play",
    "Points",
    "PortPlatform",
    "RecordedPlatform",
    "RecordedTarget",
    "Rehearsal",
    "RobotFilePlatform",
    "SimEnsemble",
    "SimPlatform",
    "SimRobot",
    "SimTarget",
    "SimTrials",
    "SimTwin",
    "SimWorld",
    "SimWorldRobot",
    "TwinPlatform",
    "TwinTarget",
    "allow_code",
    "as_numbers",
    "as_sim",
    "base_robot_of",
    "built_in_platforms",
    "class_of",
    "close_twins",
    "described_platform",
    "emulated_robot",
    "emulated_robots",
    "is_physical",
    "jyro_rules",
    "jyro_scene",
    "known_specs",
    "names_a_port",
    "open_target",
    "open_trials",
    "open_twin",
    "platform_class",
    "platform_names",
    "platform_of",
    "release_twins",
    "retry_genomes",
    "score_genomes",
    "scores_of",
    "split_spec",
    "study_platforms",
    "trace_genome",
    "trace_genomes",
    "traced_at_once",
    "trajectories_of",
    "try_genomes",
]
