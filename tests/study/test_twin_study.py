"""Conditions on the platform `twin`: evolved in processes of their own, refused once the file has changed."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from realitygap.errors import StudyError
from realitygap.platforms import TwinPlatform, close_twins, open_twin, trace_genome, try_genomes
from realitygap.records import ResultsFolder
from realitygap.robots.twin import load_twin, sample_twin
from realitygap.runs import Condition, genome_of, replay
from realitygap.study import Study, parse_study, run_study
from realitygap.trials import NoiseKey
from realitygap.world import paper_arena
from tests.interrupted import INTERRUPTED

from ..conftest import twin_processes

pytestmark = pytest.mark.slow

STEPS = 15


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("twins") / "same.toml"
    path.write_text(sample_twin("same", 3).to_toml())  # `sim` itself, which needs no MuJoCo
    return path


def study_on(file: Path, more: str = "") -> Study:
    text = f"""
    [study]
    name = "on-a-twin"
    replicates = 2
    [neat]
    population = 4
    generations = 2
    [platform.twin]
    steps = {STEPS}
    [[condition]]
    name = "same"
    platform = "twin:{file}"
    {more}
    """
    return parse_study(text, "on-a-twin.toml")


@pytest.fixture(scope="module")
def results(file: Path, tmp_path_factory: pytest.TempPathFactory) -> ResultsFolder:
    return run_study(study_on(file), tmp_path_factory.mktemp("results") / "twin", threads=1).folder


def test_a_condition_is_known_by_the_hash_of_its_twin(file: Path, tmp_path: Path) -> None:
    (condition,) = study_on(file).conditions
    assert (condition.label, condition.platform, condition.noise) == ("TWIN", "twin", 0.0)
    assert len(condition.on.sha256) == 64
    assert Condition.from_settings("same", condition.settings()) == condition
    other = tmp_path / "other.toml"
    other.write_text(file.read_text() + "\n# touched\n")
    assert study_on(other).conditions[0].on.sha256 != condition.on.sha256


def test_conditions_on_other_platforms_say_nothing_of_twins() -> None:
    assert "twin" not in Condition(name="x").settings()
    assert Condition(name="x").hash() == "88619d669239056ab8f0db6e344ff21f35594cafedf7367f54ba1db22536a7f7"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"platform": "twin"}, "expected twin:FILE"),
        ({"platform": "twin:no-such.toml"}, r"the twin's file 'no-such.toml' cannot be read \(No such file"),
        ({"platform": "twin:{file}", "noise": 0.5}, "noise is 0.5, expected none with platform 'twin'"),
    ],
)
def test_a_condition_that_cannot_be_is_told(file: Path, more: dict[str, object], said: str) -> None:
    values = {
        key: str(value).format(file=file) if key == "platform" else value for key, value in more.items()
    }
    with pytest.raises((ValueError, ValidationError), match=said):
        Condition(name="x", **values)  # type: ignore[arg-type]


def test_trials_are_those_of_the_twin(file: Path, results: ResultsFolder) -> None:
    (condition,) = study_on(file).conditions
    row = results.scan().collect().row(5, named=True)
    trajectory = replay(condition, row)  # which compares it with the row
    robot = open_twin(load_twin(file), paper_arena())
    from realitygap.kernels.math.philox import PURPOSE_NOISE
    from realitygap.platforms._stepwise import trial_number

    individual, generation = row["individual"], row["generation"]
    counter = np.array([individual << 8 | int(PURPOSE_NOISE), generation << 12, row["replicate"]], np.uint32)
    robot.number = trial_number(row["key"], counter)
    robot.reset()
    for step, command in enumerate(trajectory.commands):
        assert max(robot.observe().readings) == trajectory.inputs[step, 0]
        robot.drive(command)
        np.testing.assert_allclose(robot.pose, trajectory.poses[step + 1], atol=1e-12)
    assert robot.visited_cells == tuple(row["cells"])
    assert trajectory.step_s == robot.step_s


def test_other_random_numbers_are_another_trial(file: Path, results: ResultsFolder) -> None:
    (condition,) = study_on(file).conditions
    genome = genome_of(condition, results.scan().collect().row(5, named=True))
    traced = [
        trace_genome(condition.on, paper_arena(), genome, noise=0.0, noise_key=NoiseKey(1, repeat=repeat))
        for repeat in (0, 0, 1)
    ]
    assert np.array_equal(traced[0].answers, traced[1].answers)
    assert not np.array_equal(traced[0].answers, traced[2].answers)
    with pytest.raises(ValueError, match="expected none with platform 'twin'"):
        try_genomes(condition.on, paper_arena(), [genome], noise=0.1, noise_key=NoiseKey(1))


@pytest.mark.parametrize("processes", [1, 2])
def test_digest_does_not_depend_on_processes_or_interruptions(
    file: Path,
    results: ResultsFolder,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    processes: int,
) -> None:
    from realitygap.platforms.twin import _pool as _twin_pool
    from realitygap.platforms.twin import _pooled

    _pooled._last.clear()
    _pooled._pools.clear()
    monkeypatch.setattr(_twin_pool, "usable_processors", lambda: processes)
    study = study_on(file)
    first = study.model_copy(update={"about": study.about.model_copy(update={"replicates": 1})})
    run_study(first, tmp_path / "r", threads=2)
    result = run_study(study, tmp_path / "r", threads=2)
    assert result.n_computed == 1
    assert result.folder.digest() == results.digest()


def test_the_processes_of_a_twin_end_with_the_study(file: Path, tmp_path: Path) -> None:
    """They stayed until the program ended."""
    close_twins()
    run_study(study_on(file), tmp_path / "r", threads=1)
    assert not twin_processes()


def test_a_twin_that_has_changed_is_refused(file: Path, results: ResultsFolder, tmp_path: Path) -> None:
    changed = tmp_path / "same.toml"
    changed.write_text(file.read_text())
    (condition,) = study_on(changed).conditions
    folder = run_study(study_on(changed), tmp_path / "r", threads=1).folder
    changed.write_text(file.read_text() + "\n# touched\n")
    with pytest.raises(StudyError, match=r"same: twin.sha256 is '\w+' there, '\w+' here"):
        run_study(study_on(changed), tmp_path / "r")
    from realitygap.platforms.twin import _pooled

    _pooled._last.clear()
    _pooled._pools.clear()
    with pytest.raises(StudyError, match="has changed: its SHA-256 begins with"):
        replay(condition, folder.scan().collect().row(0, named=True))


def test_a_platform_without_a_file_is_no_twin() -> None:
    assert TwinPlatform().label == "TWIN"
    with pytest.raises(ValueError, match="sha256"):
        TwinPlatform(sha256="short")


def processor_s(pid: int) -> float:
    """Processor time of a process so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="looks for child processes in /proc")
