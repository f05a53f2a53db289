"""A population that is saved and loaded goes on as if nothing had been; workers change nothing."""

from __future__ import annotations

import io
import json
import multiprocessing
import pickle
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

from realitygap.errors import RecordError, RecordVersionError
from realitygap.evolution import Genome, NeatSettings, Network, Population
from tests.evolution.xor import CASES

SETTINGS = NeatSettings(population=20, add_node=0.3, add_link=0.4, target_species=4)


def xor_fitness(genome: Genome) -> float:
    network = genome.network()
    return (4.0 - sum(abs(network.activate(given)[0] - wanted) for given, wanted in CASES)) ** 2


def answer(network: Network) -> list[float]:
    return network.activate([0.3, 0.7]).tolist()


def step(population: Population, pool: Executor | None = None) -> None:
    fitness = (pool.map if pool else map)(xor_fitness, population.ask())
    population.tell(list(fitness))


def state(population: Population) -> list[object]:
    return [
        population.ask(),
        population.generation,
        population.species.tolist(),
        population.parents.tolist(),
        population.threshold,
    ]


def new_population(**changes: object) -> Population:
    settings = SETTINGS.model_copy(update=changes)
    return Population(2, 1, settings, seed=7, replicate=3)


@pytest.mark.parametrize("changes", [{}, {"recurrent": True, "node_bias": True}], ids=["plain", "recurrent"])
def test_a_population_taken_up_at_any_generation_is_bit_for_bit_the_one_that_went_on(tmp_path, changes):
    straight = new_population(**changes)
    resumed = new_population(**changes)
    for generation in range(12):
        path = tmp_path / f"{generation}.npz"
        resumed.save(path)
        resumed = Population.load(path)
        assert state(resumed) == state(straight)
        step(straight)
        step(resumed)
    assert state(resumed) == state(straight)
    assert max(genome.n_hidden for genome in resumed.ask()) > 1


def test_any_earlier_checkpoint_leads_to_the_same_end(tmp_path):
    population = new_population()
    for generation in range(8):
        population.save(tmp_path / f"{generation}.npz")
        step(population)
    for generation in range(8):
        again = Population.load(tmp_path / f"{generation}.npz")
        while again.generation < 8:
            step(again)
        assert state(again) == state(population)


def test_the_same_population_gives_the_same_file(tmp_path):
    for name in ("a", "b"):
        population = new_population()
        step(population)
        population.save(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a", "b"], "no temporary file stays"


def test_a_file_that_is_there_gives_way_and_stays_when_writing_fails(tmp_path, monkeypatch):
    path = tmp_path / "p.npz"
    population = new_population()
    population.save(path)
    before = path.read_bytes()
    step(population)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full)
        with pytest.raises(RecordError, match="No space left"):
            population.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    population.save(path)
    assert Population.load(path).generation == 1


def test_a_torn_file_is_refused_wherever_it_is_cut(tmp_path):
    path = tmp_path / "p.npz"
    new_population().save(path)
    whole = path.read_bytes()
    for kept in [0, 1, 2, 30, *range(100, len(whole), len(whole) // 40), len(whole) - 1]:
        path.write_bytes(whole[:kept])
        with pytest.raises(RecordError, match=r"is no checkpoint|is cut off or damaged"):
            Population.load(path)


def test_a_changed_byte_is_refused_or_changes_nothing(tmp_path):
    path = tmp_path / "p.npz"
    population = new_population()
    population.save(path)
    whole = path.read_bytes()
    n_refused = 0
    for at in range(0, len(whole), len(whole) // 150):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        try:
            assert state(Population.load(path)) == state(population)
        except RecordError:
            n_refused += 1
    assert n_refused > 100


def rewritten(path, **changes):
    """The checkpoint with other values in its description."""
    with np.load(path) as found:
        arrays = {name: found[name] for name in found.files}
    about = json.loads(arrays["about"].tobytes()) | changes
    arrays["about"] = np.frombuffer(json.dumps(about).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    path.write_bytes(buffer.getvalue())


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"version": 99}, RecordVersionError, "with version 99, expected 1"),
        ({"results_version": 99}, RecordVersionError, "results version 99"),
        ({"kind": "herd"}, RecordError, "no checkpoint of a population"),
        ({"format": "x"}, RecordError, "no checkpoint of a population"),
        ({"settings": {"populatoin": 3}}, RecordError, "not one of a population as this version has it"),
        ({"n_inputs": 5}, RecordError, "not one of a population as this version has it"),
        ({"settings": {"population": 4}}, RecordError, "has shape"),
    ],
)
def test_other_versions_and_other_contents_are_said(tmp_path, changes, error, message):
    path = tmp_path / "p.npz"
    new_population().save(path)
    if "n_inputs" in changes:
        changes = {"n_inputs": "five"}
    rewritten(path, **changes)
    with pytest.raises(error, match=message):
        Population.load(path)


