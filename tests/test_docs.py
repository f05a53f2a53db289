"""The documents say what is true: outputs, settings, commands, columns and numbers are those of the program."""

import csv
import importlib.util
import json
import re
import subprocess
import sys
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest

from realitygap import run_study
from realitygap.cli import app
from realitygap.evolution import NAMED_SETTINGS, NeatSettings, NoveltySettings
from realitygap.platforms import JyroPlatform
from realitygap.records import column_table, derived_table
from realitygap.records._derived import DERIVED
from realitygap.report import audit_distance
from realitygap.runs import ArchiveSettings
from realitygap.settings import is_hidden
from realitygap.study import ConditionNotes, ReportSection, StudySection
from realitygap.tasks import ControllerSettings, CoverageTask
from realitygap.world import ArenaSettings, load_robot

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"


sys.path.append(str(DOCS))  # as for a script that runs there: some of them import another one


def _load(name):
    if name not in sys.modules:
        spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
        sys.modules[name] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules[name])
    return sys.modules[name]


_load("written")  # scripts import it
make_outputs = _load("make_outputs")
description_pages = _load("description_pages")
task_pages = _load("task_pages")
reference_pages = _load("reference_pages")
PAGES = [path for path in make_outputs.documents() if path.name != "README.md"]


LONG = {"tutorials/robot-lab.md", "how-to/score.md", "how-to/track.md"}
"""Pages whose examples take half a minute or more."""


def _page(path):
    name = str(path.relative_to(DOCS))
    return pytest.param(path, marks=pytest.mark.long if name in LONG else pytest.mark.slow, id=name)


@pytest.mark.parametrize("path", [_page(path) for path in PAGES])
def test_examples_of_a_page_run_and_print_what_it_shows(path):
    _, problems = make_outputs.rewrite(path.read_text("utf-8"), str(path.relative_to(ROOT)))
    assert problems == []


@pytest.mark.parametrize(
    "model",
    [
        ArenaSettings,
        ConditionNotes,
        ControllerSettings,
        CoverageTask,
        JyroPlatform,
        NeatSettings,
        NoveltySettings,
        ArchiveSettings,
        ReportSection,
        StudySection,
    ],
)
def test_every_setting_is_in_the_reference_with_a_description(model):
    page = reference_pages.settings_page()
    for name, info in model.model_fields.items():
        if is_hidden(info):
            continue
        assert info.description, name
        assert f"`{name}`\n: " in page
        assert reference_pages.escape(info.description) in page


def test_the_keys_of_a_condition_are_in_the_reference():
    page = reference_pages.settings_page()
    for name in reference_pages.CONDITION_KEYS:
        assert f"`{name}`\n: " in page


def test_limits_and_alternatives_of_settings_are_said_in_words():
    page = reference_pages.settings_page()
    assert "`population`\n: a whole number, 2 to 1,000,000; default `8`." in page
    assert '`activation`\n: `"tanh"`, `"sigmoid"`, `"identity"`; default `"tanh"`.' in page
    assert "`turn_per_step`\n: a number, more than 0 to 3; default `0.1`." in page
    assert '`start`\n: `"corner"`, `"center"`, `"left"`, or a list of 3 numbers; default `"corner"`.' in page
    assert "`pair`\n: true or false; default `true`." in page
    assert "`name`\n: a text, at most 80 letters; no default." in page


def test_named_sets_stand_side_by_side_with_every_setting():
    table = reference_pages.neat_sets()
    for name in NAMED_SETTINGS:
        assert f"`{name}`" in table.splitlines()[0]
    for key in NeatSettings.model_fields.keys() - {"settings"}:
        assert f"| `{key}` |" in table


def test_every_command_has_a_page_with_every_option_an_example_and_its_python_twin():
    pages = reference_pages.command_pages()
    names = [command.name for command in app.registered_commands]
    for group in app.registered_groups:
        names += [f"{group.name} {command.name}" for command in group.typer_instance.registered_commands]
    assert sorted(pages) == sorted(names)
    table = reference_pages.commands_table()
    assert [row.count(f"[`{name}`]") for name, row in zip(pages, table.splitlines()[2:], strict=True)] == [
        1
    ] * len(pages)
    for name, command in reference_pages.commands().items():
        page = pages[name]
        for parameter in command.params:
            for option in parameter.opts:
                assert f"`{option}" in page or f"`{parameter.metavar}`" in page
        assert f"```sh\nrealitygap {name}" in page
        assert page.rstrip().splitlines()[-2].startswith("realitygap.")


