"""Tasks beside coverage: against plain ones, hand-made paths, and what must hold of any path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from realitygap.errors import TaskError
from realitygap.tasks import (
    AvoidTask,
    GoalTask,
    LightTask,
    Task,
    TraceArrays,
    Trajectories,
    WallTask,
    wall_outlines,
)
from realitygap.world import Arena, Goal, Grid, Light, Obstacle, Pose
from tests.reference import scores as reference
from tests.reference.effort import cases

WALLS = (
    (0.0, 0.0, 1.0, 0.0),
    (1.0, 0.0, 1.2, 0.8),
    (1.2, 0.8, 0.0, 1.0),
    (0.0, 1.0, 0.0, 0.0),
    (0.5, 0.5, 0.5, 0.5),
)
ARENA = Arena(
    "test",
    WALLS,
    Grid(0.0, 0.0, 1.0, 1, 1),
    Pose(0.3, 0.4, 0.5),
    obstacles=(
        Obstacle(0.7, 0.5, 0.3, ((0.0, 0.0), (0.1, 0.0), (0.1, 0.2))),
        Obstacle(0.2, 0.8, radius=0.05),
    ),
    lights=(Light(0.9, 0.3), Light(0.1, 0.7)),
    goal=Goal(0.8, 0.7, 0.1),
)
TASKS: list[Any] = [
    AvoidTask(),
    AvoidTask(backward=False),
    LightTask(),
    GoalTask(),
    WallTask(side="left", within=0.2),
    WallTask(side="right", within=0.4),
]


def trials(
    paths: Any,
    arena: Arena = ARENA,
    commands: Any = None,
    readings: Any = None,
    stalled: Any = None,
    real: Any = float,
) -> Trajectories:
    """Trials that went along paths (n, t + 1, 2) in the arena; what is not given is 0."""
    paths = np.asarray(paths, np.float64)
    n, rows, _ = paths.shape
    poses = np.zeros((rows, 3, n))
    poses[:, :2] = paths.transpose(1, 2, 0) - np.array([arena.start.x, arena.start.y])[:, None]
    commands = np.zeros((n, rows - 1, 2)) if commands is None else np.asarray(commands)
    readings = np.zeros((n, rows, 3)) if readings is None else np.asarray(readings)
    stalled = np.zeros((n, rows), bool) if stalled is None else np.asarray(stalled, bool)
    arrays = TraceArrays(
        poses.astype(real),
        np.ascontiguousarray(readings.transpose(1, 2, 0), real),
        np.zeros((rows - 1, 0, n), real),
        np.ascontiguousarray(commands.transpose(1, 2, 0), real),
        np.ascontiguousarray(stalled.T),
        np.zeros((rows, 2, n), real),
    )
    nothing = np.zeros(n)
    return Trajectories(
        arena, 0.1, arrays, ("range.0", "light.0", "range.1"), (), nothing, nothing, nothing.astype(np.int32)
    )  # fmt: skip


def wandering(
    seed: int, n: int = 7, n_steps: int = 20, arena: Arena = ARENA, real: Any = float
) -> Trajectories:
    rng = np.random.default_rng(seed)
    steps = rng.normal(0, 0.08, (n, n_steps, 2)) * (rng.random((n, n_steps, 1)) < 0.8)
    start = np.array([arena.start.x, arena.start.y])
    paths = start + np.concatenate([np.zeros((n, 1, 2)), steps.cumsum(axis=1)], axis=1)
    return trials(
        paths,
        arena,
        rng.uniform(-1, 1, (n, n_steps, 2)),
        rng.uniform(0, 1, (n, n_steps + 1, 3)),
        rng.random((n, n_steps + 1)) < 0.3,
        real,
    )


def plain(task: Any, found: Trajectories, arena: Arena, k: int) -> float:
    poses = found.poses[k].tolist()
    if isinstance(task, AvoidTask):
        return reference.avoid(
            found.commands[k].tolist(), found.readings[k][1:, [0, 2]].tolist(), backward=task.backward
        )
    if isinstance(task, LightTask):
        return reference.light(poses, found.stalled[k].tolist(), [(each.x, each.y) for each in arena.lights])
    if isinstance(task, GoalTask):
        assert arena.goal is not None
        return reference.goal(poses, (arena.goal.x, arena.goal.y), arena.goal.radius)
    walls = [*arena.walls, *(edge for each in arena.obstacles[:1] for edge in each.edges())]
    disc = [(0.2 + 0.05 * math.cos(a), 0.8 + 0.05 * math.sin(a)) for a in np.arange(32) * math.pi / 16]
    walls += [(*one, *other) for one, other in zip(disc, [*disc[1:], disc[0]], strict=True)]
    return reference.wall(poses, walls, task.side, task.within)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: f"{task.name}-{getattr(task, 'side', '')}")
@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_scores_equal_plain_ones(task: Any, real: Any) -> None:
    assert isinstance(task, Task)
    for seed in range(cases(8, 2)):
        found = wandering(seed, real=real)
        expected = [plain(task, found, ARENA, k) for k in range(len(found))]
        close = 1e-7 if real is np.float64 else 1e-4
        assert task.fitness(found, ARENA) == pytest.approx(expected, abs=close)


@settings(max_examples=cases(60, 4), deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(TASKS), st.randoms(use_true_random=False))
def test_a_trial_is_worth_the_same_among_any_others(seed, task, random) -> None:
    found = wandering(seed)
    order = list(range(len(found)))
    random.shuffle(order)
    order = order[: random.randint(1, len(order))]
    arrays = TraceArrays(*(np.ascontiguousarray(each[..., order]) for each in found.arrays))
    assert (task.fitness(replace(found, arrays=arrays), ARENA) == task.fitness(found, ARENA)[order]).all()


def mirrored(arena: Arena) -> Arena:
    flipped = (
        Obstacle(
            each.x, -each.y, -each.heading, tuple((x, -y) for x, y in reversed(each.corners)), each.radius
        )
        for each in arena.obstacles
    )
    assert arena.goal is not None
    return replace(
        arena,
        walls=tuple((x1, -y1, x2, -y2) for x1, y1, x2, y2 in arena.walls),
        start=Pose(arena.start.x, -arena.start.y, -arena.start.heading),
        obstacles=tuple(flipped),
        lights=tuple(Light(each.x, -each.y) for each in arena.lights),
        goal=Goal(arena.goal.x, -arena.goal.y, arena.goal.radius),
    )


@settings(max_examples=cases(60, 4), deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(TASKS))
def test_a_mirrored_path_in_a_mirrored_arena_is_worth_the_same_with_walls_on_the_other_side(
    seed, task
) -> None:
    found, arena = wandering(seed), mirrored(ARENA)
    turned = trials(
        found.poses[..., :2] * [1, -1], arena, found.commands * [1, -1], found.readings[..., [2, 1, 0]], found.stalled
    )  # fmt: skip
    other = task
    if isinstance(task, WallTask):
        other = WallTask(side="left" if task.side == "right" else "right", within=task.within)
    assert other.fitness(turned, arena) == pytest.approx(task.fitness(found, ARENA), abs=1e-9)


@settings(max_examples=cases(60, 4), deadline=None)
@given(st.integers(0, 10**6), st.floats(0.1, 10), st.floats(-5, 5), st.floats(-5, 5))
def test_scores_of_light_and_goal_do_not_depend_on_where_and_how_large_all_is(seed, size, x, y) -> None:
    found = wandering(seed)
    assert ARENA.goal is not None
    arena = replace(
        ARENA,
        start=Pose(ARENA.start.x * size + x, ARENA.start.y * size + y, 0.0),
        lights=tuple(Light(each.x * size + x, each.y * size + y) for each in ARENA.lights),
        goal=Goal(ARENA.goal.x * size + x, ARENA.goal.y * size + y, ARENA.goal.radius * size),
    )
    moved = trials(found.poses[..., :2] * size + [x, y], arena, found.commands, found.readings, found.stalled)
    for task in (LightTask(), GoalTask()):
        assert task.fitness(moved, arena) == pytest.approx(task.fitness(found, ARENA), abs=1e-6)


@settings(max_examples=cases(60, 4), deadline=None)
@given(st.integers(0, 10**6))
def test_scores_stay_within_their_bounds_and_the_way_back_takes_away_what_the_way_there_gave(seed) -> None:
    found = wandering(seed)
    for task in (AvoidTask(), LightTask()):
        scores = task.fitness(found, ARENA)
        assert ((scores >= 0) & (scores <= 1)).all()
    assert (GoalTask().fitness(found, ARENA) <= 1).all()
    wall = WallTask(side="left", within=0.3)
    there = wall.fitness(found, ARENA)
    back = wall.fitness(trials(found.poses[:, ::-1, :2]), ARENA)
    assert back == pytest.approx(-there, abs=1e-9)
    assert wall.fitness(found, ARENA) == pytest.approx(
        -WallTask(side="right", within=0.3).fitness(found, ARENA)
    )


def avoided(
    command: Sequence[float], reading: Sequence[float] = (0, 1, 0), task: AvoidTask = TASKS[0]
) -> float:
    here = (ARENA.start.x, ARENA.start.y)
    found = trials([[here] * 4], commands=[[command] * 3], readings=[[[1, 1, 1], *[reading] * 3]])
    return float(task.fitness(found, ARENA)[0])


def test_straight_on_in_the_open_is_worth_one_and_standing_spinning_or_touching_nothing() -> None:
    assert avoided((1, 0)) == avoided((-1, 0)) == 1
    assert avoided((0, 0)) == avoided((0, 1)) == avoided((0, -1)) == 0
    assert avoided((1, 0), (0, 0, 1)) == 0
    assert avoided((0.5, 0)) == 0.5
    # The wheels are asked for 0.4 and 1.2, which is more than there is.
    assert avoided((0.8, 0.4)) == pytest.approx(0.7 * (1 - math.sqrt(0.3)))
    assert avoided((1, 0), (0.25, 1, 0.5)) == 0.5
    forward = AvoidTask(backward=False)
    assert (avoided((1, 0), task=forward), avoided((-1, 0), task=forward)) == (1, 0)
    assert avoided((0.2, 0.6), task=forward) == pytest.approx(0.2 * (1 - math.sqrt(0.6)))


def test_standing_seeks_no_light_and_being_blocked_costs() -> None:
    here, there = (ARENA.start.x, ARENA.start.y), (0.9, 0.3)
    task = LightTask()
    assert task.fitness(trials([[here] * 5]), ARENA)[0] == 0
    assert task.fitness(trials([[here] + [there] * 4]), ARENA)[0] == 1
    blocked = trials([[here] + [there] * 4], stalled=[[1, 1, 0, 0, 0]])
    assert task.fitness(blocked, ARENA)[0] == 0.75


def test_going_along_a_wall_counts_in_meters_and_a_circle_before_it_nothing() -> None:
    arena = replace(ARENA, walls=((-5.0, 0.0, 5.0, 0.0),), obstacles=(), start=Pose(0, 0.1, 0))
    along = [[(0.1 * k, 0.1) for k in range(11)]]
    assert WallTask(side="right", within=0.2).fitness(trials(along, arena), arena)[0] == pytest.approx(1.0)
    assert WallTask(side="left", within=0.2).fitness(trials(along, arena), arena)[0] == pytest.approx(-1.0)
    assert WallTask(side="right", within=0.1).fitness(trials(along, arena), arena)[0] == 0
    circle = [[(0.05 * math.sin(a), 0.15 - 0.05 * math.cos(a)) for a in np.arange(65) * math.pi / 16]]
    assert WallTask(within=0.4).fitness(trials(circle, arena), arena)[0] == pytest.approx(0, abs=1e-12)
    onto = trials([[(0, 0.1), (0, -0.1), (0, 0.0), (0, 0.0)]], arena)
    assert WallTask(within=0.4).fitness(onto, arena)[0] == pytest.approx(0)


def test_the_end_of_a_wall_is_followed_round() -> None:
    arena = replace(ARENA, walls=((0.0, 0.0, 1.0, 0.0),), obstacles=(), start=Pose(0, 0.1, 0))
    angles = np.linspace(math.pi / 2, -math.pi / 2, 50)
    round_end = [[(1 + 0.1 * math.cos(a), 0.1 * math.sin(a)) for a in angles]]
    assert WallTask(side="right").fitness(trials(round_end, arena), arena)[0] == pytest.approx(
        0.1 * math.pi, rel=1e-3
    )


def test_obstacles_are_followed_as_walls_are() -> None:
    arena = replace(ARENA, walls=(), obstacles=(Obstacle(0.0, 0.0, radius=0.3),), start=Pose(0.4, 0, 0))
    angles = np.linspace(0, 2 * math.pi, 200)
    found = trials([[(0.4 * math.cos(a), 0.4 * math.sin(a)) for a in angles]], arena)
    assert WallTask(side="left").fitness(found, arena)[0] == pytest.approx(0.8 * math.pi, rel=0.02)
    assert wall_outlines(arena).shape == (32, 4)


def test_a_goal_counts_once_it_was_reached_else_by_what_is_left_of_the_way() -> None:
    arena = replace(ARENA, goal=Goal(1.3, 0.4, 0.1))
    x, y = ARENA.start.x, ARENA.start.y
    paths = [
        [(x, y), (x + dx, y), (x + end, y)] for dx, end in ((0.95, 0.0), (0.89, 0.5), (0.2, -0.5), (0.0, 1.0))
    ]
    assert GoalTask().fitness(trials(paths, arena), arena) == pytest.approx([1.0, 0.5, -0.5, 1.0])


@pytest.mark.parametrize(
    ("task", "arena", "said"),
    [
        (LightTask(), replace(ARENA, lights=()), "Task 'light' needs a light, but arena 'test' has none"),
        (LightTask(), replace(ARENA, lights=(Light(0.3, 0.4),)), "is where trials start"),
        (GoalTask(), replace(ARENA, goal=None), "Task 'goal' needs a goal, but arena 'test' has none"),
        (GoalTask(), replace(ARENA, goal=Goal(0.35, 0.4, 0.1)), "start at its goal"),
        (
            WallTask(),
            replace(ARENA, walls=(), obstacles=()),
            "Task 'wall' needs walls, but arena 'test' has none",
        ),
    ],
)
def test_an_arena_without_what_a_task_wants_is_refused(task: Any, arena: Arena, said: str) -> None:
    with pytest.raises(TaskError, match=said):
        task.fitness(wandering(1, arena=arena), arena)
