"""`realitygap compare` as a user meets it."""

import json
from pathlib import Path

import pytest

import realitygap
from realitygap.orders import read_order
from tests.cli.invoked import printed, refused

SIMPLER = Path(__file__).parent.parent / "data" / "simpler" / "scores.csv"


@pytest.fixture
def table(tmp_path):
    lines = ["controller,platform,trial,score"]
    for k in range(8):
        for trial in range(4):
            score = 0.1 * k + 0.01 * trial
            lines += [f"c{k},mujoco,{trial},{score:.2f}", f"c{k},arm,{trial},{score + 0.1:.2f}"]
    path = tmp_path / "scores.csv"
    path.write_text("\n".join(lines))
    return path


def test_each_task_has_its_own_table_and_common_reasons_come_once():
    text = printed("compare", SIMPLER)
    assert text.count("Gap in score: sim against real, task ") == 9
    assert text.count("are means, without trials") == 1
    assert "rank violation (MMRV)  0.111 [" in text
    assert "octo-base is 0.333 better than rt-1-begin on real, and not on sim" in text


def test_full_output_has_all_measures_but_those_of_paths(table):
    text = printed("compare", table, "--sim", "mujoco", "--full", "--margin", "0.2")
    assert text.count("No pair is violated") == 1
    for measure in realitygap.gap.SHOWN:
        assert (measure.row in text) != measure.name.startswith("energy"), measure.name


def test_json_has_all_numbers_and_the_order(table, tmp_path):
    values = json.loads(printed("compare", table, "--sim", "mujoco", "--json"))
    (task,) = values["tasks"]
    assert task["level"]["estimate"] == pytest.approx(0.1)
    assert task["rms"]["estimate"] == pytest.approx(0.1, abs=0.01)
    assert (task["source"], task["target"], task["labels"]) == ("mujoco", "arm", ["SIM", "REAL"])
    assert [each["name"] for each in task["controllers"]] == [f"c{k}" for k in range(8)]
    (tmp_path / "gap.json").write_text(json.dumps(values))
    order = read_order(tmp_path / "gap.json")
    assert realitygap.compare_scores(order).to_dict()["tasks"] == values["tasks"]


def test_python_gives_the_same_from_the_fields(table):
    compared = realitygap.compare_scores(str(table), sim="mujoco", real="arm")
    assert compared.gaps[0].result.level.value == pytest.approx(0.1)
    assert repr(compared).startswith("ComparedScores(mujoco → arm: level 0.100 [")
    assert repr(realitygap.compare_scores(SIMPLER)) == "ComparedScores(sim → real, 9 tasks)"
    assert realitygap.compare_scores([table], sim="mujoco").gaps[0].result.target == "arm"


def test_platforms_of_whole_files_are_named_before_them(table, tmp_path):
    halves = []
    for name in ("mujoco", "arm"):
        half = tmp_path / f"{name}.csv"
        lines = [line for line in table.read_text().splitlines() if "platform" in line or f",{name}," in line]
        half.write_text("\n".join(line.replace(",platform", "").replace(f",{name},", ",") for line in lines))
        halves.append(half)
    text = printed("compare", f"sim={halves[0]}", f"real={halves[1]}")
    assert text.startswith("Gap in score: sim against real\n")


def test_successes_print_each_controller_with_its_test(tmp_path):
    lines = ["policy,platform,success,n"]
    lines += [
        f"p{k},{name},{(k + shift) / 20},20" for k in (2, 9, 15) for name, shift in (("sim", 4), ("real", 0))
    ]
    path = tmp_path / "rates.csv"
    path.write_text("\n".join(lines))
    text = printed("compare", path, "--binary")
    assert text.startswith("Gap in success: sim against real")
    assert text.count("  p = ") == 3
    assert "Boschloo" in text
    assert "p = " not in printed("compare", path, "--score", "success")


def test_without_tasks_the_option_is_refused(table):
    assert "The table has no column task" in refused("compare", table, "--sim", "mujoco", "--task", "pick")


REFUSED = {
    "no roles": ((), "The platforms are mujoco, arm. Name the one that predicts"),
    "no such platform": (("--sim", "mujocco"), "Did you mean 'mujoco'"),
    "the same": (("--sim", "arm", "--real", "arm"), "--real is arm, expected another platform"),
    "range": (("--sim", "mujoco", "--range", "1:0"), "--range is '1:0', expected LOW:HIGH"),
    "a small range": (("--sim", "mujoco", "--range", "0:0.5"), "expected 0 to 0.5"),
    "margin": (("--sim", "mujoco", "--margin", "0"), "--margin is 0"),
    "task": (("--sim", "mujoco", "--task", "pick"), "There is no task 'pick'"),
    "column": (("--sim", "mujoco", "--score", "scor"), "Did you mean 'score'"),
}


@pytest.mark.parametrize(("words", "message"), REFUSED.values(), ids=list(REFUSED))
def test_a_wrong_option_is_refused_with_what_to_do(table, words, message):
    assert message in refused("compare", table, *words)


def test_a_table_of_one_platform_is_refused(tmp_path):
    path = tmp_path / "scores.csv"
    path.write_text("controller,platform,score\na,sim,0.5\n")
    assert "All scores are of the platform sim" in refused("compare", path)
    assert "There is no file" in refused("compare", tmp_path / "none.csv")


def test_file_of_trials_is_refused_with_the_commands_that_compare_it(tmp_path):
    from realitygap.records import write_observations
    from tests.records.test_observations_file import HEAD, trial

    for name in ("trials.sqlite", "trials.jsonl"):
        file = tmp_path / name
        write_observations(file, HEAD, [trial(0)])
        for table in (file, f"real={file}"):
            text = refused("compare", table)
            assert f"gap sim recorded:{file}" in text
            assert f"trials advise {file}" in text
