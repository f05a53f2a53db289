"""The controller that a class tries to beat: evolved in simulation, and tried on the robot that students drive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from realitygap._wording import counted
from realitygap.platforms import emulated_robot, retry_genomes, trace_genome
from realitygap.playback import MovingTrial, in_motion
from realitygap.report import choose_trial, read_tally
from realitygap.robot_families import default_family
from realitygap.runs import genome_of
from realitygap.trials import NoiseKey, drive_trial
from realitygap.world import cells_along

from ._lab import Lab
from ._live import open_robot

NAME = "class-evolution"
"""Name of the study, which is one of the lab."""
SECONDS = 60.0
N_TRIALS = 50
"""Number of trials with fresh noise that judge the network."""
_TEXT = f"""[study]
name = "{NAME}"
title = "One minute, evolved for the class"
replicates = 10

[neat]
population = 60
generations = 40

[platform.sim]
steps = {{steps}}

[[condition]]
name = "evolved"
selection = "coverage"
platform = "sim"
"""


@dataclass(frozen=True)
class Evolved:
    """The best network of the study.

    Attributes:
        cells: (n,) number of cells in each simulated trial with fresh noise.
        emulated: Number of cells of the same network on an emulated robot.
        trial: The simulated trial with the median number of cells.
    """

    cells: np.ndarray[tuple[int], np.dtype[np.int64]]
    emulated: int
    trial: MovingTrial


def begin_evolution(lab: Lab) -> None:
    """Start or resume the study, unless it is complete."""
    if not lab.studies.has(NAME):
        lab.start_new(NAME, _TEXT.format(steps=round(SECONDS / 0.5)))
    elif lab.standing(NAME).can_resume:
        lab.go_on(NAME)


def evolved_controller(folder: Path) -> Evolved:
    """Try the best network of a complete study again; this takes a second or two."""
    tally = read_tally(folder)
    name = tally.name_of(None)
    condition = tally.resolved(name)
    sim, arena, noise = condition.on, condition.placed_arena, condition.noise
    best_run = tally.replicates(name)[tally.run_scores(name).argmax()]
    genome = genome_of(condition, choose_trial(tally, name, int(best_run)).row)
    again = retry_genomes(
        sim, arena, [genome], noise=noise, noise_keys=[NoiseKey(0)], repeats=range(1, N_TRIALS + 1)
    )
    cells = np.rint(again.coverage_line * arena.grid.n_cells).astype(np.int64)
    typical = int(np.argsort(cells, kind="stable")[N_TRIALS // 2])
    key = NoiseKey(0, repeat=1 + typical)
    driven = trace_genome(sim, arena, genome, noise=noise, noise_key=key)
    trial = in_motion(
        driven, arena, sim, title=f"Evolution, {counted(int(cells[typical]), 'cell')}", label="SIM"
    )

    robot, _ = open_robot(condition, f"{emulated_robot(default_family().name)}&speed=off")
    with robot:
        drive_trial(robot, genome.network(), round(SECONDS / robot.step_s), interface=genome.interface)
        path = robot.port.witness.path()  # type: ignore[attr-defined]  # an emulated robot's port has one
        on_time = path[path[:, 0] <= path[0, 0] + SECONDS]
        emulated = len(cells_along(on_time[:, 1:3], arena.grid))
    return Evolved(cells, emulated, trial)
