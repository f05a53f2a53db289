"""The environments give the trials of the batch kernel, and keep Gymnasium's contract."""

from __future__ import annotations

import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

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
    assert ends([np.nan, np.inf]) == ends([0.0, 1.0])


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
