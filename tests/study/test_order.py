"""The order for a chunk says whether its worker may run code; what is in a folder does not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from realitygap.errors import TaskError
from realitygap.runs import Condition
from realitygap.study._executors import ChunkTask
from realitygap.study._order import carry_out_order, make_order
from realitygap.tasks import PythonTask


def order_of(task: PythonTask, inbox: Path) -> dict[str, object]:
    neat = {"population": 2, "generations": 1}
    condition = Condition(name="far", platform="sim", sim={"steps": 3}, neat=neat, task=task)
    travelled: dict[str, object] = json.loads(json.dumps(make_order(ChunkTask(condition, 0, 1), inbox)))
    return travelled


def test_worker_runs_code_when_the_order_has_the_permission(tmp_path):
    task = PythonTask(kind="python:task.py:far", source="def far(t): return t.poses[:, -1, 0]")
    carry_out_order(order_of(task.allowed(), tmp_path))
    assert len(list(tmp_path.iterdir())) == 1
    with pytest.raises(TaskError, match="not allowed"):
        carry_out_order(order_of(task, tmp_path))
