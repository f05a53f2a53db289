"""What a billion runs would take: the measured figures, and the tables, of the page "A billion runs".

    uv run python docs/make_billion.py            # on an idle machine; takes some minutes

Measures on this machine, with `realitygap bench`'s figures, a study, its folder and a Dask scheduler on the loopback
interface, and writes docs/data/billion.json. The page's tables are worked out from that file when the documents are
built.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from realitygap import ResultsFolder, run_study
from realitygap.study import machine_facts, measure_speed, parse_study

HERE = Path(__file__).parent
DATA = HERE / "data" / "billion.json"
RUNS = 1_000_000_000
CORES = (2, 16, 128, 1024)
LEAST = """
[study]
name = "least"
replicates = {replicates}
[neat]
population = 2
generations = 1
[platform.jyro]
steps = 1
[[condition]]
name = "least"
"""
# The largest amount of memory that a process has used, by a report on a folder.
REPORT = """
import resource, sys
import realitygap
realitygap.write_report(sys.argv[1])
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024))
"""


def measure(
    replicates: int = 2000, chunks: int = 2000, names: int = 100_000, seconds: float = 2.0
) -> dict[str, Any]:
    """All figures.

    Args:
        replicates: of the study of the paper whose folder is measured.
        chunks: sent through a scheduler, each as short as can be.
        names: of files in a folder that is listed.
        seconds: that each figure of speed is measured.
    """
    speed = measure_speed(seconds)["paper_runs_recorded_per_second"]
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        return {
            "machine": machine_facts() | {"host": ""},
            "python": platform.python_version(),
            "runs_per_second_a_core": speed["per_core"],
            "speedup_of_all_cores": speed["all_cores"] / speed["per_core"],
            "runs_per_chunk": _runs_per_chunk(),
            **_folder_figures(work, replicates),
            **_listing_figures(work, names),
            **_cluster_figures(work, chunks),
        }


def _runs_per_chunk() -> int:
    """Of a study of the paper that is so large that only a chunk's length bounds it."""
    from realitygap.study import _run, load_study

    return min(_run._chunk_size(each, RUNS) for each in load_study("paper").conditions)


