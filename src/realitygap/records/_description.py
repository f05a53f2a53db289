"""`study.json`: the study as resolved, with what is needed to notice that the file was damaged or edited."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from realitygap._limits import MOST_JSON_BYTES, parse_json, read_file
from realitygap.errors import RecordError
from realitygap.records._chunk import check_condition
from realitygap.records._files import reading, write_durably

DESCRIPTION_NAME = "study.json"
_FORMAT = "realitygap results 1"


@dataclass(frozen=True)
class Description:
    """A study as plain JSON values, and the version of what computes its numbers."""

    study: dict[str, Any]
    results_version: int

    @classmethod
    def of(cls, study: Mapping[str, Any], results_version: int) -> Description:
        """Return a description, as it will be read back from a file.

        Raises:
            TypeError: a value is not JSON's.
            ValueError: a value is beyond the limits of what is read, a number is not finite, or `conditions` does not
                list names, or tables with a `name`.
        """
        plain = parse_json(json.dumps(dict(study), allow_nan=False))  # so that what is written can be read
        description = cls(plain, results_version)
        names = description.conditions
        for name in names:
            check_condition(name)
        if len(set(names)) != len(names):
            raise ValueError(f"The conditions {names} must differ in their names.")
        return description

    @classmethod
    def read(cls, path: Path) -> Description:
        """Return the description in a file.

        Raises:
            RecordError: the file is torn, edited or foreign.
        """
        with reading(path):
            data = read_file(path, MOST_JSON_BYTES, plain=True)
        try:
            document = parse_json(data)
        except ValueError as error:
            raise RecordError(
                f"{path} is damaged: it is not JSON ({error}). Restore it from a copy, or move the folder elsewhere."
            ) from None
        if not isinstance(document, dict) or document.get("format") != _FORMAT:
            raise RecordError(
                f"{path} was not written by realitygap (no format {_FORMAT!r}). "
                "Name another folder for the results."
            )
        study: Any = document.get("study")
        version: Any = document.get("results_version")
        if document.get("sha256") != _sha256(study, version):
            raise RecordError(
                f"{path} was edited or damaged. Restore it from a copy, or move the whole folder elsewhere."
            )
        return cls(study, version)

    def write(self, path: Path) -> None:
        """Write the description to a file, atomically.

        Raises:
            RecordError: the system refused.
        """
        document = {
            "format": _FORMAT,
            "results_version": self.results_version,
            "sha256": _sha256(self.study, self.results_version),
            "study": self.study,
        }
        write_durably(path, (json.dumps(document, indent=2) + "\n").encode(), replace=True)

    @property
    def conditions(self) -> list[str]:
        """The names in `conditions`, in their order.

        Raises:
            ValueError: there is no such list, or it lists something else.
        """
        conditions = self.study.get("conditions")
        if not isinstance(conditions, list):
            raise ValueError(f"The description's 'conditions' is {conditions!r}, expected a list.")
        names: list[Any] = [each.get("name") if isinstance(each, dict) else each for each in conditions]
        if not all(isinstance(name, str) for name in names):
            raise ValueError(f"Every condition must be a name or have a 'name', found {names}.")
        return names


def _sha256(study: Any, results_version: Any) -> str:
    value = json.dumps([results_version, study], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(value.encode()).hexdigest()
