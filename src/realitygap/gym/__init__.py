"""The tasks as environments for Gymnasium: one robot, or thousands a call.

    import gymnasium
    import realitygap.gym

    env = gymnasium.make("realitygap/ScribblerCoverage-v1")
    envs = gymnasium.make_vec("realitygap/ScribblerCoverage-v1", num_envs=4096)

Importing this package registers the environments of `ENV_IDS`. It needs the extra `gym`. The commands of a network
give, through either kind of environment, the trial that `platforms.trace_genome` and `try_genomes` give for the
same `NoiseKey`.
"""

from realitygap.errors import from_extra

from_extra("gymnasium", "gym")

from ._env import MazeEnv, RobotEnv  # noqa: E402 - after the message that the extra is missing
from ._register import ENV_IDS, register  # noqa: E402
from ._vector_env import MazeVectorEnv, RobotVectorEnv  # noqa: E402

register()

__all__ = ["ENV_IDS", "MazeEnv", "MazeVectorEnv", "RobotEnv", "RobotVectorEnv", "register"]
