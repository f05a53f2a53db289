from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realitygap.errors import TableError
from realitygap.report import AuditProgress, audit_notes, audit_results
from realitygap.report._audit import doubt

EXAMPLE = Path(__file__).parents[2] / "examples" / "table-2.csv"


def write(path: Path, *lines: str, header: str = "condition,run,value") -> Path:
    path.write_text("\n".join([header, *lines]) + "\n", "utf-8")
    return path


def rows(**conditions) -> list[str]:
    return [f"{name},{k},{value}" for name, values in conditions.items() for k, value in enumerate(values)]


@pytest.fixture(scope="module")
def audit():
    return audit_results(EXAMPLE, denominator=72)


def test_values_that_cannot_be_are_found(audit):
    assert [(each.line, each.text, each.problem, each.nearest) for each in audit.doubtful] == [
        (5, ".154", "impossible", 11),
        (7, ".166", "cut", 12),
        (9, ".432", "impossible", 31),
        (11, ".180", "cut", 13),
    ]


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (".153", None), ("0.1528", None), (".152", ("cut", 11)), (".154", ("impossible", 11)), ("1", None),
        ("0", None), (".167", None), (".168", ("impossible", 12)), ("1.2", ("impossible", 72)),
        ("-0.1", ("impossible", 0)), (".2", None), ("0.348", ("raised", 25)),
    ],
)  # fmt: skip
def test_each_way_of_being_wrong_has_its_word(text, found):
    assert doubt(text, 72) == found


def test_half_way_may_go_either_way():
    assert doubt("0.12", 8) is None
    assert doubt("0.13", 8) is None


def test_every_share_as_rounded_is_accepted():
    for n in (7, 40, 72, 99):
        for digits in (3, 4, 6):
            assert not any(doubt(f"{k / n:.{digits}f}", n) for k in range(n + 1))


def test_three_runs_against_three_show_nothing(audit):
    assert len(audit.pairs) == 6
    for pair in audit.pairs:
        assert pair.smallest_p == pytest.approx(0.1)
        assert pair.p >= 0.1
        assert not pair.can_claim
        assert pair.a12.ends is None
        assert pair.difference.ends is None
        assert pair.runs_for_a_claim == 5
        assert pair.verdict == "no claim possible; 5 runs each at least"
        assert pair.detectable > 3
    first = audit.pairs[0]
    assert (first.one, first.other, first.a12.value) == ("Physical robot", "10% Noise (Sim)", 1.0)
    assert (first.p, first.p_holm) == (pytest.approx(0.1), pytest.approx(0.6))
    assert audit.conditions[0].mean == pytest.approx(0.449)
    assert {each.median_low for each in audit.conditions} == {None}
    assert audit.runs_needed["large"] < audit.runs_needed["medium"] < audit.runs_needed["small"]


def test_notes_say_what_cannot_be_said(audit):
    notes = " ".join(audit_notes(audit))
    assert "4 of 12 values are no k/72" in notes
    assert "3 runs against 3 cannot give a p below 0.1" in notes
    assert "From 5 runs each on" in notes
    assert "no 95 % interval of the median" in notes


def test_enough_runs_show_what_is_there(tmp_path):
    rng = np.random.default_rng(5)
    low, high = rng.integers(10, 30, 12) / 72, rng.integers(40, 60, 12) / 72
    audit = audit_results(write(tmp_path / "t.csv", *rows(low=low, high=high)))
    (pair,) = audit.pairs
    assert pair.verdict == "high above low"
    assert pair.difference.high < 0
    assert pair.a12.value == 0
    assert pair.a12.method == "Newcombe", "no resample differs where all runs are above"
    assert audit.denominator is None
    assert audit.doubtful == []
    assert audit.conditions[0].median_low is not None


