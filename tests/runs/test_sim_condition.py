"""What a condition on `sim` refuses, and where its figures draw things."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from realitygap.runs import Condition
from realitygap.trials import Trajectory
from realitygap.world import Distribution

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"sim": {"set": {"arena.start.x": 0.0}}}, "the robot does not fit at the start"),
        ({"sim": {"set": {"arena.start.x": {"uniform": [0.0, 0.4]}}}}, "does not fit at the start"),
        ({"sim": {"set": {"drive.delay": 1e9}}}, "expected at most 1000 steps"),
        ({"sim": {"set": {"arena.goal.x": 1.0}}}, "no number of this name"),
        ({"noise": 0.3, "sim": {"set": {"range.0.noise_uniform": 0.1}}}, "Leave one of them out"),
        (
            {"arena": {"preset": "goal"}, "task": {"kind": "goal", "inputs": ["goal_sector.4"]}},
            "goal_sector.4 is missing",
        ),
        ({"platform": "jyro", "task": {"kind": "light"}}, "light.0 to light.1 are missing"),
    ],
)
def test_a_mistake_is_said(values: dict[str, Any], said: str) -> None:
    with pytest.raises(ValidationError, match=said.replace(".", r"\.")):
        Condition.model_validate({"name": "a", "platform": "sim", **values})


BESIDE = {"arena": {"preset": "paper", "start": [0.1, 0.3, 0.0]}}
BOXES = {"arena": {"preset": "paper-boxes"}}
ALL_AROUND = {"arena.start.heading": {"uniform": [-1.5, 1.5]}}
TOGETHER = [{"choice": values, "together": "a"} for values in ([0.2, 0.4], [0.3, 0.19])]


@pytest.mark.parametrize(
    ("values", "drawn", "said"),
    [
        (BESIDE, ALL_AROUND, "beyond a wall.*Drawn: arena.start.heading = "),
        (BESIDE, {"arena.start.heading": {"uniform": [-0.1, 0.1]}}, ""),
        (BOXES, {"arena.obstacle.0.x": {"uniform": [0.05, 0.5]}}, ""),
        (
            BOXES,
            {"arena.obstacle.0.x": {"uniform": [0.05, 0.5]}, "arena.obstacle.0.y": {"choice": [0.2, 0.4]}},
            "(overlap|lies within) obstacle 0.*Drawn: arena.obstacle.0.x = .*, arena.obstacle.0.y = 0.2",
        ),
        (BOXES, {"arena.wall.0.y1": {"uniform": [0.0, 0.3]}}, "Drawn: arena.wall.0.y1"),
        ({}, {"arena.start.x": {"choice": [0.05, 0.2]}}, "start \\(0.05, 0.1905, 0\\)"),
        ({}, dict(zip(("arena.start.x", "arena.start.y"), TOGETHER, strict=True)), ""),
    ],
)
def test_whatever_is_drawn_of_heading_and_obstacles_the_robot_fits_at_the_start(
    values: dict[str, Any], drawn: dict[str, Any], said: str
) -> None:
    """Only the ends of the start's place were looked at."""
    given = {"name": "a", "platform": "sim", **values, "sim": {"set": drawn}}
    if said:
        with pytest.raises(ValidationError, match=said):
            Condition.model_validate(given)
    else:
        assert Condition.model_validate(given).drawn_names == tuple(drawn)


def test_figures_of_a_trial_show_the_arena_that_was_drawn_for_it() -> None:
    name = "arena.obstacle.0.x"
    values: dict[str, Any] = {
        "name": "a",
        "platform": "sim",
        "arena": {"preset": "paper-boxes"},
    }
    still = Condition.model_validate(values)
    x = still.placed_arena.obstacles[0].x
    near = Distribution(uniform=(x - 0.01, x + 0.03))
    condition = Condition.model_validate({**values, "sim": {"set": {name: near}}})
    assert condition.placed_arena.obstacles[0].x == pytest.approx(x + 0.01)
    nothing: Any = None
    trial = Trajectory(0.5, *[nothing] * 5, 0.0, 0.0, (), drawn=(x + 0.02,), drawn_names=(name,))
    assert condition.arena_of(trial).obstacles[0].x == x + 0.02


@pytest.mark.parametrize("speed", [1e6, 1e300])
def test_a_robot_that_is_far_too_fast_is_a_mistake_and_not_a_long_wait(speed: float) -> None:
    with pytest.raises(
        ValueError, match=r"parts to look for contact in; expected at most 1,000\. Is drive\.speed"
    ):
        Condition(name="a", platform="sim", noise=0.0, sim={"set": {"drive.speed": speed}})
