"""What holds for all tests."""

from __future__ import annotations

import signal
import threading

import pytest
from hypothesis import settings

# A busy machine is no fault of what is tested.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")

WITH_DEVICE = "_with_device.py"


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


@pytest.fixture(autouse=True)
def _ctrl_c_is_heard() -> None:
    """A shell that starts a job in the background has it ignore Ctrl-C, and tests that press it would wait for ever."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def port(request: pytest.FixtureRequest) -> str:
    """The port that was given."""
    return str(request.config.getoption("--port"))
