"""Every environment keeps Gymnasium's contract and gives the trials and fitness of its task."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import realitygap.gym
from realitygap.errors import TaskError
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.gym._robots import ARENAS, INPUTS, KHEPERA, WITHIN
from realitygap.platforms import JyroPlatform, SimPlatform, TwinPlatform, trace_genomes
from realitygap.robots.twin import sample_twin
from realitygap.runs import MazeTrials
from realitygap.study import load_study
from realitygap.tasks import TASKS
from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

pytestmark = pytest.mark.slow

COVERAGE = "realitygap/ScribblerCoverage-v1"
IDS = {"avoid": "realitygap/Avoid-v0", "light": "realitygap/Light-v0", "wall": "realitygap/Wall-v0"}
IDS["goal"] = "realitygap/Goal-v0"
KEY = NoiseKey(0x9E3779B97F4A7C15, replicate=3, generation=2, individual=5, repeat=1)


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    """The platform's name of a twin without a gap, which needs no MuJoCo."""
    file = tmp_path_factory.mktemp("twin") / "twin.toml"
    file.write_text(sample_twin("same", 1).to_toml())
    return f"twin:{file}"


EVERY = [
    *((name, None) for name in realitygap.gym.ENV_IDS),
    (COVERAGE, "sim"),
    (COVERAGE, "twin"),
    ("realitygap/Avoid-v0", "jyro"),
]


def settings_of(platform: str | None, twin: str) -> dict[str, object]:
    """Arguments by which an environment has a platform; not its own ones need an arena with room."""
    if platform is None:
        return {}
    return {"platform": twin if platform == "twin" else platform, "arena": {"preset": "paper"}}


@pytest.mark.parametrize(("name", "platform"), EVERY)
def test_environment_passes_checkers_without_warnings(name, platform, twin):
    """What stable-baselines3's checker asserts as well, as that package is too large to be installed here."""
    settings = settings_of(platform, twin)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(name, render_mode="rgb_array", **settings).unwrapped
        check_env(env, skip_render_check=platform == "twin")  # which would open the twin four times
        for space in (env.observation_space, env.action_space):
            assert isinstance(space, gymnasium.spaces.Box)
            assert space.dtype == np.float32
            assert space.is_bounded()
            assert (space.low < space.high).all()
        assert (-env.action_space.low).tolist() == env.action_space.high.tolist() == [1.0, 1.0]
        assert env.metadata["render_fps"] == max(1, round(1 / env._robots.step_s))
        first, info = env.reset(seed=1)
        env.action_space.seed(1)
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        for seen in (first, observation):
            assert seen.dtype == np.float32
            assert seen in env.observation_space
        assert isinstance(info, dict)
        assert (type(reward), type(terminated), type(truncated)) == (float, bool, bool)
        frame = env.render()
        assert frame.dtype == np.uint8
        assert frame.ndim == 3
        assert frame.shape[1:] == (480, 3)
        env.reset(seed=1)
        assert not np.array_equal(env.render(), frame)
        env.action_space.seed(1)
        env.step(env.action_space.sample())
        assert np.array_equal(env.render(), frame)
        env.close()


@pytest.mark.parametrize(("name", "platform"), [each for each in EVERY if each[1] != "twin"])
def test_vector_environment_equals_environments_in_sequence(name, platform):
    settings = settings_of(platform, "")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        envs = gymnasium.make_vec(name, num_envs=2, render_mode="rgb_array", **settings)
        in_turn = gymnasium.make_vec(name, num_envs=2, vectorization_mode="sync", **settings)
    assert envs.metadata["autoreset_mode"] == in_turn.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    assert envs.observation_space == in_turn.observation_space
    assert envs.action_space == in_turn.action_space
    for k, env in enumerate(in_turn.envs):
        env.reset(options={"noise_key": NoiseKey(7, individual=k)})
    seen, _ = envs.reset(options={"noise_key": NoiseKey(7)})
    assert seen in envs.observation_space
    actions = np.random.default_rng(1).uniform(-1, 1, (3, 2, 2)).astype(np.float32)
    for action in actions:
        many = envs.step(action)
        single = [env.step(each) for env, each in zip(in_turn.envs, action, strict=True)]
        assert many[0].tolist() == [step[0].tolist() for step in single]
        assert many[1].tolist() == [step[1] for step in single]
    frames = envs.render()
    assert len(frames) == 2
    assert frames[0].shape == frames[1].shape
    envs.close()
    in_turn.close()


