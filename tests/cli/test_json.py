"""Each command with `--json`: the numbers and files that it prints without are in its JSON."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.cli._options import print_json
from realitygap.errors import StudyError
from realitygap.evolution import NeatSettings, Population
from realitygap.world import load_calibration, load_robot
from tests.cli.test_import import DISC, MAP
from tests.logs.made import drive, rows, wall_table, write, write_sample

from .invoked import printed as run

pytestmark = pytest.mark.slow

PORT = "emulator://s2?fluke=2&arena=paper&seed=1&speed=off"
ROOT = Path(__file__).parent.parent.parent

COMMANDS = {
    "platforms": "platforms",
    "platforms of a class": "platforms --check jyro",
    "families": "twin families",
    "family": "twin families worn",
    "info": f"robot info {PORT}",
    "sense": f"robot sense {PORT}",
    "battery": f"robot battery {PORT}",
    "recording": "robot show-recording session.jsonl --wire",
    "recording that is cut off": "robot show-recording cut.jsonl",
    "audit of results": f"audit-results {ROOT / 'examples' / 'table-2.csv'} --denominator 72",
    "audit of a distance": "audit-distance jaccard --seed 7 -o distance.svg",
    "import": "import drive.csv --base pioneer -o trials.jsonl",
    "import by a mapping": "import drive.csv --map drive.toml -o trials.jsonl",
    "log": "calibrate motion --from drive.csv --map drive.toml -o drive-fit.toml",
    "table of readings": "calibrate sensors --from wall.sample --base disc.toml -o wall.toml",
    "path": "calibrate path --robot sim -o path.toml",
    "sensors": "calibrate sensors --robot sim --budget 6 -o sensors.toml --figure sensors.svg",
    "run": "run paper --replicates 6 --out runs",
    "gap": "gap sim jyro --n-controllers 4 --trials 3 --margin 0.05 --report gap.html",
    "close": "close sim sim --what path --budget 2 --n-controllers 5 --trials 2 -o closed",
    "plan": "plan --effect 0.1",
    "plan of a correlation": "plan --correlation 0.9",
    "try": "try champion.json --on sim --trials 2 --steps 10",
    "task": "bench xor --settings stanley-2002 --seeds 2 --change generations=3",
}  # fmt: skip
"""Commands whose output is the same each time. `test_score` and `test_track` check the others."""

ELSEWHERE = {"robot list", "drive", "score", "track", "transfer", "trials"}

NO_FACTS = (
    r"9[05] % interval|interval of 90 %|at least 95 %|computed in .*|\d+/\d+ = \S+|k/\d+|\(\d+ bytes\)|"
    r"In Python: .*|sim:\S+|realitygap \S+.*|--\S+"
)
"""Texts with numbers that are the same each time: explanations, hints, and code."""


def commands_of(group: click.Command, words: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield each command that has `--json`."""
    if isinstance(group, click.Group):
        for name, each in group.commands.items():
            yield from commands_of(each, (*words, name))
    elif any("--json" in option.opts for option in group.params):
        yield " ".join(words)


def test_every_command_with_json_is_checked():
    checked = {" ".join(words.split()[:2]) for words in COMMANDS.values()} | ELSEWHERE
    checked |= {words.split()[0] for words in COMMANDS.values()}
    assert set(commands_of(typer.main.get_command(app))) <= checked


