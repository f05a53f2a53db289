"""`realitygap gap` and `realitygap plan` as a user meets them."""

import html
import json
import math
import re
import sys
import warnings

import pytest

from realitygap.cli import _progress, main
from realitygap.gap import SHOWN
from realitygap.gap._result import MEASURES
from realitygap.records import read_observations
from tests.cli.test_commands import realitygap

pytestmark = pytest.mark.slow

SMALL = ("gap", "sim", "jyro", "--n-controllers", "6", "--trials", "3")


@pytest.fixture
def command(monkeypatch, capsys, tmp_path):
    """A command in this process, which has compiled already: status, output and errors."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)

    def run(*words, cwd=tmp_path):
        monkeypatch.chdir(cwd)
        monkeypatch.setattr(sys, "argv", ["realitygap", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        written = capsys.readouterr()
        return ended.value.code or 0, written.out, written.err

    return run


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gap")
    more = ("--margin", "0.05", "--observe", "track", "--report", "gap.html", "-o", "trials.sqlite", "--json")
    done = realitygap(*SMALL, *more, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def test_json_has_every_measure_with_estimate_low_high_and_n(printed):
    _, found = printed
    for name in MEASURES:
        assert {"estimate", "low", "high", "n"} <= set(found[name]), name
    assert found["misspecified"] is None
    assert found["replay"]["n"] == 6
    assert len(found["replay"]["distance"]["low"]) == 101
    assert "jyro" in found["verdict"]


def test_the_page_and_the_trials_are_kept(printed):
    folder, _ = printed
    assert (folder / "gap.html").read_text("utf-8").startswith("<!DOCTYPE html>")
    assert len(read_observations(folder / "trials.sqlite").trials) == 6 * 3


def test_the_same_command_again_takes_the_kept_trials(printed, command):
    folder, found = printed
    more = ("--margin", "0.05", "--observe", "track", "-o", "trials.sqlite", "--json")
    again = json.loads(command(*SMALL, *more, cwd=folder)[1])
    assert {**again, "report": found["report"]} == found


def test_kept_trials_say_how_many_the_next_question_takes(printed, command):
    folder, _ = printed
    code, out, _ = command("plan", "--effect", "0.05", "--from", "trials.sqlite", cwd=folder)
    assert code == 0
    assert "6 controllers, 3 trials each" in out
    assert "Minimum number of trials on the target" in out


def test_at_most_twelve_lines_state_title_verdict_labels_n_and_what_follows(command, monkeypatch):
    monkeypatch.setattr(_progress, "_LINE_EVERY_S", math.inf)  # so that standard error has warnings alone
    words = ("gap", "sim", "sim", "--n-controllers", "5", "--trials", "2")
    code, out, err = command(*words)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert len(lines) <= 12
    assert lines[0].endswith(": sim against sim")
    assert "the level of coverage" in lines[1]
    assert "SIM, 5 controllers, 2 trials of each" in out
    assert "--full" in lines[-1]
    assert "close" not in lines[-1]  # of a simulator against itself
    assert lines[1] in command(*words, "--full")[1]


NUMBER = re.compile(r"[-−]?\d\.\d{3}")


def test_terminal_and_report_state_the_same_estimates_intervals_and_p(printed, command):
    """Each measure has one estimate, one interval, and one p, wherever it is shown."""
    folder, _ = printed
    out = command(
        *SMALL, "--margin", "0.05", "--observe", "track", "-o", "trials.sqlite", "--full", cwd=folder
    )[1]
    page = (folder / "gap.html").read_text("utf-8")
    words = html.unescape(re.sub("<[^>]+>", " ", page))
    rows = {line[2:34].strip(): line[34:] for line in out.splitlines() if line.startswith("  ")}
    assert re.search("p [=<] ", rows["energy distance of cells"])
    for measure in SHOWN:
        cells = re.search(rf'<th scope="row">{re.escape(measure.title)}</th>(.*?)<td class="text', page)[1]
        there = re.sub("<[^>]+>", " ", cells)
        shown = NUMBER.findall(rows[measure.row.strip()])
        assert shown == NUMBER.findall(there), measure.title
    p = re.search(r"p [=<] \d\.\d+", rows["energy distance of cells"])[0]
    caption = re.search(r"Energy distance of visited cells ([^(]*) \(([^)]*)\)", words)
    assert caption[2].startswith(p)
    assert NUMBER.findall(caption[1]) == NUMBER.findall(rows["energy distance of cells"])[:3]


@pytest.mark.parametrize(
    ("words", "texts"),
    [
        (("gap", "sim", "jyrro"), ("no platform", "jyro")),
        (("gap", "sim", "jyro", "--why"), ("realitygap calibrate all --robot jyro",)),
        (("gap", "sim", "jyro", "--margin", "-1"), ("--margin is -1", "more than 0")),
        (("gap", "sim", "jyro", "--report", "gap.pdf"), (".html",)),
        (("gap", "sim", "jyro", "--report", "none/gap.html"), ("There is no folder none",)),
        (("gap", "sim", "jyro", "--randomize", "posterior"), ("draws robots from a calibration",)),
        (("gap", "sim", "jyro", "--controllers", "nobody"), ("Unknown study 'nobody'",)),
        (("gap", "sim:nowhere.toml", "jyro"), ("nowhere.toml",)),
        (("gap", "sim", "jyro", "--arena", "nowhere"), ("nowhere",)),
        (("gap", "sim", "jyro", "--arena", "light"), ("jyro: arena 'light'", "round obstacles")),
        (("plan",), ("expected one of --effect, --margin, and --correlation",)),
        (("plan", "--effect", "0.1", "--margin", "0.1"), ("--effect, --margin",)),
        (("plan", "--effect", "0"), ("effect is 0",)),
        (("plan", "--effect", "0.1", "--from", "nothing.jsonl"), ("no file nothing.jsonl",)),
    ],
)
def test_wrong_options_give_one_message(words, texts, command):
    code, _, err = command(*words)
    assert code == 1
    assert err.count("realitygap: ") == 1
    for text in texts:
        assert text in err
