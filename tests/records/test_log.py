from __future__ import annotations

import numpy as np
import pytest

from realitygap.records import RecordWarning
from tests.records.rows import make_folder


def test_events_come_back_in_order_with_time_and_host(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    assert folder.read_log() == []
    assert folder.append_log({"event": "start", "steps_per_s": np.float32(2.5), "n": np.int64(3)})
    assert folder.append_log({"event": "end", "text": "line\nbreak ü", "path": tmp_path})
    first, second = folder.read_log()
    assert (first["event"], first["steps_per_s"], first["n"]) == ("start", 2.5, 3)
    assert second["text"] == "line\nbreak ü"
    assert first["time"] <= second["time"]
    assert first["host"]


def test_the_log_is_outside_the_digest(tmp_path):
    folder = make_folder(tmp_path / "r", 1)
    before = folder.digest()
    folder.append_log({"event": "end"})
    assert folder.digest() == before


def test_a_torn_line_is_left_out_with_a_warning_and_spoils_no_other(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    folder.append_log({"n": 1})
    with (folder.path / "log.jsonl").open("ab") as file:
        file.write(b'{"n": 2, "ti')
    folder.append_log({"n": 3})
    with pytest.warns(RecordWarning, match="1 lines"):
        assert [event["n"] for event in folder.read_log()] == [1, 3]


def test_a_log_that_cannot_be_written_warns_and_goes_on(tmp_path):
    folder = make_folder(tmp_path / "r", 0)
    (folder.path / "log.jsonl").mkdir()
    with pytest.warns(RecordWarning, match=r"log\.jsonl.*do not need it"):
        assert not folder.append_log({"event": "start"})
