"""The operator's questions in a real (pseudo-)terminal, and without one."""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from realitygap.cli import main
from realitygap.cli._grid_editor import GridEdit, edit_cells
from realitygap.cli._keys import ask_verdict
from realitygap.records import LEDGER_NAME, Ledger
from realitygap.world import paper_arena

from .fake_port import STUDY

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
COMMAND = [sys.executable, "-m", "tests.cli.fake_port"]
PATIENCE_S = 60


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(STUDY)
    return path


class Terminal:
    """A command in a pseudo-terminal, with somebody who reads what is asked and types."""

    def __init__(self, *arguments: str) -> None:
        import pty

        self._own, theirs = pty.openpty()
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "dumb", "COLUMNS": "100"}
        self._process = subprocess.Popen(
            [*COMMAND, *arguments],
            stdin=theirs, stdout=theirs, stderr=theirs, cwd=ROOT, env=environment, close_fds=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a background job ignores it
        )  # fmt: skip
        os.close(theirs)
        self.seen = ""
        self._mark = 0

    def wait_for(self, text: str) -> None:
        until = time.monotonic() + PATIENCE_S
        while text not in self.seen[self._mark :]:
            assert time.monotonic() < until, f"{text!r} was not asked; seen: {self.seen[self._mark :]!r}"
            if not self._read():
                raise AssertionError(f"It ended before {text!r}; seen: {self.seen[self._mark :]!r}")
        self._mark = self.seen.index(text, self._mark) + len(text)

    def answer(self, question: str, keys: str) -> None:
        self.wait_for(question)
        os.write(self._own, keys.encode())

    def interrupt(self) -> None:
        """What Ctrl-C does."""
        self._process.send_signal(signal.SIGINT)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait(PATIENCE_S)

    def end(self) -> int:
        while self._read():
            pass
        return self._process.wait(PATIENCE_S)

    def _read(self) -> bool:
        if not select.select([self._own], [], [], PATIENCE_S)[0]:
            raise AssertionError(f"Nothing came; seen: {self.seen[self._mark :]!r}")
        try:
            data = os.read(self._own, 4096)
        except OSError:  # what Linux says when the other end is closed
            return False
        self.seen += data.decode(errors="replace")
        return bool(data)


pty_only = pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")


@pty_only
def test_a_person_is_led_through_a_study(tmp_path, study):
    out = tmp_path / "out"
    terminal = Terminal("drive", str(study), "--port", "real", "--out", str(out), "--who", "anna")
    terminal.answer("then press Enter", "\n")
    terminal.wait_for("battery under load: 7.20 V")
    terminal.wait_for("pen: red")
    terminal.wait_for("facing right")
    terminal.answer("Enter drives", "n the floor is wet\n")
    terminal.answer("Enter drives", "\n")
    terminal.wait_for("step   3/3")
    terminal.answer("Enter drives", "\n")
    # a sheet of two lines: the first goes right and up, with a cell taken back
    terminal.answer("Escape: later", " \x1b[C\x1b[C u\x1b[A \r")
    terminal.answer("Escape: later", "dlll\r")
    # the second score is taken back and entered anew
    terminal.answer("Enter: close it", "2\n")
    terminal.answer("Escape: later", "dl\r")
    terminal.answer("Enter: close it", "\n")
    assert terminal.end() == 0
    assert "1 of 1 runs on a robot are complete. 2 trials were driven just now." in terminal.seen
    with Ledger.open(out / LEDGER_NAME) as ledger:
        trials = ledger.trials()
        assert [trial.state for trial in trials] == ["scored", "scored"]
        assert set(trials[0].cells) == {27}
        assert set(trials[1].cells) == {13, 14}
        assert [(note["text"], note["who"], note["trial"]) for note in ledger.notes()] == [
            ("the floor is wet", "anna", 1)
        ]
        undone = [row for row in ledger.scores() if row["undone"]]
        assert [set(row["cells"]) for row in undone] == [{13, 14, 15, 16}]
        assert ledger.conditions()["robot"]["label"] == "REAL"


