"""What holds for all tests."""

from __future__ import annotations

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


@pytest.fixture
def port(request: pytest.FixtureRequest) -> str:
    """The port that was given."""
    return str(request.config.getoption("--port"))
