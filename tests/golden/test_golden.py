"""Hashes of conditions and digests of results are those that are stored."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from . import make

GOLDEN = json.loads(make.FILE.read_text("utf-8"))


def test_hashes_of_conditions_are_unchanged() -> None:
    assert make.hashes_of_conditions() == GOLDEN["conditions"]


@pytest.mark.slow
@pytest.mark.parametrize("name", make.results())
def test_results_are_unchanged(name: str) -> None:
    assert make.results()[name]() == GOLDEN["results"][name]


# Prints the processor and the features that Numba compiles for, and digests.
CODE_OF_DIGESTS = """
import json, sys
from numba.core.registry import cpu_target
from tests.golden import make
target = cpu_target.target_context.codegen().magic_tuple()[1:]
print(json.dumps([target, {name: make.results()[name]() for name in sys.argv[1:]}]))
"""


@pytest.mark.slow
def test_results_do_not_depend_on_vector_instructions() -> None:
    # Every processor of a kind has the instructions of `generic`. On x86-64, they have vectors of 128 bits and no
    # fused multiply-add. The robot of `light` meets obstacles.
    names = ["run paper", "run sim-paper", "run light"]
    done = subprocess.run(
        [sys.executable, "-c", CODE_OF_DIGESTS, *names],
        capture_output=True,
        text=True,
        env={**os.environ, "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
        cwd=Path(__file__).parents[2],
        check=True,
    )
    target, results = json.loads(done.stdout)
    assert target == ["generic", ""]
    assert results == {name: GOLDEN["results"][name] for name in names}
