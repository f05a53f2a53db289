"""A platform of another package, and one of a single file, do all that ours do."""

from __future__ import annotations

import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from realitygap.errors import RecordVersionError, StudyError
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.lab._live import open_robot
from realitygap.platforms import (
    Opening,
    allow_code,
    open_target,
    platform_class,
    platform_names,
    platform_of,
)
from realitygap.platforms._python import load_platform
from realitygap.runs import Condition
from realitygap.study import calibrate, gap_between, parse_study, run_study, transfer, try_on
from realitygap.testing import PlatformContractError, check_platform
from realitygap.trials import TrialPlan, drive_trial
from realitygap.world import paper_arena

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_robot.py"

sys.path.insert(0, str(EXAMPLE.parent))  # as if its package were installed
from own_robot import ToyPlatform, ToyRobot  # noqa: E402

STUDY = """
[study]
name = "on-the-toy"
replicates = 1
[neat]
population = 6
generations = 2
[platform.toy]
steps = 20
speed = 0.2
[[condition]]
name = "toy"
platform = "toy"
noise = 0.1
"""


def add_plugin(folder: Path, value: str, name: str = "toy", package: str = "mylab") -> None:
    """Install a package that adds a platform, as pip would."""
    about = folder / f"{package}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[realitygap.platforms]\n{name} = {value}\n")


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    add_plugin(tmp_path, "own_robot:ToyPlatform")
    monkeypatch.syspath_prepend(tmp_path)


def one_genome() -> Genome:
    settings = NeatSettings.named("default").model_copy(update={"population": 2})
    return Population(3, 2, settings, seed=1, bias=False).ask()[0]


def test_toy_is_short_and_keeps_the_contract() -> None:
    assert len(EXAMPLE.read_text("utf-8").splitlines()) <= 100
    check_platform(ToyPlatform())


@pytest.mark.usefixtures("installed")
def test_package_adds_a_platform_that_studies_evolve_on(tmp_path: Path) -> None:
    assert platform_names()[-1] == "toy"
    assert platform_class("toy") is ToyPlatform
    study = parse_study(STUDY, "toy.toml")
    assert study.conditions[0].on == ToyPlatform(steps=20, speed=0.2)
    folder = run_study(study, tmp_path / "results", threads=1).folder
    rows = folder.scan().collect()
    assert len(rows) == 12
    assert rows["coverage_line"].max() > 1 / 84
    again = Condition.from_settings("toy", study.conditions[0].settings())
    assert again == study.conditions[0]


@pytest.mark.slow
@pytest.mark.usefixtures("installed")
def test_package_adds_a_target_for_gap_calibrate_transfer_and_try(tmp_path: Path) -> None:
    assert gap_between("sim", "toy", n_controllers=3, trials=2, observe="track").study.result.target == "toy"
    with open_target("toy", paper_arena()) as target:
        (trial,) = try_on(target, one_genome(), steps=10)
        assert len(trial.commands) == 10
        fitted = calibrate("path", target, observe="track", trials_file=tmp_path / "path.sqlite")
        assert fitted.trials > 0
        made = transfer(
            "sim-paper", target, "plain", 2, out=tmp_path / "transfer", runs=2, repeats=1, fresh_trials=2
        )
        assert made.strategies


@pytest.mark.usefixtures("installed")
def test_package_adds_a_robot_for_live_views_and_gymnasium() -> None:
    import realitygap.gym  # noqa: F401  # registers the environments

    robot, n_steps = open_robot(Condition(name="a"), "toy")
    assert isinstance(robot, ToyRobot)
    assert len(drive_trial(robot, one_genome().network(), n_steps).commands) == n_steps
    env = gymnasium.make("realitygap/Avoid-v0", platform="toy", arena={"preset": "paper"})
    env.reset(seed=1)
    _, reward, *_ = env.step(np.array([0.5, 0.0]))
    assert reward > 0
    env.close()