def networks(n_inputs: int, n: int = 3, **changes: object) -> list[Genome]:
    settings = NeatSettings.named("rosenzweig-remy", population=n, weight_step=5.0, **changes)
    population = Population(n_inputs, 2, settings, seed=11, bias=False)
    for _ in range(3):
        population.tell(np.arange(n))
    return population.ask()


@pytest.mark.parametrize("kind", IDS)
def test_observations_and_rewards_are_those_of_the_trial(kind):
    platform = SimPlatform(robot="khepera", **KHEPERA[kind]).model_copy(update={"steps": 60})
    arena = ArenaSettings(preset=ARENAS.get(kind, kind)).arena()
    task = TASKS[kind](**WITHIN.get(kind, {}))
    env = gymnasium.make(IDS[kind], platform=platform, task={"inputs": INPUTS[kind], **WITHIN.get(kind, {})})
    for k, genome in enumerate(networks(len(INPUTS[kind]))):
        key = NoiseKey(7, individual=k)
        trials = trace_genomes(platform, arena, [genome], noise=0.0, noise_key=key, inputs=INPUTS[kind])
        observation, info = env.reset(options={"noise_key": key})
        total = 0.0
        for step in range(platform.steps):
            assert observation.tolist() == trials.inputs[0, step].tolist()
            assert info["pose"] == pytest.approx(trials.poses[0, step])
            observation, reward, _, _, info = env.step(trials.commands[0, step])
            total += reward
        assert total == pytest.approx(task.fitness(trials, trials.arena)[0], abs=1e-5)


@pytest.mark.parametrize("kind", ["avoid", "wall"])
def test_tasks_on_jyro_have_the_inputs_of_the_paper(kind):
    platform, arena = JyroPlatform(steps=40), ArenaSettings().arena()
    genome = networks(3)[0]
    trials = trace_genomes(platform, arena, [genome], noise=0.5, noise_key=KEY)
    env = gymnasium.make(IDS[kind], platform=platform, arena={"preset": "paper"}, noise=0.5, task={})
    observation, _ = env.reset(options={"noise_key": KEY})
    total = 0.0
    for step in range(platform.steps):
        assert observation.tolist() == trials.inputs[0, step].tolist()
        observation, reward, *_ = env.step(trials.commands[0, step])
        total += reward
    task = TASKS[kind](**WITHIN.get(kind, {}))
    assert total == pytest.approx(task.fitness(trials, arena)[0], abs=1e-5)


def test_networks_driven_through_a_twin_are_its_trials(twin):
    platform, arena = TwinPlatform(file=twin.removeprefix("twin:"), steps=12), ArenaSettings().arena()
    genomes = networks(3, 2)
    trials = trace_genomes(platform, arena, genomes, noise=0.0, noise_key=KEY)
    envs = gymnasium.make_vec(COVERAGE, num_envs=2, platform=platform, dtype="float64")
    controllers = [genome.network() for genome in genomes]
    observations, infos = envs.reset(options={"noise_key": KEY})
    for step in range(platform.steps):
        assert observations.tolist() == trials.inputs[:, step].tolist()
        actions = [each.activate(seen) for each, seen in zip(controllers, observations, strict=True)]
        observations, _, _, over, infos = envs.step(np.array(actions))
        assert infos["pose"] == pytest.approx(trials.poses[:, step + 1])
    assert over.all()
    assert infos["coverage_line"].tolist() == trials.coverage_line.tolist()
    assert infos["coverage_ends"].tolist() == trials.coverage_ends.tolist()
    envs.close()


