"""A domain, robots by Fast DDS, and a peer by Cyclone DDS for each test."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from .fast_dds import FastRobot, FreeDomain, why_not


@pytest.fixture
def domain() -> Iterator[int]:
    with FreeDomain() as free:
        yield free.number


@pytest.fixture
def start_robot(domain: int) -> Iterator[Callable[..., FastRobot]]:
    """A function that starts a robot with options of `FastRobot`. It ends with the test."""
    if reason := why_not():
        pytest.skip(reason)
    with contextlib.ExitStack() as stack:

        def start(arena: Any = None, **options: object) -> FastRobot:
            return stack.enter_context(FastRobot(arena, domain=domain, **options))

        yield start


@pytest.fixture
def peer(domain: int) -> Iterator[Any]:
    """A participant by Cyclone DDS."""
    pytest.importorskip("cyclonedds", reason="needs the Python package cyclonedds")
    from .cyclone import Peer

    with Peer(domain) as made:
        yield made