def test_every_column_is_in_the_reference():
    page = reference_pages.columns()
    for name, _, _ in column_table():
        assert f"| `{name}` |" in page


def test_every_derived_column_is_in_the_reference():
    page = reference_pages.derived_columns()
    for what in DERIVED:
        assert f"## `{what}`\n\nA row is {DERIVED[what].row}." in page
        for name, kind, text in derived_table(what):
            assert f"| `{name}` | {kind} | {reference_pages.escape(text)} |" in page


def test_every_condition_of_paper_choices_is_on_the_page_of_choices():
    assert sorted(reference_pages.tried_conditions()) == sorted(reference_pages.conditions_to_try())


@pytest.mark.slow
def test_numbers_on_the_page_of_choices_are_those_of_the_study(tmp_path):
    make_choices = _load("make_choices")
    folder = run_study("paper-choices", tmp_path / "results").folder
    assert make_choices.table(folder) == reference_pages.CHOICES_DATA.read_text("utf-8")


@pytest.mark.slow
def test_numbers_on_the_page_of_the_paper_are_those_of_its_study(tmp_path):
    make_reproduced = _load("make_reproduced")
    tables, figures = make_reproduced.make(tmp_path)
    assert {path.name: path.read_text("utf-8") for path in make_reproduced.TABLES.iterdir()} == tables
    assert {path.name for path in make_reproduced.FIGURES.iterdir()} == set(figures)


@pytest.mark.slow
def test_numbers_and_figures_of_several_robots_are_those_of_the_example(tmp_path):
    make_team = _load("make_team")
    table, figures = make_team.make(tmp_path)
    assert make_team.TABLE.read_text("utf-8") == table
    assert {path.name: path.read_text("utf-8") for path in make_team.FIGURES.iterdir()} == figures


def test_tables_of_calibrations_are_of_what_was_measured():
    make_calibration = _load("make_calibration")
    for page in make_calibration.PAGES:
        text = page.read_text("utf-8")
        assert make_calibration.rewrite(text) == text
    rows = make_calibration.measured()
    assert make_calibration.each(rows) == make_calibration.EACH.read_text("utf-8")
    assert make_calibration.each_of_kinds(rows) == make_calibration.EACH_OF_KINDS.read_text("utf-8")


def test_parameters_that_the_page_of_inference_calls_missed_are_those_held_too_seldom():
    make_calibration = _load("make_calibration")
    held = {
        observe: make_calibration.held_by_name(rows)
        for observe, rows in make_calibration.by_observation(make_calibration.measured()).items()
    }
    seldom = [
        make_calibration.count(part)
        for parts in held.values()
        for part in parts.values()
        if make_calibration.chance(part) <= 0.05
    ]
    assert len(seldom) == 7
    assert set(seldom) == {17, 18, 32}
    n_parameters = sum(len(parts) for parts in held.values())
    least = min(make_calibration.chance(part) for parts in held.values() for part in parts.values())
    assert n_parameters == 90
    assert n_parameters * least > 0.05, "the page says that no parameter misses the goal after the correction"


@pytest.mark.slow
def test_the_picture_of_several_robots_is_drawn_by_its_page():
    make_several_robots = _load("make_several_robots")
    for name, text in make_several_robots.make().items():
        assert (make_several_robots.IMAGES / name).read_text("utf-8") == text


def test_the_table_on_the_page_of_sheets_is_what_its_benchmark_found():
    make_score = _load("make_score")
    page = make_score.PAGE.read_text("utf-8")
    assert make_score.with_table(page) == page


@pytest.mark.long
def test_figures_on_the_page_of_a_billion_runs_are_those_that_its_command_measures(tmp_path):
    """Times differ from sitting to sitting; which figures there are and what a run takes on disk do not."""
    make_billion = _load("make_billion")
    committed = json.loads(make_billion.DATA.read_text("utf-8"))
    measured = make_billion.measure(replicates=8, chunks=5, names=100, seconds=0.05)
    assert measured.keys() == committed.keys()
    assert measured["runs_per_chunk"] == committed["runs_per_chunk"]
    folder = run_study("paper", tmp_path / "r", replicates=200, chunk=200).folder
    n_bytes = sum(path.stat().st_size for path in (folder.path / "trials").iterdir())
    assert committed["bytes_per_run"] == pytest.approx(n_bytes / (9 * 200), rel=0.1)


