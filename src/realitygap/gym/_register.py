"""The environment under its name."""

from __future__ import annotations

from gymnasium.envs import registration

ENV_ID = "realitygap/ScribblerCoverage-v0"
"""Its version goes up whenever the same commands would give other observations or rewards."""


def register() -> None:
    """Make the environment known to `gymnasium.make` and `gymnasium.make_vec`; importing the package does it."""
    if ENV_ID not in registration.registry:
        registration.register(
            ENV_ID,
            entry_point="realitygap.gym:ScribblerCoverageEnv",
            vector_entry_point="realitygap.gym:ScribblerCoverageVectorEnv",
        )
