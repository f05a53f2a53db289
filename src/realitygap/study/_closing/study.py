"""`closing-the-gap`: robots that are calibrated by a few trials. Does the simulator then predict what they do?"""

from __future__ import annotations

import json
import multiprocessing
import os
import threading
import time
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from realitygap._process import usable_processors
from realitygap.errors import RealityGapError, RobotError, from_extra
from realitygap.orders import ORDER_FILE, ClosingOrder, takes_order
from realitygap.platforms import Opening, TwinTarget, platform_of
from realitygap.records import write_whole
from realitygap.robots.twin import sample_twin
from realitygap.trials import Target

from .._calibrate.whole import calibrate_all
from .._transfer.strategies import choose_condition
from .plan import ClosingPlan, TwinName, adopt_plan, plan_of
from .rows import ClosingSummary
from .summary import summarize_closing
from .twin import ClosingTwin


@dataclass(frozen=True)
class ClosingProgress:
    """The progress of the study.

    Attributes:
        n_done: Number of finished units.
        n_units: Number of all units.
        seconds: Time since this call began [s].
    """

    n_done: int
    n_units: int
    seconds: float


@takes_order(ClosingOrder)
def closing_the_gap(
    order: ClosingOrder,
    *,
    plan: ClosingPlan | None = None,
    tell: Callable[[ClosingProgress], None] | None = None,
) -> ClosingSummary:
    """Run the study, or the missing parts of it, and summarize it; as `realitygap closing-the-gap`.

    Each twin is drawn from its family into a file, which only the process that simulates it reads. The held-out
    controllers are tried on it; the simulator is calibrated by each budget of trials and way to observe, and judged by
    these controllers; and what evolves in it is transferred to the twin. Each of these is a file of its own, written
    whole: interrupt it at any moment, and the same call goes on.

    The plan may also be a `ClosingPlan`, which replaces the other settings of the plan. `closing_the_gap("folder",
    plan)` is short for `closing_the_gap(out="folder", plan=plan)`.

    Args:
        tell: Called with the progress, now and then.

    Returns:
        The summary, which is in `summary.json` of the folder as well: see `summarize_closing`.

    Raises:
        StudyError: There is no such plan, family, or observation level, or a number is out of its range.
        RecordError: The folder holds another plan.
        MissingExtraError: MuJoCo is not installed.
    """
    folder = order.folder
    processes = order.processes or usable_processors()
    chosen = plan or plan_of(order)
    adopt_plan(folder, chosen)
    if plan is None:
        write_whole(folder / ORDER_FILE, order.to_toml().encode(), within=folder)
    return _run(folder, chosen, processes, tell)


def _run(
    folder: Path, plan: ClosingPlan, processes: int, tell: Callable[[ClosingProgress], None] | None
) -> ClosingSummary:
    """Run what is missing in a folder."""
    _write_twins(folder, plan)
    since = time.perf_counter()

    def show() -> None:
        if tell is not None:
            tell(ClosingProgress(n_done(folder, plan), plan.n_units, time.perf_counter() - since))

    show()
    missing = [name for name in plan.names if any(not path.exists() for path in _paths(folder, plan, name))]
    if processes == 1:
        for name in missing:
            _carry_out(plan, name, folder, show)
    else:
        _carry_out_apart(plan, missing, folder, processes, show)
    show()
    summary = summarize_closing(folder)
    write_whole(folder / "summary.json", json.dumps(summary, indent=2).encode(), within=folder)
    return summary


def n_done(folder: Path, plan: ClosingPlan) -> int:
    """Return the number of finished units."""
    return sum(path.exists() for name in plan.names for path in _paths(folder, plan, name))


def _paths(folder: Path, plan: ClosingPlan, name: TwinName) -> Iterable[Path]:
    return [folder / "units" / f"{name}-{unit}.json" for unit in plan.units(name)]


def _twin_path(folder: Path, name: TwinName) -> Path:
    return folder / "twins" / f"{name}.toml"


def _write_twins(folder: Path, plan: ClosingPlan) -> None:
    """Write the file of each twin, unless it exists."""
    for name in plan.names:
        if name.family in plan.platforms:
            continue
        model = sample_twin(name.family, name.seed)
        if model.engine == "mujoco":
            from_extra("mujoco", "twin")
        path = _twin_path(folder, name)
        if not path.exists():
            write_whole(path, model.to_toml().encode(), within=folder)


def _carry_out(
    plan: ClosingPlan, name: TwinName, folder: Path, show: Callable[[], None] | None = None
) -> None:
    """Run one twin in this process; the twin itself is in another."""

    def open_twin() -> Target:
        condition = choose_condition(plan.study, None, plan.seed)
        arena, step_s = condition.arena.arena(), condition.on.command_s
        spec = plan.platforms.get(name.family)
        if spec is None:
            return TwinTarget(str(_twin_path(folder, name)), arena, 1, name=f"twin:{name}")
        return platform_of(spec).at_pace(step_s).open(arena, Opening(spec, step_s=step_s))

    ClosingTwin(plan, name, folder, open_twin, calibrate_all, lambda _: show and show()).carry_out()


def _carry_out_apart(
    plan: ClosingPlan, names: list[TwinName], folder: Path, processes: int, show: Callable[[], None]
) -> None:
    """Run twins in parallel processes; if this process ends, they end, too."""
    context = multiprocessing.get_context("spawn")
    left = list(names)
    under_way: list[tuple[Any, Connection]] = []
    try:
        while left or under_way:
            while left and len(under_way) < processes:
                ours, theirs = context.Pipe(duplex=False)
                process = context.Process(target=_report, args=(theirs, plan, left.pop(0), folder))
                process.start()
                theirs.close()
                under_way.append((process, ours))
            # the time-out lets Ctrl-C through on every system, and shows what is done
            wait([ours for _, ours in under_way], timeout=1.0)
            show()
            for process, ours in under_way[:]:
                if ours.poll():
                    under_way.remove((process, ours))
                    _end(process, ours)
    finally:
        for process, _ in under_way:
            process.terminate()


def _report(pipe: Connection, plan: ClosingPlan, name: TwinName, folder: Path) -> None:
    """Run one twin in a separate process, which sends its error, or None."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    problem: BaseException | None = None
    try:
        _carry_out(plan, name, folder)
    except BaseException as error:
        if not isinstance(error, RealityGapError):
            error.add_note(traceback.format_exc())  # the pipe carries no traceback
        problem = error
    pipe.send(problem)


def _end_with_parent() -> None:
    """End this process with its parent, so that no other process writes to the folder."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def _end(process: Any, pipe: Connection) -> None:
    """Take what a process sent; raise it where that is an error."""
    try:
        problem = pipe.recv()
    except EOFError:
        problem = RobotError(f"The process of a twin ended (status {process.exitcode}) before it was done.")
    process.join()
    if problem is not None:
        raise problem
