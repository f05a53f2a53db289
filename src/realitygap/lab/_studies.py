"""The studies in a folder, and how far each is."""

from __future__ import annotations

import contextlib
import difflib
import os
import re
import socket
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from realitygap._limits import read_file
from realitygap.errors import RealityGapError, StudyError
from realitygap.platforms import is_physical
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, complete_runs
from realitygap.runs import NAME_PATTERN
from realitygap.settings import shown

from ._figure_cache import has_thumbnail, read_rows

LABELS = ("SIM", "TWIN", "EMULATED", "REAL")
LATELY_S = 0.8
"""Largest age of the state that pages show [s]."""
PATIENCE_S = 3.0
"""Maximum time that a page waits for the state of one study [s]. A file of somebody else may take longer to read."""
_HOLDER = re.compile(r"process (\d{1,9}) on (.+)")
_LONGEST_HOLDER = 1000
"""Largest size of a lock's text [bytes]."""


@dataclass(frozen=True)
class ConditionState:
    """A condition at one moment: its runs, those that are complete, and its label, empty if unknown."""

    name: str
    n_runs: int
    n_done: int
    label: str = ""


@dataclass(frozen=True)
class StudyState:
    """A study's folder at one moment.

    Attributes:
        name: Of its folder.
        title, note: What it says of itself.
        n_runs, n_done: Simulated runs in all, and those published.
        n_driven_runs, n_driven_done: Runs of conditions that a robot drives, and those complete.
        replicates: Runs of each condition.
        conditions: The conditions, in the order of the study.
        trials: How many trials of the ledger are in each state.
        used_by: The program that writes to it now, as it calls itself; empty where none does.
        labels: Labels of its conditions, such as SIM; that of a robot from its first trial on.
        medians: Median best coverage of each condition, in the order of the study, as its figures show it; empty
            before they were drawn.
        has_thumbnail: Whether there is a small picture of its best path.
        has_report: Whether there is a report.
        problem: Why it cannot be read; empty otherwise.
    """

    name: str
    title: str = ""
    note: str = ""
    n_runs: int = 0
    n_done: int = 0
    n_driven_runs: int = 0
    n_driven_done: int = 0
    replicates: int = 1
    conditions: tuple[ConditionState, ...] = ()
    trials: dict[str, int] = field(default_factory=dict)
    used_by: str = ""
    labels: tuple[str, ...] = ()
    medians: tuple[float, ...] = ()
    has_thumbnail: bool = False
    has_report: bool = False
    problem: str = ""

    @property
    def is_complete(self) -> bool:
        """True if all runs are there."""
        return not self.problem and self.done == (self.n_runs, self.n_driven_runs)

    @property
    def has_robot(self) -> bool:
        """True if a robot drives some of its conditions."""
        return self.n_driven_runs > 0

    @property
    def n_all_done(self) -> int:
        """Number of published runs, simulated and driven."""
        return self.n_done + self.n_driven_done

    @property
    def n_all(self) -> int:
        """Number of runs, simulated and driven."""
        return self.n_runs + self.n_driven_runs

    @property
    def done(self) -> tuple[int, int]:
        """Number of published runs: simulated, and driven."""
        return self.n_done, self.n_driven_done

    @property
    def share(self) -> float:
        """Share of its runs that are published, 0 to 1."""
        return self.n_all_done / max(self.n_all, 1)


