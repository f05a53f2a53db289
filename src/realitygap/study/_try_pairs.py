"""Two controllers compared on a target, a pair of trials at a time, until one is shown to be better."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from realitygap.errors import RecordError, StudyError
from realitygap.evolution import Genome
from realitygap.gap import COVERAGE
from realitygap.orders import TryOrder, takes_order
from realitygap.platforms import open_target
from realitygap.records import Ledger, Trial
from realitygap.stats import SequentialTest
from realitygap.trials import PortObserver, TrialPlan
from realitygap.world import load_arena

from ._advise import Advice
from ._design import design_of, hold_to_design
from ._deviations import DesignReport, design_report
from ._kept_target import KeptTarget
from ._paired import CONTROLLERS, Blocks, advise_ledger
from ._targets import open_trials, refuse_more_than_is_seen
from ._try_on import genome_of


@dataclass(frozen=True)
class TriedPairs:
    """Two controllers that were compared on a platform.

    Attributes:
        target: Name of the target.
        label: Label of its trials.
        advice: What the pairs show.
        file: File with the plan and the trials.
        design: The locked design, and the deviations from it; None if there is none.
    """

    target: str
    label: str
    advice: Advice
    file: Path
    design: DesignReport | None = None


@takes_order(TryOrder)
def try_pairs(
    order: TryOrder,
    *,
    observer: PortObserver | None = None,
    tell: Callable[[Advice], None] | None = None,
    say: Callable[[str], None] | None = None,
) -> TriedPairs:
    """Compare two controllers from files on a platform, as `realitygap try GENOME --against GENOME`.

    The plan is stored in the file before the first trial: test, margin, maximum, and which of both goes first in each
    pair. The comparison ends when a difference or equivalence is shown, or at the maximum. With `lock`, the order
    follows from the hash of the locked design. With `blind`, the advice has no result by arm.

    Args:
        observer: Observer of a robot without a witness: it places the robot and reports what it drew.
        tell: Called after each pair with what is shown.
        say: Called with the hash when the design was locked.

    Raises:
        ValueError: The order has no second controller.
        StudyError: There is no such file, arena, or platform, no file for the trials, or so much cannot be seen.
        ControllerError: The platform lacks what a controller sees.
        RecordError: The file is of other controllers or another target, has a locked design that differs, or cannot be
            written.
        RobotError: The robot failed; what is in the file is safe.
    """
    if order.against is None:
        raise ValueError("against is None, expected the file of a second controller.")
    if order.out is None:
        raise StudyError(
            "A comparison is stored before its first trial. Name a file for it, such as -o pairs.sqlite."
        )
    genomes = [genome_of(path, order) for path in (order.genome, order.against)]
    names = _names(order.genome, order.against)
    if genomes[0].to_json() == genomes[1].to_json():
        raise StudyError(f"{order.genome} and {order.against} are the same controller, expected two.")
    texts = [each.to_json() for each in genomes]
    blocks = Blocks.drawn(texts, order.trials, order.seed)
    test = SequentialTest(order.alpha, order.null, order.margin)
    arena = load_arena(order.arena)
    with open_target(order.on, arena, witness=order.witness, observer=observer, key=order.seed) as target:
        refuse_more_than_is_seen(target, order.observe)
        for name, genome in zip(names, genomes, strict=True):
            if target.inputs is not None:
                genome.interface.check(target.inputs, name, target.name)
        file = open_trials(order.out, target, order.observe)
        with KeptTarget(target, file, is_exclusive=True) as kept:
            arms = list(zip(names, texts, strict=True))
            design = design_of(order, target, score=COVERAGE, arms=arms, unit="pair")
            if (
                locked := hold_to_design(file, design, lock=order.lock, blind=order.blind, say=say)
            ) is not None:
                firsts = [locked.order(block)[0] for block in range(order.trials)]
                blocks = Blocks(blocks.digests, "".join("AB"[first] for first in firsts))
            if locked is None or file.trials():
                _refuse_others(file, blocks)
            file.plan_comparison(
                {
                    "kind": CONTROLLERS,
                    "names": names,
                    "controllers": blocks.digests,
                    "order": blocks.order,
                    "maximum": order.trials,
                    "score": COVERAGE,
                    "test": test.to_dict(),
                }
            )
            _drive(kept, file, blocks, genomes, order, tell)
            return TriedPairs(target.name, target.label, advise_ledger(file), order.out, design_report(file))


def _refuse_others(file: Ledger, blocks: Blocks) -> None:
    """Raise an error if a file has another comparison, or other trials, before anything is stored.

    Raises:
        RecordError: It has.
    """
    known = file.comparison()
    if known is None:
        if file.trials():
            raise RecordError(
                f"{file.path} has trials without a comparison. Nothing was changed. Name another file (-o FILE)."
            )
        return
    there = str(known.plan.get("order", ""))
    n = min(len(there), len(blocks.order))
    if list(known.plan.get("controllers", ())) != list(blocks.digests):
        reason = "has a comparison of other controllers"
    elif there[:n] != blocks.order[:n]:
        reason = "has another order of trials, because it was begun with another --seed"
    else:
        return
    raise RecordError(f"{file.path} {reason}. Nothing was changed. Name another file (-o FILE).")


def _names(first: Path, second: Path) -> tuple[str, str]:
    """Return short names of two files that differ."""
    if first.stem != second.stem:
        return first.stem, second.stem
    return str(first), str(second)


def _drive(
    kept: KeptTarget,
    file: Ledger,
    blocks: Blocks,
    genomes: list[Genome],
    order: TryOrder,
    tell: Callable[[Advice], None] | None,
) -> None:
    """Drive incomplete blocks in their order, until something is shown."""
    while True:
        complete = blocks.complete(file)
        advice = advise_ledger(file)
        if tell is not None and complete:
            tell(advice)
        missing = [block for block in range(order.trials) if block not in complete]
        if advice.is_stop or not missing:
            return
        block = missing[0]
        _repeat_whole(file, blocks.rows(file).get(block))
        kept.read_again()
        plans = [
            TrialPlan(genome=genomes[which], steps=order.steps, number=number)
            for number, which in blocks.turns(block)
        ]
        kept.carry_out(plans, order.observe)


def _repeat_whole(file: Ledger, rows: tuple[list[Trial], list[Trial]] | None) -> None:
    """Void what counts in a block of which another trial is void, so that both are driven again.

    A block whose second trial has not begun is continued.
    """
    if rows is None:
        return
    first, second = rows
    is_continued = bool(first) and first[-1].state != "void" and not second
    if is_continued:
        return
    if not any(trial.state == "void" for trial in (*first, *second)):
        return
    for trial in (*first, *second):
        if trial.state in ("scored", "driven"):
            file.void(trial.trial, "another trial of its pair is void, so both are driven again")
