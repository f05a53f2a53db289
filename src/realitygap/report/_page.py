"""A page for a whole study: its settings, its numbers and figures, and the command to run it again."""

from __future__ import annotations

import gc
import itertools
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import polars as pl

from realitygap._version import __version__
from realitygap._wording import number
from realitygap.errors import RealityGapError, RecordError
from realitygap.platforms import described_platform, is_physical
from realitygap.records import (
    RecordWarning,
    ResultsFolder,
    column_table,
    is_special,
    refuse_links,
    refuse_results,
    write_whole,
)
from realitygap.report import _gallery
from realitygap.report._assumed import sim_assumptions
from realitygap.report._bests_figure import draw_bests
from realitygap.report._champions import Champions, retry_champions
from realitygap.report._choices_figure import compare_choices, draw_choices
from realitygap.report._comparisons import Comparison, compare_champions, compare_conditions
from realitygap.report._driven import describe_driven
from realitygap.report._export import export_page
from realitygap.report._findings import find, leading_conditions
from realitygap.report._generations_figure import draw_coverage, draw_scores
from realitygap.report._parameters import neat_parameters, settings_tables
from realitygap.report._placed import FigureOnPage, hover_content, number_figures
from realitygap.report._replay import content as replay_content
from realitygap.report._statistics_section import Statistics, statistics_content
from realitygap.report._summary import summarize, summarize_tasks
from realitygap.report._table import Cell, Column, Part, Row, TableOnPage, numbered
from realitygap.report._tally import (
    DescribedStudy,
    Tally,
    largest,
    read_tally,
    score_text,
    selection_of,
    settings_of,
)
from realitygap.report._template import render_page
from realitygap.report.charts.house import house_style
from realitygap.stats import CONFIDENCE, MEDIAN_SMALLEST_N, interval_ranks
from realitygap.study import design_report, load_study, named_studies

REPORT_NAME = "report.html"

LABELS = {
    "SIM": "computed by a simulation of robot and arena; no robot was driven",
    "TWIN": "computed by a second, structurally different simulation that stands in for a robot",
    "EMULATED": "driven over the robot’s own protocol, with a simulated robot behind it",
    "REAL": "driven on the physical robot",
}
"""Explanations of the labels of figures."""

_CONFIDENCE = f"{100 * CONFIDENCE:.0f} %"
_RANGES = (("low", "high"), ("q25", "q75"))
"""Columns of a summary with the ends of an interval, and of its quartiles."""

_MOST_GAPS = 12
"""Maximum number of conditions whose missing runs are listed. Otherwise their number is reported."""


def write_report(
    folder: ResultsFolder | str | Path,
    out: str | Path | None = None,
    *,
    figures: str | Path | None = None,
    allow_code: bool = False,
) -> Path:
    """Write the page of a study: one HTML file that needs no other file and no network.

    Args:
        folder: Results of a study, or the path to them. They are only read; trials that are drawn are recomputed.
        out: File to write, ending in .html. Default: `report.html` in the folder. An existing file is replaced once the
            new one is complete.
        figures: A folder for every figure as SVG and PDF and every table as CSV; it is made when it is not there.
            Nothing but the page is written when not given.
        allow_code: True to run Python files of tasks and descriptors that the user has not allowed before. Archives
            that need one are not corrected without.

    Returns:
        The path of the page.

    Raises:
        RecordError: there is no such folder, a file in it is damaged, it holds no trials yet, or the page
            or another file cannot be written, ends in something else, or would take the place of
            a file of a study's results.
    """
    if out is not None:
        _check_out(Path(out))
    else:
        folder_path = folder.path if isinstance(folder, ResultsFolder) else Path(folder)
        refuse_links(folder_path, folder_path / REPORT_NAME)
    with warnings.catch_warnings(), _uncollected():
        # another version's results are announced on the page itself
        warnings.simplefilter("ignore", RecordWarning)
        tally = read_tally(folder, allow_code=allow_code)
        with house_style():
            content = _content(tally)
        page = _render(content)
        if figures is not None:
            content["exported"] = export_page(Path(figures), tally, content)
            page = _render(content)
    within = tally.folder.path if out is None else None
    path = tally.folder.path / REPORT_NAME if out is None else Path(out)
    write_whole(path, page.encode("utf-8", "replace"), within=within)
    return path


