"""Measure how many small faults in three kernels and in the ledger the tests detect (mutation testing).

    uv run python benchmarks/mutants.py                                   # about 10 processor minutes
    uv run python benchmarks/mutants.py --most 200 kernels/tasks/coverage.py

A mutant is a copy of the package with one fault in one module: another operator, another number, an inverted
condition, or a missing statement. A mutant is killed if a test of its module fails or does not end. Kernels run as
plain Python, so no mutant needs compiling. Texts stay as they are, SQL statements included.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import os
import random
import resource
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent

LEDGER = ["tests/records/test_ledger.py"]
MODULES = {
    "kernels/tasks/coverage.py": ["tests/kernels/test_coverage.py"],
    "kernels/neat/species.py": ["tests/kernels/test_species.py"],
    "kernels/neat/novelty.py": ["tests/kernels/test_novelty.py"],
    "records/_ledger.py": LEDGER,
    "records/_ledger_file.py": [*LEDGER, "tests/test_limits.py", "tests/records/test_inside.py"],
    "records/_ledger_rows.py": LEDGER,
}
"""Modules of the package, and their tests."""

LIBRARIES = ("hypothesis", "numba", "polars", "pydantic", "pytest", "scipy.stats")
"""Imported once, before the mutants' processes are forked."""

OPERATORS: dict[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult, ast.Break: ast.Continue, ast.Continue: ast.Break,
}  # fmt: skip
FUNCTIONS = {"min": "max", "max": "min", "any": "all", "all": "any", "floor": "ceil", "abs": "float"}


def faults(node: ast.AST) -> Iterator[ast.AST]:
    """Yield what can replace a node."""
    match node:
        case ast.Compare(left=left, ops=[op], comparators=comparators) if type(op) in OPERATORS:
            yield ast.Compare(left, [OPERATORS[type(op)]()], comparators)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            yield ast.BinOp(left, OPERATORS[type(op)](), right)
        case ast.BoolOp(op=op, values=values):
            yield ast.BoolOp(OPERATORS[type(op)](), values)
        case ast.AugAssign(target=target, op=op, value=value):
            yield ast.AugAssign(target, OPERATORS[type(op)](), value)
            yield ast.Pass()
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            yield ast.Constant(value + 1)
        case ast.Name(id=name, ctx=context) if name in FUNCTIONS:
            yield ast.Name(FUNCTIONS[name], context)
        case ast.UnaryOp(op=ast.Not() | ast.USub(), operand=operand):
            yield operand
        case ast.If(test=test, body=body, orelse=orelse):
            yield ast.If(ast.UnaryOp(ast.Not(), test), body, orelse)
        case ast.IfExp(test=test, body=one, orelse=other):
            yield ast.IfExp(test, other, one)
        case ast.Break() | ast.Continue():
            yield OPERATORS[type(node)]()
        case ast.Expr(value=ast.Call()) | ast.Raise() | ast.Assign():
            yield ast.Pass()
        case ast.Return(value=value) if value is not None:
            yield ast.Return(None)


class _Replace(ast.NodeTransformer):
    """Replaces the node with a number, counted over the statements of functions, by its fault with a number."""

    def __init__(self, wanted: int, fault: int) -> None:
        self.wanted, self.fault = wanted, fault
        self.n, self.n_faults, self.line = 0, 0, 0

    def visit(self, node: ast.AST) -> ast.AST:
        if isinstance(node, ast.arguments):
            return node  # annotations are not evaluated
        number, self.n = self.n, self.n + 1
        if number != self.wanted:
            return self.generic_visit(node)
        others = list(faults(node))
        self.n_faults = len(others)
        self.line = getattr(node, "lineno", 0)
        return others[self.fault] if self.fault < len(others) else node


def mutants(source: str) -> list[tuple[int, str]]:
    """Return the line and the changed source of every mutant of a module."""
    found = []
    tree = ast.parse(source)
    for k, top in enumerate(tree.body):
        if not isinstance(top, ast.FunctionDef | ast.ClassDef):
            continue
        wanted, fault = 0, 0
        while True:
            changed = ast.parse(source)
            replace = _Replace(wanted, fault)
            changed.body[k] = replace.visit(changed.body[k])
            if fault < replace.n_faults:
                found.append((replace.line, ast.unparse(ast.fix_missing_locations(changed))))
                fault += 1
            elif wanted >= replace.n:
                break
            else:
                wanted, fault = wanted + 1, 0
    return found


def tests_pass(package: Path, tests: list[str], seconds: int) -> bool:
    """Return whether the tests pass with the package in a folder, within a time of the processor."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, 1)
        os.dup2(sink, 2)
        sys.dont_write_bytecode = True  # two mutants of one size in one second would look alike
        sys.path[:0] = [str(package), str(ROOT)]
        import pytest

        options = [
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            "-p",
            "no:xdist",
            "-m",
            "not long",
            "--basetemp",
            str(package / "tmp"),
        ]
        os._exit(int(pytest.main([*options, *tests])))
    _, status = os.waitpid(child, 0)
    return status == 0


def main() -> None:
    """Print the mutants that survive, and the share that was killed."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("modules", nargs="*", default=list(MODULES), metavar="MODULE")
    parser.add_argument("--most", type=int, default=25, help="Mutants per module, drawn at random.")
    parser.add_argument("--seed", type=int, default=1, help="Seed of the draw.")
    options = parser.parse_args()
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    for library in LIBRARIES:
        importlib.import_module(library)
    os.chdir(ROOT)
    killed_of_all = n_of_all = 0
    for module in options.modules:
        with tempfile.TemporaryDirectory() as folder:
            shutil.copytree(ROOT / "src" / "realitygap", Path(folder) / "realitygap")
            target = Path(folder) / "realitygap" / module
            source = target.read_text("utf-8")
            began = os.times()
            if not tests_pass(Path(folder), MODULES[module], 600):
                raise SystemExit(f"The tests of {module} fail without a fault.")
            ended = os.times()
            seconds = 10 + 5 * round(ended.children_user - began.children_user)
            every = mutants(source)
            drawn = random.Random(options.seed).sample(every, min(options.most, len(every)))
            plain = ast.unparse(ast.parse(source)).splitlines()
            n_killed = 0
            for line, changed in sorted(drawn):
                target.write_text(changed, "utf-8")
                if tests_pass(Path(folder), MODULES[module], seconds):
                    faulty = [new for new in changed.splitlines() if new not in plain]
                    print(
                        f"    survives: {module}:{line}: {' '.join(map(str.strip, faulty)) or 'a statement is missing'}"
                    )
                else:
                    n_killed += 1
            print(f"{module}: {n_killed} of {len(drawn)} mutants killed ({len(every)} possible)")
            killed_of_all, n_of_all = killed_of_all + n_killed, n_of_all + len(drawn)
    print(f"all: {killed_of_all} of {n_of_all} killed, {killed_of_all / n_of_all:.0%}")


if __name__ == "__main__":
    main()
