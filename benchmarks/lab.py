"""What those who watch a study at the lab's page cost it, and how long a page takes to answer.

    python benchmarks/lab.py                     # 50 pages, three times 20 s with them and without; some minutes
    python benchmarks/lab.py --pages 10 --seconds 10 --rounds 1 --json

A study computes on all cores. For some seconds nobody watches it, then so many pages do: each loads the page Watch,
keeps its websocket and loads every new figure, as a browser does; and again. Every two seconds or so each page presses
the button that stops a robot, and the time until the server's answer is on the wire back is taken: an update of a page.

Then an emulated robot drives a trial at its own speed, which the pages show 20 times a second, and the same is
measured; nobody presses the button then.

What watching costs is told in two ways: by how much fewer runs a second the study computes (with the pages themselves
on the same machine, and whatever else it does), and what share of the machine's processor time the lab takes for them,
its server and the process that draws figures. The second holds on a busy machine, too.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import platform
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from lab_client import PageClient

STUDY = """
[study]
name = "watched"
replicates = 1000000

[platform.sim]
steps = 2000

[[condition]]
name = "coverage-10"
platform = "sim"

[[condition]]
name = "novelty-10"
selection = "novelty"
platform = "sim"
"""
DRIVEN = """
[study]
name = "watched"
replicates = 1

[platform.scribbler]
steps = 2000