@contextmanager
def _uncollected() -> Iterator[None]:
    """Suspend garbage collection: figures are many small objects that live as long as the page."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _check_out(path: Path) -> None:
    """Refuse a wrong place before minutes are spent on the page."""
    refuse_results(path)
    if path.suffix.lower() not in (".html", ".htm", "") and not is_special(path):
        raise RecordError(f"{path} ends in {path.suffix}, expected .html: a report is a page.")


def _render(content: Mapping[str, Any]) -> str:
    return render_page("report.html.jinja", content, count=_count)


def _content(tally: Tally) -> dict[str, Any]:
    """Return the content of the template."""
    with ThreadPoolExecutor(max_workers=1) as beside:
        digest = beside.submit(tally.folder.digest)
        computed = beside.submit(_statistics, tally)
        content = _words_and_figures(tally)
        statistics, comparisons, champions, fresh = computed.result()
    findings = find(tally, comparisons, champions, fresh, content["tasks"])
    content |= {
        "digest": digest.result(),
        "statistics": statistics,
        "findings": findings,
        "compared": {"recorded": comparisons, "fresh": fresh},
    }
    sections = _sections(content)
    number_figures(figure for _, _, figures in sections for figure in figures)
    content["sections"] = [(anchor, title) for anchor, title, _ in sections]
    content |= hover_content(content)
    content["tables"] = {table.name: table for table in _tables(content)}
    return content


def _statistics(
    tally: Tally,
) -> tuple[Statistics, list[Comparison], list[Champions], list[Comparison]]:
    comparisons, champions = compare_conditions(tally), retry_champions(tally)
    fresh = compare_champions(tally, champions)
    return statistics_content(tally, comparisons, champions, fresh), comparisons, champions, fresh


def _sections(content: Mapping[str, Any]) -> list[tuple[str, str, list[FigureOnPage | str | None]]]:
    """Anchor, title, and figures of each section in the order of the page."""
    gallery = content["gallery"]
    sections = [
        ("findings", "Findings and replay", [content["bests"]]),
        ("results", "Results", [content["coverage"], *content["scores"]]),
        ("comparisons", "Comparisons", [content["choices"]]),
        (
            "networks",
            "Paths, networks, and species",
            [*gallery["individuals"], gallery["networks"], *gallery["elites"], gallery["species"]],
        ),
        ("questions", "The paper’s questions", []),
        ("methods", "Methods and settings", [gallery["arena"]]),
        ("again", "Reproduce and cite", []),
        ("data", "Data", []),
    ]
    has_comparisons = content["statistics"].comparisons or content["choices"]
    return [each for each in sections if each[0] != "comparisons" or has_comparisons]


def _tables(content: Mapping[str, Any]) -> list[TableOnPage]:
    """Return the tables in the order of the page, with their numbers."""
    statistics: Statistics = content["statistics"]
    tables = [
        content["results"],
        content["task_scores"],
        *statistics.compared,
        content["gallery"]["structures"],
        *statistics.answers,
        content["parameters"],
    ]
    tables += [*content["settings"], _columns_table()]
    return numbered([table for table in tables if table])


def _columns_table() -> TableOnPage:
    rows = [
        (Cell(name, element="code"), Cell(kind, element="code"), meaning)
        for name, kind, meaning in column_table()
    ]
    columns = (Column("Column"), Column("Type"), Column("Meaning", kind="prose"))
    return TableOnPage("columns", "Columns of the data.", columns, (Part(rows),), kind="settings")


def _results_table(summary: pl.DataFrame) -> TableOnPage:
    n_published = max((len(values) for values in summary["published"].drop_nulls()), default=0)
    columns = [Column("Condition"), Column("Label", kind="text"), Column("n")]
    for group in ("Cells along the line driven", "Cells at the ends of steps"):
        columns += [
            Column("median", group, kind="median"),
            Column(f"{_CONFIDENCE} interval", group),
            Column("quartiles", group),
        ]
    columns += [Column(f"run {k}", "The paper", kind="published") for k in range(n_published)]
    rows: list[Row] = []
    for row in summary.iter_rows(named=True):
        cells: list[str | Cell] = [row["condition"], row["label"], f"{row['n']:,}"]
        for which in ("line", "ends"):
            cells.append(number(row[f"{which}_median"]))
            cells += [_range(row[f"{which}_{low}"], row[f"{which}_{high}"]) for low, high in _RANGES]
        published = [*(row["published"] or []), *[None] * n_published][:n_published]
        cells += [Cell(number(value), kind="none" if value is None else None) for value in published]
        rows.append(cells)
    caption = "Best coverage of a run by condition: the visited share of the reachable cells, best of all individuals."
    more = " Counterpart of the paper’s Table 2." if n_published else ""
    return TableOnPage("results", caption + more, tuple(columns), (Part(rows),), kind="numbers")


def _scores_table(tasks: pl.DataFrame) -> TableOnPage | None:
    if tasks.is_empty():
        return None
    columns = (
        *(Column("Condition"), Column("Label", kind="text"), Column("Task", kind="text"), Column("n")),
        *(Column("first", "Generation"), Column("last", "Generation")),
        Column("median", "Whole run", kind="median"),
        Column(f"{_CONFIDENCE} interval", "Whole run"),
        Column("quartiles", "Whole run"),
    )
    rows = [
        (
            *(row["condition"], row["label"], row["task"], f"{row['n']:,}"),
            *(score_text(row[key]) for key in ("first", "last", "median")),
            *(
                "–" if row[low] is None else f"{score_text(row[low])} to {score_text(row[high])}"
                for low, high in _RANGES
            ),
        )
        for row in tasks.iter_rows(named=True)
    ]
    caption = (
        "Best score of a run by condition. First and last: the median of the best in the first and in the last "
        "generation."
    )
    return TableOnPage("scores", caption, columns, (Part(rows),), kind="numbers tasks")


def _words_and_figures(tally: Tally) -> dict[str, Any]:
    summary, tasks = summarize(tally), summarize_tasks(tally.folder)
    description = tally.description
    replay = replay_content(tally, leading_conditions(tally)[0])
    return {
        "counts": _counts(tally),
        "title": description.get("title") or description.get("name") or "A study",
        "name": description.get("name") or "–",
        "banners": _banners(tally),
        "facts": _facts(tally),
        "labels": _labels(tally),
        "results_version": tally.folder.results_version,
        "version": __version__,
        "software": description.get("software") or "unknown",
        "parameters": neat_parameters(tally.conditions),
        "settings": settings_tables(tally.conditions),
        "results": _results_table(summary),
        "measure": tally.measure,
        "note": description.get("note") or "",
        "published_sources": _published_sources(tally),
        "interval_notes": _interval_notes(summary),
        "confidence": _CONFIDENCE,
        "bests": FigureOnPage("figure-bests", draw_bests(tally, replayed=replay.replayed)),
        "coverage": FigureOnPage("figure-coverage", draw_coverage(tally), "Figure 4"),
        "tasks": tasks.to_dicts(),
        "task_scores": _scores_table(tasks),
        "scores": _score_figures(tally),
        "choices": _choices_figure(tally),
        "gallery": _gallery.content(tally, replay.trials),
        "replay": replay,
        "command": _command(tally),
        "has_novelty": any(selection_of(each) == "novelty" for each in tally.conditions),
        "exported": None,
    }


# figures


def _score_figures(tally: Tally) -> list[FigureOnPage]:
    """A figure for each score of another task than coverage."""
    return [
        FigureOnPage(f"figure-scores-{k}", drawing) for k, drawing in enumerate(draw_scores(tally.folder))
    ]


def _choices_figure(tally: Tally) -> FigureOnPage | None:
    if not compare_choices(tally):
        return None
    return FigureOnPage("figure-choices", draw_choices(tally))


# words


def _banners(tally: Tally) -> list[tuple[str, str]]:
    """Return the notices that a reader must see first: a heading and a sentence each."""
    banners = []
    if tally.folder.version_note is not None:
        banners.append(("Results of another version", tally.folder.version_note))
    if tally.driven:
        message = " ".join(describe_driven(name, driven) for name, driven in tally.driven.items())
        report = design_report(tally.folder.path)
        banners.append(("Trials on a robot", message if report is None else f"{message} {report.line}"))
    if tally.uncounted:
        banners.append(
            (
                "Conditions that are left out",
                f"Nobody counted the cells of {', '.join(tally.uncounted)}, whose task does not need them.",
            )
        )
    missing = _missing_runs(tally)
    if missing:
        expected = len(tally.conditions) * _expected_replicates(tally)
        n_missing = sum(count for _, count, _ in missing)
        listed = [f"{name} lacks {count:,} ({where})" for name, count, where in missing[:_MOST_GAPS]]
        if len(missing) > _MOST_GAPS:
            listed.append(f"and {len(missing) - _MOST_GAPS} more conditions")
        banners.append(
            (
                "The study is incomplete",
                f"{expected - n_missing:,} of {expected:,} runs are complete. {'; '.join(listed)}. "
                "Run the same command again to complete the study.",
            )
        )
    return banners


def _expected_replicates(tally: Tally) -> int:
    most = largest(tally.runs, "replicate") + 1
    return int(tally.description.get("replicates") or most)


def _missing_runs(tally: Tally) -> list[tuple[str, int, str]]:
    """Name, number of missing runs, and which, of each condition that lacks some."""
    missing = []
    for condition in tally.conditions:
        gaps = _gaps([int(run) for run in tally.replicates(condition["name"])], _expected_replicates(tally))
        if gaps:
            shown = [str(first) if first == last else f"{first} to {last}" for first, last in gaps]
            where = "runs " + ", ".join(shown[:4]) + (", …" if len(shown) > 4 else "")
            missing.append((condition["name"], sum(last - first + 1 for first, last in gaps), where))
    return missing


def _gaps(there: list[int], n: int) -> list[tuple[int, int]]:
    """First and last of each stretch of 0 to n - 1 that is not `there`, a list in order."""
    edges = [-1, *(number for number in there if number < n), n]
    return [(before + 1, after - 1) for before, after in itertools.pairwise(edges) if after > before + 1]


def _counts(tally: Tally) -> list[str]:
    """Return the numbers of runs and trials, in words."""
    return [f"{_count(tally.runs.height)} runs", f"{_count(tally.n_trials())} trials"]


def _facts(tally: Tally) -> list[tuple[str, str]]:
    description = tally.description
    n_runs, n_trials, n_steps = tally.runs.height, tally.n_trials(), _robot_steps(tally)
    platforms = sorted({str(settings_of(each).get("platform", "unknown")) for each in tally.conditions})
    facts = [
        ("Study", str(description.get("name") or "–")),
        ("Conditions", _count(len(tally.conditions))),
        (
            "Runs",
            f"{_count(n_runs)} ({_count(_expected_replicates(tally))} planned for each condition)",
        ),
        ("Trials", f"{_count(n_trials)}, one for each network"),
    ]
    if n_steps is not None:
        facts.append(("Robot-steps", _count(n_steps)))
    facts.append(
        (
            "Platform",
            "; ".join(map(described_platform, platforms)),
        )
    )
    facts += [(f"Assumed of {names}", text) for names, text in sim_assumptions(tally.conditions)]
    numbers = {
        "True": "; all conditions draw the same random numbers",
        "False": "; each condition draws its own random numbers",
    }.get(str(description.get("pair")), "")
    facts.append(("Seed", f"{description.get('seed', '–')}{numbers}"))
    return facts


def _robot_steps(tally: Tally) -> int | None:
    """Return the steps of all trials together; None if a condition has no number of steps."""
    total = 0
    for condition in tally.conditions:
        settings = settings_of(condition)
        platform = settings.get(str(settings.get("platform")))
        steps = platform.get("steps") if isinstance(platform, Mapping) else None
        if not isinstance(steps, int):
            return None
        robots = settings.get("arena", {}).get("robots", 1)
        total += steps * robots * tally.n_trials(condition["name"])
    return total


def _labels(tally: Tally) -> list[tuple[str, str]]:
    return [(label, LABELS.get(label, "as the records say")) for label in tally.labels]


def _published_sources(tally: Tally) -> list[str]:
    sources = [
        condition.get("published_source") for condition in tally.conditions if condition.get("published")
    ]
    return list(dict.fromkeys(str(source) for source in sources if source))


def _interval_notes(summary: pl.DataFrame) -> list[str]:
    """Describe the ranks between which the intervals lie, for each number of runs."""
    notes = []
    for n in sorted(set(summary["n"]) - {0}):
        ranks = interval_ranks(n)
        if ranks is None:
            notes.append(
                f"With n = {n} there is no interval: fewer than {MEDIAN_SMALLEST_N} runs cannot give one of 95 %."
            )
        else:
            notes.append(
                f"With n = {n:,}, it extends from the {_ordinal(ranks.lower)} to the {_ordinal(ranks.upper)} of "
                f"the ordered values and covers the median with {100 * ranks.coverage:.1f} %."
            )
    return notes


class _CommandLine(NamedTuple):
    """The command that runs a study again, also in Python, and whether the study comes with realitygap."""

    built_in: bool
    run: str
    python: str


def _command(tally: Tally) -> _CommandLine:
    description = tally.description
    name = str(description.get("name") or "")
    built_in = _is_built_in(description)
    study = name if built_in else "STUDY.toml"
    seed, replicates = description.get("seed", 1), _expected_replicates(tally)
    command, function, port = "realitygap run", "run_study", ""
    if all(is_physical(settings_of(condition)) for condition in description["conditions"]):
        command, function, port = "realitygap drive", "drive_study", "PORT"
    return _CommandLine(
        built_in,
        f"{command} {study}{port and f' --port {port}'} --seed {seed} --replicates {replicates} --out DIR",
        f"{function}({study!r}, {port and f'{port!r}, '}'DIR', seed={seed}, replicates={replicates})",
    )


def _is_built_in(description: DescribedStudy) -> bool:
    """Return whether the conditions equal, by hash, those of the built-in study of this name."""
    name = description.get("name")
    if name not in named_studies():
        return False
    try:
        ours = load_study(str(name), seed=description.get("seed")).description()
    except RealityGapError:
        return False
    return {each["hash"] for each in ours["conditions"]} == {
        each.get("hash") for each in description["conditions"]
    }


def _range(low: float | None, high: float | None) -> Cell:
    return Cell("–", element="none") if low is None else Cell(f"[{number(low)}, {number(high)}]")


def _count(value: int) -> str:
    return f"{value:,}"


def _ordinal(number: int) -> str:
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number:,}{ending}"
