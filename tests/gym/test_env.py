"""The environments give the trials of the batch kernel, and keep Gymnasium's contract."""

from __future__ import annotations

import itertools
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from gymnasium.utils.seeding import np_random
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import realitygap.gym
from realitygap._how_to_run import install_command
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.platforms import JyroPlatform, SimPlatform, trace_genome, try_genomes
from realitygap.trials import NoiseKey
from realitygap.world import ArenaSettings

ENV = "realitygap/ScribblerCoverage-v1"
KEY = NoiseKey(0x9E3779B97F4A7C15, replicate=3, generation=2, individual=5, repeat=1)

# In double precision, as networks compute outside of trials.
DOUBLE = {"precision": "double"}
SETTINGS = [
    {"noise": 0.5, "platform": DOUBLE, "dtype": "float64"},
    {"noise": 0.0, "platform": DOUBLE, "dtype": "float64"},
    {"noise": 0.8, "platform": {**DOUBLE, "turn_per_step": 0.9, "steps": 200}, "dtype": "float64"},
    {
        "noise": 0.5,
        "platform": {**DOUBLE, "noisy_reading": "clip", "steps": 40},
        "arena": {"start": "left"},
        "dtype": "float64",
    },
    {
        "noise": 0.3,
        "platform": DOUBLE,
        "arena": {"start": [0.5, 0.3, 1.0]},
        "task": {"cells": "ends"},
        "dtype": "float64",
    },
]


def genomes(n: int = 16, *, bias: bool = False, **changes: object) -> list[Genome]:
    base = NeatSettings.named("rosenzweig-remy", population=n, add_node=0.5, add_link=0.5, weight_step=5.0)
    population = Population(3, 2, base.model_copy(update=changes), seed=11, bias=bias)
    rng = np.random.default_rng(0)
    for _ in range(4):
        population.tell(rng.random(n))
    return population.ask()


def placed(settings: dict[str, object]) -> tuple[JyroPlatform, object]:
    return (
        JyroPlatform(**settings.get("platform", {})),
        ArenaSettings(**settings.get("arena", {})).arena(),
    )


NETWORKS = [{}, {"recurrent": True}, {"activation": "identity"}]


@pytest.mark.slow
@pytest.mark.parametrize("network", NETWORKS, ids=["plain", "recurrent", "identity"])
@pytest.mark.parametrize("settings", SETTINGS)
def test_a_network_driven_through_the_environment_is_its_trial_bit_for_bit(settings, network):
    platform, arena = placed(settings)
    env = gymnasium.make(ENV, disable_env_checker=True, **settings)
    n_blocked = 0
    for k, genome in enumerate(genomes(6, bias=k_bias(network), **network)):
        key = NoiseKey(7, replicate=2, individual=k)
        trial = trace_genome(platform, arena, genome, noise=settings["noise"], noise_key=key)
        controller = genome.network()
        observation, info = env.reset(options={"noise_key": key})
        assert env.unwrapped.noise_key == key
        assert info["pose"].tolist() == trial.poses[0].tolist()
        coverage = info["coverage_line" if not settings.get("task") else "coverage_ends"]
        for step in range(platform.steps):
            assert observation.tolist() == trial.inputs[step, :3].tolist()
            observation, reward, terminated, truncated, info = env.step(controller.activate(observation))
            assert info["pose"].tolist() == trial.poses[step + 1].tolist()
            assert info["readings"].tolist() == trial.readings[step + 1].tolist()
            assert observation[1] == trial.stalled[step + 1]
            assert not terminated
            assert truncated == (step + 1 == platform.steps)
            coverage += reward
        assert info["coverage_line"] == trial.coverage_line
        assert info["coverage_ends"] == trial.coverage_ends
        assert env.unwrapped.visited_cells == trial.cells
        assert coverage == pytest.approx(
            trial.coverage_ends if settings.get("task") else trial.coverage_line, abs=1e-12
        )
        n_blocked += trial.stalled.sum()
    if not settings.get("arena"):
        assert n_blocked > 0, "no wall was met, so that contact was not tested"


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["single", "double"])
def test_the_commands_of_a_trial_give_that_trial_in_either_precision_bit_for_bit(precision):
    platform, arena = JyroPlatform(precision=precision), ArenaSettings().arena()
    tried = genomes(70)
    keys = [NoiseKey(KEY.key, individual=k) for k in range(70)]
    trials = [
        trace_genome(platform, arena, genome, noise=0.5, noise_key=key)
        for genome, key in zip(tried, keys, strict=True)
    ]
    dtype = {"single": "float32", "double": "float64"}[precision]
    envs = gymnasium.make_vec(ENV, num_envs=70, noise=0.5, platform={"precision": precision}, dtype=dtype)
    observations, infos = envs.reset(options={"noise_key": keys[0]})
    for step in range(platform.steps):
        assert observations.tolist() == [trial.inputs[step].tolist() for trial in trials]
        assert infos["pose"].tolist() == [trial.poses[step].tolist() for trial in trials]
        observations, _, _, _, infos = envs.step(np.array([trial.commands[step] for trial in trials]))
    assert [envs.visited_cells(k) for k in range(70)] == [trial.cells for trial in trials]


