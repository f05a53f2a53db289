"""What is parsed is limited in size, depth and digits, whatever the format."""

from __future__ import annotations

import ast
import io
import json
import os
import sqlite3
import threading
import tomllib
import zipfile
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import realitygap
from realitygap import _limits
from realitygap._image_file import open_image
from realitygap._limits import LimitError, is_file, parse_json, parse_toml, read_file
from realitygap._parquet_size import check_size
from realitygap.errors import LedgerError, RealityGapError, RecordError
from tests.formats import FORMATS

SOURCES = Path(realitygap.__file__).parent

PARSERS = {
    "json.loads", "json.load", "tomllib.loads", "tomllib.load", "ElementTree.fromstring", "Image.open", "np.load",
    "pl.read_parquet", "pl.read_csv", "sqlite3.connect",
}  # fmt: skip
ALLOWED = {
    "_image_file.py": {"Image.open"},
    "_limits.py": {"tomllib.loads"},
    "logs/_text.py": {"pl.read_csv"},  # of blocks of limited size
    "records/_chunk.py": {"pl.read_parquet"},  # after check_size
    "records/_ledger_check.py": {"sqlite3.connect"},
    "records/_ledger_file.py": {"sqlite3.connect"},
    "records/_trial_store.py": {"sqlite3.connect"},  # of a ledger in memory
    "records/_observations_file.py": {"json.loads"},  # of what was just written
    "study/_transfer/strategies.py": {"json.loads"},  # of what was just written
    "world/_svg.py": {"ElementTree.fromstring"},
    # between two processes of one program
    "lab/_messages.py": {"json.loads"},
    "lab/_checks.py": {"json.loads"},  # of what was just written
    "platforms/twin/_pool.py": {"json.loads"},
    "platforms/twin/_worker.py": {"json.loads"},
}


def parsers_called(path: Path) -> set[str]:
    calls = (node.func for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Call))
    return {ast.unparse(call) for call in calls} & PARSERS


@pytest.mark.slow
def test_every_reader_goes_through_the_limits():
    found = {path.relative_to(SOURCES).as_posix(): parsers_called(path) for path in SOURCES.rglob("*.py")}
    assert {name: called for name, called in found.items() if called} == ALLOWED


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (".".join(["a"] * 50_000) + " = 1", "a key of more than 32 parts"),
        ("[" + " . ".join(['"a.b"'] * 40) + "]", "a key of more than 32 parts"),
        ("a = " + "[" * 100_000, "too deep"),
        ("a = " + "{b = " * 100 + "1" + "}" * 100, "too deep"),
        ("a = " + "{" + ".".join("b" * 30) + " = ", None),
        ("a = " + "".join("{" + ".".join("b" * 30) + " = " for _ in range(3)) + "1" + "}" * 3, "too deep"),
        ("a = " + "1" * 400, "more than 300 digits"),
        ("a = " + "1_0" * 400, "more than 300 digits"),
        ("a = 0x1" + "0" * 16, "too large for 64 bits"),
        ("a = 9999999999999999999999", "too large for 64 bits"),
        ("a = 1 # " + "x" * 4_000_000, "4,000,008 characters"),
    ],
)
def test_toml_beyond_a_limit_gets_one_message(text, expected):
    with pytest.raises(ValueError, match=expected):
        parse_toml(text)


@pytest.mark.parametrize(
    "text",
    [
        'a = "[[[[ {{{{" # ]]]] """',
        "a = '''it''s [ \" # no comment''''' # '''",
        'a = """x ""y"" \\""" [[[\n"""""\nb = "\\\\" # "',
        "a.\"b.c.d\" . 'e.f' = [[1, 2], [3, 4_5.0e-3]] # g.h.i",
        "d = 1979-05-27 07:32:00.999999\n" + "".join(f"k{i}.v = [{i}]\n" for i in range(200)),
        'x = "' + "." * 100 + '"\ny = ' + "[" * 60 + "]" * 60 + "\n" + "0" * 30 + " = inf",
    ],
)
def test_toml_within_the_limits_is_read_as_it_is(text):
    assert parse_toml(text) == tomllib.loads(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[" * 100_000, "too deep"),
        ('{"a":' * 100_000, "too deep"),
        ('["' + "]" * 100 + '",' + "[" * 100 + "]" * 101, "too deep"),
        ("1" * 400, "too large for 64 bits"),
        ("[1, -9223372036854775809]", "too large for 64 bits"),
        ("18446744073709551616", "too large for 64 bits"),
        ('{"a": -1e400}', "-1e400 is too large"),
        ("[NaN]", "the number NaN"),
        ("[-Infinity]", "the number -Infinity"),
        ('"\\ud800"', "half of a letter"),
    ],
)
def test_json_beyond_a_limit_gets_one_message(text, expected):
    with pytest.raises(LimitError, match=expected):
        parse_json(text)
    with pytest.raises(LimitError, match=expected):
        parse_json(text.encode())


def test_json_beyond_a_size_gets_one_message():
    with pytest.raises(LimitError, match="12 characters, expected at most 10"):
        parse_json('"0123456789"', most=10)


LETTERS = st.text(st.characters(exclude_categories=["Cs"]))
NUMBERS = st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False, allow_infinity=False)
HARD = st.sampled_from(["[" * 99, '"\\', "1" * 99, "e999", "😀"])