@pytest.mark.parametrize(
    ("value", "name", "message"),
    [
        ("nowhere_at_all:Toy", "other", "cannot be imported: ModuleNotFoundError: No module named"),
        ("own_robot:ToyRobot", "other", "expected a subclass of realitygap.platforms.Platform"),
        ("own_robot:ToyPlatform", "other", "has the name 'toy', expected 'other'"),
        ("own_robot:ToyPlatform", "noise", "expected 'noise'"),
    ],
)
def test_wrong_plugin_is_refused_with_its_package(
    value: str, name: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_plugin(tmp_path, value, name)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(StudyError, match=message) as caught:
        platform_class(name)
    assert "mylab 1.0" in str(caught.value)


def test_clash_of_plugins_concerns_their_name_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for package, value in (("mylab", "own_robot:ToyPlatform"), ("yourlab", "elsewhere:Toy")):
        add_plugin(tmp_path, value, package=package)
        add_plugin(tmp_path, "elsewhere:Sim", name="sim", package=f"{package}_sim")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(
        StudyError, match=r"package mylab 1\.0 and package yourlab 1\.0 both add a platform 'toy'"
    ):
        platform_of("toy")
    assert platform_of("sim").name == "sim"
    assert Condition(name="a", platform="sim").on == platform_of("sim")


@pytest.mark.usefixtures("installed")
def test_condition_takes_a_platform_and_no_other_thing() -> None:
    condition = Condition(name="a", on=ToyPlatform(speed=0.3))
    assert (condition.platform, condition.on.speed, condition.noise) == ("toy", 0.3, 0.0)
    assert Condition.from_settings("a", condition.settings()) == condition
    assert condition.hash() != condition.model_copy(update={"on": ToyPlatform()}).hash()
    for wrong in (ToyPlatform, {"steps": 3}, "sim", None):
        with pytest.raises(ValueError, match="on: expected a platform with its settings"):
            Condition(name="a", on=wrong)
    with pytest.raises(ValueError, match="platform is 'sim', expected 'toy'"):
        Condition(name="a", platform="sim", on=ToyPlatform())
    with pytest.raises(ValueError, match="platform is 'toy:abc', expected toy"):
        Condition(name="a", platform="toy:abc")


def test_results_of_a_platform_that_is_not_installed_name_it() -> None:
    settings = Condition(name="a").settings()
    settings["toy"] = settings.pop("jyro")
    with pytest.raises(RecordVersionError, match="on platform 'toy', which is not installed"):
        Condition.from_settings("a", {**settings, "platform": "toy"})


STRICT = """
from typing import ClassVar
from own_robot import ToyPlatform

class Strict(ToyPlatform):
    name: ClassVar[str] = "strict"
    gain: float
"""


def test_settings_without_default_may_be_in_either_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "strict.py").write_text(STRICT)
    add_plugin(tmp_path, "strict:Strict", name="strict")
    monkeypatch.syspath_prepend(tmp_path)
    text = STUDY.replace("[platform.toy]", "[platform.strict]").replace(
        'platform = "toy"', 'platform = "strict"'
    )
    for both in (text.replace("speed = 0.2", "gain = 2.0"), text + "[condition.strict]\ngain = 2.0\n"):
        (condition,) = parse_study(both, "toy.toml").conditions
        assert condition.on.gain == 2.0
    with pytest.raises(StudyError, match=r"condition\[1\] 'toy'\.strict\.gain: missing"):
        parse_study(text, "toy.toml")


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("simm", "Did you mean 'sim'"),
        ("sim:", "expected sim or sim:FILE"),
        ("twin", "expected twin:FILE"),
        ("jyro:fast", "expected jyro"),
        ("scribbler", "expected scribbler:PORT"),
        ("toy", "'toy' is no platform"),
        ("python:toy.py", "expected python:FILE.py:CLASS"),
        (f"python:{__file__}:ToyPlatform", "you have not allowed this"),
    ],
)
def test_wrong_name_gets_one_message(spec: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        platform_of(spec)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no subclass 'Mine'"),
        ("class Mine: pass", "has no subclass 'Mine'"),
        ("1 / 0", "cannot be run: ZeroDivisionError"),
        (None, "There is no Python file"),
    ],
)
def test_wrong_file_gets_one_message(text: str | None, message: str, tmp_path: Path) -> None:
    if text is not None:
        (tmp_path / "mine.py").write_text(text)
    with pytest.raises(StudyError, match=message):
        load_platform(f"python:{tmp_path}/mine.py:Mine")


def test_file_runs_only_after_it_is_allowed() -> None:
    spec = f"python:{EXAMPLE}:ToyPlatform"
    allow_code()
    try:
        assert type(platform_of(spec)).__name__ == "ToyPlatform"
    finally:
        allow_code(False)


class _Liar(ToyPlatform):
    """A platform whose trials depend on those before them, whatever their number."""

    name = "liar"

    def open_robot(self, arena, *, noise=0.0):
        robot = ToyRobot(self, arena, 0.3)
        generator = np.random.default_rng(1)
        begin = robot.reset

        def reset(pose=None):
            begin(pose)
            robot._rng = generator

        robot.reset = reset
        return robot


def test_check_platform_lists_what_is_wrong() -> None:
    with pytest.raises(PlatformContractError, match="same number differs in another order"):
        check_platform(_Liar())


def test_number_of_a_trial_chooses_the_noise_of_a_robot_without_visited_cells() -> None:
    with ToyPlatform().open(paper_arena(), Opening("toy", noise=0.1)) as target:
        plans = [TrialPlan(commands=np.array([[0.1, 0.0]] * 5), number=k) for k in (1, 2, 1)]
        first, other, again = target.carry_out(plans, "track")
    assert np.array_equal(first.readings, again.readings)
    assert not np.array_equal(first.readings, other.readings)
