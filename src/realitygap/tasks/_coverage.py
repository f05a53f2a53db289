"""The paper's task: visit as many cells as possible."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from realitygap.settings import Settings


class CoverageTask(Settings):
    """What is counted and what the network is told.

    Source: Rosenzweig & Remy, sections 2.1 and 2.4.
    """

    cells: Literal["line", "ends"] = Field(
        "line",
        description="Which cells selection counts: those that the line travelled crosses, or those in which "
        "steps end. The paper leaves it open; a full-speed step (0.1 m) is longer than a cell (0.0762 m). "
        "Both are recorded always, and the start counts for both.",
    )
    bias_input: Literal["with-novelty", "always", "never"] = Field(
        "with-novelty",
        description="When the network has a fourth, constant input. The paper (section 2.1): with novelty.",
    )
    time_input: Literal["from-0"] = Field(
        "from-0",
        description="The third input is step / steps, 0 at the first step. The paper says only 'a measure "
        "of time'; no alternative is offered.",
    )

    @property
    def name(self) -> str:
        """As `[task] kind` has it."""
        return "coverage"

    def has_bias_input(self, selection: str) -> bool:
        """Whether the networks of a condition have the constant input."""
        if self.bias_input == "with-novelty":
            return selection == "novelty"
        return self.bias_input == "always"

    def input_names(self, selection: str) -> tuple[str, ...]:
        """What the network's inputs are, in order."""
        return ("obstacle", "stall", "time", *(("bias",) if self.has_bias_input(selection) else ()))

    @property
    def output_names(self) -> tuple[str, ...]:
        """What the network's outputs are, in order."""
        return ("move", "turn")
