"""What happens to a body that meets a wall or an obstacle, in lanes."""

from __future__ import annotations

import numpy as np

from ._compile import stage
from ._lanes import LANES, fill, keep_where_low
from ._sim_rays import see_plane

FAR = 1e9  # farther than any wall [m]


@stage
def _nearer(center, along, across, forward, left, radius, low):
    for lane in range(LANES):
        gap = center[lane] + along[lane] * forward[lane] + across[lane] * left[lane] - radius[lane]
        nearest = low[lane]
        low[lane] = gap if gap < nearest else nearest


@stage
def clearance(shape, lanes, pose):
    """How far each body at `pose` is from the nearest wall [m], below zero inside one; into `lanes.low`."""
    real = lanes.low.dtype.type
    p, spare = lanes.p, lanes.spare
    fill(lanes.low, real(FAR))
    if shape.enclosed:
        for w in range(shape.n_walls):
            plane = shape.row_plane + 3 * w
            see_plane(p[plane], p[plane + 1], p[plane + 2], pose, spare[0], spare[1], spare[2])
            for part in range(shape.part_corners.size):
                first = shape.row_part[part]
                radius = first + 2 * shape.part_corners[part]
                for corner in range(first, radius, 2):
                    _nearer(spare[0], spare[1], spare[2], p[corner], p[corner + 1], p[radius], lanes.low)


@stage
def _note_stalls(low, stalled, n_stalls):
    real = low.dtype.type
    for lane in range(LANES):
        so_far = n_stalls[lane]
        hit = low[lane] <= real(0.0)
        stalled[lane] = real(1.0) if hit else real(0.0)
        n_stalls[lane] = np.int32(so_far + np.int32(1 if hit else 0))


@stage
def settle(shape, lanes):
    """Go where the step would end as far as contact allows."""
    clearance(shape, lanes, lanes.proposed)
    pose, proposed, low = lanes.pose, lanes.proposed, lanes.low
    _note_stalls(low, lanes.stalled, lanes.n_stalls)
    keep_where_low(low, pose.x, proposed.x)
    keep_where_low(low, pose.y, proposed.y)
    keep_where_low(low, pose.heading, proposed.heading)
    keep_where_low(low, pose.sine, proposed.sine)
    keep_where_low(low, pose.cosine, proposed.cosine)
