"""`realitygap transfer`: strategies that transfer controllers to a target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from realitygap._terminal import echo

from ._code import AllowPlatforms
from ._json import print_json

if TYPE_CHECKING:
    from realitygap.stats import Estimate
    from realitygap.study import TransferResult


def transfer(
    study: Annotated[str, typer.Argument(metavar="STUDY", help="Study by name or file. See --condition.")],
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="PLATFORM",
            help="Target: sim:FILE, twin:FILE, scribbler:PORT, thymio:PORT, ...",
        ),
    ],
    budget: Annotated[
        list[int] | None,
        typer.Option(
            min=0,
            max=4999,
            help="Trials that each strategy may spend on the target. Repeatable. [default: 20]",
        ),
    ] = None,
    strategy: Annotated[
        list[str] | None,
        typer.Option(
            help="plain, select, halving, noise, randomized, calibrated, posterior, recommended, transferability, "
            "direct or all. Repeatable. [default: all]"
        ),
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option(
            help="Condition of the study. [default: the first that selects for the score, preferably on sim]"
        ),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Existing calibration. Its trials count toward the budget. [default: calibrate first]",
        ),
    ] = None,
    observe: Annotated[
        str, typer.Option(help="Observation level for calibrating: cells, encoders or track.")
    ] = "cells",
    replicates: Annotated[
        int, typer.Option(min=1, max=1000, help="Number of replicates, each with its own evolution.")
    ] = 1,
    fresh_trials: Annotated[
        int,
        typer.Option(
            min=1,
            max=5000,
            help="Trials used to judge each champion. They don't count toward the budget.",
        ),
    ] = 20,
    runs: Annotated[int, typer.Option(min=1, help="Evolutions in simulation per replicate.")] = 100,
    repeats: Annotated[int, typer.Option(min=1, help="Trials per individual in simulation.")] = 8,
    seed: Annotated[
        int, typer.Option(min=0, max=2**63 - 1, help="Seed of all random numbers except a twin's own.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", metavar="DIR", help="Folder for trials and result. [default: results/transfer]"
        ),
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(min=1, help="Number of twin trials to run in parallel. [default: all processors]"),
    ] = None,
    witness: Annotated[
        str | None, typer.Option(metavar="HOST:PORT", help="Witness of an emulator in another program.")
    ] = None,
    allow_code: AllowPlatforms = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Compare strategies that transfer controllers.

    Controllers evolve in simulation. Each strategy then spends a few trials on the target.

    All strategies start from the same simulated evolution and may spend the same trials on the target. Separate trials
    judge the controllers that they choose. Each trial on the target is saved immediately. Run the same command again to
    resume.

    Strategy plain takes the best champion in simulation. Strategy select tries the N best champions once each, and
    halving tries them in rounds. Strategy noise evolves under the paper's three noise levels, and randomized with
    numbers sampled from ranges set by hand. Strategy calibrated evolves in the fitted simulator, and posterior with a
    robot sampled from the calibration in each trial. Strategy recommended takes the one of these that predicted
    held-out trials best, or the robot file's numbers if they did. Strategy transferability is that of Koos, Mouret &
    Doncieux (2013). Strategy direct evolves on the target.

    Example: realitygap transfer sim-paper --to twin:worn-1.toml --budget 20

    Example: realitygap transfer light --to sim:khepera --budget 10 --strategy select

    Example: realitygap transfer sim-paper --to jyro --budget 10 --strategy plain --strategy select --json

    In Python: realitygap.study.transfer("sim-paper", target, "all", 20, out="results/transfer")
    """
    from realitygap.study import choose_condition, strategy_names
    from realitygap.study import transfer as carry_out

    from ._target import opened_target

    names = strategy_names(strategy or "all")
    arena = choose_condition(study, condition, seed).arena.arena()
    folder = out or Path("results/transfer")
    try:
        with opened_target(to, arena, witness=witness, processes=processes, seed=seed) as target:
            result = carry_out(
                study,
                target,
                names,
                budget or [20],
                out=folder,
                condition=condition,
                replicates=replicates,
                fresh_trials=fresh_trials,
                runs=runs,
                repeats=repeats,
                observe=observe,  # type: ignore[arg-type]  # checked there
                calibration=calibration,
                seed=seed,
                allow_code=allow_code,
                tell=lambda text: echo(text, err=True),
            )
    except KeyboardInterrupt:
        echo("Interrupted. All trials are saved. Run the same command to resume.", err=True)
        raise typer.Exit(130) from None
    if as_json:
        about = {"score": result.score, "folder": folder, "champions_folder": folder / "champions"}
        print_json(result.to_dict() | about)
        return
    _print(result)
    echo(f"Results: {folder}   champions: {folder / 'champions'}")


def _with_interval(found: Estimate) -> str:
    ends = "" if found.low is None else f" ({found.low:.3f} to {found.high:.3f})"
    return f"{found.value:.3f}{ends}"


def _print(result: TransferResult) -> None:
    echo(
        f"{result.study}, {result.condition}: from simulation (SIM) to {result.target} ({result.label}), "
        f"{result.replicates} replicate{'s' if result.replicates > 1 else ''}, {result.fresh_trials} fresh trials "
        f"each, {result.score}"
    )
    echo(f"{'strategy':16}{'budget':>7}{'on the target':>24}{'regret':>24}{'in simulation':>15}")
    for row in result.strategies:
        quality, regret = map(_with_interval, (row.quality, row.regret))
        simulated = "-" if row.simulated is None else f"{row.simulated:.3f}"
        echo(f"{row.strategy:16}{row.budget:>7}{quality:>24}{regret:>24}{simulated:>15}")
    echo(f"Regret is to {result.best_in_words}.")
    if result.replicates == 1:
        echo("Intervals are over the fresh trials of one champion. To compare strategies, add --replicates.")
