"""Which cells of a grid the steps of many trials visit, in lanes: a bit a cell.

The rules are those of `coverage.py`. A step's line is cut at the borders of rows; in each row that it meets
it visits a run of columns, which is a run of bits, however long the step.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import kernel, stage
from realitygap.kernels.math.bits import highest_bit, lowest_bit, shift_left
from realitygap.kernels.math.lanes import LANES, copy_row, words_of

LANES_PER_WORD = 32
"""Number of lanes that `list_fresh` gathers as the bits of a word; it divides `LANES`."""


@stage
def place_line(grid, x, y, line):
    """The line from where the step before ended to where this one ends, and what cutting it needs.

    Args:
        grid: (4,) the start in grid units, cells per meter, and the distance from a border that lies on it.
        x, y: Positions [m from the start].
        line: Its ends: where the step before ended; all written.
    """
    real = x.dtype.type
    from_u, from_v, to_u, to_v = line.from_u, line.from_v, line.to_u, line.to_v
    slope, shift, leftmost, rightmost = line.slope, line.shift, line.leftmost, line.rightmost
    bottom, top, at_bottom, at_top = line.bottom, line.top, line.at_bottom, line.at_top
    start_u = grid[0]
    start_v = grid[1]
    scale = grid[2]
    snap = grid[3]
    for lane in range(LANES):
        u0 = to_u[lane]
        v0 = to_v[lane]
        u1 = start_u + x[lane] * scale
        v1 = start_v + y[lane] * scale
        border_u = np.floor(u1 + real(0.5))
        border_v = np.floor(v1 + real(0.5))
        u1 = border_u if abs(u1 - border_u) < snap else u1
        v1 = border_v if abs(v1 - border_v) < snap else v1
        column0 = np.floor(u0)
        column1 = np.floor(u1)
        row0 = np.floor(v0)
        row1 = np.floor(v1)
        upward = row1 > row0
        from_u[lane] = u0
        from_v[lane] = v0
        to_u[lane] = u1
        to_v[lane] = v1
        slope[lane] = (u1 - u0) / (v1 - v0)
        shift[lane] = real(1.0) if (u1 > u0) == upward else real(0.0)
        leftmost[lane] = column0 if column0 < column1 else column1
        rightmost[lane] = column1 if column0 < column1 else column0
        bottom[lane] = row0 if upward else row1
        top[lane] = row1 if upward else row0
        at_bottom[lane] = column0 if upward else column1
        at_top[lane] = column1 if upward else column0


@stage
def _meet_border(line, border, snap):
    """The columns in which lines meet a border between rows, below and above it.

    They differ at a corner only: there a line goes on to the cell diagonally opposite. A line that passes a
    corner within `snap` goes through it.
    """
    from_u, from_v, slope, shift = line.from_u, line.from_v, line.slope, line.shift
    leftmost, rightmost, below, above = line.leftmost, line.rightmost, line.below, line.above
    real = from_u.dtype.type
    for lane in range(LANES):
        first = leftmost[lane]
        last = rightmost[lane]
        u = from_u[lane] + (border - from_v[lane]) * slope[lane]
        nearest = np.floor(u + real(0.5))
        through = abs(u - nearest) < snap
        column = nearest if through else np.floor(u)
        corner = real(1.0) if through else real(0.0)
        moved = shift[lane] * corner
        under = column - moved
        over = column - (corner - moved)
        # In this order a column that is no number, as of a line along the border, becomes a limit.
        under = under if under < last else last
        over = over if over < last else last
        below[lane] = under if under > first else first
        above[lane] = over if over > first else first


@stage
def _mark_word(line, row, first_column, last_place, visited, fresh, any_fresh):
    """Set the bits of one word of one row."""
    bottoms, tops, at_bottom, at_top = line.bottom, line.top, line.at_bottom, line.at_top
    entry, leave = line.entry, line.below
    real = bottoms.dtype.type
    for lane in range(LANES):
        bottom = bottoms[lane]
        top = tops[lane]
        lower_end = at_bottom[lane]
        upper_end = at_top[lane]
        entered = entry[lane]
        left = leave[lane]
        seen = visited[lane]
        so_far = any_fresh[lane]
        one = lower_end if bottom == row else entered
        other = upper_end if top == row else left
        first = (one if one < other else other) - first_column
        last = (other if one < other else one) - first_column
        first = first if first > real(0.0) else real(0.0)
        last = last if last < last_place else last_place
        inside = (bottom <= row) & (row <= top) & (first <= last)
        bits = np.uint32(
            shift_left(np.uint32(2), np.uint32(np.int32(last)))
            - shift_left(np.uint32(1), np.uint32(np.int32(first)))
        )
        bits = bits if inside else np.uint32(0)
        new = np.uint32(bits & np.uint32(~seen))
        visited[lane] = np.uint32(seen | new)
        fresh[lane] = new
        any_fresh[lane] = np.uint32(so_far | new)


@stage
def mark_line(line, snap, columns, rows, visited, fresh, any_fresh):
    """Note the cells on the lines of a step.

    Args:
        line: As `place_line` left it.
        snap: How near to a border is on it.
        columns, rows: Size of the grid.
        visited: (rows * words, LANES) bits, changed.
        fresh: (rows * words, LANES) written: what is new in `visited`.
        any_fresh: (LANES,) written: whether anything is.
    """
    real = line.slope.dtype.type
    words = words_of(columns)
    for lane in range(LANES):
        any_fresh[lane] = np.uint32(0)
    _meet_border(line, real(0.0), snap)
    for row in range(rows):
        copy_row(line.above, line.entry)
        _meet_border(line, real(row + 1), snap)
        for k in range(words):
            last_place = min(columns - 32 * k, 32) - 1
            _mark_word(
                line,
                real(row),
                real(32 * k),
                real(last_place),
                visited[row * words + k],
                fresh[row * words + k],
                any_fresh,
            )


@stage
def mark_ends(line, columns, rows, ends):
    """Note the cells in which steps end; arguments as in `place_line` and `mark_line`."""
    u, v = line.to_u, line.to_v
    real = u.dtype.type
    words = words_of(columns)
    for row in range(rows):
        for k in range(words):
            width = real(min(columns - 32 * k, 32))
            marks = ends[row * words + k]
            for lane in range(LANES):
                seen = marks[lane]
                place = np.floor(u[lane]) - real(32 * k)
                here = (np.floor(v[lane]) == real(row)) & (place >= real(0.0)) & (place < width)
                bit = shift_left(np.uint32(1), np.uint32(np.int32(place)))
                bit = bit if here else np.uint32(0)
                marks[lane] = np.uint32(seen | bit)


@kernel
def list_fresh(line, columns, rows, fresh, any_fresh, n_lanes, cells, first, n_line):
    """Append the cells that a step visits first, in the order in which its line meets them.

    Args:
        line, columns, rows, fresh, any_fresh: As in `mark_line`.
        n_lanes: Lanes that hold a trial.
        cells: (n, c) uint8; lane k writes to row `first` + k.
        n_line: (LANES,) how many there are, changed.
    """
    words = words_of(columns)
    for start in range(0, n_lanes, LANES_PER_WORD):
        found = np.uint32(0)
        for k in range(LANES_PER_WORD):
            bit = shift_left(np.uint32(1), np.uint32(k))
            found = np.uint32(found | (bit if any_fresh[start + k] != 0 else np.uint32(0)))
        # A processor cannot predict a branch for each lane, so the loop visits only the lanes that have new cells.
        while found != 0:
            lane = start + lowest_bit(found)
            found = np.uint32(found & np.uint32(found - np.uint32(1)))
            if lane >= n_lanes:
                break
            upward = line.to_v[lane] >= line.from_v[lane]
            rightward = line.to_u[lane] >= line.from_u[lane]
            bottom = max(int(line.bottom[lane]), 0)
            top = min(int(line.top[lane]), rows - 1)
            n = n_line[lane]
            for i in range(top - bottom + 1):
                row = bottom + i if upward else top - i
                for j in range(words):
                    k = j if rightward else words - 1 - j
                    bits = fresh[row * words + k, lane]
                    while bits != 0:
                        place = lowest_bit(bits) if rightward else highest_bit(bits)
                        bits = np.uint32(bits & np.uint32(~shift_left(np.uint32(1), np.uint32(place))))
                        cells[first + lane, n] = columns * row + 32 * k + place
                        n += 1
            n_line[lane] = n


@kernel
def count_cells(marks, lane):
    """Return the number of bits set in a lane."""
    n = 0
    for word in range(marks.shape[0]):
        bits = marks[word, lane]
        while bits != 0:
            bits = np.uint32(bits & np.uint32(bits - np.uint32(1)))
            n += 1
    return n


@kernel
def list_cells(marks, lane, columns, rows, cells):
    """Write the cells whose bits a lane has set, in the order of their numbers."""
    words = words_of(columns)
    n = 0
    for row in range(rows):
        for column in range(columns):
            if marks[row * words + (column >> 5), lane] & shift_left(np.uint32(1), np.uint32(column & 31)):
                cells[n] = columns * row + column
                n += 1
