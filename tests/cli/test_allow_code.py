"""A Python task runs from a file that the user has, after the command has shown it and asked."""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from realitygap.cli import _code, app
from realitygap.errors import StudyError, TaskError
from realitygap.platforms import allow_code
from realitygap.records import ResultsFolder
from realitygap.study import load_study, run_study
from tests.python_tasks import study_text

STUDY = study_text('[[condition]]\nname = "random"\nplatform = "sim"\nselection = "random"\n')
SOURCE = "def far(trajectories):\n    return trajectories.poses[:, -1, 0]  # \x1b[2K\u202e\n"


@pytest.fixture(autouse=True)
def study(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("REALITYGAP_STATE", str(tmp_path / "state"))
    (tmp_path / "task.py").write_text(SOURCE, encoding="utf-8")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


class Terminal:
    """A terminal whose user gives these answers in turn."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.answers: list[str] = []
        monkeypatch.setattr(_code, "_is_terminal", lambda: True)
        monkeypatch.setattr(_code, "read_line", lambda: self.answers.pop(0))


@pytest.fixture
def terminal(monkeypatch) -> Terminal:
    return Terminal(monkeypatch)


def run(study: Path, *options: str) -> Any:
    return CliRunner().invoke(app, ["run", str(study), "--out", str(study.parent / "out"), *options])


def test_run_shows_the_file_asks_once_and_remembers_the_answer(study, terminal):
    terminal.answers = ["y"]
    done = run(study)
    assert done.exit_code == 0, done.exception
    assert terminal.answers == []
    assert "    1  def far(trajectories):\n" in done.stderr
    assert r"    2      return trajectories.poses[:, -1, 0]  # \x1b[2K\u202e" in done.stderr
    assert "task.py: 2 lines, SHA-256" in done.stderr
    assert "\x1b" not in done.stderr
    again = run(study, "--replicates", "2")  # nobody answers: there is nothing to ask
    assert again.exit_code == 0
    assert "you have not allowed before" not in again.stderr
    assert ResultsFolder.open(study.parent / "out").description["replicates"] == 2


@pytest.mark.parametrize("answer", ["n", "", "no", "x", "yess"])
def test_run_writes_nothing_when_the_answer_is_not_yes(study, terminal, answer):
    terminal.answers = [answer]
    done = run(study)
    assert isinstance(done.exception, TaskError)
    assert "task.py may not run. Nothing was run, and nothing was written." in str(done.exception)
    assert not (study.parent / "out").exists()
    assert not (study.parent / "state").exists()


def test_a_changed_file_is_asked_for_again(study, terminal):
    terminal.answers = ["y", "y"]
    assert run(study).exit_code == 0
    (study.parent / "task.py").write_text(SOURCE + "# changed\n", encoding="utf-8")
    done = run(study, "--fresh")
    assert done.exit_code == 0
    assert terminal.answers == []
    assert "task.py: 3 lines" in done.stderr


def test_a_changed_file_is_refused_with_both_hashes_before_the_question(study, terminal):
    terminal.answers = ["y"]
    assert run(study).exit_code == 0
    before = load_study(study).conditions[0].task.sha256
    (study.parent / "task.py").write_text(SOURCE + "# changed\n", encoding="utf-8")
    now = load_study(study).conditions[0].task.sha256
    done = run(study)
    assert isinstance(done.exception, StudyError)
    assert f"far: the text of the Python file has SHA-256 {before} there, {now} here" in str(done.exception)


def test_run_without_a_terminal_is_refused_and_writes_nothing(study):
    done = run(study)
    assert isinstance(done.exception, TaskError)
    assert "--allow-code" in str(done.exception)
    assert not (study.parent / "out").exists()


def test_allow_code_runs_without_a_question_and_is_not_remembered(study):
    assert run(study, "--allow-code").exit_code == 0
    assert not (study.parent / "state").exists()
    assert run(study).exit_code != 0


def test_allow_code_of_other_commands_holds_for_tasks(study):
    """The option was lost between command and task."""
    task = f"python:{study.parent}/task.py:far"
    words = ["gap", "sim", "jyro", "--n-controllers", "2", "--trials", "1", "--task", task]
    assert isinstance(CliRunner().invoke(app, words).exception, TaskError)
    try:
        done = CliRunner().invoke(app, [*words, "--allow-code"])
    finally:
        allow_code(False)
    assert done.exit_code == 0, done.exception


def test_an_answer_that_cannot_be_saved_holds_for_the_command(study, terminal):
    (study.parent / "state").write_text("a file in the folder's place")
    terminal.answers = ["y"]
    done = run(study)
    assert done.exit_code == 0, done.exception
    assert "note: the answer cannot be saved" in done.stderr


def test_python_runs_code_that_is_allowed_and_asks_whom_it_is_given(study):
    out = study.parent / "out"
    asked = []
    with pytest.raises(TaskError, match="allow_code=True"):
        run_study(study, out)
    with pytest.raises(TaskError, match="not allowed"):
        run_study(study, out, allow_code=lambda task: asked.append(task.file))
    assert asked == ["task.py"]
    assert not out.exists()
    assert run_study(study, out, allow_code=True).n_computed == 2


def test_python_runs_a_task_that_the_program_itself_allows(study):
    resolved = load_study(study)
    conditions = [each.model_copy(update={"task": each.task.allowed()}) for each in resolved.conditions]
    resolved = resolved.model_copy(update={"conditions": tuple(conditions)})
    assert run_study(resolved, study.parent / "out").n_computed == 2


@pytest.mark.parametrize(
    ("source", "text"),
    [
        ("def other(trajectories): pass", "task.py has no function 'far'"),
        ("far = 1", "task.py has no function 'far'"),
        ("def far(:", "task.py cannot be run: line 1: SyntaxError"),
        ("1 / 0", "task.py cannot be run: line 1: ZeroDivisionError"),
    ],
)
def test_a_file_that_cannot_be_used_is_told_before_anything_is_written(study, source, text):
    (study.parent / "task.py").write_text(source)
    with pytest.raises(TaskError, match=text):
        run_study(study, study.parent / "out", allow_code=True)
    assert not (study.parent / "out").exists()


def test_a_task_file_is_looked_for_beside_the_study_file_alone(study, monkeypatch):
    elsewhere = study.parent / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    (elsewhere / "task.py").write_text("raise RuntimeError('not this one')")
    assert run_study(study, study.parent / "out", allow_code=True).n_computed == 2
    (study.parent / "task.py").unlink()
    with pytest.raises(StudyError, match=r"task\.py cannot be read: No such file"):
        load_study(study)
    moved = study.parent / "study" / "study.toml"
    moved.parent.mkdir()
    moved.write_text(STUDY.replace("python:task.py", "python:../elsewhere/task.py"))
    assert load_study(moved).conditions[0].task.kind == "python:task.py:far"


@pytest.mark.slow
def test_run_asks_at_a_real_terminal(study):
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "realitygap", "run", str(study), "--out", str(study.parent / "out")]
    with subprocess.Popen(command, stdin=theirs, stdout=subprocess.PIPE, stderr=theirs) as process:
        os.close(theirs)
        shown = b""
        while b"[y/N]" not in shown:
            assert select.select([ours], [], [], 60)[0], shown
            shown += os.read(ours, 1000)
        os.write(ours, b"n\n")
        process.communicate(timeout=60)
    os.close(ours)
    assert process.returncode == 1
    assert rb"\x1b[2K\u202e" in shown
    assert not (study.parent / "out").exists()