def test_tables_on_the_page_of_a_billion_runs_follow_from_its_figures(tmp_path, monkeypatch):
    make_billion = _load("make_billion")
    figures = json.loads(make_billion.DATA.read_text("utf-8")) | {
        "runs_per_second_a_core": 1000.0,
        "speedup_of_all_cores": 1.6,
        "bytes_per_run": 2000.0,
        "runs_per_chunk": 500,
        "report_memory_bytes_per_run": 6400.0,
    }
    monkeypatch.setattr(make_billion, "DATA", tmp_path / "billion.json")
    make_billion.DATA.write_text(json.dumps(figures), "utf-8")
    page = make_billion.page_tables()
    assert "A billion runs are 2.0 TB in 2,000,000 chunks." in page
    assert "| 2 | 7.2 days | 3.2 MB/s | 3.2 |" in page
    assert "| 1,024 | 20.3 minutes | 1.6 GB/s | 1,638.4 |" in page
    assert "| memory of the report | 6.4 TB | 100 |" in page
    assert "e-0" not in page
    shares = [share for _, share, _, _ in make_billion.limits(figures)]
    assert shares == sorted(shares, reverse=True)


def _rows(name):
    path = _load("make_reproduced").TABLES / f"{name}.csv"
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def test_the_page_of_the_paper_states_the_numbers_of_its_table_2():
    rows = [row for row in _rows("published") if row["Condition"].startswith("novelty")]
    below_all = [row["The paper"] for row in rows if row["our runs at or below it: along the line"] == "0"]
    assert below_all == ["0.154", "0.166", "0.208", "0.180"]
    objective = [row for row in _rows("published") if row["Condition"].startswith("coverage")]
    assert [row["The paper"] for row in objective] == [row["The paper"] for row in rows]
    assert [
        row["The paper"] for row in objective if row["our runs at or below it: along the line"] == "0"
    ] == below_all
    lowest = {row["The paper"]: int(row["our runs at or below it: ends of steps"]) for row in rows}
    assert sorted(lowest[value] for value in below_all) == [2, 3, 3, 7]
    lowest = {row["The paper"]: int(row["our runs at or below it: ends of steps"]) for row in objective}
    assert sum(lowest[value] > 0 for value in below_all) == 3


def test_the_page_of_the_paper_states_the_numbers_of_plateaus():
    shares = {row["Condition"]: row for row in _rows("table-plateaus")}
    plateaus = {name: int(row["plateaus"].split()[0]) for name, row in shares.items()}
    assert max(plateaus[f"coverage-{level}"] for level in (10, 50, 80)) == 29
    assert [plateaus[f"novelty-{level}"] for level in (10, 50, 80)] == [32, 38, 43]
    ends = [shares[f"novelty-{level}"]["plateaus: interval"] for level in (10, 80)]
    (_, high), (low, _) = (re.findall(r"\d+", text) for text in ends)
    assert int(low) < int(high)  # the intervals overlap


def test_the_page_of_the_paper_states_the_numbers_of_neat_settings():
    for row in _rows("neat-sets"):
        difference = float(row["novelty − coverage"].replace("−", "-"))
        if row["constant input"].startswith("novelty only"):
            assert (difference > 0) == (row["NEAT settings"] == "rosenzweig-remy")
            assert float(row["p (Holm)"].removeprefix("< ")) < 0.05
        else:
            assert row["equivalent within ±0.02"] == "yes"
    equivalence = [row["Equivalence"] for row in _rows("constant-input")]
    assert sum(text.startswith("equivalent") for text in equivalence) == 3


def test_the_page_of_the_paper_states_the_numbers_of_the_constant_input():
    for row in _rows("constant-input"):
        one, other = (row[side].split("-") for side in ("First", "Second"))
        if one[0] == other[0]:  # with the input and without it
            assert row["Conclusion"] == f"{row['First']} above {row['Second']}"
        else:  # the two searches, with the same inputs
            assert one[2] == other[2]
            assert row["Conclusion"] == "inconclusive"


