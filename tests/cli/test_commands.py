"""The command line as a user meets it: a process, its output and its exit status."""

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
import typer
from typer.testing import CliRunner

from realitygap._version import __version__
from realitygap.cli import _commands, app
from tests.commands import Done
from tests.commands import run_command as realitygap
from tests.interrupted import INTERRUPTED

DATA = Path(__file__).parent.parent / "data"


def started(*words: str, cwd: Path | None = None, **options) -> subprocess.CompletedProcess:
    """A command in a new Python, which takes a second to import everything."""
    command = [sys.executable, "-m", "realitygap", *words]
    return subprocess.run(
        command, capture_output=True, text=True, cwd=cwd, timeout=300, check=False, **options
    )


def one_message(done: subprocess.CompletedProcess | Done, *texts: str) -> str:
    """The error of a command: one message, no traceback, status 1."""
    assert done.returncode == 1, done
    assert done.stderr.count("realitygap: ") == 1
    assert "Traceback" not in done.stderr
    for text in texts:
        assert text in done.stderr
    return done.stderr


APP = typer.main.get_command(app)
COMMANDS = sorted(APP.commands)


def test_list_of_commands_has_every_command_with_its_first_line():
    summaries = {command.name: command.summary for command in _commands.COMMANDS}
    assert sorted(summaries) == COMMANDS
    for name, command in APP.commands.items():
        assert summaries[name] == command.help.split("\n")[0]
        assert len(summaries[name]) <= 58


def test_list_of_commands_cuts_no_line_at_any_width():
    for columns in (60, 80, 200):
        text = _commands.root_help(columns)
        assert max(map(len, text.splitlines())) <= min(columns, 80)
        words = " ".join(text.split())
        for command in _commands.COMMANDS:
            assert f"{command.name} {command.summary}" in words


def test_list_of_commands_begins_with_five_and_ends_with_advanced_ones():
    names = {title: [command.name for command in commands] for title, commands in _commands.SECTIONS.items()}
    first, *_, last = names
    assert len(names[first]) == 5
    advanced = {"simulate", "audit-results", "audit-distance", "bench", "digest", "lens"}
    assert (last, set(names[last])) == ("Advanced", advanced)
    lines = _commands.root_help(80).splitlines()
    assert lines.index(f"{first}:") < 6


def members() -> Iterator[tuple[list[str], Any]]:
    """Yield the words of each command and group, and the command itself."""
    for name, group in APP.commands.items():
        yield [name], group
        for key, member in getattr(group, "commands", {}).items():
            yield [name, key], member


@pytest.mark.slow
def test_help_of_every_command_is_whole_at_any_width():
    for name, command in members():
        for columns in (60, 80, 200):
            done = CliRunner().invoke(app, [*name, "--help"], terminal_width=columns - 2)
            words = "".join(done.stdout.split())
            assert max(map(len, done.stdout.splitlines())) <= columns, (name, columns)
            for text in (command.help, *(parameter.help for parameter in command.params)):
                assert "".join((text or "").split()) in words, (name, columns, text)
            for parameter in command.params:
                title = getattr(parameter, "rich_help_panel", None)
                assert title is None or f"\n{title}:\n" in done.stdout, (name, title)


def test_root_prints_the_same_list_with_and_without_typer():
    done = started("--help", env={**os.environ, "COLUMNS": "80"})
    assert (done.returncode, done.stdout) == (0, _commands.root_help(80))
    assert CliRunner().invoke(app, ["-h"], terminal_width=78).stdout == _commands.root_help(80)
    bare = started(env={**os.environ, "COLUMNS": "80"})
    assert (bare.returncode, bare.stdout) == (2, done.stdout)


def test_unknown_command_names_a_similar_one():
    done = started("reprot")
    assert done.returncode == 2
    assert "report" in done.stderr


def test_unknown_option_names_similar_ones_only():
    """The two dashes made --run similar to --out."""
    for words, expected in (("report x --run 1", None), ("report x --figurs png", "--figures")):
        done = started(*words.split())
        assert done.returncode == 2
        assert "No such option" in done.stderr
        assert (expected or "") in done.stderr
        assert expected is not None or "--out" not in done.stderr


def test_help_has_an_example_and_the_python_twin():
    for command in COMMANDS:
        done = CliRunner().invoke(app, [command, "--help"])
        assert done.exit_code == 0, command
        assert f"Example: realitygap {command}" in done.stdout, command
        assert "In Python: realitygap." in done.stdout, command