class Studies:
    """The studies in the lab's folder; nothing outside it is opened.

    Args:
        root: Their folder.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._open: dict[str, ResultsFolder] = {}
        self._looks: dict[str, _Look] = {}
        self._lock = threading.Lock()
        self._looking = threading.Lock()

    def names(self) -> list[str]:
        """Return the names of all studies, the last one changed first."""
        studies = []
        with contextlib.suppress(OSError):
            for path in self.root.iterdir():
                changed = _changed(path) if self.has(path.name) else None
                if changed is not None:
                    studies.append((changed, path.name))
        return [name for _, name in sorted(studies, reverse=True)]

    def has(self, name: str) -> bool:
        """Return whether there is a study of this name."""
        path = self.root / name
        if re.fullmatch(NAME_PATTERN, name) is None:
            return False
        try:
            return (path / "study.json").is_file() and path.resolve().parent == self.root
        except (OSError, RuntimeError):  # a folder that cannot be entered, or links in a circle
            return False

    def path(self, name: str) -> Path:
        """The folder of a study.

        Raises:
            StudyError: There is none of this name.
        """
        if not self.has(name):
            raise StudyError(f"There is no study named {shown(name)} in this folder.")
        return self.root / name

    def new_path(self, name: str) -> Path:
        """Return the folder for a new study of this name.

        Raises:
            StudyError: The name cannot be had.
        """
        path = self.root / name
        if not re.fullmatch(NAME_PATTERN, name):
            raise StudyError(
                f"A study cannot be named {shown(name)}: expected letters, digits, '.', '-' and '_'."
            )
        if path.exists():
            raise StudyError(
                f"There is a folder {name!r} already. Choose another name, or resume that study."
            )
        return path

    def results(self, name: str) -> ResultsFolder:
        """The results of a study, as they are now."""
        path = self.path(name)
        with self._lock:
            known = self._open.get(name)
            if known is None or known.description != ResultsFolder.open(path).description:
                known = self._open[name] = ResultsFolder.open(path)
            return known

    def state(self, name: str) -> StudyState:
        """Read the state of a study."""
        try:
            return _state(name, self.results(name))
        except (RealityGapError, OSError, KeyError, TypeError, ValueError) as error:
            problem = (str(error) or repr(error)).replace(f"{self.root}{os.sep}", "")
            return StudyState(name, title=name, problem=problem)

    def states(self) -> list[StudyState]:
        """Return the recent states of all studies."""
        return [self.lately(name) for name in self.names()]

    def lately(self, name: str) -> StudyState:
        """Return the recent state of a study; all pages share one look at its folder.

        A study whose folder takes long to read gets its last known state, so that no other study waits for it.
        """
        with self._looking:
            look = self._looks.get(name)
            if look is None or look.is_old:
                look = self._looks[name] = _Look(self, name, look.state if look is not None else None)
        look.is_over.wait(PATIENCE_S)
        return look.state

    def forget(self, name: str) -> None:
        """Forget the state of a study, so that its folder is read again."""
        with self._looking:
            self._looks.pop(name, None)

    def nearest(self, name: str) -> list[str]:
        """Return the names that are most like a name, at most three."""
        return difflib.get_close_matches(name, self.names(), n=3, cutoff=0.0)


class _Look:
    """One look at the folder of a study, in a separate thread.

    Attributes:
        state: The state; the one before while the folder is being read.
        is_over: Set when the state is that of the folder.
    """

    def __init__(self, studies: Studies, name: str, before: StudyState | None) -> None:
        self.state = before or StudyState(
            name,
            title=name,
            problem="This study is still being read. Wait, or restore its ledger from a copy.",
        )
        self.is_over = threading.Event()
        self._ended = 0.0
        threading.Thread(target=self._read, args=(studies, name), daemon=True).start()

    def _read(self, studies: Studies, name: str) -> None:
        self.state = studies.state(name)
        self._ended = time.monotonic()
        self.is_over.set()

    @property
    def is_old(self) -> bool:
        """True if it is time for another look."""
        return self.is_over.is_set() and time.monotonic() - self._ended >= LATELY_S


def _changed(path: Path) -> float | None:
    """Return when a study was changed [s]; None if it is not there any more."""
    try:
        return max((path / "study.json").stat().st_mtime, path.stat().st_mtime)
    except OSError:
        return None


def _state(name: str, folder: ResultsFolder) -> StudyState:
    described = folder.description
    replicates = int(described["replicates"])
    driven = [each["name"] for each in described["conditions"] if _is_driven(each)]
    simulated = [each["name"] for each in described["conditions"] if not _is_driven(each)]
    n_each = {each: replicates - sum(map(len, folder.missing(each, replicates))) for each in simulated}
    ledger = _read_ledger(folder.path / LEDGER_NAME, driven, replicates)
    labels = {each.get("label") for each in described["conditions"]} | ledger.labels
    n_done = sum(n_each.values())
    n_each |= ledger.n_complete
    n_driven_done = sum(ledger.n_complete.values())
    rows = read_rows(folder.path, (n_done, n_driven_done))
    return StudyState(
        name=name,
        title=str(described.get("title") or name),
        note=str(described.get("note") or ""),
        n_runs=replicates * len(simulated),
        n_done=n_done,
        n_driven_runs=replicates * len(driven),
        n_driven_done=n_driven_done,
        replicates=replicates,
        conditions=tuple(
            ConditionState(
                each["name"], replicates, n_each.get(each["name"], 0), str(each.get("label") or "")
            )
            for each in described["conditions"]
        ),
        trials=ledger.trials,
        used_by=used_by(folder.path),
        labels=tuple(sorted(set(LABELS).intersection(labels))),
        medians=tuple(float(row["line_median"]) for row in rows or () if row["line_median"] is not None),
        has_thumbnail=has_thumbnail(folder.path),
        has_report=(folder.path / "report.html").is_file(),
    )


def _is_driven(condition: dict[str, Any]) -> bool:
    return is_physical(condition["settings"])


@dataclass(frozen=True)
class _LedgerState:
    """Complete runs of a ledger by condition, its trials in each state, and the labels of robots that drove."""

    n_complete: dict[str, int] = field(default_factory=dict)
    trials: dict[str, int] = field(default_factory=dict)
    labels: frozenset[str | None] = frozenset()


def _read_ledger(path: Path, conditions: list[str], replicates: int) -> _LedgerState:
    if not path.exists():
        return _LedgerState()
    with Ledger.open(path, writable=False) as ledger:
        return _LedgerState(
            {name: sum(run < replicates for run in complete_runs(ledger, name)) for name in conditions},
            dict(Counter(trial.state for trial in ledger.trials())),
            frozenset(condition["label"] for condition in ledger.conditions().values()),
        )


def used_by(folder: Path) -> str:
    """The program that says in the folder's lock that it writes there, where it is still alive; else empty."""
    try:
        program = read_file(folder / ".lock", _LONGEST_HOLDER, plain=True).decode("utf-8").strip()
    except (OSError, UnicodeDecodeError):
        return ""
    match = _HOLDER.fullmatch(program)
    if match is None or match[2] != socket.gethostname():
        return program
    return program if _is_alive(int(match[1])) else ""


def _is_alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
