"""Room on Python's stack for a function and all that it calls."""

import resource

from realitygap._process import on_wide_stack

DEPTH = 300  # calls within each other: the frames of all of them fill more than one small piece of the stack
N_CALLS = 2_000  # in a loop at each depth


def leaf() -> None:
    """Return nothing."""


def fault_pages(depth: int) -> int:
    """Return the largest number of page faults in a loop of calls, over all depths down to 0."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(N_CALLS):
        leaf()
    faults = resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
    return max(faults, fault_pages(depth - 1)) if depth else faults


@on_wide_stack
def fault_pages_on_wide_stack(depth: int) -> int:
    """Return the page faults of a wide stack."""
    return fault_pages(depth)


def test_no_loop_takes_memory_from_the_system_on_a_wide_stack() -> None:
    assert fault_pages_on_wide_stack(DEPTH) < N_CALLS / 10


@on_wide_stack
def divide(dividend: float, *, divisor: float = 2.0) -> float:
    """Return a quotient."""
    return dividend / divisor


def test_function_on_wide_stack_keeps_its_arguments_result_and_name() -> None:
    assert divide(3.0) == 1.5
    assert divide(3.0, divisor=3.0) == 1.0
    assert divide.__name__ == "divide"