def k_bias(network: dict[str, object]) -> bool:
    """Networks with the constant input are driven, too."""
    return bool(network)


@pytest.mark.slow
@pytest.mark.parametrize("settings", SETTINGS)
def test_networks_driven_through_the_vector_environment_are_the_batch_bit_for_bit(settings):
    platform, arena = placed(settings)
    tried = genomes(40)
    batch = try_genomes(platform, arena, tried, noise=settings["noise"], noise_key=KEY)
    envs = gymnasium.make_vec(ENV, num_envs=40, **settings)
    networks = [genome.network() for genome in tried]
    observations, _ = envs.reset(options={"noise_key": KEY})
    rewards, stalls, over = np.zeros(40), np.zeros(40), np.zeros(40, bool)
    while not over.any():
        actions = np.array([net.activate(seen) for net, seen in zip(networks, observations, strict=True)])
        observations, gained, ended, over, infos = envs.step(actions)
        assert not ended.any()
        rewards += gained
        stalls += observations[:, 1]
    assert over.all()
    assert infos["coverage_line"].tolist() == batch.coverage_line.tolist()
    assert infos["coverage_ends"].tolist() == batch.coverage_ends.tolist()
    assert stalls.tolist() == batch.n_stalls.tolist()
    for k in range(40):
        assert envs.visited_cells(k) == tuple(batch.behavior(k))
    total = batch.coverage_ends if settings.get("task") else batch.coverage_line
    assert rewards + 1 / 72 == pytest.approx(total, abs=1e-12)


def test_one_robot_and_many_are_the_same():
    envs = gymnasium.make_vec(ENV, num_envs=5, noise=0.5)
    env = gymnasium.make(ENV, noise=0.5)
    actions = np.random.default_rng(4).uniform(-1, 1, (87, 5, 2))
    many = [envs.reset(options={"noise_key": KEY})[0], *(envs.step(each)[0] for each in actions)]
    for k in range(5):
        key = NoiseKey(KEY.key, KEY.replicate, KEY.generation, KEY.individual + k, KEY.repeat)
        one = [env.reset(options={"noise_key": key})[0], *(env.step(each[k])[0] for each in actions)]
        assert np.array_equal(np.array(one), np.array(many)[:, k])


@pytest.mark.parametrize("settings", [{}, *SETTINGS])
def test_the_checker_of_gymnasium_finds_nothing(settings):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(ENV, **settings).unwrapped)


def test_observations_and_actions_lie_in_their_spaces():
    for settings in SETTINGS:
        envs = gymnasium.make_vec(ENV, num_envs=64, **settings)
        envs.action_space.seed(1)
        seen, _ = envs.reset(seed=1)
        for _ in range(60):
            assert seen in envs.observation_space
            seen = envs.step(envs.action_space.sample())[0]


def test_the_vector_environment_begins_anew_after_the_last_step():
    envs = gymnasium.make_vec(ENV, num_envs=3, noise=0.5, platform={"steps": 4})
    first, _ = envs.reset(seed=1)
    key = envs.noise_key
    for step in range(4):
        *_, over, _ = envs.step(np.ones((3, 2)))
        assert over.tolist() == [step == 3] * 3
    seen, rewards, ended, over, infos = envs.step(np.ones((3, 2)))
    assert envs.noise_key != key, "another trial has other noise"
    assert rewards.tolist() == [0.0] * 3
    assert not ended.any()
    assert not over.any()
    assert seen[:, 2].tolist() == [0.0] * 3
    assert infos["_pose"].tolist() == [True] * 3
    assert np.unique(infos["pose"], axis=0).shape == (1, 3)
    assert not np.array_equal(seen, first)
    again, _ = envs.reset(seed=1)
    assert np.array_equal(again, first)


