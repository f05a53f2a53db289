"""All mistakes in a study file: their positions, expected and given values, and suggestions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from realitygap.errors import StudyError
from realitygap.settings import MISSING, mistakes, shown

M = TypeVar("M", bound=BaseModel)


class StudyFileError(StudyError):
    """Mistakes in a study file.

    Args:
        head: Sentence that names the file.
        mistakes: Mistakes, each as PLACE: MESSAGE.

    Attributes:
        mistakes: Mistakes, each as PLACE: MESSAGE.
    """

    def __init__(self, head: str, mistakes: Sequence[str]) -> None:
        super().__init__("\n  ".join([head, *mistakes]))
        self.mistakes = tuple(mistakes)


class Problems:
    """Collects the mistakes of one file."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, place: str, text: str) -> None:
        """Note a mistake, once."""
        line = f"{place}: {text}"
        if line not in self.lines:
            self.lines.append(line)

    def table(self, place: str, value: Any) -> dict[str, Any]:
        """Return the value as a table; a mistake and an empty table when it is none."""
        if isinstance(value, Mapping):
            return dict(value)
        self.add(place, f"expected a table, got {shown(value)}.")
        return {}

    def check(
        self, model: type[M], values: Mapping[str, Any], place: str, *, is_part: bool = False
    ) -> M | None:
        """Return the values as a model; None after noting every mistake in them, of a part all but what is missing."""
        try:
            return model.model_validate(dict(values), strict=True)
        except ValidationError as error:
            for field, text in mistakes(error, model, values):
                if is_part and text == MISSING:
                    continue
                self.add(f"{place}.{field}" if place and field else place or field, text)
            return None
