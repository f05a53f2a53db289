"""Progress in a file, and the message after Ctrl-C."""

import pytest
import typer

from realitygap.cli import _progress
from realitygap.cli._progress import TrialsBar, resumable


def test_a_file_gets_a_line_of_progress_now_and_then(capsys, monkeypatch):
    monkeypatch.setattr(_progress, "_LINE_EVERY_S", 10.0)
    now = [0.0]
    with TrialsBar(quiet=False, clock=lambda: now[0]) as bar:
        for done in range(1, 61):
            now[0] += 1
            bar.show("sim", done, 1000)
    assert capsys.readouterr().err.splitlines() == [f"sim: {n} of 1,000 trials" for n in range(10, 61, 10)]


def test_a_quiet_command_shows_none(capsys):
    with TrialsBar(quiet=True, clock=iter(range(0, 1000, 100)).__next__) as bar:
        bar.show("sim", 1, 10)
        bar.say("fitting")
    assert capsys.readouterr().err == ""


def interrupted(capsys, *kept):
    """Return the message after Ctrl-C."""
    with pytest.raises(typer.Exit) as ended, resumable(*kept):
        raise KeyboardInterrupt
    assert ended.value.exit_code == 130
    return capsys.readouterr().err


def test_trials_are_in_a_file_as_soon_as_it_exists(tmp_path, capsys):
    file = tmp_path / "trials.sqlite"
    assert interrupted(capsys, file) == "Interrupted. Nothing was saved.\n"
    file.touch()
    message = f"Interrupted. Finished trials are in {file}. Run the same command to resume.\n"
    assert interrupted(capsys, file) == message
    assert interrupted(capsys, None, "Add -o FILE.") == "Interrupted. Nothing was saved. Add -o FILE.\n"
    assert "All runs are saved. Run the same command to resume." in interrupted(capsys, "All runs are saved.")
