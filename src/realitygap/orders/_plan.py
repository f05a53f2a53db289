"""The order of a plan."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Literal, get_args

from ._field import option
from ._order import Order, OrderError
from ._shared import ALPHA, Seed, alpha_option, arena_option, seed_option, task_option

Question = Literal["effect", "margin", "correlation"]


class PlanOrder(Order):
    """Estimate how many controllers and trials you need.

    Numbers come from normal formulas. Simulated studies of that size give the power. For a correlation, controllers
    are added until the simulated power reaches --power.

    With --sequential, two controllers are compared instead, in pairs of one trial each. The plan states how many pairs
    the test of `realitygap try --against` needs, next to those of a fixed design.

    Example: realitygap plan --effect 0.05

    Example: realitygap plan --margin 0.05 --spread 0.03

    Example: realitygap plan --effect 0.1 --sequential

    Example: realitygap plan --effect 0.05 --task light --arena light

    In Python: realitygap.study.plan_gap(effect=0.05)
    """

    command: ClassVar[str] = "plan"

    effect: float | None = option(None, help="Detect a mean difference D in score.", above=0, metavar="D")
    margin: float | None = option(
        None, help="Show equivalence within a margin M of scores.", above=0, metavar="M"
    )
    correlation: float | None = option(
        None, help="Show that a correlation R is above --least.", above=0, metavar="R"
    )
    least: float = option(0.5, help="Lower bound for --correlation.", above=-1)
    spread: float | None = option(
        None,
        help="Standard deviation of true differences between platforms over controllers.",
        default_is="half of the standard deviation of the controllers",
        at_least=0,
    )
    power: float = option(
        0.8, help="Statistical power: the probability of detecting the effect.", at_least=0.05, at_most=0.999
    )
    sequential: bool = option(
        False, help="Plan to compare two controllers in pairs of trials, with looks after each pair."
    )
    alpha: float = alpha_option()
    data: Path | None = option(
        None,
        help="Recorded trials to estimate the noise from.",
        default_is="a pilot on sim",
        metavar="FILE",
        names=("--from",),
    )
    task: str = task_option()
    arena: str = arena_option()
    seed: Seed = seed_option()

    @classmethod
    def by_place(cls, *values: object) -> dict[str, object]:
        """Return the fields for a question and its value, such as "effect" and 0.05."""
        question, value = values if len(values) == 2 else (None, None)
        if question not in get_args(Question):
            names = ", ".join(get_args(Question))
            raise OrderError({"question": f"expected one of {names}, got {question!r}."})
        return {str(question): value}

    def conflicts(self) -> Iterator[tuple[str, str]]:
        """Yield the field and the message for each setting that others exclude."""
        names = [name for name in get_args(Question) if getattr(self, name) is not None]
        if len(names) != 1:
            got = ", ".join(f"--{name}" for name in names) or "no question"
            yield (
                "effect",
                f"Got {got}, expected one of --effect, --margin, and --correlation. For example: realitygap plan "
                "--effect 0.05",
            )
        elif self.correlation is not None and not -1 < self.least < self.correlation < 1:
            yield (
                "least",
                f"least is {self.least} and correlation {self.correlation}, expected -1 < least < correlation < 1.",
            )

        if self.alpha != ALPHA and not self.sequential:
            yield "alpha", "--alpha is only for --sequential. Leave it out."
        if self.sequential and self.effect is None:
            yield (
                "sequential",
                "--sequential needs --effect. For example: realitygap plan --effect 0.1 --sequential",
            )

    @property
    def question(self) -> Question:
        """The question: effect, margin or correlation."""
        return next(name for name in get_args(Question) if getattr(self, name) is not None)

    @property
    def value(self) -> float:
        """Value of the effect, the margin, or the correlation."""
        return float(getattr(self, self.question))
