"""Tables of scores as people and other programs write them."""

import json

import pytest

from realitygap.errors import TableError
from realitygap.logs import read_scores


def written(folder, text, name="scores.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("controller", ["controller", "policy", "Policy"])
def test_rows_have_the_values_of_their_columns(tmp_path, separator, controller):
    lines = [
        (controller, "platform", "task", "trial", "block", "score"),
        ("a", "sim", "pick", "1", "b1", "0.25"),
        ("b", "real", "pick", "", "", "1e-1"),
    ]
    path = written(tmp_path, "\ufeff" + "\n".join(separator.join(line) for line in lines))
    first, second = read_scores(path)
    assert (first.controller, first.platform, first.task, first.trial, first.block) == (
        "a",
        "sim",
        "pick",
        "1",
        "b1",
    )
    assert (first.score, first.decimals, first.is_mean) == (0.25, 2, False)
    assert (second.score, second.is_mean, second.n) == (0.1, True, None)


def test_words_are_successes_and_a_named_column_is_the_score(tmp_path):
    path = written(tmp_path, "policy,platform,trial,success,time\na,sim,1,True,3\na,sim,2,false,4\n")
    assert [row.score for row in read_scores(path)] == [1.0, 0.0]
    assert [row.score for row in read_scores(path, score="time")] == [3.0, 4.0]


def test_controller_and_platform_of_a_whole_table_may_be_given(tmp_path):
    path = written(tmp_path, "trial,score\n1,0.5\n")
    (row,) = read_scores(path, platform="arm", controller="push")
    assert (row.platform, row.controller) == ("arm", "push")


def test_a_block_makes_a_row_a_trial(tmp_path):
    (row,) = read_scores(written(tmp_path, "policy,platform,block,score\na,sim,left,0.5\n"))
    assert (row.trial, row.block, row.is_mean) == ("left", "left", False)


REFUSED = {
    "no platform": ("policy,score\na,0.5\n", "no column platform. If all rows are of one"),
    "no controller": ("platform,score\nsim,0.5\n", "controller=NAME"),
    "no score": ("policy,platform,value\na,sim,0.5\n", "score=COLUMN"),
    "percent": ("policy,platform,score\na,sim,85%\n", "line 2: score is '85%'.* Percent is not guessed"),
    "a comma": ("policy;platform;score\na;sim;0,5\n", "score is '0,5'"),
    "nan": ("policy,platform,score\na,sim,nan\n", "score is 'nan'"),
    "infinity": ("policy,platform,score\na,sim,inf\n", "score is 'inf'"),
    "underscore": ("policy,platform,score\na,sim,1_0\n", "score is '1_0'"),
    "no name": ("policy,platform,score\n,sim,0.5\n", "policy is empty"),
    "n": ("policy,platform,score,n\na,sim,0.5,2.5\n", "n is '2.5'"),
    "a value too many": ("policy,platform,score\na,sim,0.5,1\n", "line 2: 4 values, expected 3"),
    "the same column twice": ("policy,platform,score,score\na,sim,0.5,1\n", "two columns 'score'"),
    "no rows": ("policy,platform,score\n", "no rows"),
    "nothing": ("", "no rows"),
    "a quote": ('policy,platform,score\n"a,sim,0.5\n', "Save the table as CSV"),
}


@pytest.mark.parametrize(("text", "message"), REFUSED.values(), ids=list(REFUSED))
def test_a_wrong_table_is_refused_with_its_place(tmp_path, text, message):
    with pytest.raises(TableError, match=message):
        read_scores(written(tmp_path, text))


def test_all_wrong_values_are_listed(tmp_path):
    rows = "".join(f"a,sim,x{k}\n" for k in range(30))
    with pytest.raises(TableError) as refused:
        read_scores(written(tmp_path, f"policy,platform,score\n{rows}"))
    assert str(refused.value).count("\n") == 20
    assert "And 10 more." in str(refused.value)


@pytest.mark.parametrize("name", ["none.csv", "."])
def test_a_file_that_cannot_be_read_is_refused(tmp_path, name):
    with pytest.raises(TableError, match="Name a table of scores"):
        read_scores(tmp_path / name)


def test_text_that_is_not_utf8_is_refused(tmp_path):
    path = tmp_path / "scores.csv"
    path.write_bytes(b"policy,platform,score\n\xff,sim,1\n")
    with pytest.raises(TableError, match="UTF-8"):
        read_scores(path)


FIELDTRIAL = (
    "trial_id,seq,block,replicate,condition,arm,status,attempt,stage_index,success,termination,duration_s,failure_tags,"
    "operator,rig,session_id,started_at,origin,invalid_reason,notes\n"
    "t1,0,0,1,left,new,completed,1,2,True,success,10.0,,anna,rig,s1,2026-01-01T00:00:00,console,,\n"
    "t2,1,0,1,left,old,completed,1,0,False,timeout,10.0,,anna,rig,s1,2026-01-01T00:00:00,console,,\n"
    "t3,2,1,1,right,new,invalid,1,,,,10.0,,anna,rig,s1,2026-01-01T00:00:00,console,bumped,\n"
    "t4,3,1,2,right,new,completed,1,1,False,timeout,10.0,,anna,rig,s1,2026-01-01T00:00:00,console,,\n"
)
"""As `fieldtrial export` 0.3.0 writes it."""


def test_export_of_fieldtrial_is_read_without_invalid_trials(tmp_path):
    rows = read_scores(written(tmp_path, FIELDTRIAL), platform="real")
    assert [(row.controller, row.trial, row.block, row.score) for row in rows] == [
        ("new", "t1", "left/1", 1.0),
        ("old", "t2", "left/1", 0.0),
        ("new", "t4", "right/2", 0.0),
    ]
    staged = read_scores(written(tmp_path, FIELDTRIAL), platform="real", score="stage_index")
    assert [row.score for row in staged] == [2.0, 0.0, 1.0]


def test_episode_records_of_robostats_are_read(tmp_path):
    record = {"schema_version": 1, "policy_id": "pi", "task_id": "bowl", "success": True, "scenario_id": "clean/1",
              "episode_idx": None, "seed": None, "success_detail": None, "run_id": None}  # fmt: skip
    lines = [record, record | {"success": False, "scenario_id": None}]
    path = written(tmp_path, "\n".join(map(json.dumps, lines)), "pi.jsonl")
    first, second = read_scores(path, platform="sim")
    assert (first.controller, first.task, first.block, first.score) == ("pi", "bowl", "clean/1", 1.0)
    assert not second.is_mean
    assert second.block == ""


def test_lines_that_are_no_objects_are_refused(tmp_path):
    for text in ("[1]", "{", "1" * 400):
        with pytest.raises(TableError, match=r"line 1: .*xpected a JSON object"):
            read_scores(written(tmp_path, text, "pi.jsonl"))
