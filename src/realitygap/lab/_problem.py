"""A mistake in one field of a form."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from realitygap.errors import StudyError


@contextlib.contextmanager
def in_field(field: str) -> Iterator[None]:
    """Turn a StudyError into a FieldError of this field."""
    try:
        yield
    except StudyError as error:
        raise FieldError(field, str(error)) from error


class FieldError(StudyError):
    """A value that a visitor entered cannot be used.

    Args:
        field: Key of the field in its form.
        message: What is expected, what was entered, and what to do.
    """

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field