def test_the_page_of_the_paper_states_the_numbers_of_noise_and_selection():
    recorded, fresh = (
        {tuple(row["First - second"].split(" - ")): row[column] for row in _rows(name) if row[column]}
        for name, column in (("table-comparisons", "As recorded"), ("table-fresh", "Conclusion"))
    )
    for selection in ("coverage", "novelty", "random"):
        for level in ("50", "80"):
            assert recorded[f"{selection}-{level}", f"{selection}-10"] == "first higher"
        highest = recorded[f"{selection}-80", f"{selection}-50"]
        assert (highest == "first higher") == (selection == "random")
    for level in ("10", "50", "80"):
        for pair, conclusion in (
            ((f"novelty-{level}", f"coverage-{level}"), "first higher"),
            ((f"random-{level}", f"coverage-{level}"), "first lower"),
        ):
            assert fresh[pair] == recorded[pair] == conclusion  # and none of noise
    of_noise = [text for (one, other), text in fresh.items() if one.split("-")[0] == other.split("-")[0]]
    assert len(of_noise) == 9
    assert not [text for text in of_noise if text.startswith("first")]


def test_a_changed_output_is_noticed():
    page = "```console\n$ realitygap --version\nrealitygap 0.0.0\n```\n"
    text, problems = make_outputs.rewrite(page, "page")
    assert len(problems) == 1
    assert "-realitygap 0.0.0" in problems[0]
    assert make_outputs.rewrite(text, "page") == (text, [])


def test_groups_of_the_sidebar_have_at_most_seven_pages():
    groups = re.findall(r"```\{toctree\}\n(.*?)```", (DOCS / "index.md").read_text("utf-8"), re.DOTALL)
    pages = [[line for line in group.splitlines() if line and not line.startswith(":")] for group in groups]
    assert len(pages) > 5
    assert max(map(len, pages)) <= 7
    flat = [page for group in pages for page in group]
    assert len(set(flat)) == len(flat)


def test_doors_of_the_landing_page_and_words_of_a_search_lead_to_their_pages():
    landing = (DOCS / "index.md").read_text("utf-8")
    doors = re.findall(r":::\{grid-item-card\} (.*?)\n(.*?)\n:::\n", landing, re.DOTALL)
    assert [title for title, _ in doors] == ["Teach", "Research", "Repeat the paper", "My robot"]
    for title, door in doors:
        links = re.findall(r"\]\(([^)]+)\)", door)
        assert len(links) >= 3, title
        assert all((DOCS / link).exists() for link in links), title
    searched = {
        "plot": "how-to/figures.md",
        "teach": "tutorials/lesson.md",
        "sim2real": "how-to/gap.md",
        "setup": "how-to/install.md",
        "pandas": "how-to/python.md",
        "slurm": "how-to/cluster.md",
    }
    for word, page in searched.items():
        keywords = re.search(r"^    keywords: (.*)$", (DOCS / page).read_text("utf-8"), re.MULTILINE)[1]
        assert word in keywords.lower(), word


def test_nothing_that_is_installed_asks_for_an_address():
    for path in (ROOT / "src").rglob("*.*"):
        if path.suffix in {".py", ".toml", ".css", ".jinja"}:
            found = re.findall(r"https?://[^\s\"'`)>]+", path.read_text("utf-8"))
            names_only = {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
            assert set(found) <= names_only, path


def test_no_fence_of_backticks_has_backticks_in_its_title():
    """CommonMark, section 4.5: such a line opens no block, so the page shows its source. Three colons may be used."""
    for page in [*DOCS.rglob("*.md"), ROOT / "README.md"]:
        assert not re.findall(r"^ *```+\{.*`.*$", page.read_text("utf-8"), re.MULTILINE), page


def test_documents_name_no_addresses():
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *PAGES]:
        assert not re.search(r"https?://", path.read_text("utf-8")), path


def test_locked_packages_have_hashes_and_no_addresses():
    lines = (ROOT / "requirements.lock").read_text("utf-8").splitlines()
    pinned = [line for line in lines if "==" in line and not line.startswith("#")]
    assert len(pinned) > 20
    assert all(line.endswith("\\") for line in pinned)
    assert not [line for line in lines if re.search(r"https?:|index-url|find-links", line)]