def test_foreign_files_are_said(tmp_path):
    text = tmp_path / "text.npz"
    text.write_text("not a checkpoint")
    foreign = tmp_path / "foreign.npz"
    np.savez(foreign, a=np.arange(3))
    for path, message in [
        (text, "no checkpoint of a population"),
        (foreign, "no checkpoint of a population"),
        (tmp_path, "is a folder"),
        (tmp_path / "missing.npz", "does not exist"),
    ]:
        with pytest.raises(RecordError, match=message):
            Population.load(path)
    with pytest.raises(RecordError, match="Could not write"):
        new_population().save(tmp_path / "no" / "where.npz")


def test_a_pickle_in_a_checkpoint_is_never_opened(tmp_path):
    path = tmp_path / "p.npz"
    np.savez(path, about=np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(RecordError, match="is cut off or damaged"):
        Population.load(path)


@pytest.mark.parametrize(
    "kind", ["threads-1", "threads-3", "processes-1", pytest.param("processes-2", marks=pytest.mark.slow)]
)
def test_any_number_of_workers_finds_the_same(kind):
    alone, shared = new_population(), new_population()
    name, n_workers = kind.split("-")
    if name == "threads":
        pool: Executor = ThreadPoolExecutor(int(n_workers))
    else:
        pool = ProcessPoolExecutor(int(n_workers), multiprocessing.get_context("spawn"))
    with pool:
        for _ in range(4):
            step(alone)
            step(shared, pool)
        assert state(shared) == state(alone)
        networks = [genome.network() for genome in shared.ask()]
        assert list(pool.map(answer, networks)) == [answer(network) for network in networks]


def test_a_pickled_genome_carries_its_own_genes_only():
    population = new_population()
    for _ in range(6):
        step(population)
    for genome in population.ask():
        data = pickle.dumps(genome)
        assert pickle.loads(data) == genome
        assert len(data) < len(pickle.dumps(population)) / 5


def test_a_pickled_recurrent_network_remembers():
    population = new_population(recurrent=True)
    for _ in range(8):
        step(population)
    genome = max(population.ask(), key=lambda each: each.n_enabled)
    network = genome.network()
    network.activate([1.0, 0.0])
    copy = pickle.loads(pickle.dumps(network))
    for given in ([0.0, 1.0], [0.5, 0.5]):
        assert copy.activate(given).tolist() == network.activate(given).tolist()


def out_of_bounds() -> dict[str, tuple[int, ...]]:
    """Numbers that kernels use as indices, or count by: an array and the place in it."""
    return {
        "genomes.n_connections": (0,),
        "genomes.n_hidden": (0,),
        "genomes.source": (0, 0),
        "genomes.target": (0, 0),
        "genomes.innovation": (0, 1),
        "innovations.counters": (0,),
        "species.counts": (0,),
        "species.identity": (0,),
        "species_of": (0,),
    }


@pytest.mark.parametrize("name", out_of_bounds())
@pytest.mark.parametrize("number", [-1, 2**31 - 1])
def test_load_refuses_numbers_that_lead_kernels_out_of_bounds(tmp_path, name, number):
    path = tmp_path / "p.npz"
    population = new_population()
    step(population)
    population.save(path)
    with np.load(path) as stored:
        arrays = dict(stored)
    arrays[name][out_of_bounds()[name]] = number
    np.savez(path, **arrays)
    with pytest.raises(RecordError, match="not one of a population"):
        Population.load(path)


def test_load_refuses_rows_of_different_widths_and_a_species_without_members(tmp_path):
    path = tmp_path / "p.npz"
    population = new_population()
    step(population)
    population.save(path)
    with np.load(path) as stored:
        arrays = dict(stored)
    np.savez(path, **{**arrays, "genomes.source": arrays["genomes.source"][:, :3].copy()})
    with pytest.raises(RecordError, match=r"genomes.source has shape"):
        Population.load(path)
    arrays["species.counts"][0] += 1
    np.savez(path, **arrays)
    with pytest.raises(RecordError, match="species and their members do not agree"):
        Population.load(path)