@pty_only
def test_a_key_aborts_a_trial_and_the_operator_says_what_becomes_of_it(tmp_path, study):
    long = study.read_text().replace("steps = 3", "steps = 30000")
    study.write_text(long)
    out = tmp_path / "out"
    terminal = Terminal("drive", str(study), "--port", "real", "--out", str(out), "--score", "later")
    terminal.answer("then press Enter", "\n")
    terminal.answer("Enter drives", "\n")
    terminal.answer("space aborts", " ")
    terminal.wait_for("aborted by the operator before step")
    terminal.answer("d: driven", "what\n")
    terminal.answer("d: driven", "v\n")
    terminal.wait_for("Enter drives")
    terminal.interrupt()
    assert terminal.end() == 130
    assert "Traceback" not in terminal.seen
    with Ledger.open(out / LEDGER_NAME) as ledger:
        states = [(trial.individual, trial.attempt, trial.state) for trial in ledger.trials()]
        assert states == [(0, 0, "void"), (0, 1, "planned"), (1, 0, "planned")]


@pty_only
@pytest.mark.parametrize("when", ["trial", "sheet"])
def test_a_line_that_was_entered_is_kept_when_the_program_is_killed_at_the_next(tmp_path, study, when):
    out = tmp_path / "out"
    run = ("drive", str(study), "--port", "real", "--out", str(out), "--no-wait", "--score", when)
    terminal = Terminal(*run)
    terminal.answer("Escape: later", "dl\r")
    terminal.wait_for("Escape: later")
    terminal.kill()
    with Ledger.open(out / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["scored", "driven"]
        assert len(ledger.record(2).commands) == 3
    again = Terminal(*run)
    again.answer("Escape: later", "dll\r")
    again.answer("Enter: close it", "\n")
    assert again.end() == 0
    assert "was cut off" not in again.seen
    assert again.seen.count("Escape: later") == 1, "what was scored is not asked again"


@pty_only
def test_lines_picked_one_after_the_other_are_kept_one_by_one(driven):
    terminal = Terminal("trials", "score", str(driven), "--who", "anna")
    terminal.answer("Escape: later", "dl\r")
    terminal.wait_for("Trial 1: 2 cells")
    terminal.wait_for("Escape: later")
    terminal.interrupt()
    terminal.end()
    assert "Traceback" not in terminal.seen
    with Ledger.open(driven / LEDGER_NAME) as ledger:
        assert [trial.state for trial in ledger.trials()] == ["scored", "driven"]


def test_without_a_terminal_options_answer_and_scores_come_from_a_file(tmp_path, study, no_terminal):
    out = tmp_path / "out"
    run = ("drive", str(study), "--port", "real", "--out", str(out))
    refused = no_terminal(*run)
    assert refused.returncode == 1
    assert "There is no terminal in which to ask" in refused.stderr
    assert "--no-wait drives without waiting" in refused.stderr
    assert "Traceback" not in refused.stderr
    driven = no_terminal(*run, "--no-wait")
    assert driven.returncode == 0, driven.stderr
    assert "2 driven trials wait for their scores" in driven.stdout
    sheet = tmp_path / "sheet.txt"
    sheet.write_text("# sheet 1\n1: 13 14 15\n\n2: 13,26\n")
    scored = no_terminal("trials", "score", str(out), "--file", str(sheet), "--who", "anna")
    assert scored.stdout == "Trial 1: 3 cells.\nTrial 2: 2 cells.\n"
    second = no_terminal("trials", "score", str(out), "1", "--cells", "13,14", "--second", "--who", "ben")
    assert second.returncode == 0, second.stderr
    agreement = no_terminal("trials", "agreement", str(out))
    assert (
        "1 trial counted by two people, 72 cells: 98.6 % judged alike. Cohen's kappa 0.793"
        in agreement.stdout
    )
    assert no_terminal(*run).returncode == 0
    with Ledger.open(out / LEDGER_NAME) as ledger:
        assert [row["fitness"] for row in ledger.individuals("robot", 0, 0)] == [3 / 72, 2 / 72]
    refused = no_terminal("trials", "undo", str(out), "1")
    assert refused.returncode == 1
    assert "is closed: its score bred the next one and stays" in refused.stderr
    corrected = no_terminal("trials", "score", str(out), "1", "--cells", "13 14", "--correct")
    assert corrected.returncode == 0
    listed = no_terminal("trials", "list", str(out))
    assert "2 trials: 2 scored." in listed.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("score", "1", "--cells", "13,x"), "--cells: expected numbers of cells such as 0,1,13, got '13,x'"),
        (("score", "1", "--cells", "72"), "Cell 72 is outside the grid: expected numbers from 0 to 71"),
        (("score", "9", "--cells", "1"), "has no trial 9: its trials are 1 to 2"),
        (("score", "QQQQ", "--cells", "1"), "has no trial 'QQQQ'"),
        (("score", "1", "--cells", " "), "Mark each cell that the line crosses"),
        (("score",), "There is no terminal in which to pick cells"),
        (("void", "1"), "--text is missing"),
        (("undo",), "The number of a trial is missing"),
        (("undo", "1"), "is driven; that can be done only while it is scored"),
        (("note", "--text", " "), "An empty note was not saved"),
        (("lst",), "Did you mean 'list'?"),
        (("agreement",), "no trial was counted by two people yet"),
        (
            ("score", "1", "--cells", "1", "--second", "--correct"),
            "--second and --correct exclude each other",
        ),
        (("list", "--cells", "1"), "go with score, not with list"),
        (("score", "1", "--file", "none.txt"), "--file names its trials itself"),
        (("score", "--file", "none.txt"), "none.txt cannot be read"),
    ],
)
def test_wrong_input_gets_one_clear_message(driven, arguments, said, no_terminal):
    what, *rest = arguments
    done = no_terminal("trials", what, str(driven), *rest)
    assert done.returncode == 1
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_file_of_cells_is_entered_as_a_whole_or_not_at_all(driven, tmp_path, no_terminal):
    """Else its first lines were entered, and the file put right would be refused for them."""
    sheet = tmp_path / "sheet.txt"
    sheet.write_text("1: 13 14\n2: 13 99\n")
    refused = no_terminal("trials", "score", str(driven), "--file", str(sheet))
    assert refused.returncode == 1
    assert "Cell 99 is outside the grid" in refused.stderr
    assert refused.stdout == ""
    sheet.write_text("1: 13 14\n2: 13 9\n")
    assert no_terminal("trials", "score", str(driven), "--file", str(sheet)).returncode == 0


