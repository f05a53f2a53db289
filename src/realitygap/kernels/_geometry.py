"""Where straight lines meet: the only geometry that walls, bodies and rays need.

Jyro's rules hold: touching counts, parallel lines never meet. Its rounding to seven decimals is left out. That
rounding moves a crossing by 1e-7 m or so where two lines meet at a wide angle, the more the flatter they meet,
and calls nearly parallel lines parallel; `_scene.py` repeats it, for cases that must equal Jyro.
"""

from __future__ import annotations

import math

from ._compile import kernel


@kernel
def segments_touch(ax, ay, bx, by, cx, cy, dx, dy):
    """Whether segment AB has a point in common with segment CD; never, when they are parallel."""
    rx = bx - ax
    ry = by - ay
    sx = dx - cx
    sy = dy - cy
    turn = rx * sy - ry * sx
    if turn == 0.0:
        return False
    qx = cx - ax
    qy = cy - ay
    along_ab = (qx * sy - qy * sx) / turn
    along_cd = (qx * ry - qy * rx) / turn
    return 0.0 <= along_ab <= 1.0 and 0.0 <= along_cd <= 1.0


@kernel
def ray_fraction(px, py, qx, qy, cx, cy, dx, dy):
    """How far along the ray from P to Q segment CD is met, 0..1; inf when it is not, or runs parallel."""
    rx = qx - px
    ry = qy - py
    sx = dx - cx
    sy = dy - cy
    turn = rx * sy - ry * sx
    if turn == 0.0:
        return math.inf
    ox = cx - px
    oy = cy - py
    along_ray = (ox * sy - oy * sx) / turn
    along_wall = (ox * ry - oy * rx) / turn
    if 0.0 <= along_ray <= 1.0 and 0.0 <= along_wall <= 1.0:
        return along_ray
    return math.inf
