"""Common base of all settings: plain values, which are checked, with our own error messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticKnownError

from .errors import did_you_mean, meant

MISSING = "missing, and it has no default."
_EXPECTED = {
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "a text in quotes",
    "path_type": "the name of a file",
    "list_type": "a list",
    "tuple_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "string_pattern_mismatch": "letters, digits, '.', '-' and '_', a letter or digit first",
}
_LIMITS = {
    "greater_than_equal": ("at least", "ge"),
    "greater_than": ("more than", "gt"),
    "less_than_equal": ("at most", "le"),
    "less_than": ("less than", "lt"),
}


def _refusing(wrong: Literal["float_type", "int_type"]) -> dict[str, Any]:
    """Return a step before the check of a number that refuses true, false, and texts."""

    def refuse(value: Any) -> Any:
        if isinstance(value, bool | str):
            raise PydanticKnownError(wrong)
        return value

    return {"type": "no-info", "function": refuse}


_REFUSING = {"float": _refusing("float_type"), "int": _refusing("int_type")}


def _with_plain_numbers(schema: Any) -> Any:
    """Return a schema that refuses true, false, and texts as numbers; pydantic would read 1, 0, and their digits."""
    if isinstance(schema, list | tuple):
        return type(schema)(map(_with_plain_numbers, schema))
    if not isinstance(schema, dict) or schema.get("function") in _REFUSING.values():
        return schema
    step = _REFUSING.get(str(schema.get("type")))
    if step is not None:
        return {"type": "function-before", "function": step, "schema": schema}
    return {key: _with_plain_numbers(part) for key, part in schema.items()}


def as_tuple(values: Any) -> Any:
    """Return a list of a file as a tuple, which a field with several values is, and anything else as it is."""
    return tuple(values) if isinstance(values, list) else values


class Settings(BaseModel):
    """Immutable settings that refuse unknown names.

    Raises:
        ValueError: A setting is unknown, missing, or out of range. The message lists all mistakes.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def __init__(self, **values: Any) -> None:
        try:
            super().__init__(**values)
        except ValidationError as error:
            found = mistakes(error, type(self), values)
        else:
            return
        raise self.refusal(found)

    # Otherwise pydantic would call it for nested tables, too, and report its errors as errors of a value.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def refusal(cls, found: list[tuple[str, str]]) -> ValueError:
        """Return the error for mistakes, with the place and the message of each."""
        name = cls.__name__
        return ValueError(
            "\n".join(f"{name}.{place}: {text}" if place else f"{name}: {text}" for place, text in found)
        )

    @classmethod
    def table_of(cls, name: str) -> type[BaseModel] | None:
        """Return the model of a table that is no field; None if there is no such table."""
        return None

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema of pydantic, but refuse true, false, and texts as numbers."""
        strict: CoreSchema = _with_plain_numbers(handler(source))
        return strict


def mistakes(
    error: ValidationError, model: type[BaseModel], values: Mapping[str, Any]
) -> list[tuple[str, str]]:
    """Return all mistakes that pydantic found in the values of a model: the place, such as start[3], and a message."""
    found: dict[str, list[str]] = {}
    is_setting: dict[str, bool] = {}
    problems = error.errors(include_url=False)
    within = {problem["loc"][:-2] for problem in problems} | {problem["loc"][:-1] for problem in problems}
    for problem in problems:
        if problem["type"] == "too_short" and problem["loc"] in within:
            continue  # a list whose entries have mistakes is not too short
        place, last, owner = _place(model, problem["loc"])
        found.setdefault(place, []).append(explained(problem, owner))
        is_setting[place] = last in owner.model_fields
    lines = []
    for place, texts in found.items():
        if is_setting[place] and len(texts) > 1:  # none of the types that it may have
            expected = dict.fromkeys(text.split(", got ")[0].removeprefix("expected ") for text in texts)
            texts = [f"expected {', or '.join(expected)}, got {shown(_value_at(values, place))}."]
        lines += [(place, text) for text in texts]
    return lines


def is_hidden(info: FieldInfo) -> bool:
    """Return whether realitygap fills in a setting, which is then no part of study files."""
    extra = info.json_schema_extra
    return isinstance(extra, dict) and bool(extra.get("hidden"))


def shown(value: object) -> str:
    """Return a value as it came, short enough for a message."""
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def visible(text: str) -> str:
    r"""Return a text in printable ASCII, with an escape such as \x1b or \u202e for every other character.

    So no sequence that controls a terminal, no invisible letter and no lookalike can hide what a text says.
    """
    return "".join(c if " " <= c <= "~" else c.encode("unicode_escape").decode() for c in text)


def _place(model: type[BaseModel], loc: tuple[int | str, ...]) -> tuple[str, str, type[BaseModel]]:
    """Return a problem's place as text, the last name in it, and the model that this belongs to.

    Tables in a list are counted from 0, as in the names of their numbers: range.0.cone. Numbers by name have theirs:
    draws.drive.track[2]. Any other part after a setting that is no table is an entry of a list, or one of the possible
    types of the setting, which is no part of the place.
    """
    names: list[str] = []
    owner = model
    rest = list(loc)
    while rest:
        name = str(rest.pop(0))
        names.append(name)
        annotation: Any = owner.model_fields[name].annotation if name in owner.model_fields else None
        if annotation is None and issubclass(owner, Settings):
            annotation = owner.table_of(name)
        if get_origin(annotation) is dict and rest:
            names.append(str(rest.pop(0)))
        inner, is_list = table_in(annotation)
        if not rest or inner is None:
            break
        if is_list:
            names.append(str(rest.pop(0)))
        owner = inner
    entry = f"[{rest[0] + 1}]" if len(rest) == 1 and isinstance(rest[0], int) else ""
    return ".".join(names) + entry, names[-1] + entry if names else "", owner


def table_in(annotation: Any) -> tuple[type[BaseModel] | None, bool]:
    """Return the model that a setting's type is, may be or lists, if any, and whether it lists it."""
    parts = [part for part in get_args(annotation) if part not in (type(None), Ellipsis)]
    is_list = get_origin(annotation) is tuple
    if parts:
        annotation = parts[0] if len(parts) == 1 else None
    is_model = isinstance(annotation, type) and issubclass(annotation, BaseModel)
    return (annotation if is_model else None), is_list