def test_closed_environment_of_a_twin_starts_again_as_others_do(twin):
    """The checker of stable-baselines3 closes an environment after its picture, and goes on with it."""
    env = gymnasium.make(COVERAGE, platform=twin)
    first, _ = env.reset(seed=1)
    env.close()
    again, _ = env.reset(seed=1)
    assert again.tolist() == first.tolist()
    env.close()


def test_network_driven_through_a_maze_is_its_path():
    arena = ArenaSettings(preset="maze-medium").arena()
    genome = networks(10, activation="tanh", activation_slope=2.45)[0]
    path = MazeTrials(arena).path(genome)
    env = gymnasium.make("realitygap/MazeMedium-v0", dtype="float64", disable_env_checker=True)
    network = genome.network()
    observation, info = env.reset()
    total = 0.0
    for step in range(60):
        assert observation == pytest.approx(path.inputs[step], abs=1e-3)
        observation, reward, *_, info = env.step(network.activate(observation))
        assert info["pose"][:2] == pytest.approx(path.poses[step + 1][:2], abs=1e-3)
        total += reward
    away = [np.hypot(arena.goal.x - x, arena.goal.y - y) for x, y, _ in path.poses[[0, 60]]]
    assert total == pytest.approx(away[0] - away[1], abs=1e-3)


@pytest.mark.parametrize("kind", IDS)
def test_defaults_are_those_of_the_study_of_the_task(kind):
    condition = load_study(kind).conditions[0]
    assert SimPlatform(robot="khepera", **KHEPERA[kind]) == condition.on
    assert condition.network_inputs == (*INPUTS[kind], "bias")
    assert condition.arena == ArenaSettings(preset=ARENAS.get(kind, kind))
    task = TASKS[kind](inputs=(*INPUTS[kind], "bias"), **WITHIN.get(kind, {}))
    assert condition.task_of_trials == task


@pytest.mark.parametrize(
    ("settings", "error", "message"),
    [
        ({"kind": "python:mine.py:f"}, ValueError, "a Python task scores whole trials"),
        ({"kind": "walls"}, ValueError, "kind is 'walls'. Did you mean 'wall'"),
        ({"platform": "scribbler:/dev/ttyUSB0"}, ValueError, "an emulated robot in this program"),
        ({"platform": "twin:nothing.toml"}, Exception, "nothing.toml"),
        (
            {"kind": "avoid", "platform": "jyro", "task": {"inputs": ["range.3"]}},
            ValueError,
            r"range\.3 is missing",
        ),
        ({"kind": "light", "platform": "jyro", "arena": {"preset": "paper"}}, TaskError, "needs a light"),
        ({"kind": "goal", "arena": {"preset": "avoid"}}, ValueError, "goal"),
        ({"task": {"cell": "ends"}}, ValueError, "cell"),
        ({"dtype": "float16"}, ValueError, "dtype is 'float16', expected 'float32' or 'float64'"),
        ({"render_mode": "human"}, ValueError, "render_mode is 'human', expected None or 'rgb_array'"),
    ],
)
def test_environment_refuses_wrong_settings(settings, error, message):
    with pytest.raises(error, match=message):
        realitygap.gym.RobotEnv(**settings)


def test_twin_refuses_noise():
    with pytest.raises(ValueError, match=r"noise is 0\.1, expected none with platform 'twin'"):
        realitygap.gym.RobotEnv(platform="twin:worn.toml", noise=0.1)


def test_unknown_maze_is_refused():
    with pytest.raises(ValueError, match="Did you mean 'maze-hard'"):
        realitygap.gym.MazeEnv("maze-hrd")
