"""Cards of studies, gaps, and transfers, for notebooks."""

from __future__ import annotations

from realitygap.drawing import Bar, Card, Table, card_of
from realitygap.gap import gap_card, pairs_picture

from ._gap.between import GapBetween
from ._study import Study
from ._transfer.result import TransferResult


@card_of.register(Study)
def study_card(study: Study) -> Card:
    """Return the design of a study: a row for each condition."""
    rows = [
        [
            condition.name,
            condition.platform,
            condition.selection,
            str(getattr(condition.task, "name", "")),
            f"{condition.noise:g}",
            f"{condition.neat.population} × {condition.neat.generations}",
            condition.label,
        ]
        for condition in study.conditions
    ]
    heads = ["condition", "platform", "selection", "task", "noise", "individuals × generations", "label"]
    about = study.about
    return Card(
        about.title or about.name,
        study.labels,
        f"{len(rows)} conditions × {about.replicates:,} runs, seed {about.seed}. {about.note}".strip(),
        parts=[Table(heads, rows)],
        code=[f"study.run('results/{about.name}')"],
    )


@card_of.register(GapBetween)
def between_card(gap: GapBetween) -> Card:
    """Return the measures of a gap, its controllers on both platforms, and the part of each part of the model."""
    study = gap.study
    card = gap_card(study.result, [pairs_picture(study.source, study.target, study.result.score)])
    why = gap.why
    if why is None:
        return card
    rows = [[why.parts[k], str(why.falls[k]), str(why.numbers[k])] for k in why.order]
    table = Table(["part of the model", "RMS gap that it explains", "numbers"], rows)
    return Card(card.title, card.labels, card.lead, card.warning, [*card.parts, table, why.advice])


@card_of.register(TransferResult)
def transfer_card(result: TransferResult) -> Card:
    """Return quality and regret on the target by strategy and budget, with intervals."""
    ends = [
        value
        for each in result.strategies
        for value in (each.quality.value, each.quality.low, each.quality.high)
        if value is not None
    ]
    rows = []
    for each in result.strategies:
        quality = each.quality
        bar = Bar(quality.value, quality.low, quality.high, min(0.0, *ends), max(ends)) if ends else ""
        simulated = "–" if each.simulated is None else f"{each.simulated:.3f}"
        rows.append([each.strategy, f"{each.budget:,}", str(quality), bar, str(each.regret), simulated])
    heads = ["strategy", "budget", f"{result.score} on the target", "interval", "regret", "in simulation"]
    return Card(
        f"Transfer: {result.study} ({result.condition}) → {result.target}",
        [result.label],
        f"{result.replicates} replicates, {result.fresh_trials} fresh trials of each champion. Regret is to "
        f"{result.best_in_words}. Brackets are intervals of 95 %.",
        parts=[Table(heads, rows)],
    )
