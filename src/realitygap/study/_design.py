"""The locked design of an order: made before trial 1, kept when the order resumes, amended, and unblinded."""

from __future__ import annotations

import getpass
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from realitygap._limits import parse_json
from realitygap._version import __version__
from realitygap._wording import counted
from realitygap.errors import RecordError, StudyError, did_you_mean
from realitygap.orders import ORDERS, Order
from realitygap.records import AMENDED, RESUMED, UNBLINDED, DrivenTrial, Ledger, LockedDesign, open_ledger
from realitygap.stats import Null, SequentialTest
from realitygap.trials import Target

from ._problems import Problems
from ._study import StudySection, TrialsSection
from ._targets import open_trials

Unit = Literal["pair", "round", ""]
"""Noun for a block: one trial of each arm. Empty if the trials have no blocks."""

_FREE = ("lock", "blind", "witness", "processes")
"""Settings that decide nothing about the trials."""

DESIGN_NAME = "design.sqlite"
"""File with the design of an order whose trials are in several files of a folder."""

_EXCLUSION = {
    "pair": "A trial counts unless it is void, for a reason that does not depend on its score. Its whole pair is then "
    "driven again.",
    "round": "A trial counts unless it is void, for a reason that does not depend on its score. It is driven again.",
    "": "A trial counts unless it is void, for a reason that does not depend on its score.",
}


def digest_of(genome: str) -> str:
    """Return the SHA-256 of a controller."""
    return hashlib.sha256(genome.encode()).hexdigest()