def _folder_figures(work: Path, replicates: int) -> dict[str, float]:
    """Bytes and seconds a run, from the folder of a study and the report on it."""
    small = run_study("paper", work / "small", replicates=max(1, replicates // 4)).folder
    folder = run_study("paper", work / "large", replicates=replicates).folder
    n_runs = 9 * replicates
    n_bytes = sum(path.stat().st_size for path in (folder.path / "trials").iterdir())
    small_report = _report(small.path)
    large_report = _report(folder.path)
    more_runs = n_runs - 9 * max(1, replicates // 4)
    tracemalloc.start()
    opened = ResultsFolder.open(folder.path)
    n_chunks = len(opened.chunks())
    memory = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    return {
        "bytes_per_run": n_bytes / n_runs,
        "check_bytes_per_second": n_bytes / _seconds(lambda: ResultsFolder.open(folder.path).chunks()),
        "memory_bytes_per_chunk": memory / n_chunks,
        "digest_runs_per_second": n_runs / _seconds(folder.digest),
        "report_seconds_per_run": (large_report["seconds"] - small_report["seconds"]) / more_runs,
        "report_memory_bytes_per_run": (large_report["bytes"] - small_report["bytes"]) / more_runs,
    }


def _report(folder: Path) -> dict[str, float]:
    """Seconds and the most memory of a report, in a process of its own."""
    since = time.perf_counter()
    done = subprocess.run(
        [sys.executable, "-c", REPORT, str(folder)], capture_output=True, text=True, check=True
    )
    return {"seconds": time.perf_counter() - since, "bytes": float(done.stdout)}


def _listing_figures(work: Path, names: int) -> dict[str, float]:
    """Seconds to list a file, from a folder of names."""
    from realitygap.records._listing import list_chunks

    trials = work / "names"
    trials.mkdir()
    for first in range(names):
        (trials / f"coverage-10.{first:09d}-{first:09d}.parquet").touch()
    return {"list_seconds_per_chunk": _seconds(lambda: list_chunks(trials)) / names}


def _cluster_figures(work: Path, chunks: int) -> dict[str, float]:
    """Chunks a second from the order to the published file, through a scheduler and a worker on this machine."""
    with _scheduler(work) as address:
        run_study(parse_study(LEAST.format(replicates=20), "least"), work / "warm", chunk=1, cluster=address)
        study = parse_study(LEAST.format(replicates=chunks), "least")
        result = run_study(study, work / "least", chunk=1, cluster=address)
    return {"chunks_per_second_through_a_scheduler": chunks / result.seconds}


@contextlib.contextmanager
def _scheduler(work: Path) -> Iterator[str]:
    """The address of a scheduler that has one worker."""
    file = work / "scheduler.json"
    common = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(file)]
    more = ["--no-nanny", "--nthreads", str(os.cpu_count()), "--local-directory", str(work)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    program = [sys.executable, "-m"]
    with contextlib.ExitStack() as stack:
        for arguments in (
            ["distributed.cli.dask_scheduler", "--port", "0", *common],
            ["distributed.cli.dask_worker", *common, *more],
        ):
            process = stack.enter_context(subprocess.Popen([*program, *arguments], **quiet))
            stack.callback(process.kill)
            while not file.exists():
                time.sleep(0.05)
        yield json.loads(file.read_text())["address"]


def _seconds(work: Callable[[], object]) -> float:
    since = time.perf_counter()
    work()
    return time.perf_counter() - since


def page_tables() -> str:
    """What the page shows: the figures, what a billion runs take, and what gives way first."""
    figures = json.loads(DATA.read_text("utf-8"))
    return "\n".join([_figures_table(figures), _time_table(figures), _limits_table(figures)])


def _figures_table(f: dict[str, Any]) -> str:
    rows = [
        ("runs of the paper a second on one core, rows written", f"{f['runs_per_second_a_core']:,.0f}"),
        (f"times that on all {f['machine']['processors']} cores", f"{f['speedup_of_all_cores']:.2f}"),
        ("bytes a run, as published", f"{f['bytes_per_run']:,.0f}"),
        ("runs in a chunk", f"{f['runs_per_chunk']:,}"),
        (
            "chunks a second through one scheduler, from order to published file",
            f"{f['chunks_per_second_through_a_scheduler']:,.0f}",
        ),
        ("checked a second when a study is taken up again", size(f["check_bytes_per_second"])),
        ("runs a second that `realitygap digest` reads", f"{f['digest_runs_per_second']:,.0f}"),
        ("microseconds to list a chunk", f"{1e6 * f['list_seconds_per_chunk']:.1f}"),
        ("bytes of memory for each chunk known", f"{f['memory_bytes_per_chunk']:,.0f}"),
        ("microseconds of the report for each run", f"{1e6 * f['report_seconds_per_run']:.0f}"),
        ("bytes of memory of the report for each run", f"{f['report_memory_bytes_per_run']:,.0f}"),
    ]
    head = f"Measured on {f['machine']['processor']}, Python {f['python']}:\n\n"
    return head + _table(["figure", "value"], rows)


def _time_table(f: dict[str, Any]) -> str:
    # of a core while all of the machine's are at work, as they are then
    rate = f["runs_per_second_a_core"] * f["speedup_of_all_cores"] / f["machine"]["processors"]
    rows = [
        (
            f"{cores:,}",
            duration(RUNS / rate / cores),
            size(rate * cores * f["bytes_per_run"]) + "/s",
            f"{rate * cores / f['runs_per_chunk']:,.1f}",
        )
        for cores in CORES
    ]
    head = f"A billion runs are {size(RUNS * f['bytes_per_run'])} in {n_chunks(f):,} chunks. "
    head += "With cores like these, all at work:\n\n"
    return head + _table(["cores", "time to compute", "written", "chunks a second"], rows)


def limits(f: dict[str, Any]) -> list[tuple[str, float, str, str]]:
    """(what, how much it takes of what is usual, in words, what helps) of each part, the first to give way first.

    What is usual: a day, 64 GB of memory, and a million files in one folder.
    """
    day, memory, files = 86_400.0, 64e9, 1e6
    n = n_chunks(f)
    report_memory = RUNS * f["report_memory_bytes_per_run"]
    report_time = RUNS * f["report_seconds_per_run"]
    check = RUNS * f["bytes_per_run"] / f["check_bytes_per_second"]
    digest = RUNS / f["digest_runs_per_second"]
    scheduler = n / f["chunks_per_second_through_a_scheduler"]
    rows = [
        ("memory of the report", report_memory / memory, size(report_memory), "a report on each of several folders"),
        ("time of the report", report_time / day, duration(report_time), "likewise"),
        ("taking the study up again, all bytes checked", check / day, duration(check), "several folders"),
        ("digest", digest / day, duration(digest), "several folders, one digest each"),
        ("files in one folder", n / files, f"{n:,}", "a larger `--chunk`"),
        ("memory for the chunks known", n * f["memory_bytes_per_chunk"] / memory,
         size(n * f["memory_bytes_per_chunk"]), "a larger `--chunk`"),
        ("one scheduler", scheduler / day, duration(scheduler), "a larger `--chunk`"),
        ("listing the folder once", n * f["list_seconds_per_chunk"] / day,
         duration(n * f["list_seconds_per_chunk"]), "a larger `--chunk`"),
    ]  # fmt: skip
    return sorted(rows, key=lambda row: -row[1])


def _limits_table(f: dict[str, Any]) -> str:
    rows = [(what, words, _share(share), helps) for what, share, words, helps in limits(f)]
    head = "What gives way first stands first: its need in days, in 64 GB of memory, or in millions of files.\n\n"
    return head + _table(["part", "for a billion runs", "parts", "what helps"], rows)


def _share(share: float) -> str:
    """A share with the digits that count."""
    if share < 0.001:
        return "below 0.001"
    return f"{share:,.0f}" if share >= 10 else f"{share:.2g}"


def n_chunks(f: dict[str, Any]) -> int:
    """Chunks of a billion runs."""
    return -(-RUNS // f["runs_per_chunk"])


def duration(seconds: float) -> str:
    """A time in the unit that suits it."""
    for unit, length in (("days", 86_400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * length:
            return f"{seconds / length:,.1f} {unit}"
    return f"{seconds:,.1f} s"


def size(n_bytes: float) -> str:
    """A number of bytes in the unit that suits it."""
    for unit, length in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if n_bytes >= length:
            return f"{n_bytes / length:,.1f} {unit}"
    return f"{n_bytes:,.0f} bytes"


def _table(head: list[str], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def main() -> None:
    """Measure and write."""
    DATA.write_text(json.dumps(measure(), indent=2) + "\n", "utf-8")
    print(f"Written: {DATA}")


if __name__ == "__main__":
    main()
