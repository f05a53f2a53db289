"""Texts that others wrote, with escape sequences and markup, in each command that shows them."""

from __future__ import annotations

import json
import re
import unicodedata
from typing import Any

import pytest
from typer.testing import CliRunner

from realitygap.cli import app
from realitygap.cli._progress import RunsBar, TrialsBar
from realitygap.families.scribbler.emulator import _memory
from realitygap.lab._server import _clean_pages
from realitygap.lab._studies import Studies
from realitygap.records import LEDGER_NAME, ResultsFolder
from realitygap.report import write_report
from tests.commands import run_command
from tests.formats import FORMATS

from .test_damaged_ledgers import Rows, rows, study, write_ledger

__all__ = ["rows", "study"]

pytestmark = pytest.mark.slow

EVIL = "x\x1b]52;c;eA==\x07\x9b31m\x85\u202e\u2066\u200f[/2][red]y[/red]"
"""It changes the clipboard, rings, colors, reorders, and ends a style that was never begun."""

FREE = {
    "conditions": ("hash",),
    "sittings": ("began", "ended", "port"),
    "generations": ("planned", "closed"),
    "trials": ("code", "reason", "end", "problem", "started", "driven"),
    "scores": ("who", "time", "undone"),
    "notes": ("text", "who", "time"),
    "events": ("time", "what"),
}
"""Columns of a ledger with any text."""


def is_harmless(text: str) -> bool:
    """Return whether a text has no character that controls, is invisible, or reorders."""
    kinds = {letter: (unicodedata.category(letter), unicodedata.bidirectional(letter)) for letter in text}
    return not [letter for letter, (kind, _) in kinds.items() if kind in ("Cc", "Cf") and letter != "\n"]


def run(*words: object) -> str:
    """Return all that a command prints, and check it."""
    done = run_command(*map(str, words))
    text = done.stdout + done.stderr
    assert is_harmless(text), ascii(text)
    assert "Traceback" not in text, text
    return text


def with_evil(rows: Rows) -> Rows:
    """Return the rows of a ledger in which each free text is hostile."""

    def changed(table: str, k: int, row: dict[str, Any]) -> dict[str, Any]:
        values = {
            name: f"{EVIL}{k}"
            for name in FREE.get(table, ())
            if row[name] is not None or name in ("reason", "problem")
        }
        if table == "sittings":
            robot = json.loads(row["robot"])
            values["robot"] = json.dumps(dict.fromkeys((*robot, EVIL), EVIL))
        return row | values

    return {table: [changed(table, k, row) for k, row in enumerate(these)] for table, these in rows.items()}


def test_ledger_and_description_with_hostile_texts(study, rows, tmp_path):
    hostile = tmp_path / "small"
    about = ResultsFolder.open(study).description
    folder = ResultsFolder.create(hostile, {**about, "title": EVIL, "note": EVIL})
    assert folder.description["title"] == EVIL
    write_ledger(hostile / LEDGER_NAME, with_evil(rows))
    assert "\\x1b]52" in run("trials", "list", hostile)
    assert json.loads(run("trials", "list", hostile, "--json"))[0]["reason"] == f"{EVIL}0", (
        "data stay as they are"
    )
    run("trials", "agreement", hostile)
    run("export-trials", hostile, "-o", tmp_path / "bags")
    run("digest", hostile)
    page = write_report(hostile, tmp_path / "report.html").read_text("utf-8")
    assert is_harmless(page.replace("\t", ""))
    assert re.search(r"\\u(001b|202e|2066)", page) is None
    # the lab
    _clean_pages()
    from nicegui import json as page_json

    state = Studies(tmp_path).state("small")
    assert EVIL in state.title
    assert is_harmless(json.loads(page_json.dumps({"text": state.title}))["text"])
    renamed = {
        table: [
            row
            | {name: EVIL for name in ("condition",) if name in row}
            | ({"name": EVIL} if table == "conditions" else {})
            for row in these
        ]
        for table, these in rows.items()
    }
    write_ledger(hostile / LEDGER_NAME, renamed)
    for words in (["trials", "list"], ["trials", "agreement"], ["report"], ["digest"]):
        run(*words, hostile)
    run("export-trials", hostile, "-o", tmp_path / "more")


def test_note_with_brackets_is_listed_as_it_was_entered(study, rows):
    write_ledger(study / LEDGER_NAME, rows)
    for text in ("cells [/2] unclear", "[red]x[/red]", ":robot: 12", "[link=x]y", "\\[x]"):
        assert "Noted" in run("trials", "note", study, 2, "--text", text)
    shown = " ".join(run("trials", "list", study).split())
    for text in ("cells [/2] unclear", "[red]x[/red]", ":robot: 12", "[link=x]y", "\\[x]"):
        assert f"note: {text}" in shown, shown


def test_table_of_results_with_hostile_conditions(tmp_path):
    path = tmp_path / "table.csv"
    lines = ["condition,run,value", *(f"{EVIL} {name},{k},.{k}5{k}" for name in "ab" for k in range(1, 6))]
    path.write_text("\n".join(lines).replace("\x85", ""), "utf-8")
    assert "[/2]" in run("audit-results", path, "--denominator", 72)


def test_names_of_files_folders_and_options(tmp_path):
    name = EVIL.replace("/", "")
    for words in (
        ["trials", "list"],
        ["run"],
        ["report"],
        ["show", "arena"],
        ["twin", "show"],
        ["export-trials"],
    ):
        run(*words, tmp_path / name)
        run(*words, f"--{name}")
    run(name)
    (tmp_path / name).mkdir()
    run("trials", "list", tmp_path / name)


def test_name_of_a_robot(monkeypatch):
    monkeypatch.setattr(_memory, "NAME", b"x\x1b]0;y\x07\x9b[/2]\xae ".ljust(16))
    done = CliRunner().invoke(app, ["robot", "info", "emulator://s2?fluke=2&speed=off"])
    assert done.exit_code == 0, done.output
    assert is_harmless(done.output), ascii(done.output)
    assert "[/2]" in done.output


def test_progress(capsys):
    with RunsBar(quiet=False) as runs:
        runs._console.file = None
        runs._progress.update(runs._task, description=EVIL, rate=EVIL)
        text = "".join(segment.text for segment in runs._console.render(runs._progress.get_renderable()))
    assert is_harmless(text)
    assert "x\\x1b]52" in text
    with TrialsBar(quiet=False) as trials:
        trials._console._force_terminal = True
        trials.say(EVIL)
    assert "[/2][red]" in capsys.readouterr().err


# every text file that is read, by the message that refuses it


def hostile_files() -> list[tuple[str, bytes]]:
    """Return files of each format, one for each text in it, with the hostile text there."""
    found = []
    for name, (valid, _) in FORMATS.items():
        try:
            text = valid.decode("utf-8")
        except UnicodeDecodeError:
            continue
        quoted = json.dumps(EVIL)[1:-1]
        for match in list(re.finditer(r'"([^"\n]{1,80})"', text))[:40]:
            found.append((name, f"{text[: match.start(1)]}{quoted}{text[match.end(1) :]}".encode()))
        found += [(name, EVIL.encode() + valid), (name, text.replace("\n", f"\n{EVIL}", 1).encode())]
    return found


def test_messages_about_each_format(capsys):
    from realitygap.cli import _print_error

    n = 0
    for name, data in hostile_files():
        try:
            FORMATS[name].read(data)
        except Exception as error:
            n += 1
            _print_error(str(error))
            text = capsys.readouterr().err
            assert is_harmless(text), (name, ascii(text))
    assert n > 100
