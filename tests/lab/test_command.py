"""`realitygap lab` at a terminal."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from realitygap.errors import RealityGapError, StudyError
from realitygap.lab import open_lab
from realitygap.lab._server import _entry

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "realitygap", "lab"]


def said_without(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    """What the command says in a Python in which some code ran first."""
    begun = f"import sys; {code}; sys.argv = {['realitygap', *arguments]!r}"
    text = f"{begun}; from realitygap.cli import main; sys.exit(main())"
    return subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, check=False)


def test_help_is_there_at_once():
    code = "import atexit; atexit.register(lambda: print(sorted({'nicegui', 'numba', 'numpy'} & set(sys.modules))))"
    done = said_without(code, "lab", "--help")
    assert done.returncode == 0
    assert "Example: realitygap lab" in done.stdout
    assert done.stdout.rstrip().endswith("[]")


def test_a_missing_extra_is_one_message(tmp_path: Path):
    done = said_without("sys.modules['nicegui'] = None", "lab", str(tmp_path))
    assert done.returncode != 0
    assert "comes with the extra 'lab'" in done.stderr
    assert "Traceback" not in done.stderr


def test_wrong_options_are_refused_before_the_lab_serves_a_page(tmp_path: Path):
    with (
        socket.create_server(("127.0.0.1", 0)) as other,
        pytest.raises(RealityGapError, match="Is a lab running there"),
    ):
        open_lab(tmp_path / "in", port=other.getsockname()[1], show=False)
    with pytest.raises(RealityGapError, match="Name an"):
        open_lab(tmp_path / "in", host="192.0.2.1", port=0, show=False)
    (tmp_path / "file").write_text("")
    with pytest.raises(StudyError, match="cannot be a folder of studies"):
        open_lab(tmp_path / "file", port=0, show=False)
    (tmp_path / "study.json").write_text("{}")
    with pytest.raises(StudyError, match="is the folder of one study"):
        open_lab(tmp_path, port=0, show=False)


def test_it_answers_at_the_address_that_it_tells_and_ends_with_ctrl_c(tmp_path: Path):
    command = [*COMMAND, str(tmp_path), "--port", "0", "--no-open"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as lab:
        assert lab.stdout is not None
        address = next(line for line in lab.stdout if line.startswith("Open ")).split()[1]
        plain, _, token = address.partition("?token=")
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(plain)
        browser = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
        with browser.open(address) as entry:
            assert b'href="/"' in entry.read()
        with browser.open(plain) as answer:
            assert b"Stop robot" in answer.read()
        assert len(token) >= 20
        lab.send_signal(signal.SIGINT)
        _, said = lab.communicate(timeout=60)
    assert "Traceback" not in said
    assert lab.returncode in (0, 130)


def test_browser_is_started_without_the_token_in_its_arguments(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")  # elsewhere, other accounts cannot read them
    with _entry("http://127.0.0.1:1/?token=secret", tmp_path) as opened:
        file = Path(unquote(urlsplit(opened).path))
        assert "secret" not in opened
        assert "token=secret" in file.read_text("utf-8")
        assert file.stat().st_mode & 0o077 == 0
    assert not file.exists()
