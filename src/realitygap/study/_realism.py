"""The speed of trials of `sim` with full realism."""

from __future__ import annotations

import platform as python_platform
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from realitygap._version import __version__
from realitygap.evolution import NeatSettings
from realitygap.kernels.math.peak import peak_flops
from realitygap.kernels.neat.network import Networks, make_networks
from realitygap.kernels.sim.lanes import SimRules, make_sim_room, make_sim_trace
from realitygap.kernels.sim.shape import half_width, make_sim_shape, sim_table, substeps_for
from realitygap.kernels.sim.trial import run_sim_trials
from realitygap.platforms import DEFAULT_ROBOT
from realitygap.world import Arena, load_arena, load_robot, paper_arena

from ._bench import check_seconds, fastest_rate
from ._run import machine_facts

N_TRIALS = 1_280
N_STEPS = 100
STEP_S = 0.5
SPREAD = 0.03  # by which every number differs from trial to trial, up or down, as a part of it

# Three infrared range sensors with the mixture of a Fluke's faults, ahead and to both sides.
SENSORS = ((0.089, 0.03, 0.6), (0.089, 0.0, 0.0), (0.089, -0.03, -0.6))
RANGE = {
    "reach": 0.5,
    "amplitude": 1.0,
    "decay": 0.173,
    "noise_uniform": 0.02,
    "noise_gain": 0.05,
    "drop_most": 0.5,
    "drop_at": 0.2286,
    "drop_width": 0.0254,
    "outlier_most": 0.05,
    "outlier_at": 0.1,
    "outlier_width": 0.02,
}
DRIVE = {
    "delay": 0.1,
    "delay_jitter": 0.03,
    "slip": 0.02,
    "travel_noise_per_m": 0.01,
    "travel_noise_per_s": 0.003,
    "heading_noise_per_m": 0.1,
    "heading_noise_per_s": 0.02,
    "drift_per_m": 0.1,
    "battery_sag": 0.0005,
}
# Weights of the inputs (left, ahead, right, constant) for move and turn.
AVOIDING = ((-0.2, -1.6, -0.2, 0.9), (-3.0, -1.2, 3.0, 0.1))
PRESSED = ((0.0, 0.0, 0.0, 2.5), (0.2, 0.0, -0.1, 0.03))


def measure_realism(seconds: float = 2.0) -> dict[str, Any]:
    """Return robot-steps a second of one core, with everything that `sim` has for its default robot.

    Outline of ten corners and their radius, contact `slide`, three infrared sensors with their mixture of noise,
    a drive with lag, delay and noise; every number of robot and drive is different in each trial. Steps of
    0.5 s in the paper's arena, in single precision. Time is that of the thread: what else the machine does counts
    little.

    Args:
        seconds: Measuring time of each figure [s], after everything is compiled.

    Returns:
        `avoiding`: of networks that turn away from walls; `pressed`: of such as push into them; `boxes`: that
        avoid, among the two boxes of the arena `paper-boxes`. `stalled`: the share of their steps in which they
        stall, and `visited`: how many cells they visit. `peak_gflops`: as of `measure_speed`; `per_gflop`: the three
        rates for 10^9 operations of that peak. `machine` and `versions`.

    Raises:
        ValueError: `seconds` is not more than 0 and at most 3600.
    """
    check_seconds(seconds)
    kinds = {"avoiding": (AVOIDING, False), "pressed": (PRESSED, False), "boxes": (AVOIDING, True)}
    rates, stalled, visited = {}, {}, {}
    for name, (weights, boxes) in kinds.items():
        work = RealisticTrials(weights, boxes=boxes)
        rates[name] = work.rate(seconds)
        stalled[name] = float(work.counts[:, 2].mean() / N_STEPS)
        visited[name] = float(work.counts[:, 0].mean())
    versions = {
        "realitygap": __version__,
        "python": python_platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
    }
    peak_gflops = peak_flops() / 1e9
    return {
        **rates,
        "stalled": stalled,
        "visited": visited,
        "peak_gflops": peak_gflops,
        "per_gflop": {name: rate / peak_gflops for name, rate in rates.items()},
        "machine": machine_facts(),
        "versions": versions,
    }


