"""Straight walls as a body and its rays meet them, in lanes.

Jyro's rules: touching counts, parallel lines never meet. Two roads lead to the same answer. Where walls
enclose the robot in a convex shape (`is_enclosed` of the scene), a wall is a half-plane: one distance and one
direction in the body's frame say how far every point of body and rays is from it. Anywhere else a wall is a
segment, and edges of the body and rays cross it or not.
"""

from __future__ import annotations

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.lanes import LANES

FAR = 1e9  # farther than any wall [m]


@stage
def _see_plane(normal_x, normal_y, offset, pose, seen):
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    gap, along, across = seen.gap, seen.along, seen.across
    for lane in range(LANES):
        gap[lane] = normal_x * x[lane] + normal_y * y[lane] - offset
        along[lane] = normal_x * cosine[lane] + normal_y * sine[lane]
        across[lane] = normal_y * cosine[lane] - normal_x * sine[lane]


@stage
def gap_to_planes(normals, body, pose, seen, low):
    """Distance from the nearest of the body's corners to the nearest wall, below zero beyond one.

    Args:
        normals: (w, 3) unit normal into the room, offset of each wall's line.
        body: (b, 2) corners, forward and left.
        pose: Where the robots are.
        seen: Room.
        low: Written [m].
    """
    real = pose.x.dtype.type
    center, along, across = seen.gap, seen.along, seen.across
    for lane in range(LANES):
        low[lane] = real(FAR)
    for w in range(normals.shape[0]):
        _see_plane(normals[w, 0], normals[w, 1], normals[w, 2], pose, seen)
        for b in range(body.shape[0]):
            forward = body[b, 0]
            left = body[b, 1]
            for lane in range(LANES):
                gap = center[lane] + along[lane] * forward + across[lane] * left
                nearest = unmasked(low[lane])
                low[lane] = gap if gap < nearest else nearest


@stage
def sense_planes(normals, sensors, sensor_range, pose, seen, fractions, rates):
    """Compute the distance along each sensor's ray to the nearest wall, 0..1.

    Args:
        normals, pose, seen: As in `gap_to_planes`.
        sensors: (s, 4) mount forward and left, cosine and sine of its direction.
        sensor_range: [m].
        fractions: (s, LANES) written.
        rates: (s, LANES) room.
    """
    real = pose.x.dtype.type
    center, along, across = seen.gap, seen.along, seen.across
    for s in range(sensors.shape[0]):
        for lane in range(LANES):
            fractions[s, lane] = sensor_range[lane]
            rates[s, lane] = real(1.0)
    for w in range(normals.shape[0]):
        _see_plane(normals[w, 0], normals[w, 1], normals[w, 2], pose, seen)
        for s in range(sensors.shape[0]):
            forward = sensors[s, 0]
            left = sensors[s, 1]
            ahead = sensors[s, 2]
            aside = sensors[s, 3]
            for lane in range(LANES):
                facing = along[lane]
                beside = across[lane]
                gap = center[lane] + facing * forward + beside * left
                rate = -(facing * ahead + beside * aside)
                nearest = unmasked(fractions[s, lane])
                nearest_rate = rates[s, lane]
                # gap / rate < nearest / nearest_rate; a wall behind has a rate below zero
                nearer = gap * nearest_rate < nearest * rate
                fractions[s, lane] = gap if nearer else nearest
                rates[s, lane] = rate if nearer else nearest_rate
    _to_fractions(sensor_range, fractions, rates)


@stage
def _to_fractions(sensor_range, fractions, rates):
    for s in range(fractions.shape[0]):
        for lane in range(LANES):
            fractions[s, lane] = fractions[s, lane] / (rates[s, lane] * sensor_range[lane])


