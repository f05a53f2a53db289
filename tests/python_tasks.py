"""A study whose task is a Python function in a file beside it, and a file that shows whether it ran."""

from __future__ import annotations

from pathlib import Path

STUDY = """
[study]
name = "mine"
replicates = {replicates}
[neat]
settings = "rosenzweig-remy"
population = {population}
generations = {generations}
[platform.sim]
steps = {steps}
[task]
kind = "python:task.py:far"
inputs = ["obstacle", "stall", "time"]
[[condition]]
name = "far"
platform = "sim"
"""

SOURCE = """
from pathlib import Path

MARKER = Path({marker!r})
MARKER.write_text("run by the file")


def far(trajectories):
    MARKER.write_text("run by the function")
    return trajectories.poses[:, -1, 0]
"""


def study_text(
    more: str = "", *, replicates: int = 1, population: int = 2, generations: int = 1, steps: int = 3
) -> str:
    """Return a study file for `task.py`, followed by more tables."""
    sizes = {"replicates": replicates, "population": population, "generations": generations, "steps": steps}
    return STUDY.format(**sizes) + more


def marking_source(marker: Path) -> str:
    """Return the text of a `task.py` that writes a file when it is loaded, and again when its function is called."""
    return SOURCE.format(marker=str(marker))
