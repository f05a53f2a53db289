"""The links that join stretches of a pen's color to one trace: by the shortest tree, then between pairs of ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from realitygap.errors import from_extra

Floats = NDArray[np.float32]

STEP = 0.001  # between the points at which a trace is followed [m]
LONG = 0.12  # a stretch so long is the pen's, whatever lies between it and the others [m]
LINK_WORTH = 0.7  # a link may cost so much for each millimeter of what it joins
CLOSING = ((60.0, 0.8), (300.0, 0.5))
"""Maximum cost of a link between two ends of a trace, and of a point of it in the mean: a long one must be hidden."""

END_RADIUS = 7  # points around an end, all on one side of it
END_OFFSET = 0.38  # of that radius: how far off their middle lies; half of it at the end of a line, 0 within
CROSSING = 0.8  # what a link pays for crossing its own trace, a millimeter
LEAVING = 10  # points after which a link's direction is taken
LEAST_COSINE = 0.6  # of the angle between it and the line that it continues
BARE = 0.008  # length of its own color at the start below which its line is under others there [m]
START_RADIUS = 10  # points around the start, where a line ends by right


@dataclass(frozen=True)
class Search:
    """The cheapest path from every point to a stretch.

    Attributes:
        nodes: (n,) places of the points through which a trace can go, in a flat picture.
        before: (n,) next point on the path back; negative on a stretch.
        region: (n,) the stretch it leads to.
        rows, columns: (e,) pairs of neighboring points whose ways lead to different places on stretches.
        total: (e,) total cost of both paths.
    """

    nodes: NDArray[np.int64]
    before: NDArray[np.int32]
    source: NDArray[np.int32]
    region: NDArray[np.int32]
    rows: NDArray[np.int32]
    columns: NDArray[np.int32]
    total: NDArray[np.float64]

    def way(self, edge: int) -> NDArray[np.int64]:
        """Return places of the points of a link, from stretch to stretch."""
        ends = _back(self.before, int(self.rows[edge])), _back(self.before, int(self.columns[edge]))
        return np.asarray(self.nodes[ends[0][::-1] + ends[1]])


def joined(
    stretches: NDArray[np.int32],
    lengths: NDArray[np.float64],
    costs: Floats,
    root: int,
    start: tuple[int, int] | None = None,
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.int64]]:
    """Return the stretches of the trace, the points of the links between them, and (k, 2) ends without a link.

    The links are the shortest tree over the stretches; stretches that are not worth their link are cut off. A line has
    two ends: where there are more, those between which other ink may hide it are joined.

    Args:
        stretches: (h, w) number of each point's stretch, 0 for none.
        lengths: (1 + k,) length of each stretch [m].
        costs: (h, w) cost of a path through each point, per millimeter; inf if impossible.
        root: Stretch at the start; 0 if there is none.
        start: Row and column of the start, at which an end is allowed.

    Source: Mehlhorn (1988), a shortest tree between sets of points from one search.
    """
    n = len(lengths) - 1
    kept = np.zeros(n + 1, np.bool_)
    points = np.zeros(costs.shape, np.bool_)
    if not n:
        return kept, points, np.zeros((0, 2), np.int64)
    search = _search(stretches, costs)
    edges = _tree(search, n)
    kept, alive = _pruned(edges, lengths, root)
    for _, _, _, edge in alive:
        points.ravel()[search.way(edge)] = True
    is_bare = start is not None and lengths[root] < BARE
    ways, loose = _closing(kept[stretches], points, costs, start, is_bare=is_bare)
    for way in ways:
        points.ravel()[way] = True
    return kept, points, loose


Edge = tuple[int, int, float, int]
"""Two stretches, what the link between them costs, and its number in the search."""


def _pruned(
    edges: list[Edge], lengths: NDArray[np.float64], root: int
) -> tuple[NDArray[np.bool_], list[Edge]]:
    """Return the stretches that are worth the links to the rest, and the links between these.

    A link is worth it where all that lies beyond it, less what the links there cost, is worth more.

    Source: Johnson, Minkoff & Phillips (2000), strong pruning. Differs: a long stretch stays, whatever it costs.
    """
    neighbors: dict[int, list[tuple[int, Edge]]] = {}
    for edge in edges:
        for near, far in (edge[:2], edge[1::-1]):
            neighbors.setdefault(near, []).append((far, edge))
    kept = lengths >= LONG
    kept[root] = True
    worth = np.where(lengths >= LONG, np.inf, 1000 * LINK_WORTH * lengths)
    alive: list[Edge] = []
    reached: set[int] = set()
    for first in (root, *np.argsort(-lengths).tolist()):
        if first in reached or not kept[first]:
            continue
        order = _outwards(first, neighbors)
        reached |= {stretch for stretch, _, _ in order}
        beyond: dict[int, list[Edge]] = {}
        for stretch, before, edge in reversed(order[1:]):
            if worth[stretch] >= edge[2]:
                worth[before] += worth[stretch] - edge[2]
                beyond.setdefault(before, []).append(edge)
        for stretch, before, edge in order[1:]:
            if kept[before] and edge in beyond.get(before, []):
                kept[stretch] = True
                alive.append(edge)
    kept[0] = False
    return kept, sorted(alive)


def _outwards(first: int, neighbors: dict[int, list[tuple[int, Edge]]]) -> list[tuple[int, int, Edge]]:
    """Return the stretches of a tree from one of them on: each with that before it, and the link between the two."""
    order = [(first, 0, (0, 0, 0.0, 0))]
    seen = {first}
    for stretch, _, _ in order:
        for other, edge in neighbors.get(stretch, []):
            if other not in seen:
                seen.add(other)
                order.append((other, stretch, edge))
    return order


def _search(stretches: NDArray[np.int32], costs: Floats) -> Search:
    from scipy.sparse.csgraph import dijkstra

    graph, nodes = _graph(costs)
    label = stretches.ravel()[nodes]
    sources = np.flatnonzero(label)
    far, before, source = dijkstra(graph, indices=sources, min_only=True, return_predecessors=True)
    region = np.where(source >= 0, label[np.maximum(source, 0)], 0)
    table = graph.tocoo()
    rows, columns = table.row, table.col
    meets = (rows < columns) & (region[rows] > 0) & (region[columns] > 0) & (source[rows] != source[columns])
    meets &= (far[rows] > 0) | (far[columns] > 0)
    rows, columns = rows[meets], columns[meets]
    return Search(nodes, before, source, region, rows, columns, far[rows] + far[columns] + table.data[meets])


def _tree(search: Search, n: int) -> list[Edge]:
    """Return the shortest tree over n stretches."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import minimum_spanning_tree

    a, b = search.region[search.rows], search.region[search.columns]
    low, high = np.minimum(a, b).astype(np.int64), np.maximum(a, b).astype(np.int64)
    pair = low * (n + 1) + high
    order = np.lexsort((search.total, pair))
    order = order[low[order] != high[order]]
    first = order[np.unique(pair[order], return_index=True)[1]]
    between = coo_matrix((search.total[first] + 1e-9, (low[first], high[first])), (n + 1, n + 1))
    tree = minimum_spanning_tree(between.tocsr()).tocoo()
    number = {(int(low[k]), int(high[k])): int(k) for k in first}
    return [
        (one, other, cost, number[(min(one, other), max(one, other))])
        for one, other, cost in zip(tree.row.tolist(), tree.col.tolist(), tree.data.tolist(), strict=True)
    ]


