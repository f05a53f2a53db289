"""The prose check, on sentences of the editorial rules and on what it must leave alone."""

import importlib.util
import sys
from pathlib import Path

import pytest

from realitygap.gap import SHOWN

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


PAIRS = [
    ("It is the typical run and not a picked one.", "We show the median run."),
    (
        "not shown; n finds 0.031 in 80 %, this difference takes 566 runs",
        "Inconclusive: 100 runs detect 0.031 with 80 % power; this difference would need about 566.",
    ),
    (
        "a piece of line that several runs share is stronger",
        "Darker segments are shared by several runs.",
    ),
    ("picked because it has most species … and so most to see", "the run with the most species"),
    (
        "Up to 4 together; a generation's number takes all of it.",
        "Select up to four trials; click a generation number to select its row.",
    ),
    (
        "correlation over controllers is 0.39 where noise allows 0.99",
        "The rank correlation is 0.39; trial noise alone would permit 0.99.",
    ),
    (
        "There were three rows to be the closest, so chance had three times to do it.",
        "This is the most extreme of three comparisons, so chance plays a part.",
    ),
    ("a box for a body", "a box-shaped body"),
    ("a blocked robot freezes", "a blocked robot stops dead"),
    (
        "its scripts show trials and values, and send nothing",
        "Self-contained: works offline and sends no data.",
    ),
    (
        "No cell was entered: the line crosses at least the cell of the start.",
        "Mark at least the start cell before saving.",
    ),
    (
        "No controller was selected for its score where it can be tried again.",
        "Not measured: pass champions with `--controllers STUDY`.",
    ),
    (
        "The goal for rank violations was missed with cells.",
        "Scored by cells, the calibrated simulator misranked controllers more often than our goal allows.",
    ),
    ("coverage on the twin less that in simulation", "coverage on the twin minus coverage in simulation"),
    ("A drawing of the settings; n and interval do not apply.", "Drawn from the study's settings."),
]


def test_prose_check_finds_riddles_in_every_kind_of_text_and_not_their_better_forms(prose, tmp_path):
    kinds = {
        "page.md": "# Title\n\n{}\n",
        "message.py": 'raise ValueError(f"{{n}} {}")\n',
        "page.html.jinja": "{{% if x %}}<p>{}</p>{{% endif %}}\n",
        "player.js": "const hint = `${{n}} {}`;\n",
    }
    for name, template in kinds.items():
        for found, better in PAIRS:
            assert findings(prose, tmp_path, name, template.format(found)), (name, found)
            assert not findings(prose, tmp_path, name, template.format(better)), (name, better)


def test_prose_check_names_each_measure_as_the_table_of_measures_does(prose, tmp_path):
    others = {
        "rank correlation": "The correlation over controllers is high.",
        "noise ceiling": "That is the ceiling of noise.",
        "RMS gap": "The RMS difference in coverage is small.",
        "level": "The mean gap is small.",
        "run": "The study has more replicates now.",
        "a number such as 0.306": "The median is .306 here.",
        "a true minus (−)": "The level is -0.089 here.",
    }
    assert others.keys() == prose.OTHER_NAMES.keys()
    assert {each.title.lower() for each in SHOWN} >= {"rank correlation", "noise ceiling", "rms gap", "level"}
    for name, text in others.items():
        found = findings(prose, tmp_path, "page.md", f"# Title\n\n{text}\n")
        assert len(found) == 1, (text, found)
        assert f"expected {name}" in found[0]
        if not name.startswith("a "):
            assert findings(prose, tmp_path, "message.py", f'say("{text}")\n'), text
    good = "The level is −0.089, the median 0.306, and the RMS gap 0.145 [0.047, 0.244]; `-0.5` is code."
    assert not findings(prose, tmp_path, "page.md", f"# Title\n\n{good}\n")


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
