"""A gap, a calibration, and the gap again, over the same controllers and the same trials on the target."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from realitygap._limits import MOST_TABLE_BYTES, parse_toml, read_file
from realitygap._wording import change_verdict, claims, counted, platform_in_words, with_interval
from realitygap.errors import StudyError
from realitygap.gap import GapChange, measure_change
from realitygap.orders import ORDER_FILE, CalibrateOrder, CloseOrder, GapOrder, takes_order
from realitygap.platforms import base_robot_of, open_target, platform_of
from realitygap.records import refuse_links, sees, write_whole
from realitygap.trials import Pulse
from realitygap.world import Calibration, load_arena, load_robot, read_calibration

from ._calibrate.kinds import KINDS
from ._calibrate.one import refuse_other_sensors
from ._calibrate.ordered import make_calibration
from ._design import DESIGN_NAME, design_of, hold_folder_to_design
from ._deviations import check_unblinded
from ._gap.between import GapBetween, Say, gap_between
from ._gap.study import Tell
from ._targets import refuse_more_than_is_seen


@dataclass(frozen=True)
class ClosedGap:
    """A gap before and after a calibration.

    Attributes:
        before: Gap with the simulator as it was.
        after: Gap with the calibrated simulator, to the same trials on the target.
        change: After minus before.
        calibration: The calibration.
        order: The order.
    """

    before: GapBetween
    after: GapBetween
    change: GapChange
    calibration: Calibration
    order: CloseOrder

    @property
    def title(self) -> str:
        """The platforms and the calibration in words."""
        return (
            f"{self.before.study.result.title}, before and after a calibration with "
            f"{counted(self.calibration.trials, 'trial')}"
        )

    @property
    def verdict(self) -> str:
        """The effect of the calibration, and whether the calibrated simulator can be trusted."""
        before, after = self.before.study.result, self.after.study.result
        return f"{change_verdict(self.change.rms, before.rms, after.rms)} {claims(after.verdict)}"

    @property
    def main_measures(self) -> list[tuple[str, str]]:
        """Name and value of each main measure before and after, and the change of the RMS gap, in words."""
        results = (self.before.study.result, self.after.study.result)
        before, after = (
            {
                "level": with_interval(result.level),
                "RMS gap": with_interval(result.rms),
                "rank correlation": with_interval(result.srcc),
                "noise ceiling": with_interval(result.noise_ceiling),
            }
            for result in results
        )
        rows = [(name, f"{words} → {after[name]}") for name, words in before.items()]
        return [*rows, ("change in RMS gap", with_interval(self.change.rms))]


@takes_order(CloseOrder)
def close_gap(
    order: CloseOrder,
    *,
    pulse: Pulse | None = None,
    allow_code: bool = False,
    tell: Tell | None = None,
    say: Say | None = None,
) -> ClosedGap:
    """Measure a gap, calibrate the simulator, and measure the gap again, as `realitygap close`.

    Args:
        pulse: Called when a trial on a robot begins or ends, and when the robot has answered in it.
        allow_code: True to run the Python file of a task that the user has not allowed before.
        tell: Called as trials are done.
        say: Called with what is done otherwise.

    Raises:
        StudyError: The platforms, the part of the robot, and the numbers do not go together, or the folder belongs to
            another order.
        RealityGapError: The robot failed, or files cannot be read or written.
    """
    order = _adopted(_checked(order), say)
    folder = order.folder
    fit, trials = folder / "fit.toml", folder / "fit.trials.sqlite"
    gap = order.to_order(GapOrder, results=trials, lock=False)
    before = gap_between(gap, pulse=pulse, allow_code=allow_code, tell=tell, say=say)
    calibration = _calibrated(order, fit, pulse, tell, say)
    shown = before.study.shown
    after = gap_between(
        gap.model_copy(update={"sim": f"sim:{fit}"}),
        pulse=pulse,
        allow_code=allow_code,
        tell=tell,
        say=say,
        shown=None if shown is None else shown.controller,
    )
    change = measure_change(before.study.source, after.study.source, after.study.target, seed=order.seed)
    design = folder / DESIGN_NAME
    after = _with_notes(after, check_unblinded(design if design.exists() else None))
    return ClosedGap(before, after, change, calibration, order)


def _with_notes(gap: GapBetween, notes: tuple[str, ...]) -> GapBetween:
    result = gap.study.result
    return replace(gap, study=replace(gap.study, result=replace(result, notes=(*result.notes, *notes))))


def _checked(order: CloseOrder) -> CloseOrder:
    """Return the order if it can run, before a trial is spent.

    Raises:
        StudyError: It cannot.
    """
    if order.sim.partition(":")[0] != "sim":
        raise StudyError(f"close calibrates sim, but the simulator is {order.sim}. Name sim or sim:FILE.")
    if order.target.partition(":")[0] == "jyro":
        raise StudyError(
            "close cannot calibrate to jyro. Name twin:FILE, sim:FILE, or an emulated robot as target."
        )
    if order.target.partition(":")[0] == "recorded" or (
        order.witness is None and platform_of(order.target).needs_person
    ):
        raise StudyError(
            f"close drives its trials without an operator, but {platform_in_words(order.target, 'REAL')} needs one. "
            f"Use three commands: realitygap gap sim {order.target} -o gap.sqlite; realitygap calibrate {order.what} "
            f"--robot {order.target} -o fit.toml; realitygap gap sim:fit.toml {order.target} -o gap.sqlite"
        )
    kind = KINDS[order.what]
    if order.budget < kind.least:
        raise StudyError(
            f"--budget is {order.budget}, but a calibration of {order.what} needs at least {kind.least} trials."
        )
    return order


def _adopted(order: CloseOrder, say: Say | None) -> CloseOrder:
    """Return the order with its observation level, and make its folder.

    Raises:
        StudyError: The target or the calibration does not support it, or the folder belongs to another order.
        RecordError: The folder cannot be written, or has trials of before the lock.
    """
    known = KINDS[order.what].observes
    with open_target(order.target, load_arena(order.arena), witness=order.witness, processes=1) as target:
        observe = order.observe or ("track" if sees(target.observes, "track") else "cells")
        refuse_more_than_is_seen(target, observe)
        refuse_other_sensors(load_robot(_base_of(order)), target)
        if observe not in known:
            raise StudyError(
                f"{observe} alone does not identify {order.what}. Record more (--observe {' or '.join(known)})."
            )
        order = order.model_copy(update={"observe": observe})
        _adopt(order.folder, order)
        design = design_of(order, target, score=order.task or "")
        hold_folder_to_design(order.folder, target, design, lock=order.lock, say=say or (lambda _: None))
    return order


def _adopt(folder: Path, order: CloseOrder) -> None:
    """Make the folder that of the order, or see that it is.

    Raises:
        StudyError: It belongs to another order.
        RecordError: It cannot be written.
    """
    path = folder / ORDER_FILE
    refuse_links(folder, path, *(folder / name for name in ("fit.toml", "fit.trials.sqlite", "report.html")))
    if folder.exists() and not folder.is_dir():
        raise StudyError(f"{folder} is a file, expected a folder for the results. Name another with --out.")
    folder.mkdir(parents=True, exist_ok=True)
    if path.exists():
        stored = parse_toml(read_file(path, MOST_TABLE_BYTES).decode("utf-8", "replace")).get("order", {})
        now = order.record()
        other = sorted(
            name
            for name in {*stored, *now} - {"version", "processes", "margin", "lock"}  # which change no trial
            if stored.get(name) != now.get(name)
        )
        if other:
            raise StudyError(
                f"{folder} has results of other settings ({', '.join(other)}); nothing was run. Name another folder "
                "with --out."
            )
    elif any(folder.iterdir()):
        raise StudyError(f"{folder} has other files; nothing was run. Name a new or empty folder with --out.")
    write_whole(path, order.to_toml().encode(), within=folder)


def _base_of(order: CloseOrder) -> str:
    """Return the robot on whose numbers the calibration builds."""
    return order.sim.partition(":")[2] or base_robot_of(order.target)


def _calibrated(
    order: CloseOrder, fit: Path, pulse: Pulse | None, tell: Tell | None, say: Say | None
) -> Calibration:
    """Return the calibration: the one in the file if the same order made it, otherwise a new one."""
    wanted = order.to_order(CalibrateOrder, robot=order.target, out=fit, base=_base_of(order), lock=False)
    made = read_calibration(fit) if fit.exists() else None
    if made is not None and made.order == wanted.record():
        return made
    if say is not None:
        say(f"Calibrating with {counted(order.budget, 'trial')}; the fit takes up to a minute.")
    name = f"calibrating on {order.target}"
    return make_calibration(
        wanted, pulse=pulse, tell=None if tell is None else lambda done, n: tell(name, done, n)
    )
