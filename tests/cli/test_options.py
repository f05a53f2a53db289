"""Options of every command: one value means one, and messages name options that their command has."""

import ast
import inspect
import re
from pathlib import Path

import pytest
import typer

import realitygap
from realitygap.cli import app


def commands():
    """Yield the words of every command, and the command."""
    for name, command in typer.main.get_command(app).commands.items():
        members = getattr(command, "commands", None)
        if members is None:
            yield (name,), command
        else:
            yield from (((name, key), member) for key, member in members.items())


def test_second_value_of_an_option_is_refused_by_every_command():
    """The last of several values counted, in silence."""
    n_options = 0
    for words, command in commands():
        for option in command.params:
            if option.param_type_name != "option" or option.is_flag or option.multiple or option.count:
                continue
            n_options += 1
            for first, second in ((option.opts[0], option.opts[-1]), (option.opts[-1], option.opts[0])):
                with pytest.raises(typer.BadParameter) as error:
                    command.make_context(words[-1], [first, "1", second, "2"])
                assert f"{option.opts[0]} is given 2 times" in error.value.message, (words, option.opts)
    assert n_options > 200


SOURCES = Path(realitygap.__file__).parent
PRINTED_BY = {
    "calibration/_prior.py": ("calibrate",),
    "cli/_calibration_operator.py": ("calibrate",),
    "cli/_demo.py": ("demo",),
    "cli/_observer.py": ("calibrate", "drive", "gap"),
    "cli/_operator.py": ("drive",),
    "emulator/_serve.py": ("emulate scribbler",),
    "emulator/command.py": ("emulate scribbler",),
    "gap/_measure.py": ("compare",),
    "gap/_scores.py": ("compare",),
    "lab/_server.py": ("lab",),
    "logs/_log_map.py": ("calibrate", "import"),
    "logs/_range_table.py": ("calibrate",),
    "logs/_round_robot.py": ("calibrate",),
    "logs/_scores.py": ("compare", "estimate"),
    "logs/_table_map.py": ("calibrate",),
    "orders/_calibrate.py": ("calibrate",),
    "orders/_gap.py": ("gap",),
    "orders/_order.py": ("calibrate", "gap", "transfer"),
    "orders/_plan.py": ("plan",),
    "orders/_record.py": ("calibrate", "gap", "transfer"),
    "orders/_compare.py": ("compare",),
    "orders/_estimate.py": ("estimate",),
    "orders/_transfer.py": ("transfer", "try"),
    "platforms/_python.py": (
        "calibrate",
        "drive",
        "gap",
        "lab",
        "plan",
        "platforms",
        "run",
        "transfer",
        "try",
    ),
    "platforms/_spec.py": ("drive", "gap", "run"),
    "records/_ledger.py": ("drive",),
    "records/_trial_log.py": ("trials",),
    "study/_calibrate/from_table.py": ("calibrate",),
    "study/_calibrate/hold_out.py": ("calibrate",),
    "study/_calibrate/kinds.py": ("calibrate",),
    "study/_calibrate/one.py": ("calibrate",),
    "study/_calibrate/ordered.py": ("calibrate",),
    "study/_calibrate/whole.py": ("calibrate",),
    "study/_camera.py": ("calibrate", "drive", "gap", "track"),
    "study/_close.py": ("close",),
    "study/_cluster.py": ("run",),
    "study/_code.py": ("gap", "plan"),
    "study/_compare.py": ("compare",),
    "study/_file.py": ("drive", "gap", "run"),
    "study/_gap/between.py": ("gap",),
    "study/_estimate_table.py": ("estimate",),
    "study/_gap/estimate.py": ("estimate",),
    "study/_gap/study.py": ("gap",),
    "study/_order.py": ("run",),
    "study/_physical.py": ("drive",),
    "study/_run.py": ("drive", "run"),
    "study/_targets.py": ("calibrate", "gap", "transfer", "try"),
    "study/_task.py": ("bench",),
    "study/_tracked.py": ("track",),
    "study/_kept_target.py": ("calibrate", "gap", "transfer", "try"),
    "study/_try_pairs.py": ("try",),
    "tasks/_python.py": ("drive", "gap", "lab", "plan", "run", "try"),
    "vision/_ros_map.py": ("arena",),
    "vision/_sheet_trials.py": ("score",),
    "vision/track/_align.py": ("track",),
    "report/_page.py": ("drive", "run"),
    "world/_calibration.py": ("calibrate",),
}
"""Commands that print the messages of a module. A message of others names the command: `realitygap run --fresh`."""
OTHER_PROGRAMS = (
    "vision/_cells.py",
    "_how_to_run.py",
    "families/thymio/playground/_playground.py",
    "classroom/myro/__main__.py",
    "cli/_commands.py",
)
"""Modules with the options of other programs, and of the list of commands."""
OPTION = re.compile(r"(?<![\w-])(?<!dask worker )--(?!show-completion)[a-z][a-z-]*[a-z]")
PART = re.compile(r"\s*(--[a-z-]+[ =]?(\{\})?\s*)+")
"""A part of a command: options, and values of them."""
COMMAND = re.compile(r"(?:realitygap|\{\}) ([a-z][a-z-]*)(?: ([a-z][a-z-]*))?")


def messages(path):
    """Yield the texts of a module that a user may read, with {} for values; docstrings only of commands."""
    tree = ast.parse(path.read_text("utf-8"))
    inner = {
        id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)
    }
    inner -= {id(node) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)}
    hidden = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module) and path.parent.name != "cli":
            hidden |= {id(node.body[0].value)} if node.body and isinstance(node.body[0], ast.Expr) else set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner | hidden
        ):
            yield node.value


@pytest.mark.slow
def test_options_that_messages_name_are_options_of_the_command_that_prints_them():
    """A message on irregular times offered --step to commands that have no such option."""
    known, printed_by = {}, {}
    for words, command in commands():
        known[words] = {
            name for option in command.params for name in (*option.opts, *option.secondary_opts)
        } | {"--help"}
        module = f"cli/{inspect.unwrap(command.callback).__module__.rpartition('.')[2]}.py"
        printed_by.setdefault(module, set()).add(words)
    known[("again",)] |= (
        known[("calibrate",)] | known[("gap",)] | known[("transfer",)]
    )  # it passes options on
    for module, names in PRINTED_BY.items():
        printed_by.setdefault(module, set()).update(tuple(name.split()) for name in names)
    robots = [options for words, options in known.items() if words[0] == "emulate"]
    known["emulate",] = set.intersection(*robots)  # those of every robot
    wrong, seen = [], 0
    for path in sorted(SOURCES.rglob("*.py")):
        module = path.relative_to(SOURCES).as_posix()
        for text in () if module in OTHER_PROGRAMS else messages(path):
            if PART.fullmatch(text) or "var(--" in text or ": var" in text:  # a variable of a style sheet
                continue
            for found in OPTION.finditer(text):
                named = COMMAND.findall(text[: found.start()])
                owner = [words for pair in named[::-1] for words in (pair, pair[:1]) if words in known]
                owners = owner[:1] or printed_by.get(module, ())
                lacking = [words for words in owners if found[0] not in known[words]]
                is_of_one = module.startswith(("cli/", "orders/")) and len(lacking) < len(
                    owners
                )  # of a module with several
                seen += 1
                if not owners or (lacking and not is_of_one):
                    wrong.append(
                        f"{module}: {found[0]} in {text[:90]!r}: no option of {lacking or 'a named command'}"
                    )
    assert seen > 200
    assert not wrong, "\n".join(wrong)
