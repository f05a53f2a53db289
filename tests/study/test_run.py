"""Carrying out a study: the same results whatever happens on the way."""

import random
import shutil
import subprocess
import sys
import time

import polars as pl
import pytest

from realitygap.errors import OutgrownError, RecordError, StudyError
from realitygap.records import ResultsFolder
from realitygap.study import load_study, parse_study, run_study

SMALL = """
[study]
name = "small"
seed = 3
replicates = 12
[platform.jyro]
steps = 30
[[condition]]
name = "coverage"
[[condition]]
name = "novelty"
selection = "novelty"
noise = 0.5
[[condition]]
name = "random"
selection = "random"
"""


@pytest.fixture(scope="module")
def study():
    return parse_study(SMALL, "small.toml")


@pytest.fixture(scope="module")
def undisturbed(study, tmp_path_factory):
    return run_study(study, tmp_path_factory.mktemp("study") / "undisturbed", threads=1).folder


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("chunk", [1, 5, 12, None])
def test_digest_does_not_depend_on_threads_or_chunks(study, undisturbed, tmp_path, threads, chunk):
    result = run_study(study, tmp_path / "r", threads=threads, chunk=chunk)
    assert result.n_computed == result.n_runs == 36
    assert result.folder.digest() == undisturbed.digest()


def test_another_seed_gives_another_digest(undisturbed, tmp_path):
    other = run_study(parse_study(SMALL, "small.toml", seed=4), tmp_path / "r")
    assert other.folder.digest() != undisturbed.digest()


def test_a_study_interrupted_by_ctrl_c_goes_on(study, undisturbed, tmp_path):
    told = []

    def stop(progress):
        told.append(progress)
        if len(told) in (4, 9):
            raise KeyboardInterrupt

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            run_study(study, tmp_path / "r", chunk=2, tell=stop)
    result = run_study(study, tmp_path / "r", chunk=5)
    assert 0 < result.n_computed < result.n_runs
    assert result.folder.digest() == undisturbed.digest()


ASKING = """
import sys
from realitygap.study import load_study, run_study

def ask(progress):
    print("chunk", flush=True)
    sys.stdin.readline()

run_study(load_study(sys.argv[1]), sys.argv[2], chunk=1, threads=2, tell=ask)
"""
"""A study that waits for an answer after each chunk, so that it cannot end before it is killed."""