AFTER_A_BARE_IMPORT = """
import os, sys
import matplotlib.pyplot, numba, numpy, polars, pydantic, scipy.stats, typer  # once for all
import realitygap

failed = []
for names in sys.argv[1:]:
    if os.fork() == 0:  # what one package imports must not help another
        try:
            os._exit(not all(callable(eval(name)) for name in names.split()))
        except BaseException:
            os._exit(1)
    failed += [names] if os.wait()[1] else []
print(*failed)
"""


@pytest.mark.slow
def test_python_twins_of_commands_are_found_after_a_bare_import():
    twins = [page.rstrip().splitlines()[-2] for page in reference_pages.command_pages().values()]
    names = sorted({re.match(r"[.\w]+", twin)[0] for twin in twins})
    assert len(names) > 20
    groups = [" ".join(group) for _, group in groupby(names, lambda name: name.rpartition(".")[0])]
    done = subprocess.run(
        [sys.executable, "-c", AFTER_A_BARE_IMPORT, *groups], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == []


def test_tables_on_the_page_of_speed_follow_from_its_figures():
    make_speed = _load("make_speed")
    figures = {
        name: {
            "ours": {"median": 2.0, "low": 1.0, "high": 3.0},
            "jyro": {"median": 5000.0, "low": 1.0, "high": 3.0, "ratio": 1234.5},
            "multineat": {"not_measured": "not done after 120 s"},
        }
        for name in make_speed.FIGURES
    }
    assert [make_speed.digits(value) for value in (52_614_339, 810_209, 5.834)] == [
        "52.6 million", "810,000", "5.83",
    ]  # fmt: skip
    table = make_speed.peers_table({"figures": figures})
    assert "| **1,230** | robot-steps a second, one core | Jyro | 5,000/s (1 to 3) | 2/s (1 to 3) |" in table
    assert "| – | robot-steps a second, one core | MultiNEAT | not measured: not done after 120 s |" in table
    assert make_speed.ahead_text(figures).startswith("No peer is faster")
    figures["realism_boxes"]["jyro"]["ratio"] = 0.5
    ahead = make_speed.ahead_text(figures).splitlines()
    title = make_speed.FIGURES["realism_boxes"][0]
    assert ahead[2:] == [f"* Jyro is 2 times as fast as realitygap: {title}."]
    assert f"| {title} | 2/s (1 to 3) |" in make_speed.realism_table(figures)
    engine = {
        "robot_steps_per_second": {"per_core": 34.8e6},
        "paper_runs_per_second": {"per_core": 8000.0},
        "paper_runs_recorded_per_second": {"per_core": 5000.0},
    }
    rows = make_speed.run_table(engine).splitlines()[2:]
    assert [row.split("|")[2].strip() for row in rows] == ["100 µs", "25 µs", "75 µs"]
    step = {"engine": {"variants": {"as it is": 5e7}, "draw_ns": 5.0}}
    table = make_speed.step_table({**step, "figures": {"pass_us": {"ours": {"side_by_side": 0.003}}}})
    assert [row.split("|")[3].strip() for row in table.splitlines()[2:]] == ["25 %", "15 %", "60 %"]
    assert "| double | 25.0 ns | 1.25 |" in make_speed.variants_table({"as it is": 5e7, "double": 4e7})


def test_figures_of_the_page_of_speed_are_those_that_its_command_measures():
    """Times differ from sitting to sitting; what is measured, of whom and how it is called does not."""
    make_speed = _load("make_speed")
    measured = json.loads(make_speed.DATA.read_text("utf-8"))
    names = (
        "import json, peers; "
        "print(json.dumps({f: [p.name for p in peers.PEERS if f in p.figures] for f in peers.FIGURES}))"
    )
    folder = make_speed.BENCHMARK.parent
    done = subprocess.run(
        [sys.executable, "-c", names], cwd=folder, capture_output=True, text=True, check=True
    )
    expected = json.loads(done.stdout)
    assert {figure: list(answers)[1:] for figure, answers in measured["figures"].items()} == expected
    assert expected.keys() == make_speed.FIGURES.keys()
    assert all("median" in answers["ours"] for answers in measured["figures"].values())


def _distance_rows(name):
    path = _load("make_distances").TABLES / f"{name}.csv"
    head, *rows = list(csv.reader(path.read_text("utf-8").splitlines()))
    return head, {row[0]: row[1:] for row in rows}


@pytest.mark.long
def test_numbers_on_the_page_of_distances_are_those_of_its_commands(tmp_path):
    make_distances = _load("make_distances")
    tables, figures = make_distances.make(tmp_path)
    assert {path.name: path.read_text("utf-8") for path in make_distances.TABLES.iterdir()} == tables
    assert {path.name for path in make_distances.FIGURES.iterdir()} == set(figures)


@pytest.mark.slow
def test_weights_on_the_page_of_distances_are_those_of_the_audit():
    make_distances = _load("make_distances")
    audits = {name: audit_distance(name) for name in ("paper", "hamming")}
    _, *rows = make_distances.weights(audits).splitlines()
    committed = (make_distances.TABLES / "weights.csv").read_text("utf-8").splitlines()
    assert set(rows) <= set(committed)
    assert (
        make_distances.times(n=5, seconds=0.01).splitlines()[0]
        == make_distances.TIMES.read_text("utf-8").splitlines()[0]
    )


def test_the_page_of_distances_states_the_numbers():
    _, coverage = _distance_rows("coverage")
    for name in ("paper-by-y", "ordered", "hamming", "edit", "coverage"):
        assert coverage[name][-2] == "inconclusive", name
        assert coverage[name][-1].startswith("equivalent within ±0.02"), name
    for name in ("jaccard", "alignment", "final", "random"):
        assert coverage[name][-2:] == [f"paper above {name}", ""]
    assert _number(coverage["random"][1]) < min(
        _number(coverage[name][1]) for name in ("jaccard", "alignment")
    )
    _, behaviors = _distance_rows("behaviors")
    novelty = {name: _number(row[6]) for name, row in behaviors.items() if row[6]}
    for name in ("jaccard", "alignment"):
        assert 0.4 < novelty[name] / novelty["paper"] < 0.65
    assert min(novelty["hamming"], novelty["edit"]) > novelty["paper"] > 0.5
    for name in ("paper-by-y", "ordered"):
        assert abs(_number(behaviors[name][3])) < 0.12
        assert abs(_number(behaviors[name][5])) < 0.02
    variety = {name: _number(row[7]) for name, row in behaviors.items()}
    assert min(variety, key=variety.get) == "final"
    del variety["final"]
    assert max(variety.values()) - min(variety.values()) < 0.03
    _, lengths = _distance_rows("lengths")
    assert all(0.75 < _number(cell) ** 2 < 0.95 for cell in lengths["paper"])
    for name in ("jaccard", "alignment"):
        assert all(_number(cell) ** 2 < 0.125 for cell in lengths[name])
    _, trials = _distance_rows("trials")
    assert all(_number(row[1]) > _number(row[0]) for row in trials.values())


def _number(cell):
    """The first number of a cell."""
    return float(cell.replace("−", "-").split()[0])


def test_the_page_of_sensors_has_the_numbers_of_the_robot_files():
    make_sensors = _load("make_sensors")
    lines = make_sensors.page_parts()["parts/sensors.md"].splitlines()
    heads = [line for line in lines if line.startswith("| number")]
    assert heads[0].endswith("| " + " | ".join(f"`{name}`" for name in make_sensors.ROBOTS) + " |")
    robots = [load_robot(name).range[0] for name in make_sensors.ROBOTS]
    decay = next(line for line in lines if line.startswith("| `decay` |"))
    assert decay.endswith(" | ".join(f"{robot.decay:.4g}" for robot in robots) + " |")


@pytest.mark.slow
def test_the_figure_of_sensors_is_drawn_from_readings_of_the_kernels():
    make_sensors = _load("make_sensors")
    distances = np.linspace(0.0, 0.3, 70)
    jyro = make_sensors.read(make_sensors.without_noise(load_robot("jyro")), distances, 1)[0]
    assert jyro == pytest.approx(np.maximum(1 - distances / 0.2, 0))
    noisy = make_sensors.read(load_robot("scribbler-s2-fluke1"), distances, 20)
    assert (noisy == 0).any()
    assert ((noisy >= 0) & (noisy <= 1)).all()


def test_page_on_robots_of_other_people_shows_missed_goals_first():
    make_real_data = _load("make_real_data")
    found = json.loads((DOCS / "data/real-data.json").read_text("utf-8"))
    results = [row[0] for row in make_real_data.verdicts(found)]
    assert results == sorted(results)
    assert len(results) == len(found["goals"]) + 1
    page = (DOCS / "explanations/real-data.md").read_text("utf-8")
    for name, text in make_real_data.page_parts().items():
        assert f"../generated/{name}" in page
        assert "nan" not in text
    assert "REAL (others' robots)" in make_real_data.page_parts()["parts/real-goals.md"]


def test_the_page_of_the_gap_explains_each_interval_that_holds_the_truth_too_seldom():
    rows = list(csv.DictReader((DOCS / "data" / "gap-coverage.csv").read_text("utf-8").splitlines()))
    assert len({tuple(row.values())[:6] for row in rows}) == 12
    kinds = {
        (row["differences"], row["measure"], row["on the target"])
        for row in rows
        if float(row["holds the truth [%]"]) < (88.0 if row["measure"] == "equivalence" else 93.0)
    }
    assert kinds == {
        ("exponential", "rms", "10"), ("exponential", "mmrv", "10"), ("exponential", "spread", "10"),
        ("few", "mmrv", "10"), ("few", "spread", "10"), ("normal", "spread", "2"), ("cells", "noise_ceiling", "20"),
    }  # fmt: skip
    page = (DOCS / "explanations" / "gap.md").read_text("utf-8")
    page = page.split("### How often the intervals hold the truth")[1].split("## How many controllers")[0]
    shares = {row["holds the truth [%]"] for row in rows}
    assert set(re.findall(r"(\d\d\.\d) %", page)) <= shares


def test_page_on_recovery_follows_from_the_scores_of_twins():
    make_recovery = _load("make_recovery")
    found = json.loads((DOCS / "data/recovery.json").read_text("utf-8"))
    parts = make_recovery.page_parts()
    page = (DOCS / "explanations/recovery.md").read_text("utf-8")
    assert all(f"../generated/{name}" in page for name in parts)
    by_twin = [
        {each["strategy"]: each["score"] for each in twin["scores"] if each["budget"] == 10}
        for twin in found["twins"]
    ]
    mean = {name: np.mean([scores[name] for scores in by_twin]) for name in by_twin[0]}
    for row in found["table"]:
        if row["budget"] == 10:
            assert row["score"]["estimate"] == pytest.approx(mean[row["strategy"]])
            assert f"`{row['strategy']}`" in parts["parts/recovery-table.md"]
    assert found["best"] == max((name for name in mean if name.startswith("trial")), key=mean.get)
    assert f"`{found['best']}` spends half" in page
    assert max(mean, key=mean.get) == found["best"]
    shares = {
        family: np.mean(
            [
                scores[found["best"]] / twin["intact"]
                for twin, scores in zip(found["twins"], by_twin, strict=True)
                if twin["family"] == family
            ]
        )
        for family in {twin["family"] for twin in found["twins"]}
    }
    assert found["families_that_regain"] == sum(share >= 0.8 for share in shares.values())
    is_met = found["families_that_regain"] >= 3
    assert f"**The first goal is {'met' if is_met else 'missed'}**" in parts["parts/recovery-words.md"]
    for part, difference in found["combined_minus_part"].items():
        assert difference["estimate"] == pytest.approx(mean["trial-and-error-combined"] - mean[part])


@pytest.mark.parametrize("path", sorted(DOCS.rglob("tutorials/*.ipynb")), ids=lambda path: path.name)
def test_notebooks_are_stored_without_outputs(path):
    cells = [cell for cell in json.loads(path.read_text("utf-8"))["cells"] if cell["cell_type"] == "code"]
    assert cells
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)


