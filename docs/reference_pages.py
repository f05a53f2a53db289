"""The reference pages that come from the code itself: settings, named sets, columns, commands, choices.

`conf.py` calls `write_all` at each build, so none of these can say something else than the program.
"""

from __future__ import annotations

import csv
import inspect
import re
import tomllib
import types
import typing
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import typer
from description_pages import description_parts
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from task_pages import task_parts

from realitygap.classroom import myro
from realitygap.classroom.myro._catalog import DONE, LEFT_OUT
from realitygap.cli import app
from realitygap.evolution import DISTANCES, NAMED_SETTINGS, NeatSettings, NoveltySettings
from realitygap.platforms import built_in_platforms
from realitygap.records import column_table, derived_table, ledger_tables
from realitygap.runs import ArchiveSettings, Condition
from realitygap.settings import is_hidden
from realitygap.study import (
    DEFAULT_NEAT,
    ConditionNotes,
    ReportSection,
    StudySection,
    TrialsSection,
    load_study,
)
from realitygap.tasks import (
    AvoidTask,
    ControllerSettings,
    CoverageTask,
    GoalTask,
    LightTask,
    WallTask,
)
from realitygap.world import ArenaSettings, Distribution, RobotModel

CHOICES_DATA = Path(__file__).parent / "data" / "choices.csv"
FEATURES_DATA = Path(__file__).parent / "data" / "jyro-features.toml"
CONDITION_KEYS = ("name", "selection", "platform", "noise")
TABLES: dict[str, type[BaseModel]] = {
    "[study]": StudySection,
    "[arena]": ArenaSettings,
    "[task]": CoverageTask,
    '[task] with kind = "avoid"': AvoidTask,
    '[task] with kind = "light"': LightTask,
    '[task] with kind = "wall"': WallTask,
    '[task] with kind = "goal"': GoalTask,
    "[controller]": ControllerSettings,
    "[neat]": NeatSettings,
    "[novelty]": NoveltySettings,
    "[archive]": ArchiveSettings,
    **{f"[platform.{model.name}]": model for model in built_in_platforms() if model.is_for_studies},
    "[trials]": TrialsSection,
    "[report]": ReportSection,
    "[[condition]]": Condition,
    "[[condition]], notes": ConditionNotes,
}


def write_all(folder: Path, more: Mapping[str, str] | None = None) -> None:
    """Write all generated pages, parts of pages, and `more`, into a folder; what did not change stays untouched."""
    pages = {
        **(more or {}),
        "parts/settings.md": settings_page(),
        "parts/neat-sets.md": neat_sets(),
        "parts/columns.md": columns(),
        "parts/derived-columns.md": derived_columns(),
    }
    pages["parts/ledger.md"] = ledger()
    pages["parts/choices.md"] = choices()
    pages["parts/largest-choices.md"] = largest_choices()
    pages["parts/distances.md"] = distances()
    pages["parts/commands.md"] = commands_table()
    pages["parts/myro.md"] = myro_functions()
    pages["parts/jyro-features.md"] = jyro_features()
    pages |= description_parts() | task_parts()
    pages |= {f"commands/{name.replace(' ', '-')}.md": page for name, page in command_pages().items()}
    for name, text in pages.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


# Myro


def myro_functions() -> str:
    """Every name of Myro: what is done by subject, and what is left out with its reason."""
    parts = []
    for subject, names in DONE.items():
        rows = [f"| `{name}{signature(name)}` | {escape(meaning(name))} |" for name in names]
        parts.append("\n".join([f"## {subject}", "", "| function | what it does |", "|---|---|", *rows]))
    reasons: dict[str, list[str]] = {}
    for name, reason in LEFT_OUT.items():
        reasons.setdefault(reason, []).append(f"`{name}`")
    rows = [f"| {', '.join(names)} | {escape(reason)} |" for reason, names in reasons.items()]
    parts.append(
        "\n".join(["## Left out", "", "| functions | why, and what to do instead |", "|---|---|", *rows])
    )
    return "\n\n".join(parts) + "\n"