class Keyed(gymnasium.Wrapper):
    """One robot whose trials have the keys of robot k of a vector environment that was reset with seed 1."""

    def __init__(self, env: gymnasium.Env, k: int) -> None:
        super().__init__(env)
        self.k, self.keys = k, np_random(1)[0]

    def reset(self, **_: object) -> tuple[np.ndarray, dict]:
        key = int(self.keys.integers(1 << 64, dtype=np.uint64))
        robot = self.env.unwrapped
        options = (
            {}
            if isinstance(robot, realitygap.gym.MazeEnv)
            else {"noise_key": NoiseKey(key, individual=self.k)}
        )
        return self.env.reset(options=options)


def same(one: object, other: object) -> bool:
    """Whether two results have the same values and types, with arrays of objects and tables inside each other."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, tuple) or one.dtype == object:
        return len(one) == len(other) and all(map(same, one, other))
    return one.dtype == other.dtype and np.array_equal(one, other)


@pytest.mark.parametrize("name", [ENV, "realitygap/MazeMedium-v0"])
def test_vector_environment_ends_trials_as_gymnasium_does(name):
    """Gymnasium's own vector environment over single robots is the reference, in each mode and with a time limit."""
    steps = {} if "Maze" in name else {"noise": 0.5, "platform": {"steps": 4}}
    actions = np.random.default_rng(1).uniform(-1, 1, (12, 2, 2)).astype(np.float32)
    for mode, limit in itertools.product(AutoresetMode, (3, None) if steps else (3,)):
        settings = {**steps, "max_episode_steps": limit} if limit else steps
        envs = gymnasium.make_vec(name, num_envs=2, autoreset_mode=mode, **settings)
        reference = SyncVectorEnv(
            [lambda k=k, settings=settings: Keyed(gymnasium.make(name, **settings), k) for k in range(2)],
            autoreset_mode=mode,
        )
        assert envs.metadata["autoreset_mode"] is mode
        assert same(envs.reset(seed=1), reference.reset())
        for number, action in enumerate(actions):
            step = envs.step(action)
            assert same(step, reference.step(action)), f"{mode}, limit {limit}, step {number}"
            if mode is AutoresetMode.DISABLED and step[3].any():
                with pytest.raises(ResetNeeded, match="call reset"):
                    envs.step(action)
                mask = {"reset_mask": step[3]}
                assert same(envs.reset(options=mask), reference.reset(options={**mask}))
        envs.close()
        reference.close()


def test_vector_environment_refuses_wrong_modes_limits_and_masks():
    for settings, message in (
        (
            {"autoreset_mode": "later"},
            "autoreset_mode is 'later', expected one of NextStep, SameStep, Disabled",
        ),
        ({"max_episode_steps": 0}, "max_episode_steps is 0, expected at least 1"),
    ):
        with pytest.raises(ValueError, match=message):
            gymnasium.make_vec(ENV, num_envs=2, **settings)
    assert gymnasium.make_vec(ENV, num_envs=2, autoreset_mode="SameStep", max_episode_steps=-1) is not None
    envs = gymnasium.make_vec(ENV, num_envs=2)
    for mask, error in (
        (np.array([True, False]), ValueError),
        (np.ones(3, bool), ValueError),
        (np.ones(2), TypeError),
        ([True, True], TypeError),
    ):
        with pytest.raises(error, match="reset_mask"):
            envs.reset(options={"reset_mask": mask})


@pytest.mark.parametrize("name", realitygap.gym.ENV_IDS)
def test_action_that_is_no_number_is_refused(name):
    env, envs = gymnasium.make(name), gymnasium.make_vec(name, num_envs=3)
    poses = env.reset(seed=1)[1]["pose"], envs.reset(seed=1)[1]["pose"]
    first = "turn" if "Maze" in name else "move"
    for wrong in (np.nan, np.inf, -np.inf):
        with pytest.raises(ValueError, match=f"^{first} is {wrong}, expected a number from -1 to 1"):
            env.unwrapped.step(np.array([wrong, np.nan]))
        actions = np.zeros((3, 2))
        actions[2, 0] = wrong
        with pytest.raises(
            ValueError, match=f"^{first} of robot 2 is {wrong}, expected a number from -1 to 1"
        ):
            envs.step(actions)
    assert np.array_equal(env.unwrapped._info()["pose"], poses[0])
    assert np.array_equal(envs.unwrapped._info()["pose"], poses[1])