def test_a_second_count_is_another_persons(driven, no_terminal):
    for options in (("--who", "anna"), ("--who", "ben", "--second")):
        done = no_terminal("trials", "score", str(driven), "1", "--cells", "13", *options)
        assert done.returncode == 0, done.stderr
    again = no_terminal("trials", "score", str(driven), "1", "--cells", "13", "--who", "anna", "--second")
    assert again.returncode == 1
    assert "'anna' already counted the cells of trial 1" in again.stderr


def test_blind_trials_are_listed_without_their_conditions(tmp_path, study, no_terminal):
    study.write_text(study.read_text().replace("[trials]", "[trials]\nblind = true"))
    out = tmp_path / "out"
    no_terminal("drive", str(study), "--port", "real", "--out", str(out), "--no-wait")
    rows = json.loads(no_terminal("trials", "list", str(out), "--json").stdout)
    assert [row["condition"] for row in rows] == [None, None]
    assert "robot" not in no_terminal("trials", "list", str(out)).stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--in-flight", "maybe"), "--in-flight is 'maybe', expected void or driven"),
        (("--score", "never"), "--score is 'never', expected trial, sheet or later"),
    ],
)
def test_wrong_options_of_drive_are_refused_before_anything_is_done(
    tmp_path, study, no_terminal, options, said
):
    out = tmp_path / "out"
    done = no_terminal("drive", str(study), "--port", "real", "--out", str(out), *options)
    assert done.returncode == 1
    assert said in done.stderr
    assert not out.exists()


def test_drive_refuses_a_study_without_a_robot_before_anything_is_written(tmp_path, no_terminal):
    done = no_terminal("drive", "paper", "--out", str(tmp_path / "out"), "--port", "real")
    assert done.returncode == 1
    assert "No condition of study 'paper' is on a robot" in done.stderr
    assert "`realitygap run` computes it." in done.stderr
    assert not (tmp_path / "out").exists()


