"""Forms: each label above its field, each explanation and each mistake below it."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from nicegui import run, ui
from nicegui.elements.mixins.value_element import ValueElement

from realitygap.lab._choices import Choices
from realitygap.lab._mistakes import FormError, Mistakes
from realitygap.orders import Limits, OrderField
from realitygap.settings import shown

from ._elements import Picker
from ._notices import WRONG

FindMistakes = Callable[[dict[str, Any]], Mistakes]


@dataclass
class _Field:
    """A field, the line for its mistake, and its help.

    Attributes:
        label: Label above it.
        input: The element that takes the value.
        problem: Line below it for a mistake.
        help: Explanation below it; None if there is none.
        check: Raises a ValueError if the value cannot be used.
        marked: The mistake that is shown; None before the field was drawn.
    """

    label: str
    input: ValueElement[Any]
    problem: ui.label
    help: ui.label | None
    check: Callable[[], Any]
    marked: str | None = None


def needed(text: str) -> str:
    """Return a text that is not empty.

    Raises:
        ValueError: It is empty.
    """
    if not text:
        raise ValueError("This field is empty. Enter a value.")
    return text


class Form:
    """The fields of a form, and a summary of their mistakes.

    Call `summary` where the summary belongs, at the top of the form; then add fields.
    """

    def __init__(self) -> None:
        self._fields: dict[str, _Field] = {}
        self._refused: dict[str, tuple[Any, str]] = {}

    def summary(self) -> None:
        """Show the place for the summary of mistakes."""
        with ui.element("div").classes("lab-summary lab-lines").props('role="alert" tabindex="-1"') as box:
            self._summary = box
        box.set_visibility(False)

    # fields

    def text(
        self,
        key: str,
        label: str,
        value: str = "",
        *,
        explanation: str = "",
        choices: Choices | None = None,
        placeholder: str = "",
        parse: Callable[[str], Any] = str,
    ) -> ValueElement[Any]:
        """Add a line of text, or a choice of texts.

        Args:
            key: Key of the field.
            label: Label, above the field.
            value: Initial text.
            explanation: Explanation, below the field.
            choices: Texts to choose from; the visitor can also type another one.
            placeholder: Text that is shown while the field is empty, such as the default.
            parse: Returns the value of the text; raises a ValueError if it has none, as `needed` does for an empty one.
        """

        def check() -> Any:
            entered = element.value.strip() if isinstance(element.value, str) else ""
            return parse(entered)

        with self._around(label):
            element: ValueElement[Any] = (
                ui.input(value=value, placeholder=placeholder)
                if choices is None
                else Picker(choices, value, label, placeholder)
            )
            self._add(key, label, element, explanation, check)
        return element

    def number(
        self,
        key: str,
        label: str,
        value: float | None,
        limits: Limits,
        *,
        explanation: str = "",
        placeholder: str = "",
    ) -> ui.number:
        """Add a number; a field without an initial value may be empty.

        Args:
            key: Key of the field.
            label: Label, above the field.
            value: Initial number; None if the field is empty.
            limits: Allowed numbers.
            explanation: Explanation, below the field.
            placeholder: Text that is shown while the field is empty, such as the default.
        """

        def check() -> float | int | None:
            entered = element.value
            if entered is None or entered == "":
                if value is None:
                    return None
                raise ValueError(f"This field is empty. Enter {limits.words}.")
            is_number = isinstance(entered, int | float) and not isinstance(entered, bool)
            if not is_number or not math.isfinite(entered) or not limits.allow(entered):
                got = f"{entered:.10g}" if is_number else shown(entered)
                raise ValueError(f"Enter {limits.words}. You entered {got}.")
            return int(entered) if limits.is_whole else float(entered)

        with self._around(label):
            element = ui.number(value=value, placeholder=placeholder)
            element.props(f'step="{1 if limits.is_whole else "any"}"')
            self._add(key, label, element, explanation, check)
        return element

    def choice(
        self,
        key: str,
        label: str,
        options: Mapping[Any, str] | Sequence[str],
        value: Any,
        explanation: str = "",
    ) -> ui.select:
        """Add a choice.

        Args:
            key: Key of the field.
            label: Label, above the field.
            options: The choices; a mapping also has their names.
            value: Initial choice.
            explanation: Explanation, below the field.
        """
        with self._around(label):
            listed = dict(options) if isinstance(options, Mapping) else list(options)
            element = ui.select(listed, value=value)
            self._add(key, label, element, explanation, lambda: element.value)
        return element

    def switch(self, key: str, label: str, *, explanation: str = "", is_enabled: bool = True) -> ui.switch:
        """Add a switch that is off.

        Args:
            key: Key of the field.
            label: Label, next to the switch.
            explanation: Explanation, below the field.
            is_enabled: Whether it can be switched on.
        """
        with ui.element("div").classes("lab-field"):
            element = ui.switch(label)
            element.props(f"id={_control(element)}").set_enabled(is_enabled)
            self._explain(key, label, element, explanation, lambda: element.value)
        return element

    # fields of an order

    def field_of(self, field: OrderField, choices: Choices | None = None) -> None:
        """Add a field of an order, as its type needs; `choices` are those of a text."""
        if field.kind is bool:
            self.choice(field.name, field.face.label, {False: "No", True: "Yes"}, field.default, field.help)
        elif field.choices:
            options: dict[Any, str] = {choice: choice for choice in field.choices}
            if field.is_optional:
                options = {None: f"Default: {field.face.default_is}", **options}
            self.choice(field.name, field.face.label, options, field.default, field.help)
        elif field.kind in (int, float):
            self.number_of(field)
        else:
            self.text_of(field, choices=choices)

    def text_of(
        self,
        field: OrderField,
        value: str = "",
        choices: Choices | None = None,
        *,
        explanation: str = "",
        is_needed: bool = False,
    ) -> ValueElement[Any]:
        """Add a text of an order.

        Args:
            field: The field.
            value: Initial text. Default: that of the field.
            choices: Texts to choose from; the visitor can also type another one.
            explanation: Explanation, below the field. Default: help of the field.
            is_needed: Whether the field must not be empty, although the order allows that.
        """
        return self.text(
            field.name,
            field.face.label,
            value or field.default or "",
            explanation=explanation or field.help,
            choices=_with_default(field, choices),
            placeholder=field.face.default_is,
            parse=needed if is_needed or not field.is_optional else lambda text: text or None,
        )

    def number_of(self, field: OrderField) -> ui.number:
        """Add a number of an order."""
        return self.number(
            field.name,
            field.face.label,
            field.default,
            field.limits,
            explanation=field.help,
            placeholder=field.face.default_is,
        )

    # mistakes

    async def all_problems(self, find: FindMistakes | None) -> dict[str, str]:
        """Return what is wrong, by key in the order of the form: in each field, and by a check of several fields.

        Args:
            find: Finds mistakes in the values of those fields that are not wrong by themselves, in a thread.
        """
        problems = self.problems()
        usable = {key: field.check() for key, field in self._fields.items() if key not in problems}
        if find is not None and (found := await run.io_bound(find, usable)) is not None:
            problems |= found.problems
        return self._in_order(problems)

    def _in_order(self, problems: Mapping[str, str]) -> dict[str, str]:
        """Return mistakes in the order of the fields, those of no field last."""
        return {key: problems[key] for key in (*self._fields, *problems) if key in problems}

    def problems(self) -> dict[str, str]:
        """Return what is wrong in each field, by key; empty if nothing is."""
        return {key: text for key in self._fields if (text := self.problem_of(key))}

    def problem_of(self, key: str) -> str:
        """Return what is wrong in a field; empty if nothing is."""
        try:
            self._fields[key].check()
        except ValueError as error:
            return str(error)
        return ""

    def is_wrong(self, key: str) -> bool:
        """Return whether a mistake is shown at this field."""
        return bool(self._fields[key].problem.text)

    def clear(self) -> None:
        """Forget all fields, because others will be added."""
        self._fields.clear()

    async def submit(self, act: Callable[[dict[str, Any]], Any], find: FindMistakes | None = None) -> bool:
        """Pass what was entered to a function, in a thread; show all mistakes at their fields.

        Args:
            act: Takes the values by key; raises FormError for mistakes in fields.
            find: As in `all_problems`. Without it, mistakes that only `act` finds come after the others.

        Returns:
            Whether it succeeded.
        """
        with ui.context.client:  # the button that was pressed may be gone by then
            problems = await self.all_problems(find)
            if not problems:
                try:
                    await run.io_bound(act, {key: field.check() for key, field in self._fields.items()})
                except FormError as error:
                    problems = error.problems
                except WRONG as error:
                    problems = {"": str(error)}
            self.show_problems(problems)
            return not problems

    def show_problems(self, problems: Mapping[str, str]) -> None:
        """Show mistakes at their fields and in the summary, and move the focus to the first field with one.

        Args:
            problems: Messages by key; a key that is no field's is shown in the summary only.
        """
        problems = self._in_order(problems)
        self._refused = {
            key: (self._fields[key].input.value, text)
            for key, text in problems.items()
            if key in self._fields
        }
        for key, field in self._fields.items():
            self._mark(field, problems.get(key, ""))
            if key in problems:
                for around in field.input.ancestors():
                    if isinstance(around, ui.expansion):
                        around.value = True  # a mistake is never in a closed section
        self._summary.clear()
        self._summary.set_visibility(bool(problems))
        if not problems:
            return
        with self._summary:
            for key, text in problems.items():
                named = self._fields.get(key)
                if named is None:
                    ui.label(text if key in ("", text) else f"{key}: {text}")
                else:
                    target = _control(named.input)
                    link = ui.link(f"{named.label}: {text}", f"#{target}")
                    link.on("click", js_handler=f"(e) => {{ e.preventDefault(); {_focus(target)} }}")
        first = next((_control(self._fields[key].input) for key in problems if key in self._fields), "")
        _focus_later(first, self._summary.html_id)

    def refuse(self, error: FormError) -> bool:
        """Show mistakes at fields of a form without a summary, and move the focus there; False if it lacks a field."""
        if not set(error.problems) <= set(self._fields):
            return False
        for key, text in error.problems.items():
            field = self._fields[key]
            self._refused[key] = (field.input.value, text)
            self._mark(field, text)
            _focus_later(_control(field.input))
        return True

    def _refused_again(self, key: str) -> str:
        """Return the message about a value that was refused and has not changed; empty if there is none."""
        value, text = self._refused.get(key, (None, ""))
        return text if text and self._fields[key].input.value == value else ""

    def _around(self, label: str) -> ui.element:
        box = ui.element("div").classes("lab-field")
        with box:
            self._label = ui.html(html.escape(label), tag="label", sanitize=False).classes("lab-label")
        return box

    def _add(
        self, key: str, label: str, element: ValueElement[Any], explanation: str, check: Callable[[], Any]
    ) -> None:
        element.props(f'outlined dense for="{_control(element)}"')
        self._label.props(f'for="{_control(element)}"')
        self._explain(key, label, element, explanation, check)

    def _explain(
        self, key: str, label: str, element: ValueElement[Any], explanation: str, check: Callable[[], Any]
    ) -> None:
        """Add a field with the lines below it."""
        note = ui.label(explanation).classes("lab-hint") if explanation else None
        problem = ui.label("").classes("lab-problem")
        field = self._fields[key] = _Field(label, element, problem, note, check)
        self._mark(field, "")
        element.on(
            "blur",
            lambda: self._mark(field, self.problem_of(key) or self._refused_again(key)),
            js_handler="() => whenReleased(() => emit())",
        )

    def _mark(self, field: _Field, text: str) -> None:
        # an update sends the value that the server knows, and the visitor may be entering another one
        if text == field.marked:
            return
        field.problem.text = field.marked = text
        field.problem.set_visibility(bool(text))
        about = [each.html_id for each in (field.help, field.problem if text else None) if each is not None]
        for name, value in (
            ("aria-describedby", " ".join(about)),
            ("aria-invalid", "true" if text else ""),
            ("error", bool(text)),
        ):
            if value:
                field.input.props[name] = value
            else:
                field.input.props.pop(name, None)
        field.input.props["no-error-icon"] = True
        field.input.props["hide-bottom-space"] = True
        field.input.update()


def _with_default(field: OrderField, choices: Choices | None) -> Choices | None:
    """Return choices with that of the default, if the field may be empty."""
    if choices is None or not field.is_optional:
        return choices
    return {"Default": {"": field.face.default_is.capitalize() or "None"}} | dict(choices)


def _control(element: ui.element) -> str:
    """The id of the control that takes the focus."""
    return f"f{element.id}"


def _focus_later(target: str, otherwise: str = "") -> None:
    """Move the focus when the page is drawn, unless the visitor types in another field by then."""
    ui.run_javascript(f"setTimeout(() => {{ if (!isTypingOn()) {{ {_focus(target, otherwise)} }} }}, 50)")


def _focus(target: str, otherwise: str = "") -> str:
    """Return the script that moves the focus to a control, or to another element if the control is not in sight."""
    return (
        f"const [it, other] = ['{target}', '{otherwise}'].map((id) => document.getElementById(id)); "
        "const seen = it?.checkVisibility() ? it : other; "
        "const height = other && seen.getBoundingClientRect().bottom - other.getBoundingClientRect().top; "
        "const fits = other && height < innerHeight - 200; "
        "seen.focus({preventScroll: true}); "
        "(fits ? other : seen).scrollIntoView({block: fits ? 'start' : 'center'});"
    )
