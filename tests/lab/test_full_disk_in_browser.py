"""A lab whose disk is full says so on its pages, and still answers."""

from __future__ import annotations

import re
import resource
from collections.abc import Iterator
from pathlib import Path

import pytest

from .conftest import RunningLab
from .test_studies_in_browser import TINY, start

pytestmark = pytest.mark.slow

FULL = re.compile(r"Could not write .*Make room there")


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[RunningLab]:
    """A lab that cannot write more than 1 kB into a file, which fails as a full disk does."""
    running = RunningLab(tmp_path / "studies", is_forking=False, limits={resource.RLIMIT_FSIZE: 1000})
    running.start()
    yield running
    running.stop()


def test_full_disk_is_one_message_and_the_lab_goes_on(lab, visit):
    page = visit("new")
    start(page, TINY)
    page.get_by_text(FULL).wait_for()
    assert lab.post("stop") == b"no robot"
