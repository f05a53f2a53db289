"""The hard maze: novelty finds the way out, the objective does not.

Where each network of one run ended in Lehman & Stanley's hard maze, later ones darker: rewarded for ending where nobody
ended before, and for ending near the exit, which lies behind a wall. The line is the way out.
"""

import sys

from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from realitygap.evolution import NeatSettings
from realitygap.runs import MAZE_REWARDS, MazeTrials, run_maze
from realitygap.tasks import MAZE_TASKS
from realitygap.world import load_arena

task = MAZE_TASKS["maze-hard"]
arena = load_arena(task.name)
settings = NeatSettings.named("default").model_copy(update={"population": 250, "generations": 100})
trials = MazeTrials(arena)

figure = Figure(figsize=(9.6, 5.1))
for k, reward in enumerate(MAZE_REWARDS):
    run = run_maze(task, trials, reward, settings, 1, 0, keep_ends=True)
    axes = figure.add_axes((0.005 + 0.5 * k, 0.005, 0.49, 0.93))
    axes.add_collection(
        LineCollection([[wall[:2], wall[2:]] for wall in arena.walls], colors="#1c1f24", linewidths=2)
    )
    axes.scatter(*run.ends.T, s=2.5, c=range(len(run.ends)), cmap="viridis_r", linewidths=0)
    axes.plot(arena.start.x, arena.start.y, "o", color="#c2182b", markersize=8)
    axes.plot(arena.goal.x, arena.goal.y, "*", color="#00805c", markersize=15)
    if run.solver is not None:
        poses = trials.path(run.solver).poses
        axes.plot(poses[:, 0], poses[:, 1], color="#b8480a", linewidth=1.8)
    outcome = "out" if run.solved else "not out"
    axes.set_title(
        f"{reward}: {outcome} after {run.evaluations:,} networks (SIM, n = 1 run)", fontsize=10, loc="left"
    )
    axes.set(aspect="equal", xlim=(-0.03, 2.08), ylim=(-0.03, 2.08))
    axes.set_axis_off()
figure.savefig(sys.argv[1] if len(sys.argv) > 1 else "maze.png", dpi=110)
