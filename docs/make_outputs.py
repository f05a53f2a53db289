"""The commands and Python examples of our documents: run them, compare what they print, or write it down anew.

    uv run python docs/make_outputs.py            # says what differs
    uv run python docs/make_outputs.py --write    # puts the present output into the documents

In README.md and docs/**/*.md the blocks of a document are run in their order, in one temporary folder:

* ```console: each line that begins with `$ ` is run, and the lines below it are its output (with what goes to
  standard error where the command fails). Times and rates may differ.
* ```python: is executed; where it has `>>>`, its outputs are compared as by doctest.
* any block below a comment `<!-- file: NAME -->`: is written to NAME first.
* a block below a comment that begins with `<!-- not run: `, and a reason, is left alone.
* in a block below a comment `<!-- within 2 %: REASON -->`, numbers with a point may differ that much, or by a tenth
  of the interval in their line.

`tests/test_docs.py` does the same without writing.
"""

from __future__ import annotations

import contextlib
import difflib
import doctest
import io
import os
import re
import shlex
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = 80
BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>file|not run|within 2 %): (?P<text>.*?) -->\n+)?^```(?P<kind>[a-z]+)\n(?P<body>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
# What differs from one run and machine to the next.
VOLATILE = [
    (re.compile(r"\b[\d.]+ s \([\d,]+ runs/s\)"), "T s (R runs/s)"),
    (re.compile(r"\b\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00"), "DATE"),
    (re.compile(r"(Written: .*report\.html) \([\d.]+ s\)"), r"\1 (T s)"),
]
FRACTION = re.compile(r"\d+\.\d+")
INTERVAL = re.compile(r"(-?\d+\.\d+) to (-?\d+\.\d+)")
NEARLY, NARROW = 0.02, 0.1
# What stands where a terminal would have the progress bar.
STARTING = re.compile(r"^Compiling or loading the kernels .*\n+", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """One fenced block: what is in it, what is said above it, and where its body stands in the document."""

    kind: str
    body: str
    mark: str
    text: str
    start: int
    end: int


def documents() -> list[Path]:
    """README.md and all pages."""
    pages = sorted((ROOT / "docs").rglob("*.md"))
    return [ROOT / "README.md", *(page for page in pages if not {"_build", "generated"} & set(page.parts))]


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a document, in order."""
    for match in BLOCK.finditer(text):
        yield Block(
            match["kind"],
            match["body"],
            match["mark"] or "",
            match["text"] or "",
            match.start("body"),
            match.end("body"),
        )


def rewrite(text: str, name: str) -> tuple[str, list[str]]:
    """Run a document in a temporary folder.

    Args:
        text: The document.
        name: What to call it in messages.

    Returns:
        The document with the outputs that its commands have now, and what differs, in words.
    """
    found = list(blocks(text))
    problems: list[str] = []
    namespace: dict[str, object] = {"__name__": "__main__"}
    parts, since = [], 0
    with temporary_folder(), clean_environment():
        for block in found:
            body = block.body
            where = f"{name}:{text.count(chr(10), 0, block.start)}"
            if block.mark == "file":
                Path(block.text).write_text(body, "utf-8")
            elif block.mark != "not run" and block.kind == "console":
                body = run_console(body)
                changes = differences(block.body, body, where, nearly=block.mark == "within 2 %")
                problems += changes
                body = body if changes else block.body  # no new times where nothing else is new
            elif block.mark != "not run" and block.kind == "python":
                problems += run_python(body, namespace, where)
            parts += [text[since : block.start], body]
            since = block.end
    return "".join([*parts, text[since:]]), problems


@contextlib.contextmanager
def temporary_folder() -> Iterator[None]:
    """Work in a new folder, in which the data of the tests can be reached as in a checkout."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        for name in ("tests", "examples"):
            (Path(folder) / name).symlink_to(ROOT / name)
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


@contextlib.contextmanager
def clean_environment() -> Iterator[None]:
    """A terminal of known width without colors, in which this Python is `python`."""
    before = dict(os.environ)
    show = warnings.showwarning
    for name in ("FORCE_COLOR", "CLICOLOR_FORCE", "TTY_COMPATIBLE"):
        os.environ.pop(name, None)
    binaries = str(Path(sys.executable).parent)
    os.environ.update(COLUMNS=str(COLUMNS), NO_COLOR="1", PATH=binaries + os.pathsep + before.get("PATH", ""))
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)
        warnings.showwarning = show


def run_console(body: str) -> str:
    """The block with the outputs that its commands have now."""
    lines = []
    for line in body.splitlines():
        if line.startswith("$ "):
            lines.append(line)
            output = run_command(line.removeprefix("$ "))
            lines += [each.rstrip() for each in output.strip("\n").splitlines()]
    return "".join(line + "\n" for line in lines)


def run_command(command: str) -> str:
    """What a command prints; ours runs in this process, which has its kernels loaded already."""
    own, pipe, rest = command.partition(" | ")
    words = shlex.split(own, comments=True)
    if words[0] != "realitygap":
        return run_shell(command, "")
    from realitygap.cli import main

    out, error, before = io.StringIO(), io.StringIO(), sys.argv
    status: object = 0
    sys.argv = words
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
            main()
    except SystemExit as end:
        status = end.code
    finally:
        sys.argv = before
    if status:
        return out.getvalue() + STARTING.sub("", error.getvalue())
    return run_shell(rest, out.getvalue()) if pipe else out.getvalue()


def run_shell(command: str, given: str) -> str:
    """What a command of the system prints."""
    done = subprocess.run(["bash", "-c", command], input=given, capture_output=True, text=True, check=False)
    return done.stdout + (done.stderr if done.returncode else "")


def run_python(body: str, namespace: dict[str, object], where: str) -> list[str]:
    """What goes wrong in a block of Python; the blocks of a document share their names."""
    if ">>>" not in body:
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                exec(compile(body, where, "exec"), namespace)
        except Exception:
            return [f"{where}: {traceback.format_exc(limit=-1)}"]
        return []
    examples = doctest.DocTestParser().get_doctest(body, namespace, where, None, 0)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE, verbose=False)
    said = io.StringIO()
    runner.run(examples, out=said.write, clear_globs=False)
    namespace.update(examples.globs)
    return [f"{where}: {said.getvalue()}"] if runner.failures else []


def differences(written: str, now: str, where: str, *, nearly: bool = False) -> list[str]:
    """A diff of two blocks, times and rates apart, and numbers apart that are `nearly` the same."""
    for pattern, word in VOLATILE:
        written, now = pattern.sub(word, written), pattern.sub(word, now)
    if written == now or (nearly and are_near(written, now)):
        return []
    diff = difflib.unified_diff(
        written.splitlines(), now.splitlines(), "as written", "as it is now", lineterm=""
    )
    return [f"{where}:\n" + "\n".join(diff)]


def are_near(written: str, now: str) -> bool:
    """Whether two texts differ in nothing but spaces, and in numbers with a point.

    Numbers may differ by 2 %, by one in the last digit, or by a tenth of the interval (`0.1 to 0.3`) in their line.
    """
    written, now = (re.sub(r" +", " ", re.sub("─+", "─", text)) for text in (written, now))
    if FRACTION.split(written) != FRACTION.split(now):
        return False
    return all(
        abs(float(a) - float(b))
        <= max(NEARLY * float(a), 1.01 * 10.0 ** -len(a.partition(".")[2]), NARROW * width_in(one))
        for one, other in zip(written.splitlines(), now.splitlines(), strict=True)
        for a, b in zip(FRACTION.findall(one), FRACTION.findall(other), strict=True)
    )


def width_in(line: str) -> float:
    """Return the width of the first interval in a line; 0 without one."""
    ends = INTERVAL.search(line)
    return float(ends[2]) - float(ends[1]) if ends else 0.0


def main() -> int:
    """Check all documents, or those named; write them with `--write`."""
    arguments = sys.argv[1:]
    write = "--write" in arguments
    paths = [Path(each).resolve() for each in arguments if each != "--write"] or documents()
    status = 0
    for path in paths:
        text = path.read_text("utf-8")
        name = str(path.relative_to(ROOT))
        new, problems = rewrite(text, name)
        if write and new != text:
            path.write_text(new, "utf-8")
            print(f"Written: {name}")
            problems = [problem for problem in problems if "as written" not in problem]
        for problem in problems:
            print(problem)
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
