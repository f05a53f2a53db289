"""`realitygap gap`, `close`, and `plan`: measure a gap, close it, and plan the trials for it."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import bracketed, counted, p_equation, reproduces
from realitygap.orders import CloseOrder, GapOrder, PlanOrder

from ._code import AllowPlatforms
from ._observer import CameraOfRobots, measuring, needs_operator
from ._options import Json, ShowPage, print_json
from ._order import command_of
from ._progress import TrialsBar, resumable
from ._results import print_finding, show_page

if TYPE_CHECKING:
    from realitygap.gap import GapResult, ReplayError, Why
    from realitygap.stats import Estimate, Needed, PlannedPairs
    from realitygap.study import ClosedGap, GapPlan


@command_of(GapOrder)
def gap(
    order: GapOrder,
    camera: CameraOfRobots = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page to write, with figures and tables (.html).")
    ] = None,
    full: Annotated[bool, typer.Option("--full", help="Print all measures.")] = False,
    allow_code: AllowPlatforms = False,
    as_json: Json = False,
) -> None:
    """Measure the gap, print the result, and write the page."""
    if report is not None:
        realitygap.report.refuse_gap_page(report)
    with measuring(order, camera, quiet=as_json) as how:
        found = realitygap.study.gap_between(order, allow_code=allow_code, **how)
    result = found.study.result
    if report is not None:
        realitygap.report.write_gap_report(found, report)
        echo(f"Written: {report}", err=True)
    if as_json:
        values: dict[str, Any] = result.to_dict() | {"order": order.record(), "report": report}
        for name, part in (("replay", found.study.replay), ("why", found.why)):
            values |= {} if part is None else {name: part.to_dict()}
        if found.study.advice is not None:
            values |= {"looks": found.study.advice.to_dict()}
        print_json(values)
        return
    if full:
        _print_all(result, found.study.replay)
    else:
        _print(result, result)
    if found.study.advice is not None:
        echo(f"Looks after each round: {found.study.advice.line}")
    if found.why is not None:
        _print_why(found.why)
    elif not full:
        echo(_next(order, report))


@command_of(CloseOrder)
def close(
    order: CloseOrder, allow_code: AllowPlatforms = False, as_json: Json = False, open_page: ShowPage = False
) -> None:
    """Measure, calibrate, measure again, print both gaps, and write the page."""
    folder = order.folder
    with resumable(folder / "fit.trials.sqlite"), TrialsBar(quiet=as_json) as bar:
        closed = realitygap.study.close_gap(order, allow_code=allow_code, tell=bar.show, say=bar.say)
    page = realitygap.report.write_closed_gap(closed, folder / "report.html")
    before, after = closed.before.study.result, closed.after.study.result
    if as_json:
        values: dict[str, Any] = {
            "before": before.to_dict(),
            "after": after.to_dict(),
            "change": closed.change.to_dict(),
        }
        values |= {"verdict": closed.verdict, "folder": folder, "report": page}
        print_json(values | {"order": closed.order.record()})
        return
    _print(closed, after)
    echo("The fit has seen none of these trials.")
    echo(f"Page: {page}. Calibrated simulator: sim:{shlex.quote(str(folder / 'fit.toml'))}")
    if open_page:
        show_page(page)


def _print(shown: GapResult | ClosedGap, result: GapResult) -> None:
    """Print title, verdict, and main measures; labels, n, and notes of a result."""
    title = f"Gap in {result.score}: {shown.title}"
    basis = f"{' and '.join(dict.fromkeys(result.labels))}, {result.basis}, 95 % intervals"
    print_finding(title, shown.verdict, shown.main_measures, basis, *result.notes)


def _next(order: GapOrder, report: Path | None) -> str:
    """Return how to get more of this result, and the command that may follow."""
    words = f"All measures: --full. {'Page: --report gap.html' if report is None else f'Page: {report}'}."
    if order.sim != "sim" or not order.can_close or needs_operator(order.target, order.witness):
        return words
    return f"{words} Next: realitygap {shlex.join(order.to_order(CloseOrder).words())}"


def _print_all(result: GapResult, replay: ReplayError | None) -> None:
    """Print all measures."""
    one, other = result.trials
    echo(
        f"The transfer gap from {result.source} ({result.labels[0]}) to {result.target} ({result.labels[1]}): "
        f"{result.level.n} controllers, {one} and {other} trials each, {result.score}"
    )
    for measure in realitygap.gap.SHOWN:
        print_row(measure.row, getattr(result, measure.name))
    if replay is not None:
        print_row("replays off at their end [m]", replay.at_end)
    echo("Separate from the transfer gap:")
    print_row("re-evolved gap", result.reevolved)
    print_row("luck of selection", result.luck)
    if result.misspecified is not None:
        echo(reproduces(result.misspecified))
    for note in result.notes:
        echo(note)
    echo(result.verdict)


def print_row(title: str, found: Estimate) -> None:
    """Print a measure with its interval, and the reason if one of them is missing."""
    number = "–" if found.value is None else f"{found.value:.3f}".replace("-", "−")
    p = found.more.get("p")
    more = "" if p is None else p_equation(p)
    echo(f"  {title:32}{number:>8}  {bracketed(found):17} {more}".rstrip())
    if found.refused:
        echo(f"    {found.refused}")


def _print_why(why: Why) -> None:
    echo(
        f"Why: RMS gap {why.before} with the robot's defaults, {why.after} with the fit. Contributions to the "
        "fall:"
    )
    for k in why.order:
        fall, n = why.falls[k], why.numbers[k]
        value = f"{fall.value:.3f}".replace("-", "−")
        echo(f"  {why.parts[k]:16}{value:>8}  {bracketed(fall):17} {counted(n, 'number')}")
    echo(why.advice)


@command_of(PlanOrder)
def plan(order: PlanOrder, allow_code: AllowPlatforms = False, as_json: Json = False) -> None:
    """Plan, and print the table."""
    found = realitygap.study.plan_gap(order, allow_code=allow_code)
    if as_json:
        print_json(_plan_json(found))
    else:
        _print_plan(found)


def _plan_json(found: GapPlan) -> dict[str, Any]:
    order = found.order
    values = {
        "question": order.question,
        "value": order.value,
        "spread": found.spread,
        "noise": found.spreads.noise,
        "controllers_spread": found.spreads.controllers,
        "from": found.spreads.origin,
        "rows": [_needed_json(row) for row in found.needed],
        "best": None if found.best is None else _needed_json(found.best),
        "power": order.power,
        "score": found.score,
        "order": order.record(),
    }
    if found.pairs is not None:
        values |= {"pairs": vars(found.pairs)}
    return values | ({"least": order.least} if order.question == "correlation" else {})


def _needed_json(row: Needed) -> dict[str, Any]:
    return {**vars(row), "trials_on_target": row.on_target}


def _print_plan(found: GapPlan) -> None:
    order = found.order
    if found.pairs is not None:
        _print_pairs(found, found.pairs)
        return
    question = {
        "effect": f"to detect a mean difference of {order.value:g}",
        "margin": f"to show equivalence within ±{order.value:g} if there is no difference",
        "correlation": f"to show that a correlation of {order.value:g} is above {order.least:g}",
    }[order.question]
    echo(f"Controllers {question} in {100 * order.power:g} of 100 studies, in {found.score}")
    echo(
        f"Trials of one controller vary by {found.spreads.noise:.3f}, controllers by "
        f"{found.spreads.controllers:.3f} (standard deviations of {found.spreads.origin})"
    )
    if order.question != "correlation":
        echo(f"Assumed: true differences of controllers vary by {found.spread:.3f} (--spread)")
    echo(f"{'trials each':>12}{'controllers':>13}{'on the target':>15}{'detected in simulations':>30}")
    for row in found.needed:
        if row.controllers is None or row.power is None:
            echo(f"{row.trials:>12}{'over 100,000':>13}")
            continue
        share = f"{row.power:.2f} [{row.low:.2f}, {row.high:.2f}]"
        echo(f"{row.trials:>12}{row.controllers:>13,}{row.on_target:>15,}{share:>30}")
    if found.best is not None:
        echo(
            f"Minimum number of trials on the target: {found.best.on_target:,}, by {found.best.controllers:,} "
            f"controllers with {found.best.trials} each."
        )
    else:
        most = realitygap.study.MOST_CONTROLLERS
        echo(f"`realitygap gap` takes at most {most:,} controllers, fewer than each of these plans needs.")
    if order.question == "effect":
        echo(
            "The RMS gap and the noise ceiling need at least 2 trials each: noise and gap are not separable "
            "with one."
        )
    if order.question == "correlation":
        echo(
            "A correlation is shown if it is above --least, one-sided at 5 %. `realitygap gap` prints the correlation "
            "without noise if each controller has at least 2 trials."
        )


def _print_pairs(found: GapPlan, pairs: PlannedPairs) -> None:
    order = found.order
    echo(
        f"Pairs of trials of two controllers to detect a mean difference of {order.value:g}, in {found.score}\n"
        f"Trials of one controller vary by {found.spreads.noise:.3f} (standard deviation of {found.spreads.origin})"
    )
    if pairs.fixed is None or pairs.quantile is None or pairs.mean is None or pairs.power is None:
        echo("A paired t test needs over 100,000 pairs.")
        return
    echo(f"{'design':24}{'median':>8}{'mean':>8}{'80 %':>8}{'worst case':>12}{'detected':>10}")
    fixed = f"{pairs.fixed:>8,}"
    echo(f"{'fixed, one t test':24}{fixed}{fixed}{fixed}{pairs.fixed:>12,}{order.power:>10.2f}")
    echo(
        f"{'sequential, any looks':24}{pairs.median:>8,}{pairs.mean:>8,.0f}{pairs.quantile:>8,}{pairs.maximum:>12,}"
        f"{pairs.power:>10.2f}"
    )
    level = "" if order.alpha == PlanOrder.model_fields["alpha"].default else f" --alpha {order.alpha:g}"
    echo(
        f"The sequential test stops early if the difference is larger. Drive it with: realitygap try A.json --against "
        f"B.json --on PLATFORM --trials {pairs.maximum}{level} -o pairs.sqlite"
    )