@pytest.mark.parametrize(
    ("now", "is_near"),
    [
        ("drive.gain 1.031 m", True),
        ("drive.gain 1.011 m", True),
        ("drive.gain 1.06 m", False),
        ("drive.gain 1.03 cm", False),
        ("drive.gain 1.03 m 0.1", False),
        ("drive.gain   1.0305 m", True),
    ],
)
def test_fitted_numbers_of_a_page_may_differ_by_two_percent(now, is_near):
    assert make_outputs.are_near("drive.gain 1.030 m", now) == is_near


@pytest.mark.parametrize(
    ("now", "is_near"),
    [
        ("delay -0.0038 s -0.0216 to 0.0127", True),
        ("delay -0.0038 s -0.0216 to 0.0170", False),
        ("delay -0.0005 s -0.0212 to 0.0126", False),
        ("delay 0.0042 s -0.0212 to 0.0126", False),
    ],
)
def test_fitted_numbers_of_a_page_may_differ_by_a_tenth_of_their_interval(now, is_near):
    assert make_outputs.are_near("delay -0.0042 s -0.0212 to 0.0126", now) == is_near


def test_the_table_of_evaluations_a_second_follows_from_its_data():
    found = json.loads((DOCS / "data" / "map-elites-speed.json").read_text("utf-8"))
    page = (DOCS / "how-to" / "map-elites.md").read_text("utf-8")
    table = page[page.index("## Speed") :]
    shown = [float(number.replace(",", "")) for number in re.findall(r"\| ([\d,]+) \|\n", table)]
    names = ("ours", "pyribs", "ours_in_maze", "kheperax")
    assert shown == [round(found[name]) for name in names]
    assert found["ratio"] == pytest.approx(found["ours"] / found["pyribs"])
    assert found["ratio_in_maze"] == pytest.approx(found["ours_in_maze"] / found["kheperax"])