def test_run_names_drive_for_a_study_that_only_a_robot_drives(tmp_path, study, no_terminal):
    out = tmp_path / "out"
    done = no_terminal("run", str(study), "--out", str(out))
    assert done.returncode == 1
    assert done.stderr.startswith("realitygap: Every condition of study ")
    assert f"realitygap drive {study} --port PORT" in done.stderr
    assert not out.exists()


def test_a_person_is_not_spoken_to_where_the_json_goes(tmp_path, study, no_terminal):
    done = no_terminal(
        "drive", str(study), "--out", str(tmp_path / "out"), "--port", "real", "--no-wait", "--json"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["physical"]["n_driven"] == 2
    assert "pen: red" in done.stderr


def test_an_unattended_run_tells_of_each_generation(tmp_path, study, monkeypatch, capsys):
    def run(*options):
        monkeypatch.setattr(
            sys,
            "argv",
            ["realitygap", "drive", str(study), "--port", "emulator://s2?fluke=1&speed=off", *options],
        )
        with pytest.raises(SystemExit) as ended:
            main()
        assert not ended.value.code
        return capsys.readouterr()

    told = run("--out", str(tmp_path / "told"))
    assert re.search(r"^robot, run 0, generation 0: 2 trials, at most \d+ cells\.$", told.err, re.MULTILINE)
    quiet = run("--out", str(tmp_path / "quiet"), "--json")
    assert quiet.err == "1 of 1 runs on a robot are complete. 2 trials were driven just now.\n"
    monkeypatch.setattr("realitygap.cli._operator._SILENCE_S", 0.0)
    assert "Trial 2, robot, run 0, generation 0, individual 1: " in run("--out", str(tmp_path / "slow")).err


def test_despite_preflight_drives_an_emulated_robot_with_a_weak_battery(tmp_path, study, monkeypatch, capsys):
    def run(*options):
        port = "emulator://s2?fluke=1&speed=off"
        command = [
            "realitygap",
            "drive",
            str(study),
            "--port",
            port,
            "--out",
            str(tmp_path / "out"),
            *options,
        ]
        monkeypatch.setattr(sys, "argv", command)
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, capsys.readouterr().err

    monkeypatch.setattr("realitygap.families.scribbler.Scribbler.least_battery_v", 20.0)
    code, said = run()
    assert code
    assert re.search(
        r"nothing was driven: the battery has .* V under load.*--despite-preflight", said, re.DOTALL
    )
    code, said = run("--despite-preflight")
    assert not code
    assert "Against driving: the battery has" in said
    assert "2 trials, at most" in said


@pytest.fixture
def driven(tmp_path, study, no_terminal):
    """A folder whose two trials are driven and not scored."""
    out = tmp_path / "out"
    done = no_terminal("drive", str(study), "--port", "real", "--out", str(out), "--no-wait")
    assert done.returncode == 0, done.stderr
    return out


def keys(*names: str):
    return iter([*names, None]).__next__


def test_cells_are_marked_cleared_and_taken_back():
    arena = paper_arena()
    written = []
    cells = edit_cells(
        arena.grid, arena.start, keys("right", "space", "up", "space", "u", "enter"), written.append
    )
    assert cells == [13, 14]
    assert "[#]" in "".join(written)


def test_canceling_the_editor_enters_nothing():
    arena = paper_arena()
    assert edit_cells(arena.grid, arena.start, keys("right", "space", "escape"), lambda text: None) is None
    assert edit_cells(arena.grid, arena.start, keys("space"), lambda text: None) is None


def test_the_cursor_stays_in_the_grid():
    edit = GridEdit(3, 2)
    for key in ("left", "down", "d", "right", "right", "right", "up", "up"):
        edit.press(key)
    assert (edit.column, edit.row) == (2, 1)
    assert edit.cells == [0, 1, 2, 5]
    assert edit.lines()[0].split() == ["1", ".", ".", "[#]"]
    assert edit.press("enter") == "done"
    edit.press("c")
    assert edit.press("enter") is None, "an empty line is none"


@pytest.mark.parametrize(("answers", "verdict"), [(["", "x", "D"], "driven"), (["later", "void"], "void")])
def test_verdict_on_a_trial_is_asked_until_it_is_one(answers, verdict):
    remaining = iter(answers)
    assert ask_verdict(lambda: next(remaining)) == verdict
    assert not list(remaining)
