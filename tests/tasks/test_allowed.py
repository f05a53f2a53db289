"""The saved answers on which Python files may run: only the user's own count."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from realitygap.settings import visible
from realitygap.tasks import is_allowed, remember_allowed, source_hash
from realitygap.tasks._allowed import answers_folder

DIGEST = source_hash("print(1)\n")


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("REALITYGAP_STATE", str(tmp_path / "state"))
    return tmp_path / "state"


def test_an_answer_is_remembered_for_one_hash_in_private_files(state):
    assert not is_allowed(DIGEST)
    remember_allowed(DIGEST, "task\x1b[2J.py")
    remember_allowed(DIGEST, "again.py")
    assert is_allowed(DIGEST)
    assert not is_allowed(source_hash("print(1)"))
    (answer,) = answers_folder().iterdir()
    assert answer.read_text() == "task\\x1b[2J.py\n"
    assert answers_folder().stat().st_mode & 0o777 == 0o700
    assert answer.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("mode", [0o770, 0o707, 0o750, 0o701])
def test_a_folder_that_others_can_open_counts_for_nothing(mode):
    remember_allowed(DIGEST, "task.py")
    answers_folder().chmod(mode)
    assert not is_allowed(DIGEST)
    with pytest.raises(PermissionError, match="other users"):
        remember_allowed(source_hash("other"), "other.py")


def test_an_answer_that_others_can_write_counts_for_nothing():
    remember_allowed(DIGEST, "task.py")
    (answers_folder() / DIGEST).chmod(0o620)
    assert not is_allowed(DIGEST)


def test_links_are_not_followed(tmp_path):
    remember_allowed(DIGEST, "task.py")
    other = source_hash("other")
    (answers_folder() / other).symlink_to(answers_folder() / DIGEST)
    assert not is_allowed(other)
    folder = answers_folder().rename(tmp_path / "moved")
    answers_folder().symlink_to(folder)
    assert not is_allowed(DIGEST)
    with pytest.raises(OSError, match=r"Not a directory|symbolic links"):
        remember_allowed(source_hash("third"), "third.py")
    assert len(list(folder.iterdir())) == 2


def test_files_of_another_user_count_for_nothing(monkeypatch):
    remember_allowed(DIGEST, "task.py")
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert not is_allowed(DIGEST)


def test_a_folder_in_the_place_of_an_answer_is_none():
    remember_allowed(DIGEST, "task.py")
    other = source_hash("other")
    (answers_folder() / other).mkdir(mode=0o700)
    assert not is_allowed(other)


def test_answers_are_in_the_users_folder_for_states(monkeypatch, tmp_path):
    monkeypatch.delenv("REALITYGAP_STATE")
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert answers_folder() == tmp_path / "realitygap" / "allowed-code"
    monkeypatch.setenv("XDG_STATE_HOME", "relative")
    assert answers_folder() == Path.home() / ".local" / "state" / "realitygap" / "allowed-code"
    monkeypatch.setattr("sys.platform", "darwin")
    assert answers_folder() == Path.home() / "Library" / "Application Support" / "realitygap" / "allowed-code"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("def f(t): return 1  # a \\ b", "def f(t): return 1  # a \\ b"),
        ("\x1b[2K\x1b[1A", r"\x1b[2K\x1b[1A"),
        ("safe()\r# nothing", r"safe()\r# nothing"),
        ("\u202egnihton", r"\u202egnihton"),
        ("\u3164 = \u0430\u200b", r"\u3164 = \u0430\u200b"),
        ("\x9b2J\x08\t\x7f\x0c", r"\x9b2J\x08\t\x7f\x0c"),
        ("\ud800\U0001f600", r"\ud800\U0001f600"),
    ],
)
def test_characters_that_could_hide_code_are_shown_as_escapes(text, shown):
    assert visible(text) == shown