def _value_at(values: Mapping[str, Any], place: str) -> Any:
    found: Any = values
    for name in place.split("."):
        if isinstance(found, list | tuple):
            found = found[int(name)] if name.isdigit() and int(name) < len(found) else None
        else:
            found = found.get(name) if isinstance(found, Mapping) else getattr(found, name, None)
    return found


def explained(problem: Any, model: type[BaseModel] = BaseModel) -> str:
    """Return a mistake that pydantic found, in words: "expected a whole number, got 'two'.".

    Args:
        problem: One of `ValidationError.errors()`.
        model: Model that the setting belongs to. Its settings and tables are part of some messages.
    """
    kind = problem["type"]
    context = problem.get("ctx", {})
    came = shown(problem["input"])
    if kind == "extra_forbidden":
        return f"unknown setting. {did_you_mean(str(problem['loc'][-1]), model.model_fields)}"
    if kind == "missing":
        return MISSING
    if kind == "literal_error":
        return f"expected {context['expected']}, got {came}.{meant(problem['input'], _words(context['expected']))}"
    if kind == "value_error":
        # the value of a whole model is too long to show
        is_table = not problem["loc"] or isinstance(problem["input"], Mapping | BaseModel)
        said = str(context["error"]).removesuffix(".")
        if is_table:
            return said if said.endswith("?") else f"{said}."
        # a message that already includes the value needs no addition
        return f"{said}." if str(problem["input"]) in said else f"{said}, got {came}."
    expected = _EXPECTED.get(kind)
    if kind in _LIMITS:
        words, key = _LIMITS[kind]
        expected = f"{words} {context[key]}"
    if kind in ("too_long", "too_short"):
        n = context.get("max_length", context.get("min_length"))
        field = model.model_fields.get(str(problem["loc"][-1]))
        if field is not None and table_in(field.annotation)[1]:
            bound = "at most" if kind == "too_long" else "at least"
            return f"expected {bound} {n}, got {len(problem['input'])}."
        expected = f"{n} values"
    text = f"expected {expected}" if expected else str(problem["msg"])
    if len(problem["loc"]) > 2 and isinstance(problem["loc"][-1], int):
        text += f" as value {problem['loc'][-1] + 1}"
    return f"{text}, got {came}."


def _words(expected: str) -> list[str]:
    """Return the choices that pydantic lists."""
    return [name.strip(" '") for name in expected.replace(" or ", ",").split(",")]
