"""The paper's task as environments for Gymnasium: one robot, or thousands a call.

    import gymnasium
    import realitygap.gym

    env = gymnasium.make("realitygap/ScribblerCoverage-v0")
    envs = gymnasium.make_vec("realitygap/ScribblerCoverage-v0", num_envs=4096)

Importing this package registers the environment. It needs the extra `gym`. The commands of a network give, through
either environment, the trial that `realitygap.trials.trace_genome` and `try_genomes` give for the same `NoiseKey`.
"""

from realitygap.errors import from_extra

from_extra("gymnasium", "gym")

from ._env import ScribblerCoverageEnv  # noqa: E402 - after the message that the extra is missing
from ._register import ENV_ID, register  # noqa: E402
from ._vector_env import ScribblerCoverageVectorEnv  # noqa: E402

register()

__all__ = ["ENV_ID", "ScribblerCoverageEnv", "ScribblerCoverageVectorEnv", "register"]
