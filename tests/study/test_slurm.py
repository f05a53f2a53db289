"""A study as jobs of a real SLURM on this machine."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

from realitygap.records import ResultsFolder
from realitygap.study import parse_study, run_study

if importlib.util.find_spec("dask_jobqueue") is None:  # its import would take Ctrl-C from the other tests
    pytest.skip("needs the extra `cluster`", allow_module_level=True)

from .dask_processes import wait_until
from .one_machine_slurm import PROGRAMS, OneMachineSlurm, program

MISSING = [name for name in PROGRAMS if program(name) is None]
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(MISSING), reason=f"needs {', '.join(MISSING)} (Debian: slurmctld slurmd munge)"),
]

STUDY = """
[study]
name = "queued"
seed = 5
replicates = 200
[[condition]]
name = "coverage"
[[condition]]
name = "novelty"
selection = "novelty"
"""

SETTINGS = """\
jobqueue:
  slurm:
    cores: 1
    memory: 2GB
    walltime: "00:10:00"
    interface: lo
    queue: {queue}
    local-directory: {folder}
    log-directory: {folder}
    python: {python}
    scheduler-options:
      dashboard_address: "127.0.0.1:0"
distributed:
  deploy:
    lost-worker-timeout: 2s
"""


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    with OneMachineSlurm(tmp_path_factory.mktemp("slurm")) as daemons:
        yield daemons


@pytest.fixture(scope="module")
def digest(tmp_path_factory):
    study = parse_study(STUDY, "queued.toml")
    return run_study(study, tmp_path_factory.mktemp("local") / "r").folder.digest()


def start(slurm: OneMachineSlurm, folder: Path, where: str, *more: str, queue: str = "all"):
    (folder / "queued.toml").write_text(STUDY)
    (folder / "dask").mkdir(exist_ok=True)
    (folder / "dask" / "settings.yaml").write_text(
        SETTINGS.format(folder=folder / "dask", python=sys.executable, queue=queue)
    )
    environment = {**slurm.environment, "DASK_CONFIG": str(folder / "dask")}
    environment["PATH"] = os.environ["PATH"] + ":/usr/sbin"
    command = [sys.executable, "-m", "realitygap", "run", str(folder / "queued.toml")]
    return subprocess.Popen(
        [*command, "--out", str(folder / "r"), "--cluster", where, *more],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_digest_of_two_jobs_is_that_of_a_local_run(slurm, digest, tmp_path):
    process = start(slurm, tmp_path, "slurm:2", "--chunk", "10")
    printed, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    assert "400 of 400 runs computed" in printed
    folder = ResultsFolder.open(tmp_path / "r")
    assert folder.digest() == digest
    assert folder.read_log()[-1]["cluster"] == "slurm:2"
    wait_until(lambda: not slurm.jobs())


def test_a_job_that_is_canceled_is_submitted_anew_and_loses_nothing(slurm, digest, tmp_path):
    process = start(slurm, tmp_path, "slurm", "--chunk", "1")
    trials = tmp_path / "r" / "trials"
    wait_until(lambda: len(list(trials.glob("*.parquet"))) >= 10 or process.poll() is not None, 200)
    (job,) = slurm.jobs("running")
    slurm.run("scancel", "--signal=KILL", "--full", job)
    _, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    folder = ResultsFolder.open(tmp_path / "r")
    assert folder.digest() == digest
    assert len(folder.read_log()[-1]["workers"]) == 2
    wait_until(lambda: not slurm.jobs())


def test_a_killed_command_leaves_no_job_and_goes_on(slurm, digest, tmp_path):
    process = start(slurm, tmp_path, "slurm:2", "--chunk", "1")
    trials = tmp_path / "r" / "trials"
    wait_until(lambda: len(list(trials.glob("*.parquet"))) >= 10 or process.poll() is not None, 200)
    process.kill()
    process.communicate()
    wait_until(lambda: not slurm.jobs(), 120)
    again = start(slurm, tmp_path, "slurm:2", "--chunk", "20")
    printed, said = again.communicate(timeout=300)
    assert again.returncode == 0, said
    assert "of 400 runs computed" in printed
    assert "400 of 400" not in printed
    assert ResultsFolder.open(tmp_path / "r").digest() == digest


def test_a_job_that_slurm_refuses_is_told(slurm, tmp_path):
    process = start(slurm, tmp_path, "slurm", queue="nosuch")
    _, said = process.communicate(timeout=120)
    assert process.returncode == 1
    last = said.splitlines()[-1]
    assert last.startswith("realitygap: slurm refused the job:")
    assert "invalid partition" in last
    assert "Traceback" not in said
