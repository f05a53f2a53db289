"""The picture of a genome, its network from inputs to outputs as plain shapes, and its card."""

from __future__ import annotations

import math
from collections.abc import Sequence

from realitygap.drawing import Card, Disc, Ink, Line, Picture, Point, Shape, Table, Text, card_of, picture_of

from ._genome import ConnectionGene, Genome
from ._interface import given_names

NODE = 5.5  # radius of a node [pt]
_ACROSS, _HEIGHT = (
    5.2,
    3.0,
)  # from inputs to outputs, and from the first to the last input [unit of the picture]
_RADIUS = 0.15  # of a node, in the same unit where the picture is 280 pt wide


@picture_of.register(Genome)
def network_picture(
    genome: Genome,
    input_names: Sequence[str] | None = None,
    output_names: Sequence[str] | None = None,
    *,
    title: str = "Network",
    show_disabled: bool = True,
) -> Picture:
    """Return the network of a genome: inputs on the left, outputs on the right.

    The width of a link shows the size of its weight, which is printed next to it. A positive link is a solid line with
    an arrow, and a negative one is a dashed line with a bar. Disabled genes are faint and dotted.

    Args:
        genome: Genome to draw.
        input_names: Name of each input, including the constant one. Default: numbers.
        output_names: Name of each output. Default: numbers.
        title: Title of the picture.
        show_disabled: True to draw disabled genes.

    Raises:
        ValueError: Another number of names than of inputs or outputs.
    """
    names = node_names(genome, input_names, output_names)
    links = [gene for gene in genome.connections if gene.enabled or show_disabled]
    places = _places(genome, links)
    most = max((abs(gene.weight) for gene in links if gene.enabled), default=1.0) or 1.0
    shapes: list[Shape] = []
    labels: list[Shape] = []
    ends: list[tuple[bool, Line]] = []
    taken = list(places.values())
    for gene in sorted(links, key=lambda gene: (gene.enabled, -abs(gene.weight))):
        curve = _curve(places[gene.source], places[gene.target])
        if not gene.enabled:
            shapes.append(Line(tuple(curve), Ink.BODY, 0.7, (0.8, 2.2)))
            continue
        positive = gene.weight >= 0
        color = Ink.OURS if positive else Ink.PUBLISHED
        width = 0.6 + 2.8 * abs(gene.weight) / most
        shapes.append(Line(tuple(curve), color, width, () if positive else (4.5, 1.8)))
        ends.append((positive, _end(curve, color, positive=positive)))
        x, y = _label_place(curve, taken)
        taken.append((x, y))
        sign = "+" if positive else "−"
        labels.append(
            Text(
                x,
                y,
                f"{sign}{abs(gene.weight):.{1 if abs(gene.weight) >= 0.95 else 2}f}",
                6.4,
                color=color,
                halo=True,
            )
        )
    shapes += [end for positive, end in sorted(ends, key=lambda end: not end[0])]  # bars over arrows
    shapes += labels
    for node in genome.nodes:
        x, y = places[node.id]
        is_inner = node.kind == "hidden"
        shapes.append(Disc(x, y, NODE, Ink.TEXT, Ink.BAND if is_inner else Ink.GROUND, 1.2))
        side = {"output": "start", "hidden": "middle"}.get(node.kind, "end")
        shift = {"start": (9.0, 0.0), "end": (-9.0, 0.0), "middle": (0.0, 0.0)}[side]
        text = names.get(node.id, "")
        if text:
            shapes.append(Text(x, y, text, 8.0, "start" if side == "start" else "end", shift))
        if is_inner:
            shapes.append(Text(x, y, "h", 6.4))
    n_enabled = genome.n_enabled
    return Picture(
        title,
        f"{title}: {', '.join(names[node.id] for node in genome.nodes if node.kind in ('input', 'bias'))} to "
        f"{' and '.join(names[node.id] for node in genome.nodes if node.kind == 'output')}, {genome.n_hidden} hidden "
        f"{'node' if genome.n_hidden == 1 else 'nodes'}, {n_enabled} {'link' if n_enabled == 1 else 'links'}: "
        + "; ".join(
            f"{names.get(gene.source, 'hidden')} to {names.get(gene.target, 'hidden')} {gene.weight:+.2f}"
            for gene in genome.connections
            if gene.enabled
        )
        + ".",
        -1.5,
        -0.4,
        _ACROSS + 1.1,
        _HEIGHT + 0.4,
        tuple(shapes),
    )


def node_names(
    genome: Genome, input_names: Sequence[str] | None, output_names: Sequence[str] | None
) -> dict[int, str]:
    """Return the names of inputs and outputs, by id. Raise an error if the number of names is wrong."""
    rules = genome.rules
    inputs = ["bias" if k == rules.bias_input else f"input {k}" for k in range(rules.n_inputs)]
    outputs = [f"output {k}" for k in range(rules.n_outputs)]
    names = [
        *given_names("input_names", input_names or None, inputs),
        *given_names("output_names", output_names or None, outputs),
    ]
    return dict(enumerate(names))