[[condition]]
name = "coverage-robot"
platform = "scribbler"
"""
PORT = "emulator://s2?fluke=2&speed=1"
TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 100
PAUSE_S = 2.0
"""Between two presses at a page, on average [s]."""
WARM_S = 12.0
LOOK_S = 0.02
PATIENCE_S = 240.0
LEAST_TOLD = 3
"""Words on how far a study is, in each window."""
CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
_PIPE = subprocess.PIPE


# the pages, in a process of their own


async def watch(address: str, pages: int, presses: bool) -> dict[str, Any]:
    """Have so many pages watch until a line comes, and say what they heard."""
    loop = asyncio.get_running_loop()
    async with contextlib.AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(PageClient(address, looks=True)) for _ in range(pages)]
        print("ready", flush=True)
        answers: list[float] = []
        pressing = [asyncio.create_task(_press(client, answers)) for client in clients if presses]
        before, began = time.process_time(), time.perf_counter()
        await loop.run_in_executor(None, sys.stdin.readline)
        for task in pressing:
            task.cancel()
        seconds = time.perf_counter() - began
        return {
            "answers_ms": [round(1e3 * each, 2) for each in answers],
            "messages_per_s": sum(client.n_heard for client in clients) / seconds,
            "bytes_per_s": sum(client.n_bytes for client in clients) / seconds,
            "own_share": (time.process_time() - before) / seconds,
            "open": sum(client.is_open for client in clients),
        }


async def _press(client: PageClient, answers: list[float]) -> None:
    button = client.find(label="Stop robot")
    while True:
        await asyncio.sleep(random.uniform(0.0, 2 * PAUSE_S))
        began = time.perf_counter()
        await client.happen(button, "click", {})
        when, _ = await client.hear("notify", began)
        answers.append(when - began)


# the lab


class Served:
    """A lab in this process, with a study at work."""

    def __init__(self, root: Path) -> None:
        from realitygap.lab import _server

        listener = _server._listen("127.0.0.1", 0)
        port = listener.getsockname()[1]
        self.lab, self._server = _server._prepare(root, "token", port, is_local=True, allow_code=False)
        self.address = f"http://127.0.0.1:{port}/study/watched?token=token"
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [listener]}, daemon=True)
        self._thread.start()

    def compute(self, seconds: float) -> None:
        """Have the study compute, until it is at its pace."""
        self.lab.start_new("watched", STUDY)
        self._until(lambda job: job.progress and job.progress.n_computed)
        time.sleep(min(WARM_S, seconds))

    def drive(self, seconds: float) -> None:
        """Have an emulated robot drive the first trial of a study."""
        self.lab.start_new("watched", DRIVEN)
        while not self._job.is_over:
            time.sleep(0.1)
        self.lab.go_on("watched", port=PORT, counts="page", when="sheet", witness="")
        from realitygap.lab._messages import Answer, PlaceQuestion

        self._until(lambda job: isinstance(job.ask, PlaceQuestion))
        self._job.answer(Answer(self._job.ask.number))
        self._until(lambda job: job.step)

    def window(self, seconds: float) -> dict[str, float]:
        """What the study does, and the lab takes, in so many seconds."""
        own, drawing, began = time.process_time(), self._drawing(), time.perf_counter()
        told = [(began, self._count())]
        while (passed := time.perf_counter() - began) < seconds or len(told) < LEAST_TOLD:
            if passed > seconds + PATIENCE_S:
                raise SystemExit("Nothing goes on here: the machine is too busy to measure anything.")
            time.sleep(LOOK_S)
            if (count := self._count()) != told[-1][1]:
                told.append((time.perf_counter(), count))
        (first_s, first), (last_s, last) = told[1], told[-1]
        return {
            "rate": (last - first) / (last_s - first_s),
            "server": (time.process_time() - own) / passed,
            "drawing": max(self._drawing() - drawing, 0.0) / passed,
        }

    def wait_for_figures(self) -> None:
        """Until they have been drawn once: its process loads much before the first."""
        while not self.lab.watchers["watched"].n_drawn:
            time.sleep(0.1)

    @property
    def _job(self) -> Any:
        return self.lab.jobs["watched"]

    def _count(self) -> int:
        """Runs computed, or steps driven."""
        job = self._job
        return int(job.step.step if job.step else job.progress.n_computed)

    def _until(self, is_so: Callable[[Any], Any]) -> None:
        while not is_so(self._job):
            if self._job.is_over:
                raise SystemExit(self._job.outcome)
            time.sleep(0.1)

    def _drawing(self) -> float:
        """Processor time of the process that draws [s]."""
        number = self.lab.drawer.process_id
        if number is None:
            return 0.0
        try:
            fields = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return 0.0
        return (int(fields[11]) + int(fields[12])) / TICKS

    def close(self) -> None:
        """End drive."""
        self._server.should_exit = True
        self._thread.join(10)
        self.lab.close()


def measure(pages: int, seconds: float, rounds: int) -> dict[str, Any]:
    """Both studies, and the machine."""
    return {
        "pages": pages,
        "seconds": seconds,
        "rounds": rounds,
        "cores": CORES,
        **{name: _measured_apart(name, pages, seconds, rounds) for name in STUDIES},
        "load": [round(each, 1) for each in os.getloadavg()],
        "machine": platform.machine(),
        "python": platform.python_version(),
    }


def _measured_apart(name: str, pages: int, seconds: float, rounds: int) -> dict[str, Any]:
    """In a process of its own: there is one lab in each."""
    command = [sys.executable, __file__, "--only", name, "--pages", str(pages)]
    command += ["--seconds", str(seconds), "--rounds", str(rounds)]
    done = subprocess.run(command, check=True, stdout=_PIPE, text=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def measure_one(name: str, pages: int, seconds: float, rounds: int) -> dict[str, Any]:
    """Windows with nobody and with so many pages, in turns."""
    begin, presses = STUDIES[name]
    alone, watched, heard = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        served = Served(Path(folder).resolve())
        try:
            begin(served, seconds)
            for _ in range(rounds):
                alone.append(served.window(seconds))
                with _pages(served.address, pages, presses) as eyes:
                    if presses:
                        served.wait_for_figures()
                    watched.append(served.window(seconds))
                    heard.append(json.loads(eyes.communicate("\n")[0]))
        finally:
            served.close()
    return _summary(alone, watched, heard)


@contextlib.contextmanager
def _pages(address: str, pages: int, presses: bool) -> Iterator[subprocess.Popen[str]]:
    """So many pages, in a process of their own, once all are there."""
    command = [sys.executable, __file__, "--watch", address, "--pages", str(pages)]
    command += [] if presses else ["--quiet"]
    with subprocess.Popen(command, stdin=_PIPE, stdout=_PIPE, text=True) as eyes:
        next(line for line in eyes.stdout or () if line == "ready\n")
        yield eyes


def _summary(
    alone: list[dict[str, float]], watched: list[dict[str, float]], heard: list[dict[str, Any]]
) -> dict[str, Any]:
    """Medians over the windows; answers of all."""
    share = {name: max(_median(watched, name) - _median(alone, name), 0.0) for name in ("server", "drawing")}
    rates = {"alone": _median(alone, "rate"), "watched": _median(watched, "rate")}
    found = {
        "open": min(one["open"] for one in heard),
        "rate": rates,
        "slower": 1 - rates["watched"] / rates["alone"],
        "core_share": {**share, "pages": _median(heard, "own_share")},
        "machine_share": sum(share.values()) / CORES,
        "messages_per_s": _median(heard, "messages_per_s"),
    }
    if answers := sorted(each for one in heard for each in one["answers_ms"]):
        at = {str(k): answers[min(len(answers) * k // 100, len(answers) - 1)] for k in (50, 95, 99)}
        found |= {"answers": len(answers), "answer_ms": at}
    return found


def _median(windows: list[dict[str, Any]], name: str) -> float:
    return statistics.median([float(each[name]) for each in windows])


STUDIES: dict[str, tuple[Callable[[Served, float], None], bool]] = {
    "computing": (Served.compute, True),
    "driving": (Served.drive, False),
}
"""How each begins, and whether the pages press the button."""


def words(found: dict[str, Any]) -> str:
    """It all in words."""
    lines = [f"{found['pages']} pages watch, on {found['cores']} cores; load {found['load'][0]}."]
    for name, unit in (("computing", "runs"), ("driving", "steps")):
        one = found[name]
        share = one["core_share"]
        lines += [
            f"A study that is {name}: {one['rate']['alone']:.4g} {unit} a second alone, {one['rate']['watched']:.4g} "
            f"watched: {one['slower']:.1%} slower, the pages themselves and all else on the machine included.",
            f"The lab takes {one['machine_share']:.1%} of the machine for them: server {share['server']:.1%} of a "
            f"core, figures {share['drawing']:.1%}; {one['messages_per_s']:.0f} messages a second, {one['open']} pages "
            f"held their connection. (Their own process: {share['pages']:.1%} of a core.)",
        ]
    answer = found["computing"]["answer_ms"]
    return "\n".join(
        [
            *lines,
            f"An update of a page: {answer['50']:.0f} ms in the middle, {answer['95']:.0f} ms at the 95th "
            f"percentile of {found['computing']['answers']}.",
        ]
    )


def main() -> None:
    """Measure, or be the pages."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--pages", type=int, default=50)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each window")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", action="store_true", help="print data")
    parser.add_argument("--only", choices=STUDIES, help="one of the studies; prints data")
    parser.add_argument("--quiet", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--watch", metavar="ADDRESS", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.watch:
        print(json.dumps(asyncio.run(watch(options.watch, options.pages, not options.quiet))))
        return
    if options.only:
        print(json.dumps(measure_one(options.only, options.pages, options.seconds, options.rounds)))
        return
    found = measure(options.pages, options.seconds, options.rounds)
    print(json.dumps(found, indent=1) if options.json else words(found))


if __name__ == "__main__":
    main()