def test_python_twins_exist():
    import realitygap as package

    for command in typer.main.get_command(app).commands.values():
        path = re.search(r"In Python: realitygap\.([\w.]+)", command.help)[1]
        thing = package
        for name in path.split("."):
            if not hasattr(thing, name):
                __import__(f"{thing.__name__}.{name}")
            thing = getattr(thing, name)
        assert callable(thing), path


def test_help_imports_nothing_heavy():
    heavy = {"numpy", "numba", "polars", "scipy", "matplotlib", "jinja2"}
    assert not loaded_for("run", "--help") & heavy
    heavy |= {"typer", "pydantic"}  # newer versions of Typer load Pydantic for each command
    assert not loaded_for("--help") & heavy
    assert not loaded_for("--version") & heavy


def loaded_for(*words: str) -> set[str]:
    """The top-level modules that a command has imported when it ends."""
    code = (
        "import atexit, sys; atexit.register(lambda: print(*sys.modules, file=sys.stderr)); "
        "from realitygap.cli import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
    return {name.split(".")[0] for name in done.stderr.split()}


def test_every_number_of_every_command_must_be_finite():
    """Python's `float` takes nan, inf and 1e400. Bounds of an option do not refuse all of them."""
    n_numbers = 0
    for path, command in members():
        hints = get_type_hints(command.callback) if command.params and command.callback else {}
        needed = [
            word
            for parameter in command.params
            if parameter.required
            for word in ((parameter.opts[0], "1") if parameter.opts[0].startswith("-") else ("1",))
        ]
        for parameter in command.params:
            if float in (hints.get(parameter.name), *get_args(hints.get(parameter.name))):
                n_numbers += 1
                for wrong in ("nan", "inf", "-inf", "1e400"):
                    if parameter.opts[0].startswith("-"):
                        words = [*needed, f"{parameter.opts[0]}={wrong}"]
                    else:
                        words = ["--", *(wrong for word in needed)]
                    done = CliRunner().invoke(app, [*path, *words])
                    assert done.exit_code == 2, f"{path} {words}: {done.output}"
                    assert "finite number" in done.output or ": expected " in done.output, f"{path} {words}"
    assert n_numbers > 20


def test_every_command_refuses_words_for_whole_numbers_as_study_files_do():
    n_options = 0
    for path, command in members():
        hints = get_type_hints(command.callback) if command.params and command.callback else {}
        for parameter in command.params:
            hint = hints.get(parameter.name)
            if parameter.opts[0].startswith("-") and int in (hint, *get_args(hint)):
                n_options += 1
                done = CliRunner().invoke(app, [*path, f"{parameter.opts[0]}=two"])
                assert done.exit_code == 2, f"{path}: {done.output}"
                assert "expected a whole number, got 'two'." in done.output, f"{path} {parameter.opts[0]}"
    assert n_options > 20


def test_option_version_prints_the_version():
    assert started("--version").stdout.strip() == f"realitygap {__version__}"


def test_run_prints_a_summary_and_where_things_are(tmp_path):
    done = realitygap("run", "paper", "--replicates", "6", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for text in ("coverage-10", "novelty-50", "random-80", "SIM", "0.154 0.222", "54 of 54 runs"):
        assert text in done.stdout
    assert "results/paper" in done.stdout
    assert len(max(done.stdout.splitlines(), key=len)) <= 100
    again = realitygap("run", "paper", "--replicates", "6", cwd=tmp_path)
    assert "All 54 runs existed already" in again.stdout


def test_run_as_json(tmp_path):
    done = realitygap("run", "paper", "--replicates", "6", "--json", "--out", str(tmp_path / "r"))
    summary = json.loads(done.stdout)
    assert summary["computed"] == 54
    rows = {row["condition"]: row for row in summary["conditions"]}
    assert len(rows) == 9
    for row in rows.values():
        assert row["n"] == 6
        assert 0 < row["ends_median"] <= row["line_median"] <= 1
        assert row["line_low"] <= row["line_median"] <= row["line_high"]
    assert rows["coverage-10"]["published"] == [0.154, 0.222, 0.166]


@pytest.mark.slow
def test_run_ends_with_130_on_ctrl_c_and_goes_on(tmp_path):
    command = [sys.executable, "-m", "realitygap", "run", "paper", "--replicates", "300", "--chunk", "3"]
    process = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    trials = tmp_path / "results" / "paper" / "trials"
    until = time.monotonic() + 120
    while len(list(trials.glob("*.parquet"))) < 3 and time.monotonic() < until:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode in INTERRUPTED, errors
    assert "Run the same command to resume" in errors
    assert "Traceback" not in errors
    before = len(list(trials.glob("*.parquet")))
    assert before >= 3
    done = realitygap("run", "paper", "--replicates", "300", cwd=tmp_path)
    assert done.returncode == 0
    computed = int(re.search(r"(\d+) of 2700 runs computed", done.stdout)[1])
    assert 0 < computed <= 2700 - 3 * 3


def limit_file_size() -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))