def test_ctrl_c_ends_a_study_on_a_twin_in_the_middle_of_a_run(file: Path, tmp_path: Path) -> None:
    text = f"""
    [study]
    name = "long"
    replicates = 1
    [platform.twin]
    steps = 20_000
    [[condition]]
    name = "same"
    platform = "twin:{file}"
    """
    (tmp_path / "long.toml").write_text(text)
    command = [sys.executable, "-m", "realitygap", "run", "long.toml", "--out", "r", "--threads", "1"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    ) as process:
        children: list[int] = []
        until = time.monotonic() + 120
        while not children and time.monotonic() < until:
            time.sleep(0.2)
            with contextlib.suppress(OSError):  # a thread or a process that ended meanwhile
                found = Path(f"/proc/{process.pid}/task").glob("*/children")
                pids = [int(pid) for listed in found for pid in listed.read_text().split()]
                children = [
                    pid
                    for pid in pids
                    if "platforms.twin._worker" in Path(f"/proc/{pid}/cmdline").read_text()
                ]
        while max(map(processor_s, children)) < 3.0 and time.monotonic() < until:
            time.sleep(0.05)  # its imports take half as long, so then the twin is at work
        process.send_signal(signal.SIGINT)
        began = time.monotonic()
        _, said = process.communicate(timeout=60)
        assert time.monotonic() - began < 30
    assert children
    assert process.returncode in INTERRUPTED
    assert "Traceback" not in said
    for pid in children:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
