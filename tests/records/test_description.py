from __future__ import annotations

import json
import math

import pytest

from realitygap.errors import RecordError
from realitygap.records import ResultsFolder
from realitygap.records._description import Description
from tests.records.rows import DESCRIPTION, make_folder


def test_description_comes_back_as_it_was_given(tmp_path):
    study = {"conditions": ["a", "b"], "nested": {"x": [1, 0.1, None, True, "ü 雪"]}, "pair": False}
    ResultsFolder.create(tmp_path / "r", study)
    folder = ResultsFolder.open(tmp_path / "r")
    assert folder.description == study
    assert folder.conditions == ["a", "b"]


def test_changing_the_returned_description_changes_nothing(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    folder.description["conditions"].clear()
    assert folder.description == DESCRIPTION


@pytest.mark.parametrize(
    ("study", "message"),
    [
        ({}, "expected a list"),
        ({"conditions": "coverage"}, "expected a list"),
        ({"conditions": [1]}, "must be a name"),
        ({"conditions": [{"selection": "coverage"}]}, "must be a name"),
        ({"conditions": ["a", "a"]}, "differ"),
        ({"conditions": ["../a"]}, "cannot name a file"),
        ({"conditions": [], "noise": math.nan}, "JSON"),
        ({"conditions": ["a"], "title": "\ud800"}, "half of a letter"),
    ],
)
def test_descriptions_without_a_proper_list_of_conditions_are_refused(tmp_path, study, message):
    with pytest.raises(ValueError, match=message):
        ResultsFolder.create(tmp_path / "r", study)
    assert not (tmp_path / "r").exists()


def test_descriptions_of_more_than_json_are_refused(tmp_path):
    with pytest.raises(TypeError, match="set"):
        ResultsFolder.create(tmp_path / "r", {"conditions": [], "x": {1}})


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda data: b"", "torn"),
        (lambda data: data[: len(data) // 2], "torn"),
        (lambda data: bytes(len(data)), "torn"),
        (lambda data: b"\xff\xfe" + data, "torn"),
        (lambda data: b"[]", "not written by realitygap"),
        (lambda data: b'{"study": {}}', "not written by realitygap"),
        (lambda data: data.replace(b'"seed": 1', b'"seed": 2'), "edited or damaged"),
        (lambda data: data.replace(b'"results_version": 2', b'"results_version": 3'), "edited or damaged"),
    ],
)
def test_torn_edited_and_foreign_files_are_refused(tmp_path, spoil, message):
    folder = make_folder(tmp_path / "r", 1)
    path = folder.path / "study.json"
    path.write_bytes(spoil(path.read_bytes()))
    with pytest.raises(RecordError, match=message) as caught:
        ResultsFolder.open(folder.path)
    assert str(path) in str(caught.value)
    with pytest.raises(RecordError, match=message), folder.locked():
        pass


def test_a_file_that_was_only_laid_out_anew_is_as_good(tmp_path):
    path = tmp_path / "study.json"
    Description.of(DESCRIPTION, 1).write(path)
    path.write_text(json.dumps(json.loads(path.read_text()), sort_keys=True))
    assert Description.read(path).study == DESCRIPTION