@pytest.mark.slow
def test_a_full_disk_stops_the_run_with_a_message_and_loses_nothing(tmp_path):
    small = realitygap("run", "paper", "--replicates", "4", "--chunk", "1", "--out", "r", cwd=tmp_path)
    assert small.returncode == 0, small.stderr
    environment = {**os.environ, "NUMBA_CACHE_DIR": ""}
    full = started(
        "run", "paper", "--replicates", "200", "--chunk", "100", "--out", "r",
        cwd=tmp_path, preexec_fn=limit_file_size, env=environment,
    )  # fmt: skip
    one_message(full, "to resume")
    assert len(list((tmp_path / "r" / "trials").glob("*.parquet"))) == 9 * 4
    done = realitygap("run", "paper", "--replicates", "8", "--out", "r", cwd=tmp_path)
    assert "36 of 72 runs computed" in done.stdout


def limit_memory() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (300_000 * 1024, 300_000 * 1024))


@pytest.mark.slow
def test_lack_of_memory_is_one_message(tmp_path):
    """A library that could not be loaded was reported as output that cannot be written."""
    short = started("run", "paper", "--replicates", "1", "--out", "r", cwd=tmp_path, preexec_fn=limit_memory)
    one_message(short, "There is not enough memory")


def test_a_torn_file_is_named(tmp_path):
    realitygap("run", "paper", "--replicates", "1", "--out", "r", cwd=tmp_path)
    victim = next((tmp_path / "r" / "trials").glob("*.parquet"))
    victim.write_bytes(victim.read_bytes()[:1000])
    for command in ("run paper --replicates 1 --out r", "digest r", "report r"):
        one_message(realitygap(*command.split(), cwd=tmp_path), victim.name)


def test_digest_prints_64_digits(tmp_path):
    realitygap("run", "paper", "--replicates", "1", "--out", "r", cwd=tmp_path)
    done = realitygap("digest", "r", cwd=tmp_path)
    assert re.fullmatch(r"[0-9a-f]{64}\n", done.stdout)


def test_digest_says_that_runs_are_missing(tmp_path):
    """Of an interrupted study it printed a digest like any other."""
    realitygap("run", "paper", "--replicates", "2", "--out", "r", cwd=tmp_path)
    whole = realitygap("digest", "r", cwd=tmp_path)
    assert whole.stderr == ""
    next((tmp_path / "r" / "trials").glob("novelty-10.*")).unlink()
    part = realitygap("digest", "r", cwd=tmp_path)
    assert part.returncode == 0
    assert re.fullmatch(r"[0-9a-f]{64}\n", part.stdout)
    assert part.stdout != whole.stdout
    assert part.stderr.startswith("realitygap: note: 17 of 18 runs exist")
    assert part.stderr.count("\n") == 1


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    assert realitygap("run", "paper", "--replicates", "1", "--out", "r", cwd=folder).returncode == 0
    return folder


COMMANDS_THAT_PRINT = [
    "digest r",
    "run paper --replicates 1 --out r",
    "run paper --replicates 1 --out r --json",
]


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="the system has no full device")
@pytest.mark.parametrize("words", COMMANDS_THAT_PRINT)
def test_output_that_cannot_be_written_is_one_message(small, words):
    """It ended in a traceback. The device is only ever opened as what the shell redirects to."""
    command = f"{sys.executable} -m realitygap {words} > /dev/full"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, cwd=small, check=False)
    one_message(done, "The output cannot be written: No space left on device")


@pytest.mark.slow
@pytest.mark.parametrize("words", COMMANDS_THAT_PRINT)
def test_output_that_nobody_reads_is_no_failure_with_a_traceback(small, words):
    closed = subprocess.run(
        f"{sys.executable} -m realitygap {words} >&-",
        shell=True, capture_output=True, text=True, cwd=small, check=False,
    )  # fmt: skip
    assert (closed.returncode, closed.stderr) == (0, "")
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "realitygap", *words.split()]
    piped = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, cwd=small, check=False)
    os.close(write)
    assert (piped.returncode, piped.stderr) == (1, "")


