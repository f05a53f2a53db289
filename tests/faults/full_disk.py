"""A disk that is full after k more pages, for commands that write: one message, nothing lost, equal after a repeat.

The disk is a file system in memory, mounted where only this process sees it (Linux). A filler leaves k pages free.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import io
import os
import random
import shutil
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from realitygap.cli import main
from realitygap.records import LEDGER_NAME, Ledger, ResultsFolder, read_observations, trial_to_dict
from realitygap.runs import prepare_kernels
from realitygap.study import load_study
from tests.study.physical import SMALL, scored

from .forked import run_forked, text_of

SIZE_MIB = 64
CLONE_NEWNS, CLONE_NEWUSER = 0x00020000, 0x10000000
MS_REC, MS_PRIVATE, MNT_DETACH = 0x4000, 0x40000, 2


class Write(NamedTuple):
    """A command that writes to a folder.

    Attributes:
        command: Its arguments, with `{}` for the folder.
        result: What it made, equal after a repeat.
        kept: Parts of it that stay as they are from the moment when they are written.
    """

    command: str
    result: Callable[[Path], str]
    kept: Callable[[Path], dict[str, str]]


def _nothing(path: Path) -> dict[str, str]:
    return {}


def _digest(path: Path) -> str:
    return ResultsFolder.open(path / "run").digest()


def _file(name: str) -> Callable[[Path], str]:
    return lambda path: hashlib.sha256((path / name).read_bytes()).hexdigest()


def _chunks(path: Path) -> dict[str, str]:
    return {
        file.name: hashlib.sha256(file.read_bytes()).hexdigest()
        for file in (path / "run" / "trials").glob("*.parquet")
    }


def _scored(path: Path) -> dict[str, str]:
    if not (path / "physical" / LEDGER_NAME).exists():
        return {}
    with Ledger.open(path / "physical" / LEDGER_NAME) as ledger:
        return {str(trial.trial): str(trial.cells) for trial in ledger.trials(states=["scored"])}


def _trials(path: Path) -> dict[str, str]:
    """Return the trials of a gap that count."""
    if not (path / "gap.sqlite").exists():
        return {}
    trials = read_observations(path / "gap.sqlite").trials
    return {f"{trial.number} {trial.genome}": str(trial_to_dict(trial)) for trial in trials}


def _without_date(text: str) -> str:
    return "\n".join(line for line in text.splitlines() if not line.startswith("date"))


PORT = "emulator://s2?fluke=1&speed=off"
WRITES = {
    "run": Write("run paper --replicates 2 --chunk 1 --threads 1 --out {}/run", _digest, _chunks),
    "ledger": Write(
        f"drive small.toml --port {PORT} --no-wait --out {{}}/physical",
        lambda path: str(scored(path / "physical")),
        _scored,
    ),
    "report": Write("report whole --out {}/report.html", _file("report.html"), _nothing),
    "figures": Write(
        "report whole --out {}/report.html --figures {}/figures",
        lambda path: str(sorted(file.name for file in (path / "figures").iterdir())),
        _nothing,
    ),
    "gap": Write(
        "gap sim jyro --n-controllers 3 --trials 2 -o {}/gap.sqlite",
        lambda path: str(sorted(_trials(path).items())),
        _trials,
    ),
    "calibrate": Write(
        "calibrate path --from measured.trials.sqlite -o {}/path.toml",
        lambda path: _without_date((path / "path.toml").read_text("utf-8")),
        _nothing,
    ),
}


class Disk:
    """A file system in memory that can be filled, at a path that only this process and its children see."""

    def __init__(self, path: Path) -> None:
        path.mkdir()
        self._libc = libc = ctypes.CDLL(None, use_errno=True)
        flags = CLONE_NEWNS if os.geteuid() == 0 else CLONE_NEWNS | CLONE_NEWUSER
        mounted = (
            libc.unshare(flags) == 0
            and libc.mount(b"none", b"/", None, MS_REC | MS_PRIVATE, None) == 0
            and libc.mount(b"tmpfs", bytes(path), b"tmpfs", 0, f"size={SIZE_MIB}m".encode()) == 0
        )
        if not mounted:
            raise OSError(ctypes.get_errno(), "This system lets no process mount a file system of its own")
        self.path = path

    def __enter__(self) -> Disk:
        return self

    def __exit__(self, *_: object) -> None:
        self._libc.umount2(bytes(self.path), MNT_DETACH)

    @contextlib.contextmanager
    def full_after(self, n_pages: int) -> Iterator[None]:
        """Leave so many pages of the disk free in a block."""
        filler = self.path / "filler"
        with filler.open("wb") as file:
            state = os.statvfs(self.path)
            if state.f_bavail > n_pages:
                os.posix_fallocate(file.fileno(), 0, (state.f_bavail - n_pages) * state.f_frsize)
        try:
            yield
        finally:
            filler.unlink()


def inject(seed: int, n: int, folder: Path) -> Iterator[str]:
    """Yield what did not hold for each of n full disks, over the commands in turn."""
    draw = random.Random(seed)
    os.chdir(folder)
    with Disk(folder / "disk") as disk:
        yield from _fill(disk, draw, n, folder)


def _fill(disk: Disk, draw: random.Random, n: int, folder: Path) -> Iterator[str]:
    (folder / "small.toml").write_text(SMALL.format(selection="novelty"), "utf-8")
    prepare_kernels(load_study("paper", replicates=2).conditions)
    report = folder / "problem"
    _must(report, "run paper --replicates 2 --out whole")
    _must(report, "calibrate path --robot sim -o measured.toml")
    wanted, n_pages = {}, {}
    for name, write in WRITES.items():
        path = folder / name
        path.mkdir()
        _must(report, write.command.replace("{}", str(path)))
        wanted[name] = text_of(partial(write.result, path), report)
        n_pages[name] = sum(-(-file.stat().st_size // 4096) for file in path.rglob("*") if file.is_file())
    for number in range(n):
        name = list(WRITES)[number % len(WRITES)]
        k = draw.randrange(n_pages[name])
        path = disk.path / f"{name}-{number}"
        path.mkdir()
        problem = _filled(WRITES[name], disk, path, k, wanted[name], report)
        shutil.rmtree(path)
        yield problem and f"{name}, {k} of {n_pages[name]} pages free: {problem}"


def _must(report: Path, command: str) -> None:
    if problem := _run(report, command)[1]:
        raise RuntimeError(problem)


def _run(report: Path, command: str) -> tuple[int, str]:
    """Run a command in a forked process; return its status, and what it said if that is not 0."""
    report.unlink(missing_ok=True)
    if run_forked(partial(_in_fork, command.split()), report) == "done" and report.exists():
        status, _, text = report.read_text("utf-8").partition("\n")
        return int(status), text if int(status) else ""
    return -1, report.read_text("utf-8") if report.exists() else "no report"


def _in_fork(arguments: list[str]) -> str:
    """Run a command; return its status and what it wrote to standard error."""
    sys.argv = ["realitygap", *arguments]
    sys.stdout, sys.stderr = io.StringIO(), (errors := io.StringIO())
    status = 0
    try:
        main()
    except SystemExit as end:
        status = int(end.code or 0)
    return f"{status}\n{errors.getvalue()}"


def _filled(write: Write, disk: Disk, path: Path, k: int, wanted: str, report: Path) -> str:
    """Run a command twice, the first time with k free pages; return what did not hold."""
    command = write.command.replace("{}", str(path))
    with disk.full_after(k):
        status, text = _run(report, command)
        if status not in (0, 1) or (status == 1 and not _is_one_message(text)):
            return f"status {status}: {text[-1000:]}"
    kept = write.kept(path)
    status, text = _run(report, command)
    if status:
        return f"with room again, status {status}: {text[-1000:]}"
    if not kept.items() <= write.kept(path).items():
        return "the repeated command lost what was there"
    result = text_of(partial(write.result, path), report)
    return "" if result == wanted else f"the repeated command made {result[:300]}, expected {wanted[:300]}"


def _is_one_message(text: str) -> bool:
    lines = [line for line in text.splitlines() if line.startswith("realitygap: ") and "note:" not in line]
    return len(lines) == 1 and "Traceback" not in text
