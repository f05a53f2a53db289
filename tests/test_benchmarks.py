"""The comparison with other libraries says what it could not measure, and which way a ratio goes."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).parent.parent / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import environments  # noqa: E402
import memory_and_start  # noqa: E402
import ours  # noqa: E402
import parts  # noqa: E402
import peers  # noqa: E402
import work  # noqa: E402
from environments import Peer, PeerError  # noqa: E402


def _peer(script, folder, monkeypatch):
    """A peer in the environment that runs the tests, whose worker is these lines."""
    (folder / "some.py").write_text(script, "utf-8")
    monkeypatch.setattr(environments, "HERE", folder)
    return Peer(name="some", title="Some", requirements=(), packages=(), figures=("run_us",))


def test_a_ratio_above_one_says_that_ours_is_faster_for_rates_and_for_times():
    rates = {"ours": {"median": 30.0}, "jyro": {"median": 10.0}}
    peers.add_ratios("steps_core", rates)
    assert rates["jyro"]["ratio"] == 3.0
    times = {"ours": {"median": 10.0}, "multineat": {"median": 30.0}}
    peers.add_ratios("run_us", times)
    assert times["multineat"]["ratio"] == 3.0


def test_a_missing_measurement_has_no_ratio():
    answers = {"ours": {"median": 1.0}, "jyro": {"not_measured": "no cairo"}}
    peers.add_ratios("steps_core", answers)
    assert "ratio" not in answers["jyro"]
    answers = {"ours": {"not_measured": "no"}, "jyro": {"median": 1.0}}
    peers.add_ratios("steps_core", answers)
    assert "ratio" not in answers["jyro"]


def test_a_worker_answers_with_the_last_line_it_prints(tmp_path, monkeypatch):
    peer = _peer('print("welcome"); print(\'{"median": 2.0}\')', tmp_path, monkeypatch)
    assert environments.measure(peer, Path(sys.executable), "run_us") == {"median": 2.0}


def test_a_worker_that_fails_or_says_why_it_cannot_is_one_message(tmp_path, monkeypatch):
    peer = _peer('raise SystemExit("no such library")', tmp_path, monkeypatch)
    with pytest.raises(PeerError, match="no such library"):
        environments.measure(peer, Path(sys.executable), "run_us")
    peer = _peer(f"print({json.dumps(json.dumps({'error': 'no cairo'}))})", tmp_path, monkeypatch)
    with pytest.raises(PeerError, match=r"^no cairo$"):
        environments.measure(peer, Path(sys.executable), "run_us")


def test_a_worker_that_does_not_end_in_time_is_stopped(tmp_path, monkeypatch):
    peer = _peer("import time; time.sleep(60)", tmp_path, monkeypatch)
    monkeypatch.setitem(work.FIGURES, "run_us", work.FIGURES["run_us"]._replace(seconds=0.2))
    with pytest.raises(PeerError, match=r"not done after 0\.2 s"):
        environments.measure(peer, Path(sys.executable), "run_us")


def test_a_peer_that_cannot_be_built_is_said_to_be_not_measured(monkeypatch):
    def build(peer, *, fresh):
        if peer.requirements:
            raise PeerError("no connection")
        return Path(sys.executable)

    monkeypatch.setattr(peers, "build_environment", build)
    answer = {"median": 1.0, "low": 1.0, "high": 1.0, "versions": {}}
    monkeypatch.setattr(peers, "measure", lambda *_: dict(answer))
    result = peers.compare([peers.PEERS[0]])
    assert list(result["figures"]) == ["steps_core"]
    assert result["figures"]["steps_core"]["jyro"] == {"not_measured": "no connection"}


def test_peak_memory_counts_the_processes_that_a_command_starts():
    room = "room = bytes(b'x') * 200_000_000; import time; time.sleep(1)"
    code = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {room!r}], check=True)"
    assert 190 < memory_and_start.run([sys.executable, "-c", code]).peak_mb < 400


def test_a_measured_command_that_fails_is_an_error():
    with pytest.raises(SystemExit, match="status 3"):
        memory_and_start.run([sys.executable, "-c", "raise SystemExit(3)"])


@pytest.mark.slow
def test_robots_that_are_pressed_end_the_nearer_to_the_finest_the_more_parts_a_step_has():
    finest = parts.places("pressed", parts.FINEST)
    away = [np.median(np.hypot(*(parts.places("pressed", number) - finest).T)) for number in parts.PARTS]
    assert 0 < away[0] < away[1] < away[2] < away[3] < 0.1


@pytest.mark.slow
def test_our_loops_breed_what_population_breeds():
    from our_loops import KEY, begin_run, breed
    from realitygap.evolution import Population

    settings = ours._settings(8)
    rules = settings.rules(work.N_INPUTS, work.N_OUTPUTS)
    room = ours._room(8, rules)
    begin_run(room, rules, KEY, 3)
    room.fitness[:] = 1.0
    breed(room.genomes, room.children, room, rules, KEY, 3, 0)
    population = Population(work.N_INPUTS, work.N_OUTPUTS, settings, replicate=3, key=int(KEY), bias=False)
    population.tell([1.0] * 8)
    assert population.species.tolist() == room.species_of.tolist()
    assert population.parents.tolist() == room.parents.tolist()
    for row, genome in enumerate(population.ask()):
        n = room.children.n_connections[row]
        assert [gene.weight for gene in genome.connections] == room.children.weight[row, :n].tolist()