@pytest.mark.slow
def test_a_study_killed_at_any_moment_goes_on(study, undisturbed, tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    out = tmp_path / "r"
    rng = random.Random(5)
    for _ in range(4):
        command = [sys.executable, "-c", ASKING, str(path), str(out)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
            for _ in range(rng.randint(1, 3)):
                assert process.stdout.readline() == "chunk\n"
                process.stdin.write("go on\n")
                process.stdin.flush()
            time.sleep(rng.uniform(0.0, 0.01))
            process.kill()
    result = run_study(study, out)
    assert 0 < result.n_computed < result.n_runs
    assert result.folder.digest() == undisturbed.digest()
    assert not list(out.glob("trials/*.tmp")), "what the killed runs left half written is removed"


def test_more_replicates_extend_the_results(study, undisturbed, tmp_path):
    first = run_study(parse_study(SMALL, "small.toml", replicates=5), tmp_path / "r", chunk=2)
    assert first.n_computed == 15
    result = run_study(study, tmp_path / "r")
    assert result.n_computed == 21
    assert result.folder.digest() == undisturbed.digest()
    assert result.folder.description["replicates"] == 12


def test_fewer_replicates_leave_what_is_there(study, undisturbed, tmp_path):
    run_study(study, tmp_path / "r")
    again = run_study(parse_study(SMALL, "small.toml", replicates=2), tmp_path / "r")
    assert again.n_computed == 0
    assert again.folder.description["replicates"] == 12
    assert again.folder.digest() == undisturbed.digest()


def test_new_conditions_extend_the_results(undisturbed, tmp_path):
    only_first = SMALL.split('[[condition]]\nname = "novelty"')[0]
    run_study(parse_study(only_first, "small.toml"), tmp_path / "r")
    result = run_study(parse_study(SMALL, "small.toml"), tmp_path / "r")
    assert result.n_computed == 24
    assert result.folder.digest() == undisturbed.digest()
    run_study(parse_study(only_first, "small.toml"), tmp_path / "r")
    assert ResultsFolder.open(tmp_path / "r").digest() == undisturbed.digest()


def test_a_new_condition_whose_files_would_be_those_of_another_is_refused(undisturbed, tmp_path):
    """On a disk that does not tell capitals, chunks of `Novelty` would take the place of those of `novelty`."""
    path = tmp_path / "r"
    run_study(parse_study(SMALL, "small.toml"), path)
    renamed = parse_study(SMALL.replace('name = "novelty"', 'name = "Novelty"'), "small.toml")
    with pytest.raises(StudyError, match="'Novelty' would share files with the existing condition 'novelty'"):
        run_study(renamed, path)
    assert ResultsFolder.open(path).digest() == undisturbed.digest()
    assert not list(path.glob("trials/Novelty*"))
    assert run_study(renamed, path, fresh=True).n_computed == 36


def test_a_changed_condition_is_refused_with_the_difference(study, undisturbed, tmp_path):
    run_study(study, tmp_path / "r")
    changed = parse_study(SMALL.replace("noise = 0.5", "noise = 0.6"), "small.toml")
    with pytest.raises(StudyError, match=r"novelty: noise is 0.5 there, 0.6 here") as caught:
        run_study(changed, tmp_path / "r")
    assert "--fresh" in str(caught.value)
    assert ResultsFolder.open(tmp_path / "r").digest() == undisturbed.digest()


@pytest.mark.parametrize(
    ("change", "difference"),
    [
        (('name = "small"', 'name = "other"'), "the study's name is 'small' there, 'other' here"),
        (("seed = 3", "seed = 4"), "the study's seed is 3 there, 4 here"),
        (("seed = 3", "seed = 3\npair = false"), "the study's pair is True there, False here"),
    ],
)
def test_another_study_does_not_take_a_folder_over(study, undisturbed, tmp_path, change, difference):
    """Its conditions were added, and the folder then went by its name and seed."""
    run_study(study, tmp_path / "r")
    other = SMALL.split("[[condition]]")[0].replace(*change) + '[[condition]]\nname = "new"\n'
    with pytest.raises(StudyError, match=difference):
        run_study(parse_study(other, "other.toml"), tmp_path / "r")
    there = ResultsFolder.open(tmp_path / "r")
    assert there.digest() == undisturbed.digest()
    assert (there.description["name"], there.description["seed"]) == ("small", 3)


@pytest.mark.parametrize(
    "change",
    [("noise = 0.5", "noise = 0.6"), ("seed = 3", "seed = 4"), ('name = "novelty"', 'name = "other"')],
)
def test_a_study_that_ended_before_its_first_result_leaves_its_folder_free(
    study, undisturbed, tmp_path, change
):
    """A Python task that fails in the first trials, for example, is repaired, and the same command runs it."""
    failed = parse_study(SMALL.replace(*change), "small.toml", replicates=50)
    ResultsFolder.create(tmp_path / "r", failed.description())
    result = run_study(study, tmp_path / "r")
    assert result.folder.digest() == undisturbed.digest()
    assert result.folder.description == undisturbed.description


def test_a_study_may_get_another_name_with_all_its_conditions(study, undisturbed, tmp_path):
    run_study(study, tmp_path / "r")
    renamed = run_study(parse_study(SMALL.replace('"small"', '"renamed"'), "small.toml"), tmp_path / "r")
    assert renamed.n_computed == 0
    assert renamed.folder.description["name"] == "renamed"
    assert renamed.folder.digest() == undisturbed.digest()


def test_fresh_starts_anew(study, undisturbed, tmp_path):
    run_study(parse_study(SMALL, "small.toml", seed=4), tmp_path / "r")
    result = run_study(study, tmp_path / "r", fresh=True)
    assert result.n_computed == 36
    assert result.folder.digest() == undisturbed.digest()


def test_fresh_never_deletes_a_ledger(study, tmp_path):
    run_study(study, tmp_path / "r")
    (tmp_path / "r" / "ledger.sqlite").write_bytes(b"trials of somebody's life")
    with pytest.raises(RecordError, match="ledger"):
        run_study(study, tmp_path / "r", fresh=True)
    assert list((tmp_path / "r" / "trials").glob("*.parquet"))


def test_a_folder_of_something_else_is_refused(study, tmp_path):
    (tmp_path / "thesis.tex").write_text("chapter 1")
    with pytest.raises(RecordError, match=r"thesis\.tex"):
        run_study(study, tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["thesis.tex"]


def test_a_torn_chunk_is_named(study, tmp_path):
    run_study(study, tmp_path / "r", chunk=4)
    victim = sorted((tmp_path / "r" / "trials").glob("*.parquet"))[3]
    victim.write_bytes(victim.read_bytes()[:-100])
    with pytest.raises(RecordError) as caught:
        run_study(study, tmp_path / "r")
    assert victim.name in str(caught.value)
    victim.unlink()
    assert run_study(study, tmp_path / "r").n_computed == 4


def test_paired_conditions_draw_the_same_random_numbers(tmp_path):
    text = '[study]\nname = "p"\nreplicates = 4\npair = {pair}\n[[condition]]\nname = "a"\n[[condition]]\nname = "b"\n'
    same = {}
    for pair in ("true", "false"):
        rows = run_study(parse_study(text.format(pair=pair), "p.toml"), tmp_path / pair).folder.read()
        a, b = (rows.filter(pl.col("condition") == name).drop("condition") for name in "ab")
        same[pair] = a.equals(b)
    assert same == {"true": True, "false": False}


def test_results_open_in_polars_alone(undisturbed):
    rows = pl.scan_parquet(f"{undisturbed.path}/trials/*.parquet").collect()
    assert rows.height == 3 * 12 * 40
    assert rows.columns == [
        "condition",
        "replicate",
        "generation",
        "individual",
        "species",
        "parents",
        "fitness",
        "novelty",
        "coverage_line",
        "coverage_ends",
        "cells",
        "stalls",
        "nodes",
        "connections",
        "genome",
        "key",
    ]
    assert rows["cells"].dtype == pl.List(pl.UInt8)


def test_progress_counts_what_was_there(study, tmp_path):
    run_study(parse_study(SMALL, "small.toml", replicates=5), tmp_path / "r")
    told = []
    run_study(study, tmp_path / "r", tell=told.append)
    assert (told[0].n_done, told[0].n_computed) == (15, 0)
    assert (told[-1].n_done, told[-1].n_computed, told[-1].n_runs) == (36, 21, 36)


@pytest.mark.parametrize("wrong", [{"threads": 0}, {"chunk": 0}])
def test_a_count_below_one_is_refused(study, tmp_path, wrong):
    with pytest.raises(ValueError, match="expected at least 1"):
        run_study(study, tmp_path / "r", **wrong)


@pytest.mark.parametrize("wrong", [{"threads": 1.5}, {"threads": "2"}, {"chunk": 1.5}, {"chunk": True}])
def test_a_count_that_is_no_whole_number_is_refused(study, tmp_path, wrong):
    with pytest.raises(TypeError, match="expected a whole number"):
        run_study(study, tmp_path / "r", **wrong)
    assert not (tmp_path / "r").exists()


def test_seed_beside_a_resolved_study_is_refused(study, tmp_path):
    with pytest.raises(ValueError, match="this study has its own"):
        run_study(study, tmp_path / "r", seed=1)


def test_the_log_says_when_and_where(undisturbed):
    start, end = undisturbed.read_log()
    assert start["event"] == "start"
    assert start["missing_runs"] == 36
    assert start["machine"]["processors"] >= 1
    assert (end["event"], end["computed_runs"]) == ("end", 36)


def test_paper_study_is_carried_out_by_name(tmp_path):
    result = run_study("paper", tmp_path / "r", replicates=1)
    assert result.n_runs == 9
    assert result.folder.description["title"] == load_study("paper").about.title


def test_a_genome_beyond_all_room_ends_the_sitting_and_is_in_the_log(tmp_path, monkeypatch):
    monkeypatch.setattr("realitygap.runs._runs.MOST_GENES", 8)
    monkeypatch.setattr("realitygap.runs._runs.MOST_HIDDEN", 1)
    monkeypatch.setattr("realitygap.runs._runs.FIRST_ROOM", 1)
    monkeypatch.setattr("realitygap.runs._runs.FIRST_HIDDEN_ROOM", 1)
    grown = SMALL.replace("[platform", "[neat]\nadd_node = 0.9\n[platform", 1)
    with pytest.raises(OutgrownError, match="grew beyond 8 connection genes"):
        run_study(parse_study(grown, "small.toml"), tmp_path / "r")
    events = ResultsFolder.open(tmp_path / "r").read_log()
    assert [each["event"] for each in events] == ["start", "outgrown"]
    assert "Lower add_node" in events[-1]["message"]


AFTER_A_STUDY = """
import multiprocessing, sys
import realitygap

def work(name):
    return realitygap.run_study("paper", name, replicates=1).folder.digest()

def summary(name):
    return str(realitygap.summarize(name))

if __name__ == "__main__":
    realitygap.run_study("paper", "first", replicates=1, threads=2)
    with multiprocessing.get_context(sys.argv[1]).Pool(1) as pool:
        for function, name in ((work, "second"), (summary, "first")):
            try:
                pool.apply(function, [name])
                print("done")
            except RuntimeError as error:
                print(error)
"""


@pytest.mark.slow
def test_forked_process_refuses_to_wait_for_threads_of_its_parent(tmp_path):
    """It never ended after the parent had run a study: a fork lacks the threads of polars."""
    file = tmp_path / "program.py"
    file.write_text(AFTER_A_STUDY)
    for method, text in (("fork", 'get_context("spawn")'), ("spawn", "done")):
        for folder in tmp_path.glob("*/"):
            shutil.rmtree(folder)
        done = subprocess.run(
            [sys.executable, file, method],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        assert done.stdout.count(text) == 2, done.stdout + done.stderr
