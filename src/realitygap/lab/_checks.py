"""Study files that are read and checked in their own processes, which may come from anywhere and take any time.

`Checks` is what pages use; `answer_text` runs in a process of its own.
"""

from __future__ import annotations

import contextlib
import json
import queue
import re
import threading
import time
import tomllib
from concurrent.futures import Future, InvalidStateError
from pathlib import Path
from typing import Literal, TypeVar

from realitygap.errors import RealityGapError, StudyError
from realitygap.study import Study, StudyFileError, estimate_seconds, parse_study, physical_conditions

from . import _messages as messages
from ._channel import LOOK_S, Channel
from ._child import Child
from ._files import LONGEST_TEXT, files_outside, refuse_code
from ._form import read_form, written_form

LIMIT_S = 30.0
"""How long a check may take [s]. A study of the paper takes about one, and starting Python some more."""
MOST = 4
"""Checks at a time."""
IDLE_S = 300.0
"""How long the process waits for a file [s]; the next check then starts another process."""

_LATE = (
    f"The check was stopped after {LIMIT_S:g} s; nothing was started. Reading the study, or one of its files, "
    "takes too long. Look at the files, then check again."
)


T = TypeVar("T")
TextResult = messages.TextRead | messages.TextChecked | messages.TextRefused


class Check:
    """A process that reads or checks a study file, or waits for one.

    Attributes:
        found: Its result.
        seconds: Computing time of the study on this machine [s], some time after `found`; None if it is unknown.

    Args:
        root: The lab's folder.
        allow_code: Whether Python files of tasks may run.
    """

    def __init__(self, root: Path, *, allow_code: bool) -> None:
        self.found: Future[TextResult] = Future()
        self.seconds: Future[float | None] = Future()
        self._child = Child(messages.CheckWork(str(root), allow_code), root, self._hear)

    @property
    def is_alive(self) -> bool:
        """True if its process is still running."""
        return self._child.is_alive

    def begin(self, text: messages.StudyText) -> None:
        """Do something with a text, within the time limit."""
        timer = threading.Timer(LIMIT_S, self.end, [_LATE])
        timer.daemon = True
        timer.start()
        self.seconds.add_done_callback(lambda _: timer.cancel())
        self._child.tell(text)

    def end(self, why: str = "The check was canceled.") -> None:
        """Stop it."""
        self._answer(messages.TextRefused(why))
        self._child.kill()

    def _hear(self, message: messages.Message) -> None:
        match message:
            case messages.TextChecked():  # an estimate follows
                _set(self.found, message)
            case messages.TextRead() | messages.TextRefused():
                self._answer(message)
            case messages.TimeEstimated():
                _set(self.seconds, message.seconds)
            case messages.Failure():
                self._answer(messages.TextRefused(message.text))
            case messages.Ended():
                self._answer(messages.TextRefused("The process that checks the file ended."))

    def _answer(self, result: TextResult) -> None:
        """Set what is not known yet."""
        _set(self.found, result)
        _set(self.seconds, None)


class Checks:
    """Starts checks. One process is kept ready, because starting Python takes longer than most checks.

    Args:
        root: The lab's folder.
        allow_code: Whether Python files of tasks may run.
    """

    def __init__(self, root: Path, *, allow_code: bool) -> None:
        self._root = root
        self._allow_code = allow_code
        self._lock = threading.Lock()
        self._ready: Check | None = None
        self._going: list[Check] = []

    @property
    def is_idle(self) -> bool:
        """True if nothing is read, checked, or estimated."""
        with self._lock:
            return all(check.seconds.done() for check in self._going)

    def prepare(self) -> None:
        """Have a process ready for the next check."""
        with self._lock:
            if self._ready is None or not self._ready.is_alive:
                self._ready = self._start()

    def begin(self, do: Literal["read", "check"], text: str) -> Check:
        """Read or check a study file.

        Raises:
            StudyError: The text is far too long, or several checks are running.
        """
        if len(text) > LONGEST_TEXT:
            raise StudyError(f"The file has {len(text):,} letters, expected at most {LONGEST_TEXT:,}.")
        with self._lock:
            self._going = [check for check in self._going if not check.seconds.done()]
            if len(self._going) >= MOST:
                estimating = [check for check in self._going if check.found.done()]
                if not estimating:
                    raise StudyError(f"{MOST} checks are running. Wait until one is done, or cancel it.")
                estimating[0].end()
        self.prepare()
        with self._lock:
            check, self._ready = self._ready or self._start(), None
            self._going.append(check)
        check.begin(messages.StudyText(do, text))
        self.prepare()
        return check

    def end(self) -> None:
        """End all processes."""
        with self._lock:
            ready, self._ready = self._ready, None
            going, self._going = self._going, []
        for check in [*going, *([] if ready is None else [ready])]:
            check.end()

    def _start(self) -> Check:
        return Check(self._root, allow_code=self._allow_code)


def _set(future: Future[T], value: T) -> None:
    with contextlib.suppress(InvalidStateError):
        future.set_result(value)


# in a process


def answer_text(channel: Channel, work: messages.CheckWork) -> None:
    """Wait for one file, and answer."""
    texts: queue.Queue[messages.StudyText] = queue.Queue()
    channel.at_once(messages.StudyText, texts.put)
    end = time.monotonic() + IDLE_S
    while time.monotonic() < end:
        try:
            wish = texts.get(timeout=LOOK_S)
        except queue.Empty:
            continue
        if wish.do == "read":
            channel.say(_read(wish.text))
            return
        result, study = _check(Path(work.root), wish.text, allow_code=work.allow_code)
        channel.say(result)
        if study is not None:
            channel.say(messages.TimeEstimated(_estimate(study)))
        return


def _read(text: str) -> messages.TextRead | messages.TextRefused:
    try:
        return messages.TextRead(json.loads(json.dumps(read_form(text), default=str)))
    except ValueError as error:
        return messages.TextRefused(f"This is not TOML: {error}. Expected a study file.")


def _estimate(study: Study) -> float | None:
    """Return the computing time of a study on this machine [s]; None if it cannot be told."""
    try:
        return estimate_seconds(study)
    except (RealityGapError, OSError, ValueError):
        return None  # whoever starts the study is told


def _check(
    root: Path, text: str, *, allow_code: bool
) -> tuple[messages.TextChecked, Study] | tuple[messages.TextRefused, None]:
    """Return the name and size of the study, and the study; or all mistakes in its file, and None."""
    outside: list[str] = []
    try:
        outside, allowed = files_outside(root, text)
        study = parse_study(written_form(allowed) if outside else text, str(root / "study.toml"))
        if outside:
            raise StudyFileError("", ())
        refuse_code(study, allow_code)
    except StudyFileError as error:
        places = {_place_of(mistake) for mistake in outside}
        mistakes = [*outside, *(mistake for mistake in error.mistakes if _place_of(mistake) not in places)]
        return messages.TextRefused("\n".join(mistakes), mistakes), None
    except RealityGapError as error:
        return messages.TextRefused("\n".join([*outside, str(error)]), outside), None
    except tomllib.TOMLDecodeError as error:
        return messages.TextRefused(f"This is not TOML: {error}."), None
    about, robots = study.about, physical_conditions(study)
    n_trials = about.replicates * sum(robot.neat.population * robot.neat.generations for robot in robots)
    return messages.TextChecked(about.name, len(study.conditions), about.replicates, n_trials), study


def _place_of(mistake: str) -> str:
    """Return the place of a mistake, without the name of its condition."""
    return re.sub(r"(condition\[\d+\]) '[^']*'", r"\1", mistake).partition(": ")[0]
