"""`realitygap gap` and `realitygap plan`: measure a gap, and plan the trials for it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import realitygap
from realitygap._terminal import echo
from realitygap._wording import bracketed, counted, p_equation, reproduces
from realitygap.errors import StudyError
from realitygap.orders import ONLY_ROBOTS, GapOrder

from ._camera import CAMERA_HELP, under_camera
from ._code import AllowPlatforms
from ._json import print_json
from ._order import command_of
from ._target import attending_observer

if TYPE_CHECKING:
    from realitygap.gap import GapResult, ReplayError, Why
    from realitygap.stats import Estimate
    from realitygap.study import GapPlan


@command_of(GapOrder)
def gap(
    order: GapOrder,
    camera: Annotated[
        str | None, typer.Option(metavar="CAMERA", help=CAMERA_HELP, rich_help_panel=ONLY_ROBOTS)
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Page to write, with figures and tables (.html).")
    ] = None,
    allow_code: AllowPlatforms = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Measure the gap, print the result, and write the page."""
    if report is not None:
        realitygap.report.refuse_gap_page(report)
    from ._progress import TrialsBar

    try:
        with (
            TrialsBar(quiet=as_json) as bar,
            under_camera(
                camera,
                realitygap.world.load_arena(order.arena or "paper"),
                attending_observer(order.target, order.witness),
            ) as observer,
        ):
            found = realitygap.study.gap_between(
                order, observer=observer, allow_code=allow_code, tell=bar.show, say=bar.say
            )
    except KeyboardInterrupt:
        kept = (
            f"Finished trials are in {order.results}. Run the same command to resume."
            if order.results
            else "Nothing was saved. To save trials, add -o FILE."
        )
        echo(f"Interrupted. {kept}", err=True)
        raise typer.Exit(130) from None
    result = found.study.result
    if report is not None:
        realitygap.report.write_gap_report(found, report)
        echo(f"Written: {report}", err=True)
    if as_json:
        values: dict[str, Any] = result.to_dict() | {"order": order.record(), "report": report}
        for name, part in (("replay", found.study.replay), ("why", found.why)):
            values |= {} if part is None else {name: part.to_dict()}
        print_json(values)
        return
    _print(result, found.study.replay)
    if found.why is not None:
        _print_why(found.why)
    if report is None and sys.stdout.isatty():
        echo("With --report gap.html, the command also writes these numbers and figures as a page.")


def _print(result: GapResult, replay: ReplayError | None) -> None:

    one, other = result.trials
    echo(
        f"The transfer gap from {result.source} ({result.labels[0]}) to {result.target} ({result.labels[1]}): "
        f"{result.level.n} controllers, {one} and {other} trials each, {result.score}"
    )
    for measure in realitygap.gap.SHOWN:
        _print_row(measure.row, getattr(result, measure.name))
    if replay is not None:
        _print_row("replays off at their end [m]", replay.at_end)
    echo("Separate from the transfer gap:")
    _print_row("re-evolved gap", result.reevolved)
    _print_row("luck of selection", result.luck)
    if result.misspecified is not None:
        echo(reproduces(result.misspecified))
    for note in result.notes:
        echo(note)
    echo(result.verdict)


def _print_row(title: str, found: Estimate) -> None:
    number = "-" if found.value is None else f"{found.value:.3f}"
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
        echo(f"  {why.parts[k]:16}{fall.value:>8.3f}  {bracketed(fall):17} {counted(n, 'number')}")
    echo(why.advice)