def signature(name: str) -> str:
    """The arguments of one of Myro's functions, with their defaults and without types; nothing for values."""
    item = getattr(myro, name)
    if not callable(item):
        return ""
    arguments = []
    for argument in inspect.signature(item).parameters.values():
        bare = argument.replace(annotation=inspect.Parameter.empty)
        arguments.append(str(bare))
    return f"({', '.join(arguments)})"


def meaning(name: str) -> str:
    """The first line of what one of Myro's functions says of itself, and where it differs from Myro."""
    item = getattr(myro, name)
    if isinstance(item, myro.Color):
        return f"the color {', '.join(map(str, item.getRGB()))}"
    text = inspect.getdoc(item) or ""
    differs = re.search(r"Differs: (.*?)(?:\n\n|\Z)", text, re.DOTALL)
    first = text.split("\n\n")[0]
    more = f" Differs: {differs[1]}" if differs and "Differs:" not in first else ""
    return " ".join((first + more).split())


# Jyro


def jyro_features() -> str:
    """Every feature of Jyro: where it is here, and the test that holds it, or why it is left out."""
    parts = []
    for group, features in tomllib.loads(FEATURES_DATA.read_text("utf-8")).items():
        rows = [
            f"| {name} | {feature_place(entry)} | {feature_test(entry)} |" for name, entry in features.items()
        ]
        parts.append("\n".join([f"## {group}", "", "| in Jyro | here | test |", "|---|---|---|", *rows]))
    return "\n\n".join(parts) + "\n"


def feature_place(entry: Mapping[str, Any]) -> str:
    """Where a feature is, with what is to be said of it."""
    if "left_out" in entry:
        return f"left out: {escape(entry['left_out'])}"
    names = ", ".join(f"`{name}`" for name in entry["here"])
    attribute = f" (`{entry['attribute']}`)" if "attribute" in entry else ""
    return f"{names}{attribute}" + (f". {escape(entry['note'])}" if "note" in entry else "")


def feature_test(entry: Mapping[str, Any]) -> str:
    """The test that holds a feature."""
    if "test" not in entry:
        return ""
    file, name = entry["test"].split("::")
    return f"`tests/{file}`" + ("" if name == "*" else f": {name.removeprefix('test_').replace('_', ' ')}")


# settings


def settings_page() -> str:
    """Every setting of every table of a study file."""
    parts = []
    for table, model in TABLES.items():
        parts += [f"## `{table}`", first_line(model)]
        parts += [setting(key, info, model) for key, info in settings_of(model).items()]
    return "\n\n".join(parts) + "\n"


