"""The environments under their names."""

from __future__ import annotations

from gymnasium.envs import registration

ENV_IDS = {
    "realitygap/ScribblerCoverage-v1": ("Robot", {"kind": "coverage"}),
    "realitygap/Avoid-v0": ("Robot", {"kind": "avoid"}),
    "realitygap/Light-v0": ("Robot", {"kind": "light"}),
    "realitygap/Wall-v0": ("Robot", {"kind": "wall"}),
    "realitygap/Goal-v0": ("Robot", {"kind": "goal"}),
    "realitygap/MazeMedium-v0": ("Maze", {"maze": "maze-medium"}),
    "realitygap/MazeHard-v0": ("Maze", {"maze": "maze-hard"}),
}
"""Class and arguments of each environment. A version goes up if the same commands would give other observations or
rewards."""


def register() -> None:
    """Make the environments known to `gymnasium.make` and `gymnasium.make_vec`; importing the package does it."""
    for name, (kind, arguments) in ENV_IDS.items():
        if name not in registration.registry:
            registration.register(
                name,
                entry_point=f"realitygap.gym:{kind}Env",
                vector_entry_point=f"realitygap.gym:{kind}VectorEnv",
                kwargs=dict(arguments),
            )