@pytest.mark.slow
def test_a_terminal_without_some_letters_shows_question_marks(small):
    """Where only ASCII can be printed, the apostrophe of the title ended in a traceback."""
    done = started(
        "run", "paper", "--replicates", "1", "--out", "r",
        cwd=small, env={**os.environ, "PYTHONIOENCODING": "ascii"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "The paper?s simulated study" in done.stdout


def test_printed_commands_and_paths_can_be_pasted_into_a_shell(tmp_path):
    done = realitygap("run", "paper", "--replicates", "1", "--out", "my results", cwd=tmp_path)
    assert "realitygap report 'my results'" in done.stdout
    assert "polars.scan_parquet('my results/trials/*.parquet')" in done.stdout
    done = realitygap("new-study", "my study.toml", cwd=tmp_path)
    assert done.stdout.endswith("Run it with: realitygap run 'my study.toml'\n")


def test_an_error_of_run_begins_with_its_first_letter():
    """An empty line, meant to end a progress bar that was never shown, came first."""
    assert realitygap("run", "papr").stderr.startswith("realitygap: Unknown study")


def test_new_study_writes_a_file_that_runs(tmp_path):
    assert realitygap("new-study", "mine.toml", cwd=tmp_path).returncode == 0
    done = realitygap("run", "mine.toml", "--replicates", "1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "results" / "mine" / "study.json").exists()


def test_new_study_never_overwrites(tmp_path):
    (tmp_path / "mine.toml").write_text("precious")
    one_message(realitygap("new-study", "mine.toml", cwd=tmp_path), "exists and was not changed")
    assert (tmp_path / "mine.toml").read_text() == "precious"


def _browser_that_notes(folder: Path) -> dict[str, str]:
    """An environment whose browser writes the address it is given into the file `opened`."""
    browser = folder / "browser"
    browser.write_text(f"#!/bin/sh\nprintf '%s\\n' \"$1\" >> '{folder}/opened'\n")
    browser.chmod(0o755)
    return os.environ | {"BROWSER": f"{browser} %s"}


def _small_study(folder: Path) -> str:
    """The file of a study whose report is drawn soon."""
    (folder / "small.toml").write_text(
        '[study]\nname = "small"\nreplicates = 6\n[[condition]]\nname = "coverage"\n'
    )
    return "small.toml"


@pytest.mark.slow
def test_open_shows_the_report_in_the_browser(tmp_path):
    options = {"cwd": tmp_path, "env": _browser_that_notes(tmp_path)}
    small = _small_study(tmp_path)
    done = realitygap("run", small, "--out", "r", "--open", **options)
    assert done.returncode == 0, done.stderr
    page = tmp_path / "r" / "report.html"
    assert page.stat().st_size > 10_000
    assert re.search(r"^Written: r/report\.html \(\d+\.\d s\)$", done.stdout, re.MULTILINE)
    assert (tmp_path / "opened").read_text() == f"{page.as_uri()}\n"
    done = realitygap("report", "r", "--out", "other.html", "--open", **options)
    assert done.returncode == 0, done.stderr
    other = (tmp_path / "other.html").as_uri()
    assert (tmp_path / "opened").read_text() == f"{page.as_uri()}\n{other}\n"
    done = realitygap("run", small, "--out", "r", "--open", "--json", **options)
    assert json.loads(done.stdout)["computed"] == 0, "what is printed stays JSON"
    assert (tmp_path / "opened").read_text().count("\n") == 3


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the system opens a browser by itself")
def test_open_says_where_the_page_is_when_there_is_no_browser(tmp_path):
    realitygap("run", _small_study(tmp_path), "--out", "r", cwd=tmp_path)
    unwanted = ("BROWSER", "DISPLAY", "WAYLAND_DISPLAY")
    alone = {key: value for key, value in os.environ.items() if key not in unwanted} | {"PATH": str(tmp_path)}
    done = realitygap("report", "r", "--open", cwd=tmp_path, env=alone)
    assert done.returncode == 0, done.stderr
    assert "no browser could be opened here" in done.stderr
    assert (tmp_path / "r" / "report.html").as_uri() in done.stderr


@pytest.mark.slow
def test_simulate_repeats_jyro(tmp_path):
    case = DATA / "jyro" / "s15_net_linear_a.json"
    done = realitygap("simulate", str(case), "--out", "track.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "track.csv").read_text() == case.with_suffix(".csv").read_text()


@pytest.mark.slow
def test_bench_measures_what_it_names():
    done = realitygap("bench", "--json", "--seconds", "0.05")
    figures = json.loads(done.stdout)
    assert set(figures) == {
        "robot_steps_per_second",
        "robot_steps_two_hidden_per_second",
        "paper_runs_per_second",
        "paper_runs_novelty_per_second",
        "paper_runs_recorded_per_second",
        "neat_share",
        "peak_gflops",
        "robot_steps_per_gflop",
        "machine",
        "versions",
    }
    assert isinstance(
        figures.pop("neat_share"), float
    )  # a difference of two times: noise where both are short
    for name in list(figures)[:5]:
        assert set(figures[name]) == {"per_core", "all_cores"}
        assert all(rate > 0 for rate in figures[name].values())


@pytest.mark.parametrize("seconds", ["inf", "0", "nan"])
def test_bench_ends(seconds):
    """With inf it never did."""
    done = realitygap("bench", "--seconds", seconds)
    assert done.returncode == 2
    assert "Invalid value for '--seconds'" in done.stderr


@pytest.mark.slow
def test_bench_of_a_task_prints_its_figures_beside_the_published_ones():
    words = ("bench", "xor", "--settings", "stanley-2002", "--seeds", "2", "--change", "generations=3")
    words += ("--change", "start_topology=random")
    figures = json.loads(realitygap(*words, "--json").stdout)
    assert figures["settings"] == "stanley-2002 generations=3 start_topology=random"
    assert (figures["task"], figures["seeds"]) == ("xor", 2)
    assert figures["published"]["mean_evaluations"] == 4755
    table = realitygap(*words).stdout
    assert re.search(r"mean evaluations +\S+ +4,755", table)
    assert f"{figures['solved']} of 2" in table


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        ("bench xr", ["Unknown task 'xr'", "Did you mean 'xor'?"]),
        (
            "bench nonsense",
            ["Unknown task 'nonsense'", "xor, double-pole,", "maze-medium", "maze-hard", "realism"],
        ),
        ("bench maze-x", ["Unknown task 'maze-x'", "Did you mean 'maze-hard'?", "maze-medium"]),
        ("bench xor --settings stanley", ["Unknown NEAT settings 'stanley'"]),
        ("bench xor --change crossover", ["expected KEY=VALUE"]),
        ("bench xor --change crossover=0 --change crossover=1", ["--change gives crossover twice: 0 and 1"]),
        ("bench xor --change crossover=2", ["crossover: expected at most 1.0, got 2"]),
        ("bench xor --seconds 1", ["--seconds is only for the measurement of speed"]),
        ("bench realism --seeds 3", ["--seeds is only for a task"]),
        ("bench --seeds 3", ["--seeds is only for a task"]),
        ("bench --seed 0", ["--seed is only for a task"]),
        ("run papr", ["Unknown study 'papr'", "Did you mean 'paper'?"]),
        ("run nowhere.toml", ["no file nowhere.toml", "new-study"]),
        ("digest nowhere", ["nowhere does not exist"]),
        ("report nowhere", ["nowhere does not exist"]),
        ("simulate nowhere.json --out x.csv", ["nowhere.json"]),
        ("simulate nowhere.json --out x.html", ["x.html ends in .html", "expected .csv"]),
        ("new-study mine.txt", ["does not end in .toml"]),
        ("new-study no/such/folder/mine.toml", ["cannot be written"]),
        ("run paper --replicates 1 --out /dev/null/x", ["/dev/null/x"]),
    ],
)
def test_a_wrong_word_gets_one_message(words, texts, tmp_path):
    one_message(realitygap(*words.split(), cwd=tmp_path), *texts)


@pytest.mark.parametrize(
    "words",
    ["run", "run paper --replicates 0", "run paper --replicates x", f"bench xor --seed {2**63}", "fly"],
)
def test_wrong_usage_ends_with_2(words, tmp_path):
    done = realitygap(*words.split(), cwd=tmp_path)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_message_shows_control_characters_of_a_file_as_escapes(tmp_path):
    (tmp_path / "study.toml").write_text('["\\u001b[2Jx\\u202e"]\n')
    done = realitygap("run", "study.toml", cwd=tmp_path)
    one_message(done, "\\x1b[2Jx\\u202e: unknown section")
    assert "\x1b" not in done.stderr


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("run",), "Missing argument 'STUDY'. For example: realitygap run paper --open"),
        (("try", "x.json"), "Missing option '--on'. For example: realitygap try champion.json --on"),
        (
            ("run", "paper", "--noise", "0.3"),
            "It is a setting of the study file. Copy one and change it: realitygap",
        ),
        (("gap", "rover.toml", "jyro"), "write sim:rover.toml"),
        (("robot", "drive", "sim", "1"), "use emulator://s2"),
        (("new-study", "paper"), "To copy the study paper: realitygap new-study my-study.toml --from paper"),
        (("try", ".", "--on", "jyro"), "Export one: realitygap export . -o champion.json"),
    ],
)
def test_common_mistakes_of_newcomers_suggest_a_working_command(words, expected):
    done = realitygap(*words)
    assert done.returncode != 0
    assert expected in " ".join(done.stderr.split())
