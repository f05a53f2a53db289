"""A twin as a target: processes of its own, whose file nobody else opens."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import DescriptionError, RobotError
from realitygap.evolution import Genome, NeatSettings, Population
from realitygap.platforms import TwinTarget, open_twin
from realitygap.records import TrialRecord, trial_to_dict
from realitygap.robots.twin import load_twin, sample_twin
from realitygap.trials import RobotObserver, TrialPlan, carry_out_on_robot
from realitygap.world import Pose, paper_arena

pytestmark = pytest.mark.slow

ARENA = paper_arena()


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A twin that is `sim` itself, which needs no MuJoCo."""
    path = tmp_path_factory.mktemp("twins") / "same.toml"
    path.write_text(sample_twin("same", 3).to_toml())
    return path


@pytest.fixture(scope="module")
def target(file: Path) -> Iterator[TwinTarget]:
    with TwinTarget(str(file), ARENA, 2) as target:
        yield target


def genomes() -> list[Genome]:
    settings = NeatSettings.named("rosenzweig-remy", population=8, add_node=0.5, weight_step=5.0)
    return list(Population(3, 2, settings, seed=11, bias=False).ask())


def plans(n: int = 4, steps: int = 20) -> list[TrialPlan]:
    made = [TrialPlan(genome=genome, steps=steps, number=k) for k, genome in enumerate(genomes()[:n])]
    commands = np.array([[1.0, 0.0], [0.5, -0.25]] * 5)
    return [*made, TrialPlan(start=Pose(0.4, 0.3, 2.0), commands=commands, number=9, purpose="motion")]


def as_dicts(trials: list[TrialRecord]) -> list[dict[str, object]]:
    return [trial_to_dict(trial) for trial in trials]


def test_trials_are_those_of_the_twin_in_this_process(file: Path, target: TwinTarget) -> None:
    robot = open_twin(load_twin(file), ARENA)
    expected = []
    for plan in plans():
        robot.number = plan.number
        trial = carry_out_on_robot(robot, plan, "track", RobotObserver(robot), plan.start or ARENA.start)
        expected.append(trial)
    told: list[int] = []
    trials = target.carry_out(plans(), "track", lambda k, trial: told.append(k))
    assert as_dicts(trials) == as_dicts(expected)
    assert told == list(range(len(trials)))
    assert (target.label, target.step_s, target.n_sensors) == ("TWIN", robot.step_s, robot.n_sensors)


def test_a_trial_of_a_twin_has_no_more_than_is_to_be_observed(target: TwinTarget) -> None:
    full = target.carry_out(plans(), "track")
    for observe in ("cells", "encoders"):
        for trial, whole in zip(target.carry_out(plans(), observe), full, strict=True):
            assert trial.observe == observe
            assert len(trial.poses) == 0
            assert list(trial.cells) == sorted(trial.cells)
            assert len(trial.wheels) == (0 if observe == "cells" else len(trial.commands) + 1)
            kept = {"start", "step_s", "commands", "readings", "stalled", "cells", "genome", "number"}
            assert {name: value for name, value in trial_to_dict(trial).items() if name in kept} == {
                name: value for name, value in trial_to_dict(whole).items() if name in kept
            }


def test_all_processes_work(target: TwinTarget) -> None:
    target.carry_out(plans(8, 60), "cells")
    assert len(set(target.pids)) == 2


def is_gone(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    return False  # a zombie, too, would still be found


def test_a_process_that_dies_is_started_again_and_its_trial_tried_once_more(
    file: Path, target: TwinTarget
) -> None:
    expected = as_dicts(target.carry_out(plans(3), "track"))
    with TwinTarget(str(file), ARENA, 1) as mortal:
        (before,) = mortal.pids
        trials: list[TrialRecord] = []
        # the first trial is on its way back, and the second in flight or about to be
        trials = mortal.carry_out(
            plans(3), "track", lambda k, trial: os.kill(before, signal.SIGKILL) if k == 0 else None
        )
        if mortal.pids == (before,):  # all was done before it died
            trials = mortal.carry_out(plans(3), "track")
        assert as_dicts(trials) == expected
        (after,) = mortal.pids
        assert after != before

        stop = threading.Event()

        def kill() -> None:
            while not stop.wait(0.05):
                for pid in mortal.pids:
                    with contextlib.suppress(ProcessLookupError):  # its end was noticed meanwhile
                        os.kill(pid, signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        try:
            with pytest.raises(RobotError, match=r"ended twice in the same trial \(exit status -9\)"):
                mortal.carry_out([TrialPlan(genome=genomes()[0], steps=90_000)], "cells")
        finally:
            stop.set()
            killer.join()
    assert is_gone(before)
    assert is_gone(after)
    with pytest.raises(RobotError, match="is closed"):
        mortal.carry_out(plans(1), "cells")


SPY = """
    import sys
    opened = []
    sys.addaudithook(lambda name, args: opened.append(str(args[0])) if name == "open" else None)
    from realitygap.study import open_target
    from realitygap.trials import TrialPlan
    from realitygap.world import paper_arena
    with open_target("twin:" + sys.argv[1], paper_arena(), processes=1) as target:
        target.carry_out([TrialPlan(commands=[[1.0, 0.0]] * 3)], "track")
        assert any(path.endswith((".py", ".pyc")) for path in opened), "the spy is blind"
        print([path for path in opened if "same.toml" in path], *target.pids, flush=True)
        target.carry_out([TrialPlan(commands=[[1.0, 0.2]] * 100_000)], "cells")
"""


def test_the_calling_process_never_opens_the_file_and_ctrl_c_ends_the_processes(file: Path) -> None:
    command = [sys.executable, "-c", textwrap.dedent(SPY), str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        opened, pid = process.stdout.readline().split()
        assert opened == "[]"
        assert not is_gone(int(pid))
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
        process.wait(60)
        assert is_gone(int(pid))
        assert process.returncode not in (0, None)


@pytest.mark.parametrize(
    ("text", "said"),
    [(None, "There is no twin file"), ('format = "realitygap twin 1"\nengine = "steam"', "engine")],
)
def test_a_file_with_mistakes_is_told_in_one_message(tmp_path: Path, text: str | None, said: str) -> None:
    path = tmp_path / "bad.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(DescriptionError, match=f"(?s)bad.toml.*{said}|{said}.*bad.toml"):
        TwinTarget(str(path), ARENA, 1)


def test_plans_that_cannot_be_are_refused_before_anything_moves(target: TwinTarget) -> None:
    with pytest.raises(ValueError, match="has to have a genome or commands"):
        target.carry_out([TrialPlan()], "cells")
    with pytest.raises(ValueError, match="expected a number from"):
        target.carry_out([TrialPlan(commands=np.array([[1.5, 0.0]]))], "cells")
    with pytest.raises(ValueError, match="Did you mean 'track'"):
        target.carry_out(plans(1), "tracks")  # type: ignore[arg-type]
