"""XOR as Stanley & Miikkulainen (2002) score it (section 4.2)."""

from __future__ import annotations

from collections.abc import Callable

CASES = [((0.0, 0.0), 0), ((0.0, 1.0), 1), ((1.0, 0.0), 1), ((1.0, 1.0), 0)]


def fitness_and_solved(answer: Callable[[tuple[float, float]], float]) -> tuple[float, bool]:
    """(4 - sum of errors) squared; whether each answer in 0..1 is nearer to the right one."""
    answers = [(answer(inputs), wanted) for inputs, wanted in CASES]
    errors = [abs(given - wanted) for given, wanted in answers]
    return (4.0 - sum(errors)) ** 2, all(error < 0.5 for error in errors)