def _places(genome: Genome, links: Sequence[ConnectionGene]) -> dict[int, Point]:
    """Return the place of each node: by its longest path from the inputs, and clear of the links of other nodes."""
    rules = genome.rules
    hidden = [node.id for node in genome.nodes if node.kind == "hidden"]
    depth = dict.fromkeys(range(rules.n_inputs), 0) | dict.fromkeys(hidden, 1)
    for _ in hidden:  # a link that leads back would go on for ever: as many rounds as nodes
        for gene in links:
            if gene.source in depth and gene.target in hidden and gene.source != gene.target:
                depth[gene.target] = min(max(depth[gene.target], depth[gene.source] + 1), len(hidden))
    last = max(depth.values(), default=0) + 1
    most = max(rules.n_inputs, rules.n_outputs)
    places: dict[int, Point] = {}
    for first, n, x in ((0, rules.n_inputs, 0.0), (rules.n_inputs, rules.n_outputs, _ACROSS)):
        step = _HEIGHT / (most - 1 if n == most and most > 1 else n)
        for k in range(n):
            places[first + k] = (x, _HEIGHT / 2 + step * ((n - 1) / 2 - k))
    for node in sorted(hidden, key=lambda node: (depth[node], node)):
        x = _ACROSS * depth[node] / last
        places[node] = max(
            ((x, _HEIGHT * k / 40.0) for k in range(-3, 44)),
            key=lambda place: _room(node, place, places, links),
        )
    return places


def _room(node: int, place: Point, places: dict[int, Point], links: Sequence[ConnectionGene]) -> float:
    """Return a score of how clear a place is: its distance to other nodes and to links that are not the node's own."""
    nearest = min(math.dist(place, other) for other in places.values())
    for gene in links:
        if node not in (gene.source, gene.target) and gene.source in places and gene.target in places:
            nearest = min(nearest, 1.6 * _distance(place, places[gene.source], places[gene.target]))
    return min(nearest, 0.75) + 0.002 * nearest


def _distance(point: Point, a: Point, b: Point) -> float:
    dx, dy = b[0] - a[0], b[1] - a[1]
    length = dx * dx + dy * dy
    part = 0.0 if length == 0 else ((point[0] - a[0]) * dx + (point[1] - a[1]) * dy) / length
    part = min(max(part, 0.0), 1.0)
    return math.dist(point, (a[0] + part * dx, a[1] + part * dy))


def _curve(a: Point, b: Point) -> list[Point]:
    """Return a curve from the rim of one node to another: straight forward, bent backward, or a loop to itself."""
    if a == b:
        turns = [math.tau * (k / 16) - math.pi / 2 for k in range(17)]
        return [(a[0] + 0.3 * math.cos(turn), a[1] + 0.45 + 0.3 * math.sin(turn)) for turn in turns[1:-1]]
    bend = 0.0 if b[0] > a[0] else 0.5
    middle = ((a[0] + b[0]) / 2, (a[1] + b[1]) / 2 + 2 * bend)
    n = 1 if bend == 0.0 else 14
    curve = []
    for k in range(n + 1):
        t = k / n
        curve.append(
            (
                (1 - t) ** 2 * a[0] + 2 * t * (1 - t) * middle[0] + t * t * b[0],
                (1 - t) ** 2 * a[1] + 2 * t * (1 - t) * middle[1] + t * t * b[1],
            )
        )
    curve[0] = _toward(curve[0], curve[1], _RADIUS)
    curve[-1] = _toward(curve[-1], curve[-2], 1.5 * _RADIUS)
    return curve


def _toward(a: Point, b: Point, distance: float) -> Point:
    part = distance / (math.dist(a, b) or 1.0)
    return (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]))


def _end(curve: list[Point], color: str, *, positive: bool) -> Line:
    """Return the end of a link: an arrow if its weight is positive, a bar if it is negative."""
    (x1, y1), (x2, y2) = curve[-2], curve[-1]
    length = math.hypot(x2 - x1, y2 - y1) or 1.0
    ux, uy = (x2 - x1) / length, (y2 - y1) / length
    if positive:
        tip = (x2 + 0.07 * ux, y2 + 0.07 * uy)
        wings = [(x2 - 0.1 * ux - s * 0.07 * uy, y2 - 0.1 * uy + s * 0.07 * ux) for s in (1, -1)]
        return Line((wings[0], tip, wings[1]), color, 0.8, closed=True, fill=color)
    return Line(((x2 - 0.11 * uy, y2 + 0.11 * ux), (x2 + 0.11 * uy, y2 - 0.11 * ux)), color, 2.0)


def _label_place(curve: list[Point], taken: Sequence[Point]) -> Point:
    """Return the place of a link's weight: near its start, where links are separate, and clear of other labels."""
    best, most = curve[0], -math.inf
    for k in range(14):
        part = 0.2 + 0.03 * k
        x, y = _along(curve, part)
        # letters are wider than high, so labels need more room at the sides than above
        clear = min(math.hypot((x - ox) / 2.2, y - oy) for ox, oy in taken)
        merit = min(clear, 0.3) - 0.12 * part
        if merit > most:
            best, most = (x, y), merit
    return best


def _along(curve: list[Point], part: float) -> Point:
    if len(curve) > 2:
        return curve[int(part * len(curve))]
    (x1, y1), (x2, y2) = curve
    return (x1 + part * (x2 - x1), y1 + part * (y2 - y1))


MOST_DRAWN = 200
"""Connections of a network that is drawn: a drawing of more is a tangle, and large."""


@card_of.register(Genome)
def genome_card(genome: Genome) -> Card:
    """Return the network of a genome, and its genes, which open."""
    n = len(genome.connections)
    lead = f"{genome.n_enabled} of {n} connections are enabled."
    rows = [
        [
            str(gene.innovation),
            f"{gene.source} → {gene.target}",
            f"{gene.weight:.4g}",
            "yes" if gene.enabled else "no",
        ]
        for gene in genome.connections
    ]
    genes = Table(["innovation", "from → to", "weight", "enabled"], rows, f"{n} genes", closed=True)
    return Card(
        repr(genome),
        lead=lead,
        parts=[picture_of(genome), genes] if n <= MOST_DRAWN else ["It is too large to be drawn.", genes],
        code=["genome.network().activate(inputs)", "genome.save('champion.json')"],
    )
