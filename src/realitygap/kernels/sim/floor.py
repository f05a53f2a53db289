"""The floor under line sensors: its brightness from an image and from tape, and what a sensor makes of it.

Brightness is 0 (black) to 1 (white). The image is one for all trials of a call; a sensor sees one point of it,
between the four nearest pixels in proportion. Beyond the image the floor goes on as at its edge. Tape lies on the
image, later pieces on earlier ones.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import stage
from realitygap.kernels.math.bits import unmasked
from realitygap.kernels.math.elementary import normal
from realitygap.kernels.math.lanes import LANES


@stage
def place_point(mount_x, mount_y, pose, to_x, to_y):
    """Compute the position of a point of the body in the arena [m]."""
    x, y, sine, cosine = pose.x, pose.y, pose.sine, pose.cosine
    for lane in range(LANES):
        to_x[lane] = x[lane] + mount_x[lane] * cosine[lane] - mount_y[lane] * sine[lane]
        to_y[lane] = y[lane] + mount_x[lane] * sine[lane] + mount_y[lane] * cosine[lane]


@stage
def sample_image(image, grid, x, y, brightness):
    """Brightness of an image at points, from the four nearest pixels.

    Args:
        image: (h, w) brightness of each pixel; row 0 is the lowest in y. No pixels: white.
        grid: (3,) x and y of its lower left corner [m], pixels per meter.
        x, y: (LANES,) [m].
        brightness: Written.
    """
    real = brightness.dtype.type
    height, width = image.shape
    if height == 0 or width == 0:
        for lane in range(LANES):
            brightness[lane] = real(1.0)
    else:
        left, bottom, scale = real(grid[0]), real(grid[1]), real(grid[2])
        most_u, most_v = real(width - 1), real(height - 1)
        for lane in range(LANES):
            u = (x[lane] - left) * scale - real(0.5)
            v = (y[lane] - bottom) * scale - real(0.5)
            u = u if u < most_u else most_u
            u = u if u > real(0.0) else real(0.0)
            v = v if v < most_v else most_v
            v = v if v > real(0.0) else real(0.0)
            column, row = np.int32(u), np.int32(v)
            next_column = column + 1 if column + 1 < width else column
            next_row = row + 1 if row + 1 < height else row
            part_u, part_v = u - real(column), v - real(row)
            low, low_next = real(image[row, column]), real(image[row, next_column])
            high, high_next = real(image[next_row, column]), real(image[next_row, next_column])
            below = low + (low_next - low) * part_u
            above = high + (high_next - high) * part_u
            brightness[lane] = below + (above - below) * part_v


@stage
def _lay(x1, y1, x2, y2, half, tape_brightness, x, y, brightness):
    real = brightness.dtype.type
    along_x, along_y = real(x2 - x1), real(y2 - y1)
    start_x, start_y = real(x1), real(y1)
    square = along_x * along_x + along_y * along_y
    per_length = real(1.0) / (square if square > real(0.0) else real(1.0))
    reach = real(half) * real(half)
    there = real(tape_brightness)
    for lane in range(LANES):
        dx = x[lane] - start_x
        dy = y[lane] - start_y
        part = (dx * along_x + dy * along_y) * per_length
        part = part if part < real(1.0) else real(1.0)
        part = part if part > real(0.0) else real(0.0)
        off_x = dx - part * along_x
        off_y = dy - part * along_y
        before = unmasked(brightness[lane])
        brightness[lane] = there if off_x * off_x + off_y * off_y <= reach else before


@stage
def lay_tape(tapes, x, y, brightness):
    """Brightness of tape where points are on it: within half its width of its middle line, ends rounded.

    Args:
        tapes: (k, 6) float64: both ends [m], width [m], brightness.
        x, y: (LANES,) [m].
        brightness: Changed.
    """
    for k in range(tapes.shape[0]):
        _lay(
            tapes[k, 0],
            tapes[k, 1],
            tapes[k, 2],
            tapes[k, 3],
            0.5 * tapes[k, 4],
            tapes[k, 5],
            x,
            y,
            brightness,
        )


@stage
def answer_line(brightness, threshold, noise, word, as_level, reading):
    """1 where the floor is dark, else 0; or how dark it is.

    Robots compare brightness with a threshold: below it is a line.

    Args:
        brightness: (LANES,) 0..1.
        threshold: On the same scale.
        noise: Standard deviation that is added to the brightness.
        word: Random.
        as_level: Answer 1 - brightness, limited to 0..1, and compare nothing.
        reading: Written.
    """
    real = reading.dtype.type
    for lane in range(LANES):
        seen = brightness[lane] + noise[lane] * normal(word[lane], noise[lane])
        level = real(1.0) - seen
        level = level if level < real(1.0) else real(1.0)
        level = level if level > real(0.0) else real(0.0)
        dark = real(1.0) if seen < threshold[lane] else real(0.0)
        reading[lane] = level if as_level else dark
