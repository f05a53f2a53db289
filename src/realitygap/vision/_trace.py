"""The trace of a pen: stretches of its color, joined where other ink may hide it."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

from ._links import STEP, joined
from ._pens import PenMaps
from ._pixels import to_pixels
from ._tags import Box

Floats = NDArray[np.float32]


LIKELIEST = 0.5  # the same where no other pen is more probable
PURE = 0.6  # presence from which on a point shows the pen's color
FAINTEST_STROKE = 0.08  # of a full stroke
TRUSTED = 0.05  # a stretch so long is half trusted to be the pen's [m]
LINK_TRUST = 0.8
LEFT_OUT_TRUST = 0.2  # of a stretch that is left out: it may be another pen's, or its link was not found
OF_ITSELF = (
    0.06,
    0.3,
)  # what counts of it for its own color at most: near an end that leads nowhere, and elsewhere
NEAR_END = 0.16  # [m]
GAP = 4  # points of bare paper around ink across which a trace is followed
TIMES_TOGETHER = (
    3  # that traces are followed knowing of each other: with 1, some 2 % fewer are counted within a cell
)
COSTS = {"own": 0.02, "hidden": 0.4, "other": 1.6, "paper": 1.1}  # a millimeter


@dataclass(frozen=True)
class Trace:
    """The trace of a pen, at points a millimeter apart, row 0 uppermost.

    Attributes:
        pen: Name of the pen.
        box: Area of the arrays [m].
        own: (h, w) bool, True for its color in the trace.
        links: (h, w) bool, True for its inferred path, under other ink or across a gap.
        doubt: (h, w) cost of a link per millimeter; 0 elsewhere.
        left_out: (h, w) bool, its color, in stretches too short and too far from the rest.
        presence: (h, w) probability that the ink is the pen's.
        hidden: (h, w) likelihood of the pen's ink under other ink.
        trust: (h, w) probability that it passes, before the other traces are known: higher on longer stretches.
        own_trust: (h, w) part of that for its own color; lower near an end without a link.
    """

    pen: str
    box: Box
    own: NDArray[np.bool_]
    links: NDArray[np.bool_]
    doubt: Floats
    left_out: NDArray[np.bool_]
    presence: Floats
    hidden: Floats
    trust: Floats
    own_trust: Floats


def follow_traces(maps: PenMaps, start: tuple[float, float]) -> list[Trace]:
    """Follow the traces of all pens, first separately, and then several times given the others.

    The mixture of two crossing lines may look like another pen's ink. It is not, if both lines continue on either side.
    So each trace gives information about the next, and the pass is repeated.

    Args:
        maps: Maps of `separate_pens`.
        start: Start of the trials, x and y [m].
    """
    traces = [follow_trace(maps, pen, start) for pen in range(len(maps.pens))]
    shape = maps.strength.shape
    for _ in range(TIMES_TOGETHER):
        passing = np.array([_widened(trace.trust, shape) for trace in traces])
        of_itself = np.array([_widened(trace.own_trust, shape) for trace in traces])
        knowing = maps.along(passing, of_itself)
        traces = [follow_trace(knowing, pen, start) for pen in range(len(maps.pens))]
    return traces


def _widened(trust: Floats, shape: tuple[int, ...]) -> Floats:
    """Return a trust at the maps' resolution, also for the points next to a line, (h, w)."""
    from scipy import ndimage

    cv2 = from_extra("cv2", "vision")
    wide = ndimage.maximum_filter(trust, 3)
    return np.asarray(cv2.resize(wide, (shape[1], shape[0]), interpolation=cv2.INTER_NEAREST))


def follow_trace(maps: PenMaps, pen: int, start: tuple[float, float]) -> Trace:
    """Join the visible ink of a pen to one trace that begins at the start.

    Args:
        maps: Maps of `separate_pens`.
        pen: Number of the pen.
        start: Start of the trials, x and y [m].
    """
    presence, leads, hidden, strength = _pooled(maps, pen)
    full = float(np.linalg.norm(maps.inks[pen]))
    is_likeliest = (presence > LIKELIEST) & (leads > 0.5)
    is_own = ((presence > PURE) | is_likeliest) & (strength > FAINTEST_STROKE * full)
    stretches, n_stretches, lengths = _stretches(is_own, presence)
    box = maps.box
    at = to_pixels(np.array(start), box, 1 / STEP)
    column, row = np.round(at).astype(int)
    costs = _costs(presence, hidden, strength)
    inside = 0 <= row < costs.shape[0] and 0 <= column < costs.shape[1]
    begin = None
    if inside and lengths.sum() > 0:
        begin = _nearest_ink(costs, row, column)
        if stretches[begin] == 0:
            n_stretches += 1
            stretches[begin] = n_stretches
            lengths = np.append(lengths, 0.0)
        root = int(stretches[begin])
    else:
        root = 0
    kept, links, loose = joined(stretches, lengths, costs, root, begin)
    own = is_own & kept[stretches]
    doubt = np.where(links, costs, 0).astype(np.float32)
    long = (lengths / (lengths + TRUSTED))[stretches]
    left_out = is_own & ~own
    trust = np.select([own, links, left_out], [long, LINK_TRUST, LEFT_OUT_TRUST * long], 0).astype(np.float32)
    own_trust = np.where(_is_near(loose, own.shape), *OF_ITSELF).astype(np.float32)
    return Trace(maps.pens[pen], box, own, links & ~own, doubt, left_out, presence, hidden, trust, own_trust)


