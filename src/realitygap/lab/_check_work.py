"""A study file that is read or checked in its own process: it may come from anywhere and take any time."""

from __future__ import annotations

import json
import queue
import re
import time
import tomllib
from pathlib import Path
from typing import Any

from realitygap.errors import RealityGapError
from realitygap.study import Study, StudyFileError, estimate_seconds, parse_study, physical_conditions

from ._channel import LOOK_S, Channel, Message
from ._files import files_outside, refuse_code
from ._form import read_form, written_form

IDLE_S = 300.0
"""How long the process waits for a file [s]; the next check then starts another process."""


def work(channel: Channel, order: Message) -> None:
    """Wait for one file, and answer.

    Args:
        channel: To the server.
        order: `root`, the lab's folder; `allow_code` if Python files of tasks may run.
    """
    wishes: queue.Queue[Message] = queue.Queue()
    channel.at_once("read", wishes.put)
    channel.at_once("check", wishes.put)
    end = time.monotonic() + IDLE_S
    while time.monotonic() < end:
        try:
            wish = wishes.get(timeout=LOOK_S)
        except queue.Empty:
            continue
        text = str(wish["text"])
        if wish["do"] == "read":
            channel.say("found", **_read(text))
            return
        found, study = _check(Path(order["root"]), text, allow_code=bool(order.get("allow_code")))
        channel.say("found", **found)
        if study is not None:
            channel.say("estimated", seconds=_estimate(study))
        return


def _read(text: str) -> Message:
    """Return the values of the file for JSON, or the mistake."""
    try:
        return {"data": json.loads(json.dumps(read_form(text), default=str))}
    except ValueError as error:
        return {"mistakes": f"This is not TOML: {error}. Expected a study file."}


def _estimate(study: Study) -> float | None:
    """Return the computing time of a study on this machine [s]; None if it cannot be told."""
    try:
        return estimate_seconds(study)
    except (RealityGapError, OSError, ValueError):
        return None  # whoever starts the study is told


def _check(root: Path, text: str, *, allow_code: bool) -> tuple[dict[str, Any], Study | None]:
    """Return the name and size of the study, and the study; or all mistakes in its file, and None."""
    outside: list[str] = []
    try:
        outside, allowed = files_outside(root, text)
        study = parse_study(written_form(allowed) if outside else text, str(root / "study.toml"))
        if outside:
            raise StudyFileError("", ())
        refuse_code(study, allow_code)
        replicates = study.about.replicates
        trials = sum(each.neat.population * each.neat.generations for each in physical_conditions(study))
        sizes = {
            "n_conditions": len(study.conditions),
            "replicates": replicates,
            "n_trials": trials * replicates,
        }
        return {"name": study.about.name, **sizes}, study
    except StudyFileError as error:
        places = {_place_of(each) for each in outside}
        mistakes = [*outside, *(each for each in error.mistakes if _place_of(each) not in places)]
        return {"mistakes": "\n".join(mistakes), "places": mistakes}, None
    except RealityGapError as error:
        return {"mistakes": "\n".join([*outside, str(error)]), "places": outside}, None
    except tomllib.TOMLDecodeError as error:
        return {"mistakes": f"This is not TOML: {error}."}, None


def _place_of(mistake: str) -> str:
    """Return the place of a mistake, without the name of its condition."""
    return re.sub(r"(condition\[\d+\]) '[^']*'", r"\1", mistake).partition(": ")[0]
