"""Mistakes in the fields of a form, all of which are shown together."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping

from realitygap.errors import StudyError


class FormError(StudyError):
    """Values that a visitor entered cannot be used.

    Args:
        problems: For each field, by its key in the form: what is expected, what was entered, and what to do.
    """

    def __init__(self, problems: Mapping[str, str]) -> None:
        super().__init__("\n".join(problems.values()))
        self.problems = dict(problems)


class Mistakes:
    """Collects what is wrong in the fields of a form.

    Attributes:
        problems: Message for each field with a mistake, by its key.
    """

    def __init__(self) -> None:
        self.problems: dict[str, str] = {}

    @contextlib.contextmanager
    def in_field(self, field: str) -> Iterator[None]:
        """Take a StudyError as the mistake of this field, and continue."""
        try:
            yield
        except StudyError as error:
            self.problems[field] = str(error)

    def refuse(self) -> None:
        """Raise an error if there is a mistake.

        Raises:
            FormError: There is.
        """
        if self.problems:
            raise FormError(self.problems)
