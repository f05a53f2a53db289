"""`realitygap audit-results` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from realitygap.report import audit_results
from tests.cli.test_commands import one_message, realitygap

pytestmark = pytest.mark.slow

EXAMPLE = Path(__file__).parents[2] / "examples" / "table-2.csv"


def test_tables_say_what_can_be_claimed():
    done = realitygap("audit-results", str(EXAMPLE), "--denominator", "72")
    assert done.returncode == 0, done.stderr
    for text in (
        "Physical robot",
        ".154",
        "no k/72",
        "cut, not rounded",
        "11/72",
        "no claim",
        "From 5 runs each on",
    ):
        assert text in done.stdout


def test_without_a_denominator_values_are_not_judged():
    done = realitygap("audit-results", str(EXAMPLE))
    assert done.returncode == 0
    assert "no k/" not in done.stdout


def test_json_is_what_python_gives():
    done = realitygap("audit-results", str(EXAMPLE), "--denominator", "72", "--json")
    assert json.loads(done.stdout).items() >= audit_results(EXAMPLE, denominator=72).to_dict().items()


@pytest.mark.parametrize(
    ("content", "texts"),
    [
        ("condition,run\na,1\n", ["no column value"]),
        ("", ["is empty"]),
        ("condition,run,value\na,1,x\nb,1,y\n", ["line 2", "line 3", "not a number"]),
    ],
)
def test_wrong_input_gets_one_message(content, texts, tmp_path):
    (tmp_path / "t.csv").write_text(content)
    one_message(realitygap("audit-results", "t.csv", cwd=tmp_path), *texts)


def test_a_denominator_below_1_is_wrong_usage():
    assert realitygap("audit-results", str(EXAMPLE), "--denominator", "0").returncode == 2


def test_a_large_table_says_how_far_it_is(tmp_path):
    lines = [f"{name},{k},{k % 7}" for name in "ab" for k in range(500)]
    (tmp_path / "t.csv").write_text("\n".join(["condition,run,value", *lines]))
    done = realitygap("audit-results", "t.csv", "--json", cwd=tmp_path)
    assert done.stderr == "Comparing pair 1 of 1 ...\n"
    assert json.loads(done.stdout)["pairs"]
    assert realitygap("audit-results", str(EXAMPLE)).stderr == ""
