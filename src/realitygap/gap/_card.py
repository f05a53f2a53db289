"""The card of the measures of a gap, for notebooks."""

from __future__ import annotations

from collections.abc import Sequence

from realitygap.drawing import Bar, Card, Disc, Ink, Line, Picture, Shape, Table, Text, card_of
from realitygap.stats import Estimate

from ._result import SHOWN, GapResult
from ._side import GapSide


@card_of.register(GapResult)
def gap_card(result: GapResult, pictures: Sequence[Picture] = ()) -> Card:
    """Return the verdict, the main measures with their intervals, and all measures, with the reason for each refusal.

    Args:
        result: The measures.
        pictures: Drawn between the main measures and all of them.
    """
    rows: list[list[str | Bar]] = []
    for kind in (("rms", "level"), ("srcc", "noise_ceiling")):  # each pair on one axis
        estimates = [(each.title, getattr(result, each.name)) for each in SHOWN if each.name in kind]
        axis = _axis([one for _, one in estimates])
        rows += [
            [title, str(one), Bar(one.value, one.low, one.high, *axis)]
            for title, one in estimates
            if one.value is not None
        ]
    every = [
        [each.title, str(one), str(one.n), one.refused or each.meaning.format(score=result.score)]
        for each in SHOWN
        for one in (getattr(result, each.name),)
    ]
    refused = [[each.title, one.refused] for each in SHOWN if (one := getattr(result, each.name)).refused]
    return Card(
        f"Gap: {result.source} → {result.target}",
        tuple(dict.fromkeys(result.labels)),
        result.verdict,
        "The simulator cannot reproduce what was observed." if result.misspecified else "",
        parts=[
            Table(["measure", "estimate [95 % interval]", "interval"], rows),
            *pictures,
            Table(["not measured", "reason, and what is needed"], refused),
            Table(["measure", "estimate", "n", "meaning"], every, "All measures", closed=True),
            *result.notes,
        ],
    )


def _axis(estimates: Sequence[Estimate]) -> tuple[float, float]:
    """Return the ends of an axis that has 0 and all of these."""
    numbers = [value for one in estimates for value in (one.value, one.low, one.high) if value is not None]
    return min(0.0, *numbers) if numbers else 0.0, max(0.0, *numbers) if numbers else 1.0


def pairs_picture(source: GapSide, target: GapSide, score: str) -> Picture:
    """Return the mean score of each controller on the target against that in simulation, with the line of no gap."""
    pairs = [(float(x), float(y)) for x, y in zip(source.means, target.means, strict=True)]
    low, high = min(map(min, pairs)), max(map(max, pairs))
    size = (high - low) or 1.0
    low, high = low - 0.05 * size, high + 0.05 * size
    size = high - low
    shapes: list[Shape] = [
        Line(((low, low), (high, low), (high, high), (low, high)), Ink.MUTED, 0.8, closed=True),
        Line(((low, low), (high, high)), Ink.RULE, 1.2),
        *(Disc(x, y, 3.0, fill=Ink.OURS) for x, y in pairs),
    ]
    for value, text in ((low, f"{low:.2f}"), (high, f"{high:.2f}")):
        shapes.append(Text(value, low - 0.05 * size, text, 7.5, color=Ink.MUTED))
        shapes.append(Text(low - 0.02 * size, value, text, 7.5, "end", color=Ink.MUTED))
    middle = (low + high) / 2
    shapes.append(Text(middle, low - 0.11 * size, f"{score} on {source.name[:24]} ({source.label})", 8.0))
    shapes.append(
        Text(low - 0.17 * size, middle, f"{score} on {target.name[:24]} ({target.label})", 8.0, upright=True)
    )
    words = (
        f"{source.n} controllers: {score} on {source.name} across, on {target.name} up; no gap on the line."
    )
    return Picture(
        "Controllers on both platforms",
        words,
        low - 0.22 * size,
        low - 0.16 * size,
        high + 0.06 * size,
        high + 0.04 * size,
        tuple(shapes),
    )