def test_a_seed_decides_all_trials_and_another_seed_others():
    env = gymnasium.make(ENV, noise=0.5)

    def keys(seed: int) -> list[int]:
        env.reset(seed=seed)
        found = [env.unwrapped.noise_key.key]
        for _ in range(3):
            env.reset()
            found.append(env.unwrapped.noise_key.key)
        return found

    assert keys(1) == keys(1)
    assert not set(keys(1)) & set(keys(2))
    assert len(set(keys(1))) == 4


def test_actions_out_of_range_are_limited_as_in_a_trial():
    env = realitygap.gym.RobotEnv()

    def ends(action: list[float]) -> list[float]:
        env.reset(options={"noise_key": KEY})
        return env.step(np.array(action))[4]["pose"].tolist()

    assert ends([7.0, -7.0]) == ends([1.0, -1.0])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"noise": 11}, "noise is 11, expected 0 to 10"),
        ({"noise": float("nan")}, "noise is nan"),
        ({"task": {"cells": "lines"}}, "expected 'line' or 'ends'"),
        ({"platform": {"step": 3}}, "step"),
        ({"arena": {"start": "middle"}}, "start"),
        ({"arena": {"start": [0.01, 0.01, 0.0]}}, "does not fit at the start"),
    ],
)
def test_wrong_settings_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        realitygap.gym.RobotEnv(**settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"noise": "0.5"}, "noise is '0.5', expected a number"),
        ({"platform": 3}, "platform is 3, expected JyroPlatform"),
        ({"arena": "paper"}, "arena is 'paper', expected ArenaSettings"),
    ],
)
def test_settings_of_another_kind_are_refused(settings, message):
    with pytest.raises(TypeError, match=message):
        realitygap.gym.RobotEnv(**settings)


def test_wrong_calls_are_refused():
    env = realitygap.gym.RobotEnv(platform={"steps": 1})
    envs = realitygap.gym.RobotVectorEnv(3)
    with pytest.raises(ResetNeeded, match="call reset"):
        env.step(np.zeros(2))
    env.reset()
    with pytest.raises(ValueError, match=r"expected \(2,\)"):
        env.step(np.zeros(3))
    env.step(np.zeros(2))
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(2))
    envs.reset()
    with pytest.raises(ValueError, match=r"shape \(2, 2\), expected \(3, 2\)"):
        envs.step(np.zeros((2, 2)))
    with pytest.raises(ValueError, match="Did you mean 'noise_key'"):
        env.reset(options={"noise_keys": KEY})
    with pytest.raises(ValueError, match="expected at most"):
        envs.reset(options={"noise_key": {"key": 1, "individual": (1 << 24) - 2}})
    with pytest.raises(TypeError, match="noise_key is 7, expected NoiseKey"):
        env.reset(options={"noise_key": 7})
    with pytest.raises(TypeError, match=r"num_envs is 1\.5, expected a whole number"):
        realitygap.gym.RobotVectorEnv(1.5)
    with pytest.raises(ValueError, match="num_envs is 0"):
        realitygap.gym.RobotVectorEnv(0)


def test_a_missing_extra_is_one_message_with_the_command():
    code = "import sys; sys.modules['gymnasium'] = None; import realitygap.gym"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.strip().endswith(f"Install it: {install_command('gym')}")


@pytest.mark.slow
def test_gymnasium_finds_the_environment_by_module_and_name():
    name = f"realitygap.gym:{ENV}"
    code = f"import gymnasium; print(gymnasium.make({name!r}).reset(seed=1)[0].shape)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "(3,)\n"


# the platform sim

