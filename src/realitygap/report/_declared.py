"""The declared inputs and outputs of a condition, also by settings that another version wrote."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Names = tuple[str, ...]


def declared(settings: Mapping[str, Any]) -> tuple[Names, Names]:
    """Return the names of the inputs and the outputs of networks, as `runs.Condition` has them."""
    controller, task = (dict(settings.get(name) or {}) for name in ("controller", "task"))
    outputs = tuple(controller.get("outputs") or ("move", "turn"))
    if controller.get("inputs"):
        return tuple(controller["inputs"]), outputs
    inputs = tuple(task.get("inputs") or ("obstacle", "stall", "time"))
    if "kind" in task:
        return inputs, outputs
    bias = task.get("bias_input", "with-novelty")
    has_bias = bias == "always" or (bias == "with-novelty" and settings.get("selection") == "novelty")
    return (*inputs, "bias") if has_bias else inputs, outputs
