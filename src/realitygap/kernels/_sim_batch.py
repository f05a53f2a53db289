"""Trials of the platform `sim` of which selection wants to know more: where they ended, and in which cells."""

from __future__ import annotations

from ._compile import kernel
from ._lanes import LANES
from ._marks import list_cells
from ._sim import _run_block as run_block
from ._wiring import wire


@kernel
def run_sim_batch(
    shape, table, rules, neat, networks, which, key, counters, room, cells, ends, ended, counts, trace
):
    """Carry out n trials, a block after the other; as `run_sim_trials`, but for two more arguments.

    Args:
        shape, table, rules, neat, networks, which, key, counters, room, cells, counts, trace: As there.
        ends: (n, c) uint8, written: cells at the ends of steps, in ascending order; (0, c) keeps none.
        ended: (n, 2) float64, written: where trials ended [m from the origin of the table].
    """
    for first in range(0, which.size, LANES):
        n_lanes = min(LANES, which.size - first)
        wire(networks, which, first, n_lanes, neat, room.wiring)
        run_block(shape, table, rules, neat, key, counters, first, n_lanes, room, cells, counts, trace)
        lanes = room.lanes
        for lane in range(n_lanes):
            ended[first + lane, 0] = lanes.pose.x[lane]
            ended[first + lane, 1] = lanes.pose.y[lane]
            if ends.shape[0] > 0:
                list_cells(lanes.ends, lane, shape.columns, shape.rows, ends[first + lane])