def design_of(
    order: Order,
    target: Target,
    *,
    score: str,
    arms: Sequence[tuple[str, str]] = (),
    unit: Unit = "",
    first: int = 0,
    stride: int | None = None,
    others: Sequence[str] = (),
    more: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return all that decides which trials an order drives, and how they are judged.

    Args:
        order: The order.
        target: Target of the trials.
        score: Name of the score.
        arms: Name and genome of each controller that is compared.
        unit: Noun for a block.
        first: Number of the first trial on its platform.
        stride: Distance of the numbers of an arm from those of the next. Trial k of arm i has the number
            first + stride * i + k. None if the trials are numbered in the order in which they are driven.
        others: Genomes of controllers that are also driven, after all blocks.
        more: Further rules, as plain values.
    """
    values = order.model_dump(mode="json")
    names = {field.name: bool(field.face.refers) for field in order.fields() if not field.face.is_output}
    return {
        "command": order.command,
        "settings": {
            name: values[name] for name, refers in names.items() if not refers and name not in _FREE
        },
        "names": {name: values[name] for name, refers in names.items() if refers},
        "target": target_facts(target),
        "arms": [{"name": name, "sha256": digest_of(genome)} for name, genome in arms],
        "others": [digest_of(genome) for genome in others],
        "unit": unit,
        "first": first,
        "stride": stride,
        "score": score,
        "exclusion": _EXCLUSION[unit],
        **_rules(order, unit),
        **(more or {}),
    }


def _rules(order: Order, unit: Unit) -> dict[str, Any]:
    """Return the rules that follow from settings alone, so that an amendment of these changes them."""
    blocks = int(getattr(order, "trials", 0)) if unit else 0
    alpha: float = getattr(order, "alpha", SequentialTest().alpha)
    null: Null = getattr(order, "null", "distribution")
    margin: float | None = getattr(order, "margin", None)
    has_test = order.command in ("try", "gap") and unit
    return {
        "blocks": blocks,
        "test": SequentialTest(alpha, null, margin).to_dict() if has_test else None,
    }


def target_facts(target: Target) -> dict[str, Any]:
    """Return name, label, identity, and robot of a target, and the smallest voltage of its battery."""
    return {
        "name": target.name,
        "label": target.label,
        "identity": target.identity,
        "robot": dict(getattr(target, "robot_facts", {})),
        "least_battery_v": getattr(target, "least_battery_v", None),
    }


def hold_to_design(
    file: Ledger,
    design: Mapping[str, Any],
    *,
    lock: bool,
    blind: bool = False,
    say: Callable[[str], None] | None = None,
    who: str | None = None,
) -> LockedDesign | None:
    """Lock the design of an order before its first trial, or check that the order is the one that was locked.

    Args:
        file: File of the trials, which is closed if this raises an error.
        design: The design of the order.
        lock: True to lock it. A design that is locked already holds without it.
        blind: True to lock it blind.
        say: Called with the hash when it was locked, before trial 1, so that it can be published.
        who: Person who locks it. Default: the name of the account.

    Returns:
        The locked design; None if the order has no lock, and the file none either.

    Raises:
        StudyError: The order differs from the locked design.
        RecordError: The file has trials of before the lock, or its design was edited.
    """
    try:
        was_locked = file.design() is not None
        locked = _held(file, design, lock or blind, blind, who)
    except BaseException:
        file.close()
        raise
    if locked is not None and not was_locked and say is not None:
        say(f"Locked the design in {file.path}. SHA-256: {locked.sha256}")
    return locked


def _held(
    file: Ledger, design: Mapping[str, Any], lock: bool, blind: bool, who: str | None
) -> LockedDesign | None:
    locked = file.design()
    if locked is None:
        if not lock:
            return None
        if str(design["target"]["name"]).startswith("recorded:"):
            raise StudyError(
                "The trials of a recording were driven before, and a design is locked before the first trial."
            )
        return file.lock_design(design, who=account(who), version=__version__, is_blind=blind)
    if locked.problem:
        raise RecordError(f"{file.path}: {locked.problem}. Nothing was driven. Restore the file from a copy.")
    if blind and not locked.was_blind:
        raise StudyError(
            f"{file.path} has a locked design that is not blind. Name another file, or do not ask for blind trials."
        )
    _refuse_differences(file, locked.design, design)
    session = {"version": __version__, "target": design["target"]}
    if _plain(session) != _plain(last_session(locked)):
        locked = file.change_design(RESUMED, session)
    return locked


def hold_folder_to_design(
    folder: Path, target: Target, design: Mapping[str, Any], *, lock: bool, say: Callable[[str], None]
) -> None:
    """Lock the design of an order whose trials are in several files of a folder, or hold the order to it.

    Args:
        folder: Folder of the results, which gets the file `DESIGN_NAME`.
        target: Target of the trials.
        design: The design of the order.
        lock: True to lock it.
        say: Called with the hash when it was locked.

    Raises:
        StudyError: The order differs from the locked design.
        RecordError: The folder has trials of before the lock, or its design was edited.
    """
    path = folder / DESIGN_NAME
    if not path.exists() and not lock:
        return
    if not path.exists() and any(folder.rglob("*.sqlite")):
        raise RecordError(
            f"{folder} has trials, and a design is locked before the first one. Nothing was changed. Name another "
            "folder, or drive on without a lock."
        )
    with open_trials(path, target, "cells", within=folder) as file:
        hold_to_design(file, design, lock=lock, say=say)


def open_design(source: Path | str, *, writable: bool = True) -> Ledger:
    """Open the ledger with the design of a file, or of the folder of a study, a transfer, or a closed gap."""
    path = Path(source)
    return open_ledger(path / DESIGN_NAME if (path / DESIGN_NAME).exists() else path, writable=writable)


def refuse_lock_without_file(order: Any, file: object) -> None:
    """Raise an error if an order has a lock, and no file for the design.

    Args:
        order: An order with a field `lock`.
        file: File of its trials; None if there is none.

    Raises:
        StudyError: It has.
    """
    if (order.lock or getattr(order, "blind", False)) and file is None:
        raise StudyError(
            "A design is locked in the file of the trials, and there is none. Name one: -o FILE.sqlite"
        )


def last_session(locked: LockedDesign) -> dict[str, Any]:
    """Return the program and the target with which the trials of a design were driven last."""
    sessions = locked.of(RESUMED)
    if sessions:
        return {name: sessions[-1].details.get(name) for name in ("version", "target")}
    return {"version": locked.lock["version"], "target": locked.lock["design"].get("target")}


def _plain(value: Any) -> Any:
    return parse_json(json.dumps(value, default=str))


def _refuse_differences(file: Ledger, locked: Mapping[str, Any], design: Mapping[str, Any]) -> None:
    if [arm["sha256"] for arm in locked["arms"]] != [arm["sha256"] for arm in design["arms"]]:
        raise RecordError(
            f"{file.path} has a locked design with other controllers. Nothing was changed. Name another file."
        )
    before, after = (
        {"command": each["command"], "score": each["score"], **each["settings"]} for each in (locked, design)
    )
    # a setting that another version of the program lacks was not locked
    changed = [name for name in after if name in before and _plain(before[name]) != _plain(after[name])]
    if not changed:
        return
    listed = "; ".join(f"{name} is {after[name]}, locked: {before[name]}" for name in changed)
    pairs = [f"{name}={after[name]}" for name in changed if name in design["settings"]]
    message = (
        f"{file.path} has a locked design, and this command differs from it: {listed}. Nothing was driven. Use the "
        "locked settings."
    )
    if pairs:
        sets = " --set ".join(pairs)
        message += (
            f" Or amend the design first: realitygap trials amend {file.path} --set {sets} --reason TEXT"
        )
    raise StudyError(message)


def account(who: str | None = None) -> str:
    """Return the name of a person. Default: that of the account."""
    try:
        return who or getpass.getuser()
    except (KeyError, OSError):
        return "unknown"


# the plan


def planned_blocks(locked: LockedDesign) -> list[list[tuple[int, str]]]:
    """Return the number and the controller's SHA-256 of each trial of each block, in their order."""
    design, arms = locked.design, locked.arms
    first, stride = int(design.get("first", 0)), design.get("stride")
    blocks = []
    for k in range(int(design.get("blocks", 0))):
        order = locked.order(k)
        numbers = [
            first + (len(arms) * k + turn if stride is None else int(stride) * arm + k)
            for turn, arm in enumerate(order)
        ]
        blocks.append([(number, arms[arm]) for number, arm in zip(numbers, order, strict=True)])
    return blocks


def count_complete(ledger: Ledger, locked: LockedDesign) -> int:
    """Return the number of blocks whose trials are all scored."""
    last = {(trial.number, trial.controller): trial.state for trial in ledger.driven()}
    return sum(all(last.get(each) == "scored" for each in block) for block in planned_blocks(locked))


# changes


def amend_design(
    source: Path | str, reason: str, settings: Mapping[str, str] | None = None, *, who: str | None = None
) -> LockedDesign:
    """Log a change of a locked design, as `realitygap trials amend`.

    Args:
        source: File of trials, or folder of a study, with a locked design.
        reason: Reason for the change.
        settings: New values of settings, as text. None to log a change outside the program, such as another floor.
        who: Person who changes it. Default: the name of the account.

    Raises:
        StudyError: There is no reason, or no such setting, or the value is out of range.
        RecordError: No design is locked, or its events were edited.
    """
    with open_design(source) as ledger:
        locked = _changeable(ledger, reason)
        design = dict(locked.design)
        before = {name: design["settings"].get(name) for name in settings or {}}
        after = {name: _value(text) for name, text in (settings or {}).items()}
        for name in after:
            if name not in design["settings"]:
                raise StudyError(
                    f"The design has no setting {name!r} that can be amended. "
                    f"{did_you_mean(name, list(design['settings']))}"
                )
        if after:
            design["settings"] = {**design["settings"], **after}
            design |= _amended_rules(design)
        details = {"reason": reason.strip(), "who": account(who), "version": __version__}
        return ledger.change_design(AMENDED, {**details, "before": before, "after": after, "design": design})


def _amended_rules(design: Mapping[str, Any]) -> dict[str, Any]:
    """Return the rules of a design with new settings.

    Raises:
        OrderError: A setting is out of range.
        StudyError: A setting of a study is out of range.
    """
    model = ORDERS.get(design["command"])
    if model is None:  # of a study, whose file has the settings
        problems, settings = Problems(), design["settings"]
        study = {"name": settings["study"], "replicates": settings["replicates"]}
        trials = {name: value for name, value in settings.items() if name in TrialsSection.model_fields}
        problems.check(StudySection, study, "study")
        problems.check(TrialsSection, trials, "trials")
        if problems.lines:
            raise StudyError("\n".join(problems.lines))
        return {}
    given = {
        name: value for name, value in (design["names"] | design["settings"]).items() if value is not None
    }
    return _rules(model(**given), design["unit"])


def _value(text: str) -> Any:
    """Return a number, true, false, or none for a text that is one; otherwise the text."""
    if text == "":
        return None
    try:
        value = parse_json(text)
    except ValueError:
        return text
    return value if isinstance(value, bool | int | float | list | None) else text


def unblind_design(source: Path | str, reason: str, *, who: str | None = None) -> LockedDesign:
    """Show the results of a blind design by arm from now on, as `realitygap trials unblind`.

    The ledger gets the time, the reason, and the number of complete blocks.

    Args:
        source: File of trials with a locked design.
        reason: Reason, such as that all trials are driven.
        who: Person who unblinds it. Default: the name of the account.

    Raises:
        StudyError: There is no reason, or the design is not blind.
        RecordError: No design is locked, or its events were edited.
    """
    with open_design(source) as ledger:
        locked = _changeable(ledger, reason)
        if not locked.was_blind:
            raise StudyError(f"The design of {ledger.path} is not blind.")
        if not locked.is_blind:
            raise StudyError(f"The design of {ledger.path} was unblinded before.")
        details = {"reason": reason.strip(), "who": account(who), "version": __version__}
        return ledger.change_design(
            UNBLINDED,
            {**details, "complete": count_complete(ledger, locked), "blocks": locked.design["blocks"]},
        )


def _changeable(ledger: Ledger, reason: str) -> LockedDesign:
    if not reason.strip():
        raise StudyError("A change of a locked design needs a reason, such as: the floor was replaced.")
    locked = ledger.design()
    if locked is None:
        raise RecordError(f"{ledger.path} has no locked design. A design is locked before the first trial.")
    return locked


def driven_trials(ledger: Ledger) -> list[tuple[str, DrivenTrial]]:
    """Return the trials of a design, and a name of the file of each; empty if it is the file of the design."""
    if ledger.path.name != DESIGN_NAME:
        return [("", trial) for trial in ledger.driven()]
    trials, folder = [], ledger.path.parent
    for path in sorted(set(folder.rglob("*.sqlite")) - {ledger.path}):
        with Ledger.open(path, writable=False) as file:
            trials += [(f" in {path.relative_to(folder).as_posix()}", trial) for trial in file.driven()]
    return trials


def progress(ledger: Ledger, locked: LockedDesign) -> str:
    """Return how many blocks are complete, in words."""
    unit, blocks = locked.design.get("unit") or "", int(locked.design.get("blocks", 0))
    if not unit:
        return counted(sum(trial.state == "scored" for _, trial in driven_trials(ledger)), "scored trial")
    return f"{count_complete(ledger, locked)} of {counted(blocks, unit)} complete"
