"""The prose check, on sentences of the editorial rules and on what it must leave alone."""

import importlib.util
import sys
from pathlib import Path

import pytest

PATH = Path(__file__).parent.parent / "tools" / "prose.py"


@pytest.fixture(scope="module")
def prose():
    spec = importlib.util.spec_from_file_location("prose", PATH)
    module = importlib.util.module_from_spec(spec)
    sys.modules["prose"] = module  # its dataclass looks its module up
    spec.loader.exec_module(module)
    return module


def findings(prose, tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text, "utf-8")
    return [finding for _, finding in prose.findings(path)]


BAD = [
    "Where no run is named, it is the typical one.",
    "What is shown, the option says.",
    "The same command goes on.",
    "Beside each parameter, the table shows its interval.",
    "The robot waits until somebody moves it.",
    "One " + "word " * 30 + "too many.",
]
GOOD = [
    "Print the name of the study.",
    "`Where` is code.",
    "What does this page show?",
    "See [Of mice](mice.md) for the list.",
    "| Where | no run |\n|---|---|",
    "```sh\nWhere no run is named\n```",
    "<!-- prose: off -->\nWhere no run is named.\n<!-- prose: on -->",
    "# Where the files are",
]


def test_prose_check_finds_each_fault_in_a_page(prose, tmp_path):
    for text in BAD:
        assert len(findings(prose, tmp_path, "page.md", f"# Title\n\n{text}\n")) == 1, text


def test_prose_check_leaves_good_sentences_code_and_tables_alone(prose, tmp_path):
    for text in GOOD:
        assert findings(prose, tmp_path, "page.md", f"# Title\n\n{text}\n") == [], text


def test_prose_check_reads_docstrings_and_help_texts(prose, tmp_path):
    source = '''
def f():
    """Return the number.

    Where this is, nobody looks.
    """
    option(help="Of a twin: trials.")
    option(help="Number of trials.")
'''
    assert findings(prose, tmp_path, "module.py", source) == ["help begins with 'Of': Of a twin: trials."]


def test_prose_check_fails_when_a_file_gets_worse_and_for_a_new_file(prose, tmp_path, monkeypatch, capsys):
    (tmp_path / "old.md").write_text("Where it is.\n\nWhere it was.\n")
    (tmp_path / "new.md").write_text("Where it is.\n")
    (tmp_path / "prose.json").write_text('{"old.md": 1}')
    monkeypatch.setattr(prose, "ROOT", tmp_path)
    monkeypatch.setattr(prose, "BASELINE", tmp_path / "prose.json")
    monkeypatch.setattr(prose, "tracked", lambda: ["old.md", "new.md"])
    monkeypatch.setattr(sys, "argv", ["prose.py"])
    assert prose.main() == 1
    printed = capsys.readouterr().out
    assert "old.md: 2 findings, 1 allowed" in printed
    assert "new.md: 1 findings, 0 allowed" in printed
    (tmp_path / "old.md").write_text("It is here.\n")
    (tmp_path / "new.md").write_text("It is there.\n")
    monkeypatch.setattr(sys, "argv", ["prose.py", "--update"])
    assert prose.main() == 0
    assert (tmp_path / "prose.json").read_text() == "{}\n"