def _is_near(ends: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Return the points near an end without a link, (h, w)."""
    cv2 = from_extra("cv2", "vision")
    near = np.zeros(shape, np.uint8)
    for row, column in ends.tolist():
        cv2.circle(near, (column, row), round(NEAR_END / STEP), 1, -1)
    return near > 0


def _pooled(maps: PenMaps, pen: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Return presence, links, likelihood of hidden ink, and strength of ink, at points a millimeter apart.

    A pixel at the edge of a line has a mixed color, so those in the middle of the line count.
    """
    cv2 = from_extra("cv2", "vision")
    pool = max(1, round(maps.px_per_m * STEP))
    sigma = 0.0005 * maps.px_per_m

    def mean(part: Floats) -> Floats:
        return np.asarray(cv2.GaussianBlur(part * maps.weight, (0, 0), sigma) / maps.weight_around)

    is_likeliest = (maps.presence[pen] >= maps.highest).astype(np.float32)
    means = (mean(maps.presence[pen]), mean(is_likeliest), mean(maps.hidden[pen]))
    likeliest, first, may_hide = (
        _highest(np.where(maps.smooth_strength > 0.5, part, 0), pool) for part in means
    )
    return likeliest, first, may_hide, _highest(maps.smooth_strength, pool)


def _highest(part: Floats, pool: int) -> Floats:
    """Return the highest of each pool x pool values."""
    rows, columns = part.shape[0] // pool, part.shape[1] // pool
    corners = [
        part[i : i + rows * pool : pool, k : k + columns * pool : pool]
        for i in range(pool)
        for k in range(pool)
    ]
    return np.asarray(functools.reduce(np.maximum, corners))


def _stretches(
    is_own: NDArray[np.bool_], presence: Floats
) -> tuple[NDArray[np.int32], int, NDArray[np.float64]]:
    """Return connected stretches of a color, numbered from 1, and the length of each [m]; entry 0 is what is none."""
    from scipy import ndimage

    near = ndimage.binary_dilation(is_own, np.ones((3, 3), np.bool_))
    labels, n = ndimage.label(near, np.ones((3, 3), np.bool_))
    labels = np.asarray(np.where(is_own, labels, 0), np.int32)
    areas = np.bincount(
        labels.ravel(),
        weights=(is_own * np.clip((presence - LIKELIEST) / (1 - LIKELIEST), 0, 1)).ravel(),
        minlength=n + 1,
    )
    areas[0] = 0
    return labels, int(n), np.asarray(areas * (STEP / POINTS_ACROSS), np.float64)


POINTS_ACROSS = 2.2
"""Number of points, a millimeter apart, across a line after blur and pooling."""


def _costs(presence: Floats, hidden: Floats, strength: Floats) -> Floats:
    """Return the cost of a trace through each point, per millimeter; inf if it cannot pass."""
    from scipy import ndimage

    ink = strength > 0.5
    own = np.clip(presence, 0, 1)
    may_hide = np.clip(hidden, 0, 1) ** 0.5
    costs = COSTS["other"] + (COSTS["hidden"] - COSTS["other"]) * may_hide
    costs = costs + (COSTS["own"] - costs) * own
    near = ndimage.binary_dilation(ink, iterations=GAP)
    return np.where(ink, costs, np.where(near, COSTS["paper"], np.inf)).astype(np.float32)


def _nearest_ink(costs: Floats, row: int, column: int) -> tuple[int, int]:
    """Return the point nearest to the start through which a trace can go."""
    rows, columns = np.nonzero(np.isfinite(costs))
    nearest = int(np.argmin((rows - row) ** 2 + (columns - column) ** 2))
    return int(rows[nearest]), int(columns[nearest])
