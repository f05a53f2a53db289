"""Text tables are read whatever their separator, header, and marks; mistakes have one message."""

import gzip

import numpy as np
import pytest

from realitygap.errors import LogError
from realitygap.logs import TextFormat, open_source


def read(path, columns, rows="", **text):
    source = open_source(path, TextFormat(**text))
    parts = [batch.columns for batch in source.batches(columns, rows)]
    return {name: np.concatenate([part[name] for part in parts]) for name in columns}


NOTATIONS = {
    "comma": "t,x\n0,1.5\n1,2.5\n",
    "quoted header": '"t","x"\n0,1.5\n1,2.5\n',
    "semicolon and decimal comma": "t;x\n0;1,5\n1;2,5\n",
    "tab": "t\tx\n0\t1.5\n1\t2.5\n",
    "spaces of any width": "  t    x\n  0    1.5 \n  1  2.5\n",
    "lines of Windows": "t,x\r\n0,1.5\r\n1,2.5\r\n",
    "mark at the begin": "\ufefft,x\n0,1.5\n1,2.5\n",
    "comments and blank lines": "# made by hand\n\nt,x\n0,1.5\n# a break\n\n1,2.5\n",
    "names in a comment": "# t x\n0 1.5\n1 2.5\n",
    "no newline at the end": "t,x\n0,1.5\n1,2.5",
    "spaces after commas": "t, x\n0, 1.5\n1, 2.5\n",
    "a cell too many": "t,x\n0,1.5\n1,2.5,\n",
}


def test_notations_give_the_same_numbers(tmp_path):
    for name, text in NOTATIONS.items():
        path = tmp_path / "log.csv"
        path.write_text(text, "utf-8")
        found = read(path, ["t", "x"])
        assert found["t"].tolist() == [0, 1], name
        assert found["x"].tolist() == [1.5, 2.5], name


def test_columns_without_names_have_numbers(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("0 1.5\n1 2.5\n", "utf-8")
    assert read(path, ["2"])["2"].tolist() == [1.5, 2.5]
    assert read(path, ["x"], names=("t", "x"))["x"].tolist() == [1.5, 2.5]


def test_rows_are_chosen_by_their_first_column(tmp_path):
    path = tmp_path / "log.txt"
    path.write_text("odom 0 1.5\npoint 0 9 9 9\nodom 1 2.5\n", "utf-8")
    assert read(path, ["3"], rows="odom")["3"].tolist() == [1.5, 2.5]


def test_compressed_text_is_read(tmp_path):
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(b"t,x\n0,1.5\n"))
    assert read(path, ["x"])["x"].tolist() == [1.5]
    path.write_bytes(path.read_bytes()[:-6])
    with pytest.raises(LogError, match=r"log.csv.gz"):
        read(path, ["x"])


def test_dates_are_seconds(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x\n2026-01-02T03:04:05.250,1\n2026-01-02T03:04:05.500,1\n", "utf-8")
    assert np.diff(read(path, ["t"])["t"]) == pytest.approx([0.25])


def test_missing_numbers_are_nan(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,x\n0,\n1,NaN\n2,null\n3,1\n", "utf-8")
    assert np.isnan(read(path, ["x"])["x"]).tolist() == [True, True, True, False]


def test_blocks_join_without_a_seam(tmp_path, monkeypatch):
    monkeypatch.setattr("realitygap.logs._text.BLOCK_BYTES", 64)
    path = tmp_path / "log.csv"
    path.write_text("t,x\n" + "".join(f"{k},{2 * k}\n" for k in range(1000)), "utf-8")
    assert read(path, ["x"])["x"].tolist() == [2.0 * k for k in range(1000)]


WRONG = {
    "t,x\n0,1\n1,fast\n": "row 2 has 'fast' in column x, expected a number",
    "": "has no rows",
    "t,t,x\n0,1,2\n": "several columns of the name 't'",
    "a\0b": "is no text",
}


def test_wrong_tables_have_one_message(tmp_path):
    for text, message in WRONG.items():
        path = tmp_path / "log.csv"
        path.write_text(text, "utf-8")
        with pytest.raises(LogError) as error:
            read(path, ["x"])
        assert message in str(error.value)
        assert "\n" not in str(error.value)


def test_a_column_that_is_missing_is_named_with_those_that_are_there(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,x\n0,1\n", "utf-8")
    with pytest.raises(LogError, match=r"has no column tim\. It has: time, x\. Did you mean 'time'\?"):
        read(path, ["tim"])
    with pytest.raises(LogError, match="There is no file"):
        open_source(tmp_path / "other.csv")
    with pytest.raises(LogError, match="is a folder"):
        open_source(tmp_path)
