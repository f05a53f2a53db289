"""Mistakes in the fields of a form, all of which are shown together."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from realitygap._caller import Caller
from realitygap.errors import StudyError, did_you_mean
from realitygap.orders import ORDERS, Order, OrderError
from realitygap.settings import shown
from realitygap.study import named_studies
from realitygap.tasks import task_model
from realitygap.world import load_arena

from ._files import refuse_outside, refuse_platform


def form_caller() -> Caller:
    """Return the caller of forms, in which settings have labels."""
    fields = [field for order in ORDERS.values() for field in order.fields() if field.face.label]
    labels = {option: field.face.label for field in fields for option in field.options}
    return Caller(lambda option: labels.get(option, option), ": ")


class FormError(StudyError):
    """Values that a visitor entered cannot be used.

    Args:
        problems: For each field, by its key in the form: what is expected, what was entered, and what to do.
    """

    def __init__(self, problems: Mapping[str, str]) -> None:
        super().__init__("\n".join(problems.values()))
        self.problems = dict(problems)


def refuse_unnamed(who: str) -> str:
    """Return the name of a visitor without space around it.

    Raises:
        FormError: It is empty.
    """
    if not who.strip():
        raise FormError({"who": "Enter your name first. It is saved with each entry. Nothing was saved."})
    return who.strip()


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

    def in_order(self, model: type[Order], values: Mapping[str, Any], root: Path) -> None:
        """Add what is wrong in the fields of an order; a field that is missing is not checked.

        Args:
            model: The order.
            values: Values of fields by name. Those of other names are left out.
            root: Folder that has all files that the order may name.
        """
        given = {field: values[field.name] for field in model.fields() if field.name in values}
        for field, value in given.items():
            with self.in_field(field.name):
                if field.face.refers == "platform":
                    refuse_platform(root, value)
                elif value and field.face.refers == "file":
                    refuse_outside(root, str(value))
                    _refuse_unknown(root, field.name, str(value))
        try:
            model(**{field.name: value for field, value in given.items()})
        except OrderError as error:
            known = {field.name for field in given} - set(self.problems)
            self.problems |= {name: text for name, text in error.problems.items() if name in known}

    def refuse(self) -> None:
        """Raise an error if there is a mistake.

        Raises:
            FormError: There is.
        """
        if self.problems:
            raise FormError(self.problems)


def _refuse_unknown(root: Path, field: str, text: str) -> None:
    """Refuse an arena, a task, or controllers that do not exist.

    Raises:
        StudyError: They do not.
    """
    try:
        if field == "arena":
            load_arena(root / text if (root / text).is_file() else text)
        elif field == "task":
            task_model({"kind": text})
    except ValueError as error:
        message = str(error).replace(f"{root}/", "").rstrip(".")
        raise StudyError(f"{message[:1].upper()}{message[1:]}.") from None
    known = ("random", *named_studies())
    if field in ("controllers", "reevolved") and text not in known and not (root / text).exists():
        raise StudyError(f"There is no study or folder {shown(text)}. {did_you_mean(text, known)}")
