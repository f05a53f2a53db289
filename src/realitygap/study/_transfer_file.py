"""The file of trials on a target: JSON, a trial a line, on the disk before the next one begins."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np

from realitygap.records import ObservedTrial


class TrialsFile:
    """Trials as they come; a last line that was cut off is as if it had not been written."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> list[ObservedTrial]:
        """What is there; nothing where there is no file."""
        if not self.path.exists():
            return []
        whole = self.path.read_bytes()
        lines = whole[: whole.rfind(b"\n") + 1]
        if len(lines) < len(whole):
            self.path.write_bytes(lines)
        return [_trial(json.loads(line)) for line in lines.splitlines()]

    def append(self, trial: ObservedTrial) -> None:
        """Add a trial, safe when this returns."""
        values = {name: v.tolist() if isinstance(v, np.ndarray) else v for name, v in asdict(trial).items()}
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(values) + "\n")
            file.flush()
            os.fsync(file.fileno())


def _trial(values: dict[str, object]) -> ObservedTrial:
    kept = {field.name: values[field.name] for field in fields(ObservedTrial)}
    for name, columns in (("commands", 2), ("wheels", 2), ("poses", 3)):
        kept[name] = np.reshape(np.array(kept[name], np.float64), (-1, columns))
    kept["readings"] = np.atleast_2d(np.array(kept["readings"], np.float64))
    kept["stalled"] = np.array(kept["stalled"], bool)
    kept["cells"], kept["start"] = tuple(kept["cells"]), tuple(kept["start"])  # type: ignore[arg-type]
    return ObservedTrial(**kept)  # type: ignore[arg-type]
