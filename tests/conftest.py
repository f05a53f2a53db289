"""What holds for all tests."""

from __future__ import annotations

import functools
import gc
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer.testing
from hypothesis import settings

from .browsers import Visitors, open_browser

# A busy machine is no fault of what is tested.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

WITH_DEVICE = "_with_device.py"

PARTS = ("jyro", "sim")
"""Of `tests/warm.py`, each in a process of its own."""

KEPT_MEMORY = {f"MALLOC_{name}_THRESHOLD_": str(4 << 30) for name in ("MMAP", "TRIM")}
"""Have processes keep what they free, as a system that clears each page again takes half of a photograph's time."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--port", help="Of a robot on the floor: also run the tests that need one.")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Without a port, tests that need a robot are not selected; nothing is skipped."""
    if config.getoption("--port"):
        return
    left_out = [item for item in items if item.path.name.endswith(WITH_DEVICE)]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.path.name.endswith(WITH_DEVICE)]


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int | None:
    """Use one process more than there are cores: many tests wait, for a page or for a robot at its own speed."""
    if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ:
        return None  # xdist's own
    return (len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1) + 1


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile once what several processes would each compile: the most used kernels, and the byte code of the tests."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = (
        "OFF"  # DDS binds to all addresses; only its own tests use it
    )
    config = session.config
    is_controller = config.getoption("numprocesses", None) and not hasattr(config, "workerinput")
    if not is_controller or config.option.collectonly:
        return
    began = time.monotonic()
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    for name, value in KEPT_MEMORY.items():
        os.environ.setdefault(name, value)
    command = [sys.executable, "-m", "tests.warm"]
    collect = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", *config.args]
    collecting = subprocess.Popen(collect, cwd=config.invocation_params.dir, stdout=subprocess.DEVNULL)
    parts = [subprocess.Popen([*command, part], cwd=config.rootpath) for part in PARTS]
    failed = [name for name, part in zip(PARTS, parts, strict=True) if part.wait()]
    if failed:
        raise pytest.UsageError(f"Kernels could not be compiled: run {' '.join(command)} {failed[0]}")
    collecting.wait()  # its errors are those of the tests themselves
    if (seconds := time.monotonic() - began) > 10:
        session.config.get_terminal_writer().line(f"kernels and tests compiled after {seconds:.0f} s")


@pytest.fixture(autouse=True)
def _ctrl_c_is_heard() -> None:
    """A shell that starts a job in the background has it ignore Ctrl-C, and tests that press it would wait for ever."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True, scope="session")
def _no_file_is_allowed_yet(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the answers of this machine's user out of the tests, and theirs out of this machine."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setenv("REALITYGAP_STATE", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(autouse=True, scope="session")
def _commands_are_built_once() -> Iterator[None]:
    """Typer's runner builds all commands, for 40 ms, each time that it runs one."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("typer.testing._get_command", functools.cache(typer.main.get_command))
        yield


def twin_processes() -> list[int]:
    """Processes in which a twin lives, children of this one; none are found where there is no /proc."""
    listed = Path("/proc/self/task").glob("*/children")
    children = [int(pid) for each in listed for pid in _content(each).split()]
    return [pid for pid in children if b"platforms.twin._worker" in _content(Path(f"/proc/{pid}/cmdline"))]


def _content(path: Path) -> bytes:
    """Return the bytes of a file in /proc; none if its thread or process has ended meanwhile."""
    try:
        return path.read_bytes()
    except OSError:
        return b""


@pytest.fixture(autouse=True, scope="module")
def _no_twin_is_left_open() -> Iterator[None]:
    """Whoever opens a twin closes it; the one of the last trials by a genome is kept for the next, and closed here."""
    yield
    if twin_processes():
        sys.modules["realitygap.platforms"].close_twins()
        gc.collect()
        assert not twin_processes()


@pytest.fixture(scope="module")
def visitors() -> Iterator[Visitors]:
    """A browser, and pages in it; only while its module runs, as others run event loops in this thread."""
    with open_browser() as browser:
        yield Visitors(browser)


@pytest.fixture
def port(request: pytest.FixtureRequest) -> str:
    """The port that was given."""
    return str(request.config.getoption("--port"))
