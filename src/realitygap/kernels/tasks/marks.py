"""Which cells of a grid the steps of many trials visit, in lanes: a bit a cell.

The rules are those of `coverage.py`. A step's line is cut at the borders of rows; in each row that it meets
it visits a run of columns, which is a run of bits, however long the step.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, kernel, stage
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


@inlined
def _first_row(bottom):
    """The first row of a line that counts: its lowest one, or the row below the grid."""
    real = type(bottom)
    return bottom if bottom > real(-1.0) else real(-1.0)


@stage
def _count_rows(line, rows):
    """The most rows that a line meets, from `_first_row` on."""
    bottoms, tops = line.bottom, line.top
    real = bottoms.dtype.type
    last_row = real(rows - 1)
    most = np.int32(0)
    for lane in range(LANES):
        top = tops[lane]
        top = top if top < last_row else last_row
        n = np.int32(np.int32(top - _first_row(bottoms[lane])) + np.int32(1))
        most = n if n > most else most
    return most


@stage
def _meet_border(line, number, snap):
    """The columns in which lines meet the border above row `number` from their first one, below and above it.

    They differ at a corner only: there a line goes on to the cell diagonally opposite. A line that passes a
    corner within `snap` goes through it.
    """
    from_u, from_v, slope, shift, bottom = line.from_u, line.from_v, line.slope, line.shift, line.bottom
    leftmost, rightmost, below, above = line.leftmost, line.rightmost, line.below, line.above
    real = from_u.dtype.type
    up = real(number + 1)
    for lane in range(LANES):
        first = leftmost[lane]
        last = rightmost[lane]
        border = _first_row(bottom[lane]) + up
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
def _find_bits(line, number, rows, words, word, last_place, places, bits):
    """Find which bits of a word of row `number`, from its first one, a line sets.

    Args:
        line, rows: As in `mark_line`.
        number: Of the row.
        words, word: How many words a row has, and which one it is.
        last_place: Of the last bit of this word.
        places: (LANES,) written: number of the word among all.
        bits: (LANES,) written.
    """
    bottoms, tops, at_bottom, at_top = line.bottom, line.top, line.at_bottom, line.at_top
    entry, leave = line.entry, line.below
    real = bottoms.dtype.type
    up, last_row, first_column = real(number), real(rows - 1), real(32 * word)
    for lane in range(LANES):
        bottom = bottoms[lane]
        top = tops[lane]
        lower_end = at_bottom[lane]
        upper_end = at_top[lane]
        entered = entry[lane]
        left = leave[lane]
        row = _first_row(bottom) + up
        one = lower_end if bottom == row else entered
        other = upper_end if top == row else left
        first = (one if one < other else other) - first_column
        last = (other if one < other else one) - first_column
        first = first if first > real(0.0) else real(0.0)
        last = last if last < last_place else last_place
        # The first comparison is false if a position is no number.
        inside = (bottom <= row) & (real(0.0) <= row) & (row <= top) & (row <= last_row) & (first <= last)
        those = np.uint32(
            shift_left(np.uint32(2), np.uint32(np.int32(last)))
            - shift_left(np.uint32(1), np.uint32(np.int32(first)))
        )
        bits[lane] = those if inside else np.uint32(0)
        place = np.uint32(np.int32(row) * np.int32(words) + np.int32(word))
        places[lane] = place if inside else np.uint32(0)


@stage
def _visit(places, bits, visited, seen):
    """Set a word's bits in `visited`, lane by lane; `seen` gets those that were set before."""
    for lane in range(LANES):
        place = places[lane]
        before = visited[place, lane]
        seen[lane] = before
        visited[place, lane] = np.uint32(before | bits[lane])


@stage
def _note_fresh(bits, seen, fresh, any_fresh):
    for lane in range(LANES):
        new = np.uint32(bits[lane] & np.uint32(~seen[lane]))
        fresh[lane] = new
        any_fresh[lane] = np.uint32(any_fresh[lane] | new)


@stage
def mark_line(line, snap, columns, rows, room, visited, fresh, any_fresh):
    """Note the cells on the lines of a step.

    Most lines meet one or two rows. So each lane goes through its own rows, with a word of `visited` for each.

    Args:
        line: As `place_line` left it.
        snap: How near to a border is on it.
        columns, rows: Size of the grid.
        room: (3, LANES) uint32.
        visited: (rows * words, LANES) bits, changed.
        fresh: ((rows + 1) * words, LANES) written: what is new in `visited`, from a line's first row on.
        any_fresh: (LANES,) written: whether anything is.
    """
    real = line.slope.dtype.type
    words = words_of(columns)
    for lane in range(LANES):
        any_fresh[lane] = np.uint32(0)
    for number in range(_count_rows(line, rows)):
        copy_row(line.above, line.entry)
        _meet_border(line, number, snap)
        for k in range(words):
            last_place = real(min(columns - 32 * k, 32) - 1)
            _find_bits(line, number, rows, words, k, last_place, room[0], room[1])
            _visit(room[0], room[1], visited, room[2])
            _note_fresh(room[1], room[2], fresh[number * words + k], any_fresh)


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
            bottom = int(_first_row(line.bottom[lane]))
            n_rows = int(min(rows - 1, line.top[lane])) - bottom + 1
            n = n_line[lane]
            for i in range(n_rows):
                number = i if upward else n_rows - 1 - i
                for j in range(words):
                    k = j if rightward else words - 1 - j
                    bits = fresh[number * words + k, lane]
                    while bits != 0:
                        place = lowest_bit(bits) if rightward else highest_bit(bits)
                        bits = np.uint32(bits & np.uint32(~shift_left(np.uint32(1), np.uint32(place))))
                        cells[first + lane, n] = columns * (bottom + number) + 32 * k + place
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