SLOW_AND_DRAWN = {"drive.speed": {"uniform": [0.08, 0.14]}, "arena.start.x": {"uniform": [0.18, 0.3]}}
SIMS = [
    ({}, {}),
    ({"steps": 100, "set": SLOW_AND_DRAWN}, {"task": {"cells": "ends"}}),
    ({"robot": "jyro", "steps": 40}, {"noise": 0.5}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("platform", "settings"), SIMS)
def test_a_network_driven_through_sim_is_its_trial_bit_for_bit(platform, settings):
    platform, arena = SimPlatform(precision="double", **platform), ArenaSettings().arena()
    env = gymnasium.make(ENV, platform=platform, dtype="float64", disable_env_checker=True, **settings)
    n_blocked, starts = 0, set()
    for k, genome in enumerate(genomes(5)):
        key = NoiseKey(7, replicate=2, individual=k)
        trial = trace_genome(platform, arena, genome, noise=settings.get("noise", 0.0), noise_key=key)
        controller = genome.network()
        observation, info = env.reset(options={"noise_key": key})
        starts.add(info["pose"][0])
        coverage = info["coverage_ends" if settings.get("task") else "coverage_line"]
        for step in range(platform.steps):
            assert observation.tolist() == trial.inputs[step, :3].tolist()
            observation, reward, _, truncated, info = env.step(controller.activate(observation))
            assert info["pose"].tolist() == trial.poses[step + 1].tolist()
            assert info["readings"].tolist() == trial.readings[step + 1].tolist()
            coverage += reward
        assert truncated
        assert (info["coverage_line"], info["coverage_ends"]) == (trial.coverage_line, trial.coverage_ends)
        assert env.unwrapped.visited_cells == trial.cells
        assert coverage == pytest.approx(
            trial.coverage_ends if settings.get("task") else trial.coverage_line, abs=1e-12
        )
        n_blocked += trial.stalled.sum()
    assert (len(starts) > 1) == ("set" in platform.model_fields_set)
    assert n_blocked > 0


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["single", "double"])
def test_many_robots_of_sim_are_the_trials_of_the_batch(precision):
    """More than a block of them, so that the last one is not full."""
    platform = SimPlatform(precision=precision, steps=25, set=SLOW_AND_DRAWN)
    tried = genomes(70)
    keys = [NoiseKey(KEY.key, individual=k) for k in range(70)]
    trials = [
        trace_genome(platform, ArenaSettings().arena(), genome, noise=0.0, noise_key=key)
        for genome, key in zip(tried, keys, strict=True)
    ]
    dtype = {"single": "float32", "double": "float64"}[precision]
    envs = gymnasium.make_vec(ENV, num_envs=70, platform=platform, dtype=dtype)
    observations, infos = envs.reset(options={"noise_key": keys[0]})
    for step in range(25):
        assert observations.tolist() == [trial.inputs[step, :3].tolist() for trial in trials]
        assert infos["pose"].tolist() == [trial.poses[step].tolist() for trial in trials]
        observations, _, _, over, infos = envs.step(np.array([trial.commands[step] for trial in trials]))
    assert over.all()
    assert [envs.visited_cells(k) for k in range(70)] == [trial.cells for trial in trials]
    assert infos["coverage_ends"].tolist() == [trial.coverage_ends for trial in trials]


@pytest.mark.slow
@pytest.mark.parametrize(("platform", "settings"), SIMS)
def test_the_checker_of_gymnasium_finds_nothing_in_sim(platform, settings):
    env = gymnasium.make(ENV, platform=SimPlatform(**platform), **settings).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*infinity.*")  # a linear response has no limits
        check_env(env)


@pytest.mark.slow
def test_platforms_have_names_and_noise_of_their_own(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('base = "scribbler-s2"\n[drive]\nspeed = 0.05\n')
    speeds = []
    for name in ("sim", f"sim:{file}"):
        env = gymnasium.make(ENV, platform=name)
        at = env.reset(seed=1)[1]["pose"][0]
        speeds.append(sum(env.step(np.array([1.0, 0.0]))[4]["pose"][0] for _ in range(4)) - 4 * at)
    assert speeds[1] < 0.6 * speeds[0]
    high = [gymnasium.make(ENV, platform=name).observation_space.high[0] for name in ("jyro", "sim")]
    assert high == pytest.approx([1.1, 1.0])


@pytest.mark.parametrize(
    ("platform", "message"),
    [
        ("simm", "'simm' is no platform. Did you mean 'sim'"),
        ("sim:", "'sim:' is no platform, expected sim or sim:FILE"),
        ("sim:nothing.toml", "There is no robot file nothing.toml"),
        (SimPlatform(set={"arena.start.x": {"uniform": [0.0, 0.4]}}), "does not fit at the start"),
    ],
)
def test_environment_refuses_wrong_platforms(platform, message):
    with pytest.raises(ValueError, match=message):
        realitygap.gym.RobotEnv(platform=platform)
