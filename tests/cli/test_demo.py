"""The tour: its commands are those of a user, and Ctrl-C ends it cleanly."""

import re
import shlex
import signal
import subprocess
import sys

import pytest

from tests.commands import run_command as realitygap
from tests.interrupted import INTERRUPTED


@pytest.mark.slow
def test_demo_runs_the_commands_that_it_prints_and_names_its_results(tmp_path):
    done = realitygap("demo", "--out", "tour", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = re.findall(r"^\$ realitygap (.*)$", done.stdout, re.MULTILINE)
    names = [shlex.split(line)[0] for line in lines]
    assert names == ["run", "report", "export", "show", "try", "gap", "close"]
    assert re.search(r"EMULATED\): 3 trials, mean coverage 0\.\d+ of 72 cells", done.stdout)
    named = done.stdout.partition("The results of this tour are in tour:")[2]
    for name in ("paper/report.html", "champion.gif", "gap.html", "closed/report.html"):
        assert name in named
        assert (tmp_path / "tour" / name).stat().st_size > 1000
    tried = realitygap(*shlex.split(lines[4]), cwd=tmp_path)  # as a user types it
    assert tried.stdout in done.stdout


@pytest.mark.slow
def test_demo_ends_with_130_and_one_line_on_ctrl_c(tmp_path):
    command = [sys.executable, "-m", "realitygap", "demo", "--out", "tour"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        for line in process.stdout:
            if line.startswith("$ realitygap report"):
                break
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode in INTERRUPTED, errors
    assert errors.count("Interrupted.") == 1
    assert "Traceback" not in errors
    assert (tmp_path / "tour" / "paper" / "study.json").exists()


def test_demo_refuses_a_file_as_folder(tmp_path):
    (tmp_path / "tour").write_text("mine")
    done = realitygap("demo", "--out", "tour", cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "realitygap: --out is the file tour, expected a folder. Name another one.\n"


@pytest.mark.parametrize(
    "words",
    [
        ("demo", "--out", ""),
        ("run", "paper", "--out="),
        ("twin", "sample", "--family", "worn", "-o", ""),
    ],
)
def test_an_empty_name_of_a_folder_is_refused(words, tmp_path):
    """The path of an empty name is the current folder."""
    done = realitygap(*words, cwd=tmp_path)
    assert done.returncode == 2
    assert " is empty. Name a file or folder, or leave " in done.stderr
    assert not list(tmp_path.iterdir())