def settings_of(model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """The fields that a study file can set: of a condition only its own keys, its tables being listed apart."""
    if model is Condition:
        return {key: Condition.model_fields[key] for key in CONDITION_KEYS}
    return {key: info for key, info in model.model_fields.items() if not is_hidden(info)}


def first_line(model: type[BaseModel]) -> str:
    """What a model is, in one sentence."""
    return (model.__doc__ or "").strip().splitlines()[0]


def setting(key: str, info: FieldInfo, model: type[BaseModel]) -> str:
    """One setting as an entry of a definition list."""
    facts = [values_of(info.annotation, info.metadata)]
    default = NAMED_SETTINGS[DEFAULT_NEAT].get(key, info.default) if model is NeatSettings else info.default
    if info.default_factory is None:
        facts.append("no default" if info.is_required() else f"default {toml(default)}")
    return f"`{key}`\n: {'; '.join(facts)}.\n\n  {escape(info.description or '')}"


def values_of(annotation: Any, metadata: list[Any]) -> str:
    """What a setting may be, in words."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        inner, *more = typing.get_args(annotation)
        limits = [
            part for each in more for part in (each.metadata if isinstance(each, FieldInfo) else [each])
        ]
        return values_of(inner, [*limits, *metadata])
    if origin in (typing.Union, types.UnionType):
        each = [values_of(arm, metadata) for arm in typing.get_args(annotation) if arm is not type(None)]
        return ", or ".join(each)
    if origin is Literal:
        return ", ".join(toml(value) for value in typing.get_args(annotation))
    if origin is dict:
        return f"a table of {values_of(typing.get_args(annotation)[1], []).replace('a number', 'numbers')}"
    if origin is tuple:
        return "a list of texts"
    if origin is list:
        (inner,) = typing.get_args(annotation)
        length = next((part.max_length for part in metadata if getattr(part, "max_length", None)), None)
        return f"a list of {length or 'any number of'} numbers{values_of(inner, []).removeprefix('a number')}"
    limits = limits_of(metadata)
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
    names |= {RobotModel: "a robot by name or file", Distribution: "how one is drawn"}
    return names[annotation] + (f", {limits}" if limits else "")


def limits_of(metadata: list[Any]) -> str:
    """Limits in words, from what pydantic keeps of them."""
    found = {name: value for part in metadata for name, value in vars_of(part).items()}
    if "max_length" in found:
        return f"at most {found['max_length']} letters"
    least = f"more than {number(found['gt'])}" if "gt" in found else number(found.get("ge"))
    most = f"less than {number(found['lt'])}" if "lt" in found else number(found.get("le"))
    if least and most:
        return f"{least} to {most}"
    return f"at least {least}" if least and "ge" in found else least


def number(value: float | None) -> str:
    """A limit; empty where there is none."""
    return "" if value is None else f"{value:,.10g}" if isinstance(value, float) else f"{value:,}"


def vars_of(part: Any) -> dict[str, Any]:
    """The attributes of a limit, with or without slots."""
    names = getattr(type(part), "__slots__", ()) or vars(part)
    found = {name: getattr(part, name, None) for name in names if not name.startswith("_")}
    return {name: value for name, value in found.items() if value is not None}


def toml(value: Any) -> str:
    """A value as it stands in a study file."""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, str):
        return f'`"{value}"`'
    return "none" if value is None else f"`{value}`"


def escape(text: str) -> str:
    """Prose that Markdown leaves as it is."""
    return re.sub(r"([*<>|\[\]_])", r"\\\1", text).replace("\n", " ")


def neat_sets() -> str:
    """The named sets of NEAT settings side by side; in bold where one differs from `default`."""
    names = list(NAMED_SETTINGS)
    sets = [NeatSettings.named(name) for name in names]
    lines = [
        "| setting | " + " | ".join(f"`{name}`" for name in names) + " |",
        "|---" * (len(names) + 1) + "|",
    ]
    for key in NeatSettings.model_fields:
        if key == "settings":
            continue
        values = [getattr(each, key) for each in sets]
        shown = [f"**{value_text(v)}**" if v != values[0] else value_text(v) for v in values]
        lines.append(f"| `{key}` | " + " | ".join(shown) + " |")
    return "\n".join(lines) + "\n"


def value_text(value: Any) -> str:
    """A value in a table."""
    return str(value).lower() if isinstance(value, bool) else str(value)


# columns


def columns() -> str:
    """The columns of a frame of results."""
    lines = ["| column | type | what it holds |", "|---|---|---|"]
    lines += [f"| `{name}` | {kind} | {escape(text)} |" for name, kind, text in column_table()]
    return "\n".join(lines) + "\n"


def derived_columns() -> str:
    """The columns of the frames that are derived from rows, one table each."""
    parts = []
    for what, row in (
        ("species", "one species in one generation"),
        ("innovations", "one innovation number in one run"),
        ("lineage", "one individual"),
    ):
        lines = ["| column | type | what it holds |", "|---|---|---|"]
        lines += [f"| `{name}` | {kind} | {escape(text)} |" for name, kind, text in derived_table(what)]
        parts.append(f"## `{what}`\n\nA row is {row}.\n\n" + "\n".join(lines))
    return "\n\n".join(parts) + "\n"


def ledger() -> str:
    """The tables of a ledger, as SQLite is told them."""
    parts = [f"### `{name}`\n\n```sql\n{sql}\n```" for name, sql in ledger_tables().items()]
    return "\n\n".join(parts) + "\n"


# commands


def commands() -> dict[str, Any]:
    """Every command of the command line by name, those of a group with the group's before it."""
    found: dict[str, Any] = {}
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        members = getattr(command, "commands", None)
        found |= {name: command} if members is None else {f"{name} {each}": members[each] for each in members}
    return found


def command_pages() -> dict[str, str]:
    """A page for each command: what it does, how it is called, its options, and last its Python twin."""
    return {name: command_page(name, command) for name, command in commands().items()}


def commands_table() -> str:
    """A table of commands: a link to the page of each, its purpose, and its function in Python."""
    lines = ["| command | purpose | in Python |", "|---|---|---|"]
    for name, command in commands().items():
        page = f"[`{name}`](../generated/commands/{name.replace(' ', '-')}.md)"
        twin = re.search(r"In Python: ([\w.]+)", command.help)[1]
        lines.append(f"| {page} | {escape(command.help.split(chr(10))[0])} | `{twin}` |")
    return "\n".join(lines) + "\n"


def command_page(name: str, command: Any) -> str:
    """One command's page."""
    said = [" ".join(each.split()) for each in (command.help or "").strip().split("\n\n")]
    examples = [each.removeprefix("Example: ") for each in said if each.startswith("Example: ")]
    twins = [each.removeprefix("In Python: ") for each in said if each.startswith("In Python: ")]
    about = [each for each in said if not each.startswith(("Example: ", "In Python: "))]
    arguments = [each for each in command.params if each.param_type_name == "argument"]
    options = [each for each in command.params if each.param_type_name == "option"]
    called = " ".join(["realitygap", name, *(each.metavar for each in arguments), "[OPTIONS]"])
    paragraphs = "\n\n".join(escape(each) for each in about)
    parts = [f"# `realitygap {name}`", paragraphs, f"```text\n{called}\n```"]
    groups = {"": [(f"`{each.metavar}`", each.help) for each in arguments]}
    for each in options:
        groups.setdefault(each.rich_help_panel or "", []).append((option_text(each), each.help))
    for title, rows in groups.items():
        parts += [f"{title}:"] if title else []
        parts.append(
            "\n".join(
                ["| | |", "|---|---|", *(f"| {left} | {escape(right or '')} |" for left, right in rows)]
            )
        )
    for head, kind, lines in (("Example:", "sh", examples), ("In Python:", "py", twins)):
        parts += [head, "\n".join([f"```{kind}", *lines, "```"])]
    return "\n\n".join(parts) + "\n"


def option_text(option: Any) -> str:
    """An option with what it takes: a name, else a number."""
    kind = getattr(option, "type_descriptor", None)  # since Typer has a Click of its own
    is_text = option.type.name == "text" if kind is None else kind.annotation is str
    word = option.metavar or ("NAME" if is_text else "N")
    takes = "" if option.is_flag else f" {word}"
    return ", ".join(f"`{each}{takes}`" for each in option.opts)


# distances


def distances() -> str:
    """What each distance of behaviors says of itself, and in full."""
    compared = {
        "position": "where trials end",
        True: "the list of cells, in order",
        False: "the set of cells",
    }
    lines = ["| distance | compares | needs the order | metric | unit | steps |", "|---|---|---|---|---|---|"]
    told = []
    for name, each in DISTANCES.items():
        what = compared["position" if each.compares == "position" else each.needs_order]
        unit = "0 to 1" if each.unit == "1" else each.unit
        words = ["yes" if value else "no" for value in (each.needs_order, each.is_metric)]
        lines.append(f"| `{name}` | {what} | {' | '.join(words)} | {unit} | {each.cost} |")
        told.append(f"`{name}`\n: {escape(each.description)} Source: {escape(each.source)}")
    return "\n".join(lines) + "\n\n" + "\n\n".join(told) + "\n"


# choices

# Choices that the paper leaves open, ours, and the alternatives with the conditions of `paper-choices` that try them.
CHOICES: list[tuple[str, str, str, list[tuple[str, list[str]]]]] = [
    (
        "Output of the network",
        "“a direction for the robot composed of a move and a turn”",
        '`neat.activation = "tanh"`: −1 to 1',
        [('`"sigmoid"`: 0 to 1, which can neither reverse nor turn right', ["coverage-sigmoid"])],
    ),
    (
        "Start of trials",
        "“the same initial point for every path”",
        '`arena.start = "corner"`: the center of cell (1, 1), facing along the long side',
        [
            ('`"center"`: the arena\'s center', ["coverage-start-center"]),
            ('`"left"`: the middle of the left side', ["coverage-start-left"]),
        ],
    ),
    (
        "Visited cells",
        "squares that the path “crosses through”; a full-speed step is longer than a cell",
        '`task.cells = "line"`: all cells that the line crosses',
        [('`"ends"`: the cells in which steps end', ["coverage-cells-ends", "novelty-cells-ends"])],
    ),
    (
        "Position of the sensors",
        "three sensors on the front, facing straight ahead",
        "`jyro.sensor_offset = 0.05`: 0.05 m apart, on the front edge",
        [("`0.02`", ["coverage-sensors-near"]), ("`0.08`", ["coverage-sensors-wide"])],
    ),
    (
        "A reading after noise was added",
        "limited to 1 before; not stated for after",
        '`jyro.noisy_reading = "leave"`',
        [('`"clip"`: limited to 0..1', ["coverage-clip"])],
    ),
    (
        "Steps of a simulated trial",
        "87, from 13.75 in and 19.7 in; these lengths give 70",
        "`jyro.steps = 87`",
        [("`70`", ["coverage-steps-70"])],
    ),
    (
        "Turn in one step at full output",
        "not mentioned: the simulator's 0.1 rad; the robot turns several times as far in one command",
        "`jyro.turn_per_step = 0.1`",
        [
            ("`0.3`", ["coverage-turn-0.3"]),
            ("`0.6`", ["coverage-turn-0.6"]),
            ("`0.9`", ["coverage-turn-0.9", "novelty-turn-0.9"]),
        ],
    ),
    (
        "The constant (bias) input",
        "“when we use novelty”; Table 1 has 3 inputs",
        '`task.bias_input = "with-novelty"`',
        [('`"always"`', ["coverage-bias-input"]), ('`"never"`', ["novelty-no-bias-input"])],
    ),
    (
        "The time input",
        "“a measure of time”",
        '`task.time_input = "from-0"`: step / steps',
        [],
    ),
    (
        "Version of NEAT",
        "“Kenneth O. Stanley's Python implementation”; Table 1 uses an old neat-python's words",
        '`neat.settings = "rosenzweig-remy"`: the published NEAT with Table 1 on top',
        [('`"rosenzweig-remy-neat-python"`: a bias in every node, its slope', ["coverage-neat-python"])],
    ),
    (
        "First weights",
        "not given",
        "`neat.initial_weight = 1.0`",
        [("`3.0`", ["coverage-weights-wide"]), ("`0.3`", ["coverage-weights-narrow"])],
    ),
    (
        "Step of weights",
        "not given",
        "`neat.weight_step = 2.5`",
        [("`0.5`", ["coverage-steps-small"])],
    ),
    (
        "Replaced weights",
        "not given",
        "`neat.replace_weight = 0.1`",
        [("`0.0`", ["coverage-replace-none"])],
    ),
    (
        "Compatibility of genomes",
        "not given",
        "`neat.threshold = 3.0`",
        [("`1.0`", ["coverage-threshold-1"])],
    ),
    (
        "Size of the novelty archive",
        "not given",
        "`novelty.archive_size = 8`",
        [("`4`", ["novelty-archive-4"]), ("`20`", ["novelty-archive-20"])],
    ),
    (
        "Condition to enter the full archive",
        "a behavior “more novel than the other behaviors in the archive”",
        '`novelty.enter = "above-all"`',
        [('`"above-least"`: above the least novel', ["novelty-least"])],
    ),
    (
        "How the cells of a behavior are sorted",
        "“sorted”",
        '`novelty.sort = "x-then-y"`',
        [('`"y-then-x"`', ["novelty-sort-y"])],
    ),
    (
        "How novelty is computed from distances",
        "not given",
        '`novelty.kind = "paper"`: the mean distance to the archive',
        [('`"lehman-stanley"`: the nearest in population and archive', ["novelty-nearest"])],
    ),
    (
        "Value of a generation in Figure 4",
        "not given",
        '`report.points = "best-of-generation"`',
        [('`"best-so-far"`; changes the figure and no result', [])],
    ),
]


def choices_rows() -> dict[str, dict[str, str]]:
    """What `make_choices.py` wrote, by condition."""
    with CHOICES_DATA.open(newline="", encoding="utf-8") as file:
        return {row["condition"]: row for row in csv.DictReader(file)}


def choices() -> str:
    """The table of choices with the result of each alternative beside that of our setting."""
    rows = choices_rows()
    n = sorted({row["n"] for row in rows.values()})
    lines = [f"SIM, n = {', '.join(n)} runs of each condition, 50 % noise.", ""]
    for baseline in sorted({row["baseline"] for row in rows.values()}):
        row = rows[baseline]
        lines.append(f"* Ours, selection by {baseline}: median {row['median']} [{row['low']}, {row['high']}]")
    lines += ["", "| choice, and the paper's words | ours | alternative | selection | median | difference |"]
    lines.append("|---|---|---|---|---|---|")
    for question, paper, ours, alternatives in CHOICES:
        head = [f"**{question}**: {paper}", ours]
        for alternative, conditions in alternatives or [("none is offered", [])]:
            words = alternative
            for result in [results(rows[each]) for each in conditions] or [["", "", ""]]:
                lines.append("| " + " | ".join([*head, words, *result]) + " |")
                head, words = ["", ""], ""
    return "\n".join(lines) + "\n"


def largest_choices() -> str:
    """The alternatives whose interval of the median lies apart from that of their baseline, and the baselines."""
    rows = choices_rows()
    n = sorted({row["n"] for row in rows.values()})
    lines = [
        "| selection | what is changed | median best coverage [95 %] | difference |",
        "|---|---|---|---|",
    ]
    for row in rows.values():
        baseline = rows[row["baseline"]]
        if row["condition"] == row["baseline"]:
            lines.append(f"| {row['baseline']} | nothing | {results(row)[1]} | |")
        elif row["low"] > baseline["high"] or row["high"] < baseline["low"]:
            lines.append(
                "| " + " | ".join([row["baseline"], escape(row["change"]), *results(row)[1:]]) + " |"
            )
    lines += [
        "",
        f"SIM, n = {', '.join(n)} runs of each, 50 % noise; those whose interval lies apart from ours.",
    ]
    return "\n".join(lines) + "\n"


def results(row: Mapping[str, str]) -> list[str]:
    """One alternative's selection, median with interval, and difference."""
    return [row["baseline"], f"{row['median']} [{row['low']}, {row['high']}]", row["effect"]]


def tried_conditions() -> list[str]:
    """Conditions of `paper-choices` that the table names."""
    return [name for *_, alternatives in CHOICES for _, names in alternatives for name in names]


def conditions_to_try() -> list[str]:
    """Conditions of `paper-choices` that change something."""
    study = load_study("paper-choices")
    return [
        c.name for c, note in zip(study.conditions, study.notes, strict=True) if note.baseline is not None
    ]
