"""The work that `peers.py` times, in numbers: every peer does the same, or says what differs."""

from __future__ import annotations

from typing import NamedTuple


class Figure(NamedTuple):
    """What is measured."""

    title: str
    unit: str
    is_rate: bool  # whether more is faster
    seconds: float = 600.0  # that a worker may take, compiling and all repeats


FIGURES = {
    "steps_core": Figure("robot-steps a second, one core", "/s", True),
    "steps_all": Figure("robot-steps a second, all cores", "/s", True),
    "realism_avoiding": Figure(
        "outline, contact, noisy IR and motors: avoiding walls, robot-steps a second, one core", "/s", True
    ),
    "realism_pressed": Figure("the same, pressed into walls", "/s", True),
    "realism_boxes": Figure("the same, avoiding walls and two boxes", "/s", True),
    "run_us": Figure("NEAT run: population 8, 5 generations, trivial fitness", "µs", False),
    "xor_ms": Figure("XOR: population 150, one generation with evaluation", "ms", False),
    "large_ms": Figure("reproduction and speciation, population 10,000", "ms", False, seconds=120.0),
    "pass_us": Figure("one pass of a network, 3 inputs, 2 outputs", "µs", False),
}

REPEATS = 5  # the median counts

# A NEAT run: three inputs, two outputs, as in the paper, every fitness 1: five generations told, four bred.
N_INPUTS = 3
N_OUTPUTS = 2
RUN_POPULATION = 8
RUN_GENERATIONS = 5

XOR_POPULATION = 150
XOR_GENERATIONS = 30  # none stops at a solution

LARGE_POPULATION = 10_000
LARGE_GENERATIONS = 3  # bred, each one repeat; fitness is drawn uniformly
XOR_CASES = (((0.0, 0.0), 0.0), ((0.0, 1.0), 1.0), ((1.0, 0.0), 1.0), ((1.0, 1.0), 0.0))
