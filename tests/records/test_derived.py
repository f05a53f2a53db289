"""Species, innovations and lineage are those that walking through the rows one by one gives."""

from __future__ import annotations

import polars as pl
import pytest

from realitygap.errors import RecordError
from realitygap.records import ResultsFolder, derived_table
from realitygap.records._derived import DERIVED
from realitygap.study import parse_study, run_study
from tests.records.rows import HASH, make_folder, make_rows

STUDY = """
[study]
name = "tiny"
title = "Tiny"
replicates = 5
[neat]
population = 12
generations = 6
add_node = 0.3
add_link = 0.3
[platform.jyro]
steps = 12
[[condition]]
name = "coverage"
[[condition]]
name = "novelty"
selection = "novelty"
[[condition]]
name = "random"
selection = "random"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> ResultsFolder:
    return run_study(parse_study(STUDY, "tiny.toml"), tmp_path_factory.mktemp("tiny"), chunk=2).folder


def by_key(folder: ResultsFolder) -> dict[tuple, dict]:
    return {
        (row["condition"], row["replicate"], row["generation"], row["individual"]): row
        for row in folder.read().iter_rows(named=True)
    }


def test_species_are_the_groups_of_each_generation(folder):
    frame = folder.derive("species")
    rows = by_key(folder)
    assert frame["size"].sum() == len(rows)
    found = {}
    for key, row in rows.items():
        found.setdefault((*key[:3], row["species"]), []).append(row)
    assert frame.height == len(found)
    for each in frame.iter_rows(named=True):
        run = (each["condition"], each["replicate"])
        members = found[(*run, each["generation"], each["species"])]
        best = max(members, key=lambda row: row["fitness"])
        assert each["size"] == len(members)
        assert (each["best"], each["best_fitness"]) == (best["individual"], best["fitness"])
        assert each["mean_fitness"] == pytest.approx(sum(row["fitness"] for row in members) / len(members))
        assert each["best_coverage_line"] == max(row["coverage_line"] for row in members)
        assert each["founded"] == min(key[2] for key in found if key[:2] == run and key[3] == each["species"])


def test_innovations_are_those_first_seen_in_the_rows(folder):
    frame = folder.derive("innovations")
    found: dict[tuple, dict] = {}
    for key, row in by_key(folder).items():
        genes = row["genome"]
        for number, source, target in zip(genes["innovation"], genes["source"], genes["target"], strict=True):
            first = {"source": source, "target": target, "generation": key[2], "individual": key[3]}
            each = found.setdefault((*key[:2], number), first | {"carriers": 0, "carriers_last": 0})
            each["carriers"] += 1
            each["carriers_last"] += key[2] == 5
            each["last_generation"] = key[2]
    assert frame.height == len(found)
    for each in frame.iter_rows(named=True):
        key = (each.pop("condition"), each.pop("replicate"), each.pop("innovation"))
        assert each == found[key]
    late = frame.filter(pl.col("generation") > 0)
    assert late.height > 50
    assert late.filter(pl.col("condition") == "random").is_empty(), "unrelated networks bring nothing new"


def test_lineage_is_what_the_rows_say_of_parents_and_genes(folder):
    rows = by_key(folder)
    frame = folder.derive("lineage")
    assert frame.height == len(rows)
    origins = set()
    for each in frame.iter_rows(named=True):
        run = (each["condition"], each["replicate"])
        row = rows[(*run, each["generation"], each["individual"])]
        parents = [rows[(*run, each["generation"] - 1, parent)]["genome"] for parent in row["parents"]]
        assert [p for p in (each["parent_1"], each["parent_2"]) if p is not None] == row["parents"]
        inherited = {number for genome in parents for number in genome["innovation"]}
        assert each["new"] == sorted(set(row["genome"]["innovation"]) - inherited)
        expected = {0: "first", 2: "crossover"}.get(len(parents))
        assert each["origin"] == expected or (
            each["origin"] == ("copy" if row["genome"] == parents[0] else "mutation")
        )
        origins.add(each["origin"])
        for name in ("species", "fitness", "coverage_line", "coverage_ends"):
            assert each[name] == row[name]
    assert origins == {"first", "copy", "mutation", "crossover"}


def test_the_way_to_the_champion_is_its_ancestors_and_no_others(folder):
    rows = by_key(folder)
    for (condition, replicate), frame in folder.derive("lineage").group_by("condition", "replicate"):
        of_run = {key[2:]: row for key, row in rows.items() if key[:2] == (condition, replicate)}
        champion = max(of_run, key=lambda key: of_run[key]["coverage_line"])
        now, expected = {champion}, set()
        while now:
            expected |= now
            now = {(g - 1, parent) for g, k in now for parent in of_run[g, k]["parents"]}
        found = frame.filter("to_champion")
        assert set(zip(found["generation"], found["individual"], strict=True)) == expected


@pytest.mark.parametrize("what", DERIVED)
def test_one_run_is_the_same_by_itself_and_however_the_chunks_are_cut(folder, tmp_path, what):
    whole = folder.derive(what)
    assert whole.schema == DERIVED[what].schema
    for replicate in (0, 3, 4):
        one = folder.derive(what, "novelty", [replicate])
        assert one.equals(whole.filter(condition="novelty", replicate=replicate))
    other = run_study(parse_study(STUDY, "tiny.toml"), tmp_path / "other", chunk=5).folder
    assert other.derive(what).equals(whole)
    assert folder.derive(what, "novelty", [99]).is_empty()


@pytest.mark.parametrize("what", DERIVED)
def test_the_parquet_file_holds_the_frame(folder, tmp_path, what):
    path = tmp_path / "frame.parquet"
    path.write_text("old")
    assert folder.write_derived(what, path) == folder.derive(what).height
    assert pl.read_parquet(path).equals(folder.derive(what))
    assert folder.write_derived(what, path, "novelty", [1, 2]) > 0
    assert pl.read_parquet(path).equals(folder.derive(what, "novelty", [1, 2]))
    assert folder.write_derived(what, path, "novelty", [99]) == 0
    assert pl.read_parquet(path).schema == DERIVED[what].schema
    assert list(tmp_path.iterdir()) == [path]


def test_wrong_names_and_paths_of_derived_frames_are_refused(folder, tmp_path):
    with pytest.raises(ValueError, match="Did you mean 'lineage'"):
        folder.derive("linage")
    with pytest.raises(ValueError, match="Did you mean 'novelty'"):
        folder.derive("lineage", "novelti")
    with pytest.raises(RecordError, match="in a folder of a study"):
        folder.write_derived("lineage", folder.path / "trials" / "lineage.parquet")
    with pytest.raises(RecordError, match="Could not write"):
        folder.write_derived("lineage", tmp_path / "no" / "where.parquet")
    (tmp_path / "folder").mkdir()
    with pytest.raises(RecordError, match="Could not write"):
        folder.write_derived("lineage", tmp_path / "folder")
    assert [each.name for each in tmp_path.iterdir()] == ["folder"]


def test_rows_of_runs_of_different_length_are_not_mixed_up(tmp_path):
    folder = make_folder(tmp_path / "r", n_chunks=1, size=2)
    folder.publish("coverage", 2, make_rows(first=2, n=1, generations=4, individuals=3), HASH)
    whole = folder.derive("lineage")
    assert whole.filter(replicate=2)["generation"].max() == 3
    parents = folder.read(columns=["parents"])["parents"]
    assert whole["parent_1"].to_list() == parents.list.get(0, null_on_oob=True).to_list()


def test_every_column_is_described():
    for what in DERIVED:
        assert all(text.endswith(".") for _, _, text in derived_table(what))