def test_four_runs_have_newcombes_interval(tmp_path):
    audit = audit_results(write(tmp_path / "t.csv", *rows(a=[1, 2, 3, 4], b=[5, 6, 7, 8])))
    (pair,) = audit.pairs
    assert pair.p == pytest.approx(2 / 70)
    assert pair.a12.method == "Newcombe"
    assert pair.a12.high < 0.5
    assert pair.verdict == "b above a"


def test_order_of_columns_other_columns_and_spaces_do_not_matter(tmp_path):
    plain = audit_results(EXAMPLE)
    lines = [f"  {run} , {value},note, {name}" for name, run, value in
             (line.rsplit(",", 2) for line in EXAMPLE.read_text("utf-8").splitlines()[1:])]  # fmt: skip
    path = tmp_path / "t.csv"
    path.write_bytes(("﻿Run,Value,Note,Condition\r\n" + "\r\n".join(lines) + "\r\n\r\n").encode())
    assert audit_results(path) == plain


@pytest.mark.parametrize(
    ("header", "lines", "texts"),
    [
        ("condition,value", ["a,1"], ["no column run", "'condition', 'value'"]),
        ("a,b", ["1,2"], ["no column condition and no column run and no column value"]),
        ("condition,run,value", [], ["no line below"]),
        ("condition,run,value", ["a,0,1", "a,1,2"], ["one condition only ('a')"]),
        ("condition,run,value", ["a,0,x", "a,1,nan", "b,0,", "b,1,1_0", "b,2,inf"],
         ["line 2: the value 'x'", "line 3: the value 'nan'", "line 4: no value", "line 5", "line 6"]),
        ("condition,run,value", ["a,0,1", "a,0,2", "b,0,3"], ["line 3", "has run '0' already, in line 2"]),
        ("condition,run,value", [",0,1", "a,,1"], ["line 2: no condition", "line 3: no run"]),
        ("condition,run,value,value", ["a,0,1,1"], ["two columns 'value'"]),
    ],
)  # fmt: skip
def test_wrong_input_gets_one_message_with_everything(tmp_path, header, lines, texts):
    path = write(tmp_path / "t.csv", *lines, header=header)
    with pytest.raises(TableError) as error:
        audit_results(path)
    assert str(path) in str(error.value)
    for text in texts:
        assert text in str(error.value)


def test_many_mistakes_are_counted(tmp_path):
    with pytest.raises(TableError, match="and 10 more"):
        audit_results(write(tmp_path / "t.csv", *rows(a=["x"] * 30)))


def test_files_that_are_no_tables(tmp_path):
    for name, content, text in (("e", b"", "is empty"), ("b", b"\xff\xfe\x00", "not a text file")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(TableError, match=text):
            audit_results(tmp_path / name)
    with pytest.raises(TableError, match="cannot be read"):
        audit_results(tmp_path / "nowhere.csv")
    with pytest.raises(ValueError, match="denominator is 0"):
        audit_results(EXAMPLE, denominator=0)


def test_progress_is_told_before_each_two_conditions(tmp_path):
    """Thousands of runs kept silent for minutes."""
    told: list[AuditProgress] = []
    audit_results(write(tmp_path / "t.csv", *rows(a=[1, 2], b=[2, 3], c=[3, 4])), tell=told.append)
    assert [(each.n_done, each.n_pairs, each.n_runs) for each in told] == [(0, 3, 6), (1, 3, 6), (2, 3, 6)]


def test_a_long_header_is_shortened_in_the_message(tmp_path):
    header = ",".join(f"column{k}" for k in range(500)) + "," + "x" * 5000
    with pytest.raises(TableError, match="has no column condition") as caught:
        audit_results(write(tmp_path / "t.csv", header=header))
    assert "'column0', 'column1'" in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize("denominator", [1.5, "72"])
def test_a_denominator_is_a_whole_number(denominator):
    with pytest.raises(TypeError, match=r"denominator is .*, expected a whole number"):
        audit_results(EXAMPLE, denominator=denominator)
