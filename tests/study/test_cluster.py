"""A study on a Dask cluster: the digest of a local run, whatever is killed on the way."""

import os
import random
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from realitygap.errors import ClusterError, StudyError
from realitygap.records import ResultsFolder
from realitygap.study import _cluster, parse_study, run_study

pytest.importorskip("distributed", reason="needs the extra `cluster`")

from tests.interrupted import INTERRUPTED

from .dask_processes import DaskProcesses, free_port, kill, wait_until

pytestmark = pytest.mark.slow

SOURCES = Path(__file__).parents[2] / "src"
STUDY = """
[study]
name = "clustered"
seed = 3
replicates = 40
[[condition]]
name = "coverage"
[[condition]]
name = "novelty"
selection = "novelty"
noise = 0.5
"""


@pytest.fixture(scope="module")
def study():
    return parse_study(STUDY, "clustered.toml")


@pytest.fixture(scope="module")
def digest(study, tmp_path_factory):
    return run_study(study, tmp_path_factory.mktemp("local") / "r").folder.digest()


@pytest.fixture
def dask(tmp_path):
    (tmp_path / "dask").mkdir()
    with DaskProcesses(tmp_path / "dask") as processes:
        yield processes


def start_command(tmp_path: Path, address: str, *more: str) -> subprocess.Popen:
    path = tmp_path / "clustered.toml"
    path.write_text(STUDY)
    command = [sys.executable, "-m", "realitygap", "run", str(path), "--out", str(tmp_path / "r")]
    chunk = () if "--chunk" in more else ("--chunk", "1")
    return subprocess.Popen(
        [*command, "--cluster", address, *chunk, *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def n_published(tmp_path: Path) -> int:
    return len(list((tmp_path / "r" / "trials").glob("*.parquet")))


def assert_whole(folder: ResultsFolder, digest: str) -> None:
    assert folder.digest() == digest
    assert not list(folder.path.glob(".inbox-*"))
    assert not list(folder.path.rglob("*.tmp"))


def test_digest_is_that_of_a_local_run(study, digest, dask, tmp_path):
    dask.scheduler()
    dask.worker(nanny=True, threads=2)
    told = []
    result = run_study(study, tmp_path / "r", chunk=3, cluster=dask.address, tell=told.append)
    assert result.n_computed == result.n_runs == 80
    assert_whole(result.folder, digest)
    assert told[-1].n_done == 80
    assert [each.n_done for each in told] == sorted(each.n_done for each in told)
    start, end = result.folder.read_log()
    assert start["cluster"] == dask.address
    assert list(end["workers"].values()) == [2]
    again = run_study(study, tmp_path / "r", cluster=dask.address)
    assert again.n_computed == 0


def test_workers_that_are_killed_lose_and_double_nothing(study, digest, dask, tmp_path):
    dask.scheduler()
    workers = [dask.worker() for _ in range(2)]
    n_killed = 0

    def kill_and_replace(progress):
        nonlocal n_killed
        if progress.n_computed >= 10 * (n_killed + 1) and n_killed < 5:
            kill(workers.pop(0))
            workers.append(dask.worker())
            n_killed += 1

    result = run_study(study, tmp_path / "r", chunk=1, cluster=dask.address, tell=kill_and_replace)
    assert n_killed == 5
    assert result.n_computed == 80
    assert_whole(result.folder, digest)


def test_all_workers_gone_is_waited_out_and_said(study, digest, dask, tmp_path):
    dask.scheduler()
    worker = dask.worker()
    waited_for = []

    def kill_the_only_one(progress):
        if progress.n_computed and worker.poll() is None:
            kill(worker)
        if progress.waiting_for and worker.poll() is not None and not waited_for:
            waited_for.append(progress.waiting_for)
            dask.worker()

    result = run_study(study, tmp_path / "r", chunk=2, cluster=dask.address, tell=kill_the_only_one)
    assert waited_for == [f"a worker of {dask.address}"]
    assert_whole(result.folder, digest)


def test_a_scheduler_killed_and_restarted_loses_and_doubles_nothing(study, digest, dask, tmp_path):
    scheduler = dask.scheduler()
    dask.worker()
    restarts = []

    def restart(progress):
        nonlocal scheduler
        if progress.n_computed >= 20 * (len(restarts) + 1) and len(restarts) < 2:
            kill(scheduler)
            restarts.append(progress.n_computed)
            threading.Timer(1.0, bring_back).start()

    def bring_back():
        nonlocal scheduler
        scheduler = dask.scheduler()
        dask.worker()

    result = run_study(study, tmp_path / "r", chunk=1, cluster=dask.address, tell=restart)
    assert len(restarts) == 2
    assert result.n_computed == 80
    assert_whole(result.folder, digest)


def test_a_scheduler_that_stays_away_is_told_and_the_same_command_goes_on(
    study, digest, dask, tmp_path, monkeypatch
):
    monkeypatch.setattr(_cluster, "GONE_S", 1.0)
    scheduler = dask.scheduler()
    dask.worker()

    def end(progress):
        if progress.n_computed >= 10:
            kill(scheduler)

    with pytest.raises(
        ClusterError, match=r"has not responded for 1 s\. Published runs are saved\. Run the same"
    ):
        run_study(study, tmp_path / "r", chunk=1, cluster=dask.address, tell=end)
    dask.scheduler()
    dask.worker()
    result = run_study(study, tmp_path / "r", chunk=1, cluster=dask.address)
    assert 0 < result.n_computed <= 70
    assert_whole(result.folder, digest)


def test_a_command_killed_at_any_moment_goes_on_while_old_workers_still_compute(
    study, digest, dask, tmp_path
):
    dask.scheduler()
    dask.worker()
    rng = random.Random(7)
    kills = 0
    for chunk in ("1", "3", "2"):
        wanted = n_published(tmp_path) + rng.randint(1, 6)
        process = start_command(tmp_path, dask.address, "--chunk", chunk)
        wait_until(lambda wanted=wanted, p=process: n_published(tmp_path) >= wanted or p.poll() is not None)
        if process.poll() is None:
            process.kill()
            kills += 1
        process.communicate()
    assert kills >= 2
    result = run_study(study, tmp_path / "r", chunk=7, cluster=dask.address)
    assert result.n_computed > 0
    assert_whole(result.folder, digest)


def test_ctrl_c_leaves_what_is_published_and_says_how_to_go_on(study, digest, dask, tmp_path):
    dask.scheduler()
    dask.worker()
    process = start_command(tmp_path, dask.address)
    wait_until(lambda: n_published(tmp_path) >= 5)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode in INTERRUPTED, said
    assert said.splitlines()[-1].startswith("Interrupted. Published runs are saved")
    assert "Traceback" not in said
    result = run_study(study, tmp_path / "r", cluster=dask.address)
    assert 0 < result.n_computed <= 75
    assert_whole(result.folder, digest)


def test_a_late_worker_cannot_publish_after_its_command_has_ended(study, digest, dask, tmp_path):
    """It holds a chunk of the first command while the second goes on with other chunks."""
    dask.scheduler()
    holding, mark = tmp_path / "holding", tmp_path / "go"
    slow = (
        "import os, time\nimport realitygap.study._order as o\nreal = o.deliver\n"
        f"def late(*a):\n    open({str(holding)!r}, 'w').close()\n"
        f"    while not os.path.exists({str(mark)!r}): time.sleep(0.01)\n    return real(*a)\n"
        "o.deliver = late"
    )
    worker = dask.worker(slow)

    def interrupt():
        wait_until(holding.exists)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    with pytest.raises(KeyboardInterrupt):
        run_study(study, tmp_path / "r", chunk=5, cluster=dask.address)
    assert n_published(tmp_path) == 0
    other = run_study(study, tmp_path / "r", chunk=3)
    mark.touch()
    time.sleep(1.0)
    assert worker.poll() is None
    assert_whole(other.folder, digest)


@pytest.mark.parametrize(
    "changed",
    [
        "kernels/jyro/trial.py",
        pytest.param("_version.py", marks=pytest.mark.long),
        pytest.param("records/_version.py", marks=pytest.mark.long),
    ],
)
def test_a_worker_with_other_software_is_refused(study, dask, tmp_path, changed):
    copy = tmp_path / "other"
    shutil.copytree(SOURCES, copy, ignore=shutil.ignore_patterns("__pycache__"))
    path = copy / "realitygap" / changed
    text = path.read_text("utf-8") + "\n# another\n"
    text = text.replace("RESULTS_VERSION = 2", "RESULTS_VERSION = 99")
    path.write_text(text.replace('__version__ = "', '__version__ = "9.'), "utf-8")
    dask.scheduler()
    dask.worker(path=copy)
    with pytest.raises(ClusterError, match=r"sources is .* there, .* here") as caught:
        run_study(study, tmp_path / "r", cluster=dask.address)
    said = str(caught.value)
    assert "Install the same realitygap" in said
    assert ("results version is 99 there" in said) == (changed == "records/_version.py")
    assert ("realitygap is '9." in said) == (changed == "_version.py")
    assert n_published(tmp_path) == 0


def test_a_scheduler_needs_no_realitygap_and_a_worker_without_it_is_told(study, digest, dask, tmp_path):
    without = "sys.modules['realitygap'] = None"
    dask.scheduler(without, new=True)
    worker = dask.worker(without, new=True)
    with pytest.raises(ClusterError, match=r"A worker of .* cannot load this realitygap \(.*realitygap"):
        run_study(study, tmp_path / "r", cluster=dask.address)
    kill(worker)
    dask.worker()
    assert_whole(run_study(study, tmp_path / "r", cluster=dask.address).folder, digest)


@pytest.mark.skipif(sys.platform != "linux", reason="a path that each process sees differently")
def test_workers_that_do_not_share_the_folder_are_told(study, dask, tmp_path, monkeypatch):
    dask.scheduler()
    dask.worker()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ClusterError, match=r"cannot access /proc/self/cwd/r\. .*out=DIR"):
        run_study(study, "/proc/self/cwd/r", cluster=dask.address)
    assert n_published(tmp_path) == 0


def test_a_worker_that_cannot_write_is_told(study, dask, tmp_path):
    dask.scheduler()
    dask.worker("import resource\nresource.setrlimit(resource.RLIMIT_FSIZE, (60000, 60000))")
    with pytest.raises(ClusterError, match=r"refused: Could not write .* File too large\. .*Make room"):
        run_study(study, tmp_path / "r", chunk=40, cluster=dask.address)
    assert n_published(tmp_path) == 0


@pytest.mark.long
def test_a_chunk_that_ends_every_worker_is_told(study, dask, tmp_path, monkeypatch):
    monkeypatch.setattr(_cluster, "TRIES", 1)
    dask.scheduler("import dask\ndask.config.set({'distributed.scheduler.allowed-failures': 1})")
    deadly = "import os\nimport realitygap.study._order as o\no.run_replicates = lambda *a: os._exit(1)"
    stop = threading.Event()

    def keep_one():
        worker = dask.worker(deadly)
        while not stop.wait(0.05):
            if worker.poll() is not None:
                worker = dask.worker(deadly)

    thread = threading.Thread(target=keep_one)
    thread.start()
    try:
        with pytest.raises(ClusterError, match=r"ended every worker that computed them.*--chunk"):
            run_study(study, tmp_path / "r", cluster=dask.address)
    finally:
        stop.set()
        thread.join()


def test_fresh_deletes_nothing_where_no_scheduler_answers(study, digest, tmp_path, monkeypatch):
    monkeypatch.setattr(_cluster, "CONNECT_S", 0.5)
    folder = run_study(study, tmp_path / "r").folder
    with pytest.raises(ClusterError, match="No Dask scheduler answers at tcp://127"):
        run_study(study, tmp_path / "r", fresh=True, cluster=f"tcp://127.0.0.1:{free_port()}")
    assert folder.digest() == digest


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("slrm", r"Unknown cluster 'slrm'\. Expected tcp://HOST:PORT .* Did you mean 'slurm'\?"),
        ("127.0.0.1:8786", r"Unknown cluster '127\.0\.0\.1:8786'\. Expected tcp://HOST:PORT"),
        ("slurm:many", r"asks for 'many' jobs, expected a number, such as slurm:20"),
        ("slurm:0", r"asks for '0' jobs"),
        ("tcp://", r"is not the address of a scheduler"),
        ("tcp://127.0.0.1:port", r"is not the address of a scheduler"),
        ("tcp://nowhere", r"is not the address of a scheduler"),
    ],
)
def test_a_wrong_name_is_told(study, tmp_path, name, expected):
    with pytest.raises(StudyError, match=expected):
        run_study(study, tmp_path / "r", cluster=name)
    assert not (tmp_path / "r").exists()


def test_a_missing_batch_system_is_told(study, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(StudyError, match=r"There is no `sbatch` on this machine\. .*login node"):
        run_study(study, tmp_path / "r", cluster="slurm")


def test_threads_and_cluster_exclude_each_other(study, tmp_path):
    with pytest.raises(ValueError, match="exclude each other"):
        run_study(study, tmp_path / "r", threads=2, cluster="slurm")


def test_a_missing_extra_is_told_with_the_command_that_installs_it(study, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ClusterError, match=r"(--extra |\[)cluster"):
        run_study(study, tmp_path / "r", cluster="tcp://127.0.0.1:8786")


def test_ctrl_c_stays_ours_beside_dask_jobqueue():
    """Its import has Ctrl-C call sys.exit."""
    code = (
        "import signal\nfrom realitygap.study._job_queue import load_dask_jobqueue\n"
        "before = signal.getsignal(signal.SIGINT)\nload_dask_jobqueue()\n"
        "assert signal.getsignal(signal.SIGINT) is before"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
