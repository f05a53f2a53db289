"""Mistakes in a study file, all at once: where, what was expected, what came, what may have been meant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from realitygap.errors import did_you_mean

M = TypeVar("M", bound=BaseModel)


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
        """The value as a table; a mistake and an empty table when it is none."""
        if isinstance(value, Mapping):
            return dict(value)
        self.add(place, f"expected a table, came {_shown(value)}.")
        return {}

    def check(self, model: type[M], values: Mapping[str, Any], place: str) -> M | None:
        """The values as a model; None after noting every mistake in them."""
        try:
            return model.model_validate(dict(values), strict=True)
        except ValidationError as error:
            self._note(model, values, place, error)
            return None

    def _note(self, model: type[M], values: Mapping[str, Any], place: str, error: ValidationError) -> None:
        fields: dict[str, list[str]] = {}
        for problem in error.errors(include_url=False):
            field = ".".join(str(part) for part in problem["loc"][:1])
            if len(problem["loc"]) == 2 and isinstance(problem["loc"][1], int):
                field += f"[{problem['loc'][1] + 1}]"
            fields.setdefault(field, []).append(_explain(problem, model))
        for field, texts in fields.items():
            where = f"{place}.{field}" if place and field else place or field
            if field in model.model_fields and len(texts) > 1:
                came = _shown(values.get(field))
                unique = dict.fromkeys(text.split(", came ")[0].removeprefix("expected ") for text in texts)
                self.add(where, f"expected {', or '.join(unique)}, came {came}.")
            else:
                for text in texts:
                    self.add(where, text)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _explain(problem: Any, model: type[BaseModel]) -> str:
    kind = problem["type"]
    context = problem.get("ctx", {})
    came = _shown(problem["input"])
    if kind == "extra_forbidden":
        return f"unknown setting. {did_you_mean(str(problem['loc'][-1]), model.model_fields)}"
    if kind == "missing":
        return "missing, and it has no default."
    if kind == "literal_error":
        hint = ""
        if isinstance(problem["input"], str):
            names = [name.strip(" '") for name in context["expected"].replace(" or ", ",").split(",")]
            near = did_you_mean(problem["input"], names)
            hint = f" {near}" if near.startswith("Did") else ""
        return f"expected {context['expected']}, came {came}.{hint}"
    if kind == "value_error":
        return f"{context['error']}, came {came}."
    expected = {
        "int_type": "expected a whole number",
        "float_type": "expected a number",
        "finite_number": "expected a finite number",
        "bool_type": "expected true or false",
        "string_type": "expected a text in quotes",
        "list_type": "expected a list",
        "string_pattern_mismatch": "expected letters, digits, '.', '-' and '_', a letter or digit first",
    }.get(kind)
    if expected is None and kind in ("greater_than_equal", "greater_than", "less_than_equal", "less_than"):
        limit = context.get("ge", context.get("gt", context.get("le", context.get("lt"))))
        words = {
            "greater_than_equal": "at least",
            "greater_than": "more than",
            "less_than_equal": "at most",
            "less_than": "less than",
        }[kind]
        expected = f"expected {words} {limit}"
    if kind in ("too_long", "too_short"):
        expected = f"expected {context.get('max_length', context.get('min_length'))} values"
    if len(problem["loc"]) > 2 and isinstance(problem["loc"][-1], int):
        expected = f"{expected or problem['msg']} as value {problem['loc'][-1] + 1}"
    return f"{expected or problem['msg']}, came {came}."