class RealisticTrials:
    """Trials of one network with all the realism there is, ready to be run again and again.

    Args:
        weights: Weights of the network, for move and turn.
        boxes: True if the arena has the two boxes of `paper-boxes`.
    """

    def __init__(self, weights: tuple[tuple[float, ...], ...], *, boxes: bool) -> None:
        arena = load_arena("paper-boxes") if boxes else paper_arena()
        numbers = _numbers(arena)
        self.shape = make_sim_shape(
            parts=[len(_outline(numbers))],
            contact="slide",
            substeps=int(
                substeps_for(
                    numbers["drive.speed"] * STEP_S, half_width(_outline(numbers), numbers["body.0.radius"])
                )
            ),
            range_response=["ir"] * len(SENSORS),
            n_walls=4,
            enclosed=True,
            obstacles=[len(box.corners) for box in arena.obstacles],
            columns=arena.grid.columns,
            rows=arena.grid.rows,
            inputs=[("range", 0), ("range", 1), ("range", 2), ("bias", 0)],
        )
        start = arena.start
        self.table = sim_table(self.shape, _spread(numbers), np.float32, (start.x, start.y))
        grid = arena.grid
        place = [(start.x - grid.x) / grid.cell, (start.y - grid.y) / grid.cell]
        self.rules = SimRules(N_STEPS, STEP_S, True, 1.0, np.array([*place, 1 / grid.cell, 1e-5], np.float32))
        self.neat = NeatSettings.named("rosenzweig-remy").rules(4, 2, bias_input=3)
        self.networks = _networks(self.neat, weights)
        self.which = np.zeros(N_TRIALS, np.int32)
        self.counters = np.zeros((N_TRIALS, 3), np.uint32)
        self.counters[:, 0] = np.arange(N_TRIALS) << 8 | 1
        self.cells = np.zeros((N_TRIALS, grid.n_cells), np.uint8)
        self.no_ends = np.zeros((0, grid.n_cells), np.uint8)
        self.ended = np.zeros((N_TRIALS, 2))
        self.counts = np.zeros((N_TRIALS, 3), np.int32)
        self.room = make_sim_room(self.shape, self.neat, 0, np.float32)
        self.trace = make_sim_trace(self.shape, 4, -1, 1, np.float32)

    def run(self) -> None:
        """Run all trials."""
        run_sim_trials(
            self.shape,
            self.table,
            self.rules,
            self.neat,
            self.networks,
            self.which,
            np.uint64(1),
            self.counters,
            self.room,
            self.cells,
            self.no_ends,
            self.ended,
            self.counts,
            self.trace,
        )

    def rate(self, seconds: float) -> float:
        """Return the robot-steps per second of the fastest call within the given seconds."""

        def work(_: int) -> int:
            self.run()
            return N_TRIALS * N_STEPS

        return fastest_rate(work, seconds)


def _numbers(arena: Arena) -> dict[str, float]:
    robot = load_robot(DEFAULT_ROBOT).numbers()
    numbers: dict[str, float] = {}
    for name, value in {**robot, **arena.numbers()}.items():
        if name.split(".")[0] in ("body", "contact", "drive", "arena"):
            numbers[name] = value if isinstance(value, (int, float)) else value.center
    numbers |= {f"drive.{name}": value for name, value in DRIVE.items()}
    for k, (x, y, direction) in enumerate(SENSORS):
        numbers |= {f"range.{k}.x": x, f"range.{k}.y": y, f"range.{k}.direction": direction}
        numbers |= {f"range.{k}.{name}": value for name, value in RANGE.items()}
    return numbers


def _outline(numbers: dict[str, float]) -> list[tuple[float, float]]:
    xs = [name for name in numbers if name.startswith("body.0.corner.") and name.endswith(".x")]
    return [(numbers[name], numbers[f"{name[:-1]}y"]) for name in xs]


def _spread(numbers: dict[str, float]) -> dict[str, NDArray[np.float64]]:
    """Return every number but those of walls, differently for each trial."""
    rng = np.random.default_rng(1)
    spread = {}
    for name, value in numbers.items():
        part = 0.0 if name.startswith("arena.wall") else SPREAD
        spread[name] = value * (1 + part * rng.uniform(-1, 1, N_TRIALS))
    spread["arena.start.heading"] = rng.uniform(-np.pi, np.pi, N_TRIALS)
    return spread


def _networks(neat: Any, weights: tuple[tuple[float, ...], ...]) -> Networks:
    """Return a network without hidden nodes."""
    networks: Networks = make_networks(1, neat, 8, 0)
    networks.first_edge[0] = [0, 4, 8]
    networks.source[0] = [0, 1, 2, 3, 0, 1, 2, 3]
    networks.weight[0] = np.ravel(weights)
    return networks
