"""Tasks whose goal, lights or walls are drawn for each trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realitygap.errors import TaskError
from realitygap.tasks import GoalTask, LightTask, WallTask
from realitygap.world import Goal, Light

from .test_scores import ARENA, trials


def test_the_goal_and_the_light_of_a_trial_are_where_they_were_drawn() -> None:
    x, y, _ = ARENA.start
    arena = replace(ARENA, goal=Goal(x + 1, y, 0.1), lights=(Light(x + 1, y),))
    found = trials(np.array([[[x, y], [x + 0.5, y]]] * 2), arena)
    for task, kind in ((GoalTask(), "goal"), (LightTask(), "light.0")):
        drawn = replace(found, drawn={f"arena.{kind}.x": np.array([x + 1.0, x - 1.0])})
        one, other = task.fitness(drawn, arena)
        assert one == task.fitness(found, arena)[0] == pytest.approx(0.5)
        assert other == pytest.approx(-0.5 if kind == "goal" else 0.0)


def test_a_trial_that_happens_to_start_there_has_a_finite_score() -> None:
    x, y, _ = ARENA.start
    arena = replace(ARENA, goal=Goal(x + 1, y, 0.1), lights=(Light(x + 1, y),))
    found = trials(np.array([[[x + 1, y], [x + 1.5, y]]]), arena)
    assert GoalTask().fitness(found, arena).tolist() == [1.0]
    assert LightTask().fitness(found, arena).tolist() == [0.0]


def test_walls_to_follow_are_not_drawn() -> None:
    x, y, _ = ARENA.start
    found = replace(trials(np.array([[[x, y], [x, y]]])), drawn={"arena.wall.0.x1": np.zeros(1)})
    with pytest.raises(TaskError, match=r"arena\.wall\.0\.x1 is drawn"):
        WallTask().fitness(found, ARENA)