@settings(derandomize=True, database=None)
@given(
    st.recursive(
        st.none() | st.booleans() | NUMBERS | LETTERS | HARD,
        lambda each: st.lists(each) | st.dictionaries(LETTERS, each),
    )
)
def test_json_within_the_limits_is_read_as_it_is(value):
    for text in (json.dumps(value), json.dumps(value, ensure_ascii=False, indent=1)):
        assert parse_json(text) == value
        assert parse_json(text.encode()) == value


@settings(derandomize=True, database=None, max_examples=200)
@given(st.text(st.sampled_from('[]{}",:\\.=_ \n#\'a10e-"')), st.booleans())
def test_parsers_raise_nothing_but_value_errors(text, is_toml):
    parse, plain = (parse_toml, tomllib.loads) if is_toml else (parse_json, json.loads)
    try:
        value = parse(text)
    except ValueError:
        return
    assert value == plain(text)


def test_file_beyond_a_size_is_not_read(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    assert read_file(path, 5) == b"12345"
    with pytest.raises(OSError, match="more than 4 bytes"):
        read_file(path, 4)
    with pytest.raises(OSError, match="more than 100 bytes"):
        read_file(Path("/dev/zero"), 100)


def test_pipe_that_the_user_names_is_read_and_another_is_not(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="not a plain file"):
        read_file(pipe, 100, plain=True)
    writer = threading.Thread(target=pipe.write_bytes, args=(b"1" * 90,), daemon=True)
    writer.start()
    assert read_file(pipe, 100) == b"1" * 90
    writer.join()


def test_text_that_is_no_path_is_no_file():
    assert not is_file("a" * 5000)
    assert not is_file("a\0b")


@pytest.mark.slow
def test_image_beyond_a_size_is_refused_before_it_is_decoded():
    large = io.BytesIO()
    Image.new("1", (30_000, 30_000)).save(large, "PNG")
    for most in (512, 29_999):
        large.seek(0)
        with pytest.raises(LimitError), open_image(large, most):
            pytest.fail("it is open")


def test_parquet_file_that_would_fill_memory_is_refused(monkeypatch):
    buffer = io.BytesIO()
    pl.DataFrame({"a": [0] * 100_000, "b": ["x" * 50] * 100_000}).write_parquet(buffer)
    check_size(buffer.getvalue())
    monkeypatch.setattr("realitygap._parquet_size.MOST_VALUES", 199_999)
    with pytest.raises(LimitError, match="200,002 values"):
        check_size(buffer.getvalue())
    monkeypatch.setattr("realitygap._parquet_size.MOST_CHUNK_BYTES", 100)
    with pytest.raises(RecordError, match="cannot be read: it holds"):
        FORMATS["chunk.parquet"].read(FORMATS["chunk.parquet"].valid)


def test_checkpoint_that_is_compressed_is_refused():
    packed = io.BytesIO()
    valid = zipfile.ZipFile(io.BytesIO(FORMATS["checkpoint.npz"].valid))
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as file:
        for name in valid.namelist():
            file.writestr(name, valid.read(name))
    with pytest.raises(RecordError, match="is compressed"):
        FORMATS["checkpoint.npz"].read(packed.getvalue())


def test_checkpoint_with_an_array_larger_than_the_file_is_refused():
    valid = FORMATS["checkpoint.npz"].valid
    packed = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(valid)) as file, zipfile.ZipFile(packed, "w") as other:
        for name in file.namelist():
            data = file.read(name)
            other.writestr(
                name,
                data.replace(b"'shape': (4", b"'shape': (400000000000", 1) if name != "about.npy" else data,
            )
    with pytest.raises(RecordError, match="damaged"):
        FORMATS["checkpoint.npz"].read(packed.getvalue())


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (
            "CREATE VIEW v AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i FROM n",
            "a view",
        ),
        ("CREATE TRIGGER t AFTER INSERT ON notes BEGIN DELETE FROM notes; END", "a trigger"),
        ("UPDATE trials SET n_steps = 'many'", "table trials"),
        ("UPDATE steps SET raw = x'00'", "table steps"),
        ("UPDATE steps SET raw = '" + "[" * 500 + "'", "expected JSON that is not too deep"),
        ("UPDATE steps SET raw = '{\"a\": 1}'", "expected a list of numbers"),
        ("UPDATE scores SET cells = '[1e999]'", "expected a list of cells"),
    ],
)
def test_ledger_from_elsewhere_gets_one_message(tmp_path, change, expected):
    form = FORMATS["ledger.sqlite"]
    path = tmp_path / "ledger.sqlite"
    path.write_bytes(form.valid)
    with sqlite3.connect(path) as connection:
        connection.execute(change)
    connection.close()
    with pytest.raises(LedgerError, match=expected):
        form.read(path.read_bytes())


def test_number_beyond_sqlites_gets_one_message(tmp_path):
    from tests.records.test_ledger import new_ledger

    with new_ledger(tmp_path) as ledger, pytest.raises(LedgerError, match="64 bits"):
        ledger.trial(10**30)


def test_svg_that_would_take_hours_is_refused_at_once():
    form = FORMATS["arena.svg"]
    for change in (
        (b'transform="', b'transform="' + b"a" * 1_000_000),
        (b'x1="100', b'x1="' + b"1" * 1_000_000 + b"x"),
        (b"<svg", b"<!DOCTYPE " * 100_000 + b"<svg"),
    ):
        with pytest.raises(RealityGapError):
            form.read(form.valid.replace(*change))


def test_limits_are_above_what_realitygap_writes():
    assert all(len(form.valid) < _limits.MOST_TOML_BYTES for form in FORMATS.values())