@stage
def _see_segment(x0, y0, x1, y1, pose, seen):
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    from_x, from_y, to_x, to_y = seen.from_x, seen.from_y, seen.to_x, seen.to_y
    for lane in range(LANES):
        dx0 = x0 - x[lane]
        dy0 = y0 - y[lane]
        dx1 = x1 - x[lane]
        dy1 = y1 - y[lane]
        from_x[lane] = dx0 * cosine[lane] + dy0 * sine[lane]
        from_y[lane] = dy0 * cosine[lane] - dx0 * sine[lane]
        to_x[lane] = dx1 * cosine[lane] + dy1 * sine[lane]
        to_y[lane] = dy1 * cosine[lane] - dx1 * sine[lane]


@stage
def touch_segments(walls, body, pose, seen, low):
    """-1 where an edge of the body has a point in common with a wall, else 1.

    Args:
        walls: (w, 4) ends of each wall.
        body, pose, seen: As in `gap_to_planes`.
        low: Written.
    """
    real = pose.x.dtype.type
    start_x, start_y, end_x, end_y = seen.from_x, seen.from_y, seen.to_x, seen.to_y
    for lane in range(LANES):
        low[lane] = real(1.0)
    for w in range(walls.shape[0]):
        _see_segment(walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3], pose, seen)
        for b in range(body.shape[0]):
            to = b + 1 if b + 1 < body.shape[0] else 0
            edge_x = body[to, 0] - body[b, 0]
            edge_y = body[to, 1] - body[b, 1]
            corner_x = body[b, 0]
            corner_y = body[b, 1]
            for lane in range(LANES):
                wall_x = end_x[lane] - start_x[lane]
                wall_y = end_y[lane] - start_y[lane]
                from_x = start_x[lane] - corner_x
                from_y = start_y[lane] - corner_y
                turn = edge_x * wall_y - edge_y * wall_x
                along_edge = from_x * wall_y - from_y * wall_x
                along_wall = from_x * edge_y - from_y * edge_x
                side = real(-1.0) if turn < real(0.0) else real(1.0)
                turn = turn * side
                along_edge = along_edge * side
                along_wall = along_wall * side
                before = unmasked(low[lane])
                hit = (
                    (turn > real(0.0))
                    & (along_edge >= real(0.0))
                    & (along_edge <= turn)
                    & (along_wall >= real(0.0))
                    & (along_wall <= turn)
                )
                low[lane] = real(-1.0) if hit else before


@stage
def sense_segments(walls, sensors, sensor_range, pose, seen, fractions, rates):
    """As `sense_planes`, for walls (w, 4) that are segments."""
    real = pose.x.dtype.type
    start_x, start_y, end_x, end_y = seen.from_x, seen.from_y, seen.to_x, seen.to_y
    for s in range(sensors.shape[0]):
        for lane in range(LANES):
            fractions[s, lane] = sensor_range[lane]
            rates[s, lane] = real(1.0)
    for w in range(walls.shape[0]):
        _see_segment(walls[w, 0], walls[w, 1], walls[w, 2], walls[w, 3], pose, seen)
        for s in range(sensors.shape[0]):
            forward = sensors[s, 0]
            left = sensors[s, 1]
            ahead = sensors[s, 2]
            aside = sensors[s, 3]
            for lane in range(LANES):
                wall_x = end_x[lane] - start_x[lane]
                wall_y = end_y[lane] - start_y[lane]
                from_x = start_x[lane] - forward
                from_y = start_y[lane] - left
                turn = ahead * wall_y - aside * wall_x
                along_ray = from_x * wall_y - from_y * wall_x
                along_wall = from_x * aside - from_y * ahead
                side = real(-1.0) if turn < real(0.0) else real(1.0)
                turn = turn * side
                along_ray = along_ray * side
                along_wall = along_wall * side
                nearest = unmasked(fractions[s, lane])
                nearest_rate = rates[s, lane]
                nearer = (
                    (turn > real(0.0))
                    & (along_ray >= real(0.0))
                    & (along_ray * nearest_rate < nearest * turn)
                    & (along_wall >= real(0.0))
                    & (along_wall <= turn)
                )
                fractions[s, lane] = along_ray if nearer else nearest
                rates[s, lane] = turn if nearer else nearest_rate
    _to_fractions(sensor_range, fractions, rates)