def test_the_archives_of_the_maze_of_kheperax_follow_from_their_data():
    found = json.loads((DOCS / "data" / "map-elites-kheperax.json").read_text("utf-8"))
    page = " ".join((DOCS / "how-to" / "map-elites.md").read_text("utf-8").split())
    filled, scores = ([run[name] for run in found["ours"]] for name in ("filled", "qd_score"))
    theirs = found["kheperax"]
    assert f"After {theirs['evaluations']:,} evaluations, three archives" in page
    assert f"fill {100 * min(filled):.1f} % to {100 * max(filled):.1f} % of the cells" in page
    assert f"that of the example {100 * theirs['filled']:.1f} %." in page
    assert f"are {min(scores):,.0f} to {max(scores):,.0f}, and {theirs['qd_score']:,.0f}" in page


def test_the_numbers_of_the_search_follow_from_their_data():
    found = json.loads((DOCS / "data" / "recovery-parameters.json").read_text("utf-8"))
    page = " ".join((DOCS / "how-to" / "transfer.md").read_text("utf-8").split())
    score = {
        tuple(row[name] for name in ("spread", "offset", "kappa", "unlikely")): row["scores"][2]
        for row in found["table"]
    }
    assert found["budgets"][2] == 10
    own, papers = score[0.1, 0.1, 1.0, 0.1], score[1.0, 0.0, 0.05, None]
    assert f"mean coverage is {own:.3f}, and {papers:.3f} with the paper's numbers" in page
    assert f"12 trials of each, reaches {found['best_by_12_trials_of_each']:.3f}." in page
    assert f"chosen on {found['robots']} damaged robots" in page


def way_name(way):
    """Name a way to deal with noise as the page does."""
    parts = ["dominated novelty"] if "competition" in way else []
    n = way.get("repeats", 1)
    if n > 1 or not (way["retry"] or parts):
        parts.append(f"{n} trial{'s' * (n > 1)}")
    if way["retry"]:
        parts.append(f"retry {way['retry']:g}")
    if way.get("depth", 1) > 1:
        parts.append(f"depth {way['depth']}")
    return ", ".join(parts)


def test_the_table_of_ways_to_deal_with_noise_follows_from_its_data():
    found = json.loads((DOCS / "data" / "map-elites-noise.json").read_text("utf-8"))
    page = (DOCS / "how-to" / "map-elites.md").read_text("utf-8")
    for each in found["ratios"]:
        cells = [
            "{:.3f} [{:.3f}, {:.3f}]".format(row["corrected"], *row["corrected_interval"])
            for row in found["rows"]
            if row["way"] == each["way"]
        ]
        assert f"| {way_name(each['way'])} | {' | '.join(cells)} | {each['ratio']:.2f} |" in page
    assert len(found["rows"]) == 3 * len(found["ratios"]) == 51
    defaults = ArchiveSettings()
    assert found["default"].items() <= defaults.model_dump().items()