def _closing(
    own: NDArray[np.bool_],
    links: NDArray[np.bool_],
    costs: Floats,
    start: tuple[int, int] | None,
    *,
    is_bare: bool,
) -> tuple[list[NDArray[np.int64]], NDArray[np.int64]]:
    """Return links between ends of a trace that meet under other ink, and the ends left; each has one at most.

    The trace's own points cost at least as much as a crossing; otherwise, each link would go back along the trace. If
    no visible line of the trace begins at the start, a hidden one may. Then the start is an end like others, from which
    a link may leave in any direction.
    """
    ends, outward = _ends(own | links)
    if start is not None:
        is_elsewhere = np.hypot(*(ends - start).T) > START_RADIUS
        ends, outward = ends[is_elsewhere], outward[is_elsewhere]
    n_ends = len(ends)
    if start is not None and is_bare:
        ends, outward = np.vstack([ends, start]), np.vstack([outward, (0.0, 0.0)])
    if len(ends) < 2:
        return [], ends[:n_ends]
    labels = np.zeros(own.shape, np.int32)
    labels[ends[:, 0], ends[:, 1]] = np.arange(1, len(ends) + 1)
    raised = np.where(own, np.maximum(costs, CROSSING), costs)
    search = _search(labels, raised)
    first, second = search.region[search.rows], search.region[search.columns]
    fits = np.flatnonzero((first != second) & (search.total < CLOSING[-1][0]))
    ways: list[NDArray[np.int64]] = []
    used: set[int] = set()
    tried: set[tuple[int, int]] = set()
    for edge in fits[np.argsort(search.total[fits])].tolist():
        pair = (int(first[edge]), int(second[edge]))
        if pair in tried or pair[::-1] in tried or used & set(pair):
            continue
        tried.add(pair)
        way = search.way(edge)
        points = np.column_stack([way // own.shape[1], way % own.shape[1]])
        goes_on = _goes_on(points, outward[pair[0] - 1]) and _goes_on(points[::-1], outward[pair[1] - 1])
        mean = raised.ravel()[way].mean()
        if goes_on and any(search.total[edge] < most and mean < a_point for most, a_point in CLOSING):
            ways.append(way)
            used |= set(pair)
    return ways, ends[[k for k in range(n_ends) if k + 1 not in used]]


def _goes_on(way: NDArray[np.int64], outward: NDArray[np.float64]) -> bool:
    """Return whether a path leaves the end of a line in about the direction of the line."""
    gone = way[min(LEAVING, len(way) - 1)] - way[0]
    return bool(gone @ outward >= LEAST_COSINE * np.hypot(*gone) * np.hypot(*outward))


def _ends(trace: NDArray[np.bool_]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the ends of lines, (k, 2) rows and columns, and the unit vectors along which lines would continue, (k, 2).

    A circle around an end meets the line once.
    """
    from scipy import ndimage

    cv2 = from_extra("cv2", "vision")
    side = np.arange(-END_RADIUS, END_RADIUS + 1, dtype=np.float32)
    disc = (side[:, None] ** 2 + side**2 <= END_RADIUS**2).astype(np.float32)
    line = trace.astype(np.float32)
    count = np.maximum(cv2.filter2D(line, -1, disc, borderType=cv2.BORDER_CONSTANT), 1)
    across = cv2.filter2D(line, -1, disc * side, borderType=cv2.BORDER_CONSTANT) / count
    down = cv2.filter2D(line, -1, disc * side[:, None], borderType=cv2.BORDER_CONSTANT) / count
    offset = np.where(trace, np.hypot(across, down) / END_RADIUS, 0)
    near = ndimage.binary_dilation(offset > END_OFFSET, np.ones((3, 3), np.bool_))
    labels, n = ndimage.label(near, np.ones((3, 3), np.bool_))
    peaks = ndimage.maximum_position(offset, labels, range(1, n + 1))
    ends = np.array([end for end in peaks if _times_met(trace, end) == 1], np.int64).reshape(-1, 2)
    at = ends[:, 0], ends[:, 1]
    outward = -np.column_stack([down[at], across[at]]).astype(np.float64)
    return ends, outward / np.maximum(np.hypot(*outward.T), 1e-9)[:, None]


def _times_met(trace: NDArray[np.bool_], middle: tuple[int, int]) -> int:
    """Return the number of times that a circle around a point meets a line."""
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    rows = np.round(middle[0] + END_RADIUS * np.sin(angle)).astype(int)
    columns = np.round(middle[1] + END_RADIUS * np.cos(angle)).astype(int)
    is_inside = (rows >= 0) & (rows < trace.shape[0]) & (columns >= 0) & (columns < trace.shape[1])
    met = np.zeros(len(angle), np.bool_)
    met[is_inside] = trace[rows[is_inside], columns[is_inside]]
    return int((met & ~np.roll(met, 1)).sum())


def _graph(costs: Floats) -> tuple[Any, NDArray[np.int64]]:
    """Return points through which a trace can go, joined to their eight neighbors, and their places."""
    from scipy.sparse import coo_matrix

    is_open = np.isfinite(costs)
    nodes = np.flatnonzero(is_open)
    number = np.full(costs.shape, -1)
    number.ravel()[nodes] = np.arange(len(nodes))
    parts = []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = number[: -down or None, max(0, -right) : -right if right > 0 else None]
        b = number[down:, max(0, right) : right if right < 0 else None]
        cost_a = costs[: -down or None, max(0, -right) : -right if right > 0 else None]
        cost_b = costs[down:, max(0, right) : right if right < 0 else None]
        both = (a >= 0) & (b >= 0)
        length = np.hypot(down, right) * 1000 * STEP
        parts.append((a[both], b[both], (cost_a[both] + cost_b[both]) * (length / 2)))
    rows, columns, values = (
        np.concatenate(columns_of_parts) for columns_of_parts in zip(*parts, strict=True)
    )
    graph = coo_matrix(
        (np.tile(values, 2), (np.concatenate([rows, columns]), np.concatenate([columns, rows]))),
        (len(nodes), len(nodes)),
    )
    return graph.tocsr(), nodes


def _back(before: NDArray[np.int32], node: int) -> list[int]:
    """Return the path from a point back to the stretch from which it was reached."""
    way = [int(node)]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    return way
