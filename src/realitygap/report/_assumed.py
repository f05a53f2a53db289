"""The assumptions of the platform `sim` about the robot, in words, from the settings in the records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from realitygap.platforms import SimPlatform
from realitygap.report._tally import DescribedCondition, settings_of

_CONTACT = {
    "freeze": "a blocked robot does not move at all",
    "stop": "a blocked robot turns where its body allows, and does not slide",
    "slide": "a robot that meets a wall skids and turns along it",
}
_KINDS = ("uniform", "normal", "log_uniform", "choice")


def sim_assumptions(conditions: Sequence[DescribedCondition]) -> list[tuple[str, str]]:
    """Return the conditions and the assumptions of each set-up of the platform `sim`.

    Args:
        conditions: Conditions in the study's description.
    """
    found: dict[str, list[str]] = {}
    for condition in conditions:
        settings = settings_of(condition)
        sim = settings.get(SimPlatform.name)
        if isinstance(sim, Mapping):
            text = assumed(sim, float(settings.get("noise") or 0.0))
            found.setdefault(text, []).append(str(condition["name"]))
    return [(", ".join(names), text) for text, names in found.items()]


def assumed(sim: Mapping[str, Any], noise: float) -> str:
    """Describe the assumptions of one set-up: robot, step, motors, contact, noise, and random quantities.

    Args:
        sim: Settings of the platform, with the robot as resolved.
        noise: The condition's own, the paper's a.
    """
    robot = sim.get("robot", {})
    drive, changed = robot.get("drive", {}), dict(sim.get("set", {}))
    contact = sim.get("contact", "robot")
    model = robot.get("contact", {}).get("model", "slide") if contact == "robot" else contact
    step_s = sim.get("step_s") or robot.get("step_s", 0)
    speed = changed.get("drive.speed", drive.get("speed"))
    at = f", at full command {speed:g} m/s" if isinstance(speed, int | float) else ""
    parts = [
        f"robot {robot.get('name', '?')} of {len(robot.get('body', ()))} convex part"
        f"{'s' if len(robot.get('body', ())) != 1 else ''}{at}",
        f"commands of {step_s:g} s",
        f"contact {model}: {_CONTACT.get(model, 'as named')}",
        "noise of sensors and motors as in the robot’s file"
        if sim.get("noise", True)
        else "no noise of its own",
    ]
    if noise:
        parts.append(f"and each range reading moved by {noise:g} · U(−1, 1)")
    drawn = {**robot.get("vary", {}), **changed}
    random = {
        name: value for name, value in drawn.items() if isinstance(value, Mapping) and not _is_fixed(value)
    }
    fixed = {name: value for name, value in changed.items() if not isinstance(value, Mapping)}
    if fixed:
        parts.append("set: " + ", ".join(f"{name} {value:g}" for name, value in fixed.items()))
    if random:
        parts.append("drawn: " + ", ".join(f"{name} {_drawn(value)}" for name, value in random.items()))
    return "; ".join(parts) + "."


def _is_fixed(value: Mapping[str, Any]) -> bool:
    return not any(kind in value for kind in _KINDS)


def _drawn(value: Mapping[str, Any]) -> str:
    kind = next(kind for kind in _KINDS if kind in value)
    numbers = ", ".join(f"{number:g}" for number in value[kind])
    return f"{kind.replace('_', ' ')} ({numbers}) per {value.get('per', 'trial')}"