def missing_facts(text: str, values: Any) -> list[str]:
    """Return the numbers and files in a text that are not in JSON values."""
    strings, numbers = set(), set()

    def visit(value: Any) -> None:
        if isinstance(value, dict):
            for key, part in value.items():
                visit(key)
                visit(part)
        elif isinstance(value, list):
            numbers.add(float(len(value)))
            for part in value:
                visit(part)
        elif isinstance(value, str):
            strings.add(value)
            numbers.update(float(each) for each in re.findall(r"\d*\.?\d+(?:e[-+]?\d+)?", value))
        elif isinstance(value, int | float) and value is not None:
            numbers.add(abs(float(value)))

    visit(values)
    known = np.array(sorted(numbers))
    joined = " ".join(strings)
    missing = []
    for word in re.sub(NO_FACTS, " ", text).split():
        word = word.strip("[](),;:%±'\"").rstrip(".")
        if re.search(r"\.(toml|jsonl|html|svg|png|csv)$", word):
            missing += [] if word in joined else [word]
        elif re.fullmatch(r"[-+−]?(\d[\d,]*)?\.?\d*(e[-+]?\d+)?", word) and re.search(r"\d", word):
            number = abs(float(word.replace(",", "").replace("−", "-")))
            digits = len(word.partition(".")[2].partition("e")[0])
            scale = 10.0 ** int(word.partition("e")[2] or 0)
            near = np.abs(np.concatenate([known, 100 * known, 1000 * known]) - number)
            missing += [] if (near <= 0.6 * 10.0**-digits * scale).any() else [word]
    return missing


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with all inputs of the commands."""
    folder = tmp_path_factory.mktemp("json")
    settings = NeatSettings.named("rosenzweig-remy", population=2)
    Population(3, 2, settings, seed=1).ask()[0].save(folder / "champion.json")
    (folder / "disc.toml").write_text(DISC, "utf-8")
    (folder / "drive.toml").write_text(MAP, "utf-8")
    write(folder / "drive.csv", rows(*drive(200, noise=0.002)))
    return folder


def test_json_has_what_is_printed(folder, monkeypatch):
    monkeypatch.chdir(folder)
    robot = load_robot(folder / "disc.toml")
    cells = wall_table(
        robot.with_numbers({f"range.{k}.decay": 0.012 for k in range(4)}), 5 + 4 * np.arange(6), 24
    )
    write_sample(folder / "wall.sample", np.round(cells * 1023), 5, 4, "{:.0f}")
    run("robot", "drive", PORT, "0.5", "--record", "session.jsonl")
    (folder / "cut.jsonl").write_bytes((folder / "session.jsonl").read_bytes()[:-9])
    wrong = {}
    for name, command in COMMANDS.items():
        words = command.split()
        text = CliRunner().invoke(app, words, catch_exceptions=False)
        values = CliRunner().invoke(app, [*words, "--json"], catch_exceptions=False)
        assert (text.exit_code, values.exit_code) == (0, 0), (name, text.output, values.output)
        try:
            missing = missing_facts(text.stdout, json.loads(values.stdout))
        except ValueError:
            missing = [f"not JSON: {values.stdout}"]
        if missing:
            wrong[name] = missing
    assert not wrong


def test_calibration_file_and_json_have_errors_verdict_and_reasons(folder, monkeypatch):
    monkeypatch.chdir(folder)
    command = "calibrate motion --from drive.csv --map drive.toml -o fit.toml --json"
    values = json.loads(run(*command.split()))
    made = load_calibration(folder / "fit.toml")
    assert values["held_out"] == made.held_out
    assert set(made.held_out["errors"]) == {
        "fitted",
        "nominal numbers",
        "nominal, uniform noise",
        "lookup table",
    }
    assert values["verdict"] == made.verdict != ""
    assert tuple(values["reasons"]) == made.reasons != ()
    text = (folder / "fit.toml").read_text("utf-8")
    old = [line for line in text.splitlines() if not line.startswith("verdict")]
    start = old.index("reasons = [")
    end = old.index("]", start)
    (folder / "old.toml").write_text("\n".join(old[:start] + old[end + 1 :]), "utf-8")
    assert load_calibration(folder / "old.toml").held_out == made.held_out


def test_numbers_that_are_none_are_null(capsys):
    print_json({"error": float("nan"), "limits": (1.0, float("inf")), "file": Path("a.toml")})
    assert json.loads(capsys.readouterr().out) == {"error": None, "limits": [1.0, None], "file": "a.toml"}


def test_json_is_refused_for_entries_of_the_ledger(tmp_path):
    with pytest.raises(StudyError, match="--json is only for"):
        CliRunner().invoke(
            app, ["trials", "note", str(tmp_path), "--text", "x", "--json"], catch_exceptions=False
        )
