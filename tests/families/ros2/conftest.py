"""A domain, robots by Fast DDS, and a peer by Cyclone DDS for each test."""

from __future__ import annotations

import contextlib
import ctypes
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from .fast_dds import FastRobot, why_not

CLONE_NEWNET = 0x40000000


@contextlib.contextmanager
def own_network() -> Iterator[None]:
    """Put this thread, and the threads and processes that it starts, into a network of their own: only `lo`.

    Cyclone DDS receives on all addresses, whatever interface it is to use.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    with Path("/proc/thread-self/ns/net").open() as before:
        if libc.unshare(CLONE_NEWNET):
            pytest.skip("needs the right to make a network namespace, which root has")
        try:
            subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
            yield
        finally:
            if libc.setns(before.fileno(), CLONE_NEWNET):
                pytest.exit("The network of the tests cannot be left.")


@pytest.fixture
def domain() -> Iterator[int]:
    """The number of a DDS domain in a network without other programs."""
    with own_network():
        yield 1


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