def plan(
    effect: Annotated[
        float | None, typer.Option(metavar="D", help="Detect a mean difference D in score.")
    ] = None,
    margin: Annotated[
        float | None, typer.Option(metavar="M", help="Show equivalence within a margin M of scores.")
    ] = None,
    correlation: Annotated[
        float | None, typer.Option(metavar="R", help="Show that a correlation R is above --least.")
    ] = None,
    least: Annotated[float, typer.Option(help="Lower bound for --correlation.")] = 0.5,
    spread: Annotated[
        float | None,
        typer.Option(
            min=0,
            help="Standard deviation of true differences between platforms over controllers. [default: half of the "
            "standard deviation of the controllers]",
        ),
    ] = None,
    power: Annotated[
        float,
        typer.Option(min=0.05, max=0.999, help="Statistical power: the probability of detecting the effect."),
    ] = 0.8,
    data: Annotated[
        Path | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Recorded trials to estimate the noise from (.jsonl). [default: a pilot on sim]",
        ),
    ] = None,
    task: Annotated[str, typer.Option(metavar="KIND", help="Task that scores trials.")] = "coverage",
    arena: Annotated[str, typer.Option(metavar="NAME", help="Arena of the pilot.")] = "paper",
    allow_code: AllowPlatforms = False,
    seed: Annotated[
        int, typer.Option(min=0, max=2**31, help="Seed of the pilot and the simulated studies.")
    ] = 1,
    as_json: Annotated[bool, typer.Option("--json", help="Print the plan as JSON.")] = False,
) -> None:
    """Estimate how many controllers and trials you need.

    Numbers come from normal formulas. Simulated studies of that size give the power. For a correlation, controllers
    are added until the simulated power reaches --power.

    Example: realitygap plan --effect 0.05

    Example: realitygap plan --margin 0.05 --spread 0.03

    Example: realitygap plan --effect 0.05 --task light --arena light

    In Python: realitygap.study.plan_gap("effect", 0.05)
    """
    asked = {"effect": effect, "margin": margin, "correlation": correlation}
    given = {name: value for name, value in asked.items() if value is not None}
    if len(given) != 1:
        raise StudyError(
            f"Got {', '.join('--' + name for name in given) or 'no question'}, expected one of --effect, "
            "--margin, and --correlation. For example: realitygap plan --effect 0.05"
        )
    ((question, value),) = given.items()
    scored_by = realitygap.study.task_named(task, allow_code=allow_code)
    found = realitygap.study.plan_gap(
        question,  # type: ignore[arg-type]
        value,
        spreads=None if data is None else realitygap.study.recorded_spreads(str(data), scored_by),
        task=scored_by,
        arena=arena,
        spread=spread,
        least=least,
        power=power,
        seed=seed,
    )
    if as_json:
        asked_for = {"power": power, "score": scored_by.score_name}
        asked_for |= {"least": least} if question == "correlation" else {}
        print_json(_plan_json(found) | asked_for)
    else:
        _print_plan(found, scored_by.score_name, least, power)


def _plan_json(found: GapPlan) -> dict[str, Any]:
    return {
        "question": found.question,
        "value": found.value,
        "spread": found.spread,
        "noise": found.spreads.noise,
        "controllers_spread": found.spreads.controllers,
        "from": found.spreads.origin,
        "rows": [_needed_json(row) for row in found.needed],
        "best": None if found.best is None else _needed_json(found.best),
    }


def _needed_json(row: Any) -> dict[str, Any]:
    return {**vars(row), "trials_on_target": row.on_target}


def _print_plan(found: GapPlan, score: str, least: float, power: float) -> None:
    question = {
        "effect": f"to detect a mean difference of {found.value:g}",
        "margin": f"to show equivalence within ±{found.value:g} if there is no difference",
        "correlation": f"to show that a correlation of {found.value:g} is above {least:g}",
    }[found.question]
    echo(f"Controllers {question} in {100 * power:g} of 100 studies, in {score}")
    echo(
        f"Trials of one controller vary by {found.spreads.noise:.3f}, controllers by "
        f"{found.spreads.controllers:.3f} (standard deviations of {found.spreads.origin})"
    )
    if found.question != "correlation":
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
    if found.question == "effect":
        echo(
            "The RMS gap and the noise ceiling need at least 2 trials each: noise and gap are not separable "
            "with one."
        )
    if found.question == "correlation":
        echo(
            "A correlation is shown if it is above --least, one-sided at 5 %. `realitygap gap` prints the correlation "
            "without noise if each controller has at least 2 trials."
        )
