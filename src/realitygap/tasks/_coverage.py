"""The paper's task: visit as many cells as possible."""

from __future__ import annotations

from typing import Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from realitygap.records import Observe
from realitygap.settings import Settings
from realitygap.world import Arena

from ._inputs import Inputs
from ._trajectories import Trajectories

PAPER_INPUTS = ("obstacle", "stall", "time")


class CoverageTask(Settings):
    """A task that rewards the cells that a robot visits.

    Source: Rosenzweig & Remy, sections 2.1 and 2.4.
    """

    cells: Literal["line", "ends"] = Field(
        "line",
        description="Cells that selection counts. line: cells that the robot's line crosses. ends: cells in which a "
        "step ends. The paper leaves it open; a full-speed step (0.1 m) is longer than a cell (0.0762 m). Both are "
        "always recorded, and the start counts for both.",
    )
    bias_input: Literal["with-novelty", "always", "never"] = Field(
        "with-novelty",
        description="Conditions whose networks have a fourth, constant input. The paper (section 2.1): with novelty.",
    )
    time_input: Literal["from-0"] = Field(
        "from-0",
        description="Third input of networks: step / steps, 0 at the first step. The paper states only 'a measure of "
        "time'. There is no alternative.",
    )

    inputs: Inputs = Field(
        PAPER_INPUTS,
        description="Older name of controller.inputs, without the constant input: see bias_input.",
        json_schema_extra={"hidden": True},
    )

    name: ClassVar[str] = "coverage"
    needs_trace: ClassVar[bool] = False
    score_name: ClassVar[str] = "coverage"
    score_range: ClassVar[tuple[float, float]] = (0.0, 1.0)
    output_names: ClassVar[tuple[str, str]] = ("move", "turn")

    @model_validator(mode="after")
    def _has_no_constant(self) -> Self:
        if "bias" in self.inputs:
            raise ValueError("inputs: expected none named bias. Set bias_input: it adds the constant input")
        return self

    @model_serializer(mode="wrap")
    def _without_default_inputs(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Conditions with the paper's inputs keep their hashes."""
        values: dict[str, Any] = handler(self)
        if self.inputs == PAPER_INPUTS:
            values.pop("inputs", None)
        return values

    @property
    def observe(self) -> Observe:
        """The required observation level: the crossed cells, or poses if the cells at the ends of steps count."""
        return "cells" if self.cells == "line" else "track"

    def fitness(self, trajectories: Trajectories, arena: Arena) -> NDArray[np.float64]:
        """Return the visited share of the reachable cells, (n,), 0..1."""
        return trajectories.coverage_line if self.cells == "line" else trajectories.coverage_ends

    def has_bias_input(self, selection: str) -> bool:
        """Return whether the networks of a condition have the constant input."""
        if self.bias_input == "with-novelty":
            return selection == "novelty"
        return self.bias_input == "always"

    def input_names(self, selection: str) -> tuple[str, ...]:
        """Return the names of the network's inputs, in order."""
        return (*self.inputs, *(("bias",) if self.has_bias_input(selection) else ()))
