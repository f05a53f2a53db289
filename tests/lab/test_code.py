"""The lab runs Python tasks only if it was started with --allow-code, and only from files in its folder."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import realitygap
from realitygap.errors import StudyError
from realitygap.lab import _checks, _lab
from realitygap.lab._checks import Checks
from realitygap.lab._lab import Lab
from realitygap.lab._messages import Message, StudyWork, TextChecked, TextRefused
from realitygap.lab._study import run
from realitygap.tasks import _python
from tests.python_tasks import marking_source, study_text

STUDY = study_text()
REFUSED = "start the lab with: realitygap lab --allow-code"


class SilentChannel:
    """Takes what a process says to the server."""

    def say(self, message: Message) -> None: ...

    def report(self, message: Message, *, is_last: bool) -> None: ...


@pytest.fixture
def root(tmp_path) -> Path:
    (tmp_path / "task.py").write_text(marking_source(tmp_path / "marker"))
    return tmp_path.resolve()


def work(root: Path, **options: Any) -> None:
    channel: Any = SilentChannel()
    run(channel, StudyWork(str(root / "mine"), threads=1, **options))


@pytest.fixture
def orders(monkeypatch) -> list[StudyWork]:
    """Work for processes, none of which is started."""
    told: list[StudyWork] = []

    def note(_name: str, work: StudyWork, _root: Path, _changed: Any) -> SimpleNamespace:
        told.append(work)
        return SimpleNamespace(port="", is_over=True, is_lost=False, has_met=False)

    monkeypatch.setattr(_lab, "StudyJob", note)
    return told


def check(root: Path, text: str = STUDY, *, allow_code: bool) -> TextChecked | TextRefused:
    return _checks._check(root, text, allow_code=allow_code)[0]


def test_check_refuses_a_python_task_unless_the_lab_may_run_code(root):
    assert REFUSED in check(root, allow_code=False).text
    inline = STUDY.replace("inputs", 'source = "def far(t): pass"\ninputs')
    assert "source: code in a study file is not run" in check(root, inline, allow_code=True).text
    assert check(root, allow_code=True).name == "mine"
    assert not (root / "marker").exists()  # a check runs none


@pytest.mark.slow
def test_lab_passes_its_permission_to_its_processes(root, orders):
    lab = Lab(root, allow_code=True)
    assert lab.checks._allow_code
    lab.start_new("mine", STUDY)
    assert [order.allow_code for order in orders] == [True]
    work(root, text=STUDY, allow_code=True)
    assert (root / "marker").exists()
    lab.go_on("mine")
    Lab(root).go_on("mine")
    assert [order.allow_code for order in orders] == [True, True, False]


@pytest.mark.slow
def test_a_study_goes_on_only_with_permission_and_its_file(root):
    with pytest.raises(StudyError, match=REFUSED):
        work(root, text=STUDY)
    work(root, text=STUDY, allow_code=True)
    work(root, allow_code=True)
    (root / "marker").unlink()
    _python._load.cache_clear()
    with pytest.raises(StudyError, match=REFUSED):
        work(root)
    source = (root / "task.py").read_text()
    (root / "task.py").write_text(source + "# changed")
    with pytest.raises(
        StudyError, match=r"task\.py in .* has SHA-256 \w{64}, and the results .* with \w{64}"
    ):
        work(root, allow_code=True)
    (root / "task.py").unlink()
    with pytest.raises(
        StudyError, match=r"Resuming the study needs its Python file: .*task\.py cannot be read"
    ):
        work(root, allow_code=True)
    assert not (root / "marker").exists()


def test_module_in_the_labs_folder_is_not_run(root):
    (root / "numpy.py").write_text(f"open({str(root / 'marker')!r}, 'w').close()\n")
    checks = Checks(root, allow_code=False)
    try:
        assert REFUSED in checks.begin("check", STUDY).found.result(60).text
    finally:
        checks.end()
    assert not (root / "marker").exists()


@pytest.mark.slow
def test_child_processes_do_not_look_for_modules_in_the_current_folder():
    sources = Path(realitygap.__file__).parent.rglob("*.py")
    launches = [
        part for path in sources for part in re.findall(r"\[sys\.executable, (.*)", path.read_text("utf-8"))
    ]
    assert len(launches) >= 4
    assert all(part.startswith(('"-P"', '"-I"')) for part in launches)
