"""`realitygap export` as a user meets it."""

import json
import sys
from functools import partial

import networkx
import numpy as np
import onnx
import onnxruntime
import polars as pl
import pytest

from realitygap.errors import RealityGapError
from realitygap.evolution import Genome
from realitygap.records import ResultsFolder
from realitygap.runs import Condition, genome_of

from .invoked import printed

export = partial(printed, "export")

WHICH = {"condition": "novelty-50", "replicate": 2, "generation": 1, "individual": 3}
OPTIONS = [word for key, value in WHICH.items() for word in (f"--{key}", value)]


def recorded(results):
    folder = ResultsFolder.open(results)
    described = next(c for c in folder.description["conditions"] if c["name"] == "novelty-50")
    row = folder.read("novelty-50", [2]).row(1 * 4 + 3, named=True)
    return genome_of(Condition.from_settings("novelty-50", described["settings"]), row), row


def test_json_holds_the_genome_of_the_row_and_where_it_comes_from(results, tmp_path):
    path = tmp_path / "genome.json"
    assert export(results, *OPTIONS, "-o", path) == f"Written: {path}\n"
    genome, row = recorded(results)
    again = Genome.load(path)
    assert again == genome
    given = [0.2, 1.0, 0.5]
    assert again.network().activate(given).tolist() == genome.network().activate(given).tolist()
    values = json.loads(path.read_text())
    assert values["origin"] | WHICH == values["origin"]
    assert values["origin"]["label"] == "SIM"
    assert values["origin"]["coverage_line"] == row["coverage_line"]
    assert values["interface"] == {
        "inputs": ["obstacle", "stall", "time", "bias"],
        "outputs": ["move", "turn"],
    }


def test_onnx_answers_as_the_network_of_the_row(results, tmp_path):
    path = tmp_path / "network.onnx"
    export(results, *OPTIONS, "-o", path)
    network = recorded(results)[0].network()
    given = np.random.default_rng(0).uniform(0, 1, (20, 3))
    (outputs,) = onnxruntime.InferenceSession(path).run(None, {"inputs": given})
    assert outputs == pytest.approx(np.array([network.activate(each) for each in given]), abs=1e-12)
    about = {each.key: each.value for each in onnx.load(path).metadata_props}
    assert about["input_names"] == '["obstacle", "stall", "time"]'
    assert about["condition"] == "novelty-50"


def test_graphml_holds_every_gene_of_the_row(results, tmp_path):
    path = tmp_path / "genome.graphml"
    export(results, *OPTIONS, "-o", path)
    graph = networkx.read_graphml(path, node_type=int)
    genome = recorded(results)[0]
    weights = {(gene.source, gene.target): gene.weight for gene in genome.connections}
    assert networkx.get_edge_attributes(graph, "weight") == weights
    assert graph.nodes[0]["name"] == "obstacle"
    assert graph.graph["replicate"] == 2


def test_without_numbers_it_is_the_best_of_the_last_generation_of_the_typical_run(results, tmp_path):
    path = tmp_path / "champion.txt"
    export(results, "--format", "json", "-o", path)
    origin = json.loads(path.read_text())["origin"]
    assert (origin["condition"], origin["generation"]) == ("coverage-50", 2)
    rows = ResultsFolder.open(results).read("coverage-50", [origin["replicate"]])
    assert origin["coverage_line"] == rows.filter(generation=2)["coverage_line"].max()


def test_a_file_that_is_there_gives_way(results, tmp_path):
    path = tmp_path / "a.json"
    path.write_text("old")
    export(results, "-o", path)
    Genome.load(path)
    assert [each.name for each in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize("name", ["study.json", "trials/new.json", "../DIR/study.json"])
def test_nothing_is_written_over_results(results, tmp_path, name):
    folder = ResultsFolder.open(results)
    before = {path: path.read_bytes() for path in folder.path.rglob("*") if path.is_file()}
    path = folder.path / name.replace("DIR", folder.path.name)
    link = tmp_path / "link"
    link.symlink_to(folder.path)
    for each in (path, link / name.replace("DIR", folder.path.name)):
        with pytest.raises(RealityGapError, match=r"nothing was written"):
            export(results, "-o", each)
    assert {path: path.read_bytes() for path in folder.path.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("module", ["onnx", "networkx"])
def test_a_missing_extra_is_one_message_and_leaves_no_file(results, tmp_path, monkeypatch, module):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(RealityGapError, match=r"(--extra |\[)export"):
        export(results, "-o", tmp_path / ("a.onnx" if module == "onnx" else "a.graphml"))
    assert not list(tmp_path.iterdir())
    export(results, "-o", tmp_path / "a.json")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["DIR", "-o", "a.jsn"], "Did you mean 'json'?"),
        (["DIR", "-o", "a"], "ends in nothing, expected json, onnx, graphml, c or aseba"),
        (["DIR", "-o", "a.json", "--format", "xml"], "Unknown format 'xml'"),
        (["DIR"], "Name one with -o"),
        (["DIR", "--condition", "novelty-5O", "-o", "a.json"], "Did you mean 'novelty-50'?"),
        (["DIR", "--replicate", "9", "-o", "a.json"], "its runs are 0 to 2"),
        (["DIR", "--generation", "9", "-o", "a.json"], "its generations are 0 to 2"),
        (["DIR", "--generation", "1", "--individual", "9", "-o", "a.json"], "its individuals are 0 to 3"),
        (["nowhere", "-o", "a.json"], "nowhere does not exist"),
        (["DIR", "-o", "no/where/a.json"], "Could not write no/where/a.json"),
    ],
)
def test_mistakes_are_one_message_and_leave_no_file(results, tmp_path, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RealityGapError) as caught:
        export(*(results if word == "DIR" else word for word in words))
    assert message in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("what", ["species", "innovations", "lineage"])
def test_species_innovations_and_lineage_are_written_as_parquet(results, tmp_path, what):
    path = tmp_path / f"{what}.parquet"
    assert export(what, results, "-o", path) == f"Written: {path}\n"
    folder = ResultsFolder.open(results)
    assert pl.read_parquet(path).equals(folder.derive(what))
    export(what, results, "--condition", "novelty-50", "--replicate", 1, "-o", path)
    assert pl.read_parquet(path).equals(folder.derive(what, "novelty-50", [1]))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["lineage", "-o", "a.parquet"], "No results folder. Name one: realitygap export lineage"),
        (["linage", "DIR", "-o", "a.parquet"], "Expected species, innovations or lineage first"),
        (["lineage", "DIR", "-o", "a.csv"], "ends in .csv, expected .parquet"),
        (
            ["lineage", "DIR", "--generation", "1", "-o", "a.parquet"],
            "Not for lineage: --generation",
        ),
        (["lineage", "DIR", "--format", "json", "-o", "a.parquet"], "Not for lineage: --format"),
        (["lineage", "DIR", "--replicate", "9", "-o", "a.parquet"], "There is no run 9"),
        (["lineage", "DIR", "--condition", "novelty-5O", "-o", "a.parquet"], "Did you mean 'novelty-50'?"),
        (["lineage", "nowhere", "-o", "a.parquet"], "nowhere does not exist"),
        (["lineage", "DIR", "-o", "no/where/a.parquet"], "Could not write no/where/a.parquet"),
    ],
)
def test_mistakes_with_tables_are_one_message_and_leave_no_file(
    results, tmp_path, monkeypatch, words, message
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RealityGapError) as caught:
        export(*(results if word == "DIR" else word for word in words))
    assert message in str(caught.value)
    assert not list(tmp_path.iterdir())
