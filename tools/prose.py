"""Count what the editorial rules forbid in the project's prose, and fail if a file got worse.

The check reads Markdown, the first lines of docstrings, and help texts. It counts listed words, openings that
invert a sentence, sentences over 30 words, long summaries of commands, and option helps that do not begin with
the thing. In messages, templates, and scripts of pages it counts riddles and other words for a measure. A baseline
holds the present count of each file; a new file starts at 0.

    python tools/prose.py            compare with the baseline
    python tools/prose.py --update   lower the baseline to the present counts; counts that rose stay refused
    python tools/prose.py FILE ...   print every finding in these files
"""

from __future__ import annotations

import argparse
import ast
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BASELINE = ROOT / "tools" / "prose.json"
LONGEST_SENTENCE = 30  # words
LONGEST_SUMMARY = 58  # characters: the list of commands shows whole lines in 80 columns

OPENING = re.compile(r"^(Of|Where|Whoever|Whose|That which|What|By(?! default)|Nor|In place of|How)\b")
WORDS = re.compile(
    r"\b("
    r"carr(y|ies|ied|ying) out|go(es)? on\b(?! (to|the))|anew|what it takes|in all\b(?! )|what is there"
    r"|somebody|whoever|is said|are said|be said|is told|are told|of its own|of your own|of their own"
    r"|comes? of|comes? apart|how far apart|looked at|held to|not told|not seen|so many|so few"
    r"|beside\b(?! the point)|stands? (beside|in|there)|says of itself|attendants?|onlookers?"
    r"|where there (is|are) none|mend(s|ed|ing)?|what was seen|at once"
    r")\b",
    re.IGNORECASE,
)
RIDDLES = re.compile(
    r"(?<!\w)("
    # A less B, where "minus" or "compared with" is meant
    r"less (that|those|SIM|TWIN|EMULATED|REAL|simulat(or|ion)|the (other|first|second|objective)|second|\{\})"
    # a letter that acts, and sentences cut until their logic is gone
    r"|n finds|this difference takes|chance had|and so most to|where noise allows|noise allows at most"
    r"|where it can be|was missed with|and send nothing|a box for a body|robot freezes|share is stronger"
    r"|the cell of the start"
    # pronouns and possessives in place of the thing's name
    r"|takes all of it|to be the closest|['’]s number takes|the typical run and"
    # captions that answer a referee who has not asked
    r"|picked|(n and )?intervals? do(es)? not apply|is no proof|whatever they are|and not an? \w+ one"
    r")(?!\w)"
)
"""What a colleague has to read twice, in any text that a person sees."""

OTHER_NAMES = {
    "rank correlation": r"correlation over controllers|correlation of (the )?ranks|Spearman['’]s correlation over",
    "noise ceiling": r"noise allows|ceiling of (the )?noise|ceiling that noise",
    "RMS gap": r"RMS (difference|error) (of|in|between) (the )?(score|coverage|gap)|gap RMS|root mean square gap",
    "level": r"mean gap\b|bias of the (simulator|target)",
    "run": r"\b(more|fewer) replicates\b|\breplications?\b",
    "a number such as 0.306": r"(?<![\w.)\]/\d-])\.\d{3}\b",
    "a true minus (−)": r"(?<=\s)-\d+\.\d+\b(?= )",
}
"""The name of each measure, the word for an evolution, and the style of numbers, with other forms of each."""

BAD_HELP = re.compile(r"^(Of|By|Where|What|Whether|Who|To|In|For|How|Also|Not|With|At)\b")


@dataclass(frozen=True)
class Text:
    """A piece of prose: what kind it is, the line that it begins at, and its words."""

    kind: str
    line: int
    words: str


def main() -> int:
    """Compare the counts of all files with the baseline; return the exit status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="*", type=Path, help="Files whose findings to print.")
    parser.add_argument("--update", action="store_true", help="Lower the baseline where a count fell.")
    options = parser.parse_args()
    if options.files:
        for path in options.files:
            for line, finding in findings(path.resolve()):
                print(f"{path}:{line}: {finding}")
        return 0
    counts = {name: n for name in tracked() if (n := sum(1 for _ in findings(ROOT / name)))}
    baseline = json.loads(BASELINE.read_text("utf-8")) if BASELINE.exists() else counts
    worse = [name for name, n in counts.items() if n > baseline.get(name, 0)]
    for name in worse:
        print(
            f"{name}: {counts[name]} findings, {baseline.get(name, 0)} allowed. See: python tools/prose.py {name}"
        )
    if options.update or not BASELINE.exists():
        kept = {name: min(n, baseline.get(name, 0)) for name, n in counts.items() if baseline.get(name, 0)}
        BASELINE.write_text(json.dumps(kept, indent=0, sort_keys=True) + "\n", "utf-8")
    print(f"{sum(counts.values())} findings in {len(counts)} files; {len(worse)} files got worse.")
    return 1 if worse else 0


def tracked() -> list[str]:
    """Return the names of the files that hold prose."""
    listed = subprocess.run(
        ["git", "ls-files", "*.md", "src/*.py", "src/*.jinja", "src/*.js"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return [name for name in listed.stdout.splitlines() if (ROOT / name).is_file()]


def findings(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the line and a description of each finding in a file."""
    source = path.read_text("utf-8")
    if path.suffix in (".jinja", ".js"):
        texts = page(source) if path.suffix == ".jinja" else script(source)
    else:
        texts = markdown(source) if path.suffix == ".md" else python(source, in_cli="cli" in path.parts)
    for text in texts:
        if match := RIDDLES.search(" ".join(text.words.split())):
            yield text.line, f"'{match[0]}': {text.words[:60]}"
        shown = text.words if text.kind == "string" else re.sub(r"`[^`]*`", "CODE", text.words)
        for name, others in OTHER_NAMES.items():
            is_number = name.startswith("a ")
            if (match := re.search(others, shown)) and not (is_number and text.kind == "string"):
                yield text.line, f"'{match[0]}', expected {name}: {text.words[:60]}"
        if text.kind == "string":
            continue
        if text.kind == "summary" and len(text.words) > LONGEST_SUMMARY:
            yield (
                text.line,
                f"summary of {len(text.words)} characters, at most {LONGEST_SUMMARY}: {text.words}",
            )
        if text.kind == "help" and (match := BAD_HELP.match(text.words)):
            yield text.line, f"help begins with '{match[0]}': {text.words[:60]}"
        for sentence in sentences(text.words):
            if text.kind != "help" and (match := OPENING.match(sentence)) and not sentence.endswith("?"):
                yield text.line, f"begins with '{match[0]}': {sentence[:60]}"
            if match := WORDS.search(sentence):
                yield text.line, f"'{match[0]}': {sentence[:60]}"
            if (n := len(sentence.split())) > LONGEST_SENTENCE:
                yield text.line, f"{n} words: {sentence[:60]}"


def sentences(text: str) -> list[str]:
    """Split prose into sentences, without code."""
    plain = re.sub(r"`[^`]*`", "CODE", " ".join(text.split()))
    plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", plain)
    return [part for part in re.split(r"(?<=[.!?])\s+(?=['*(“]*[A-Za-z])", plain) if part]


def markdown(source: str) -> Iterator[Text]:
    """Yield the paragraphs and list items of a page, without code, tables, directives and switched-off parts."""
    source = re.sub(
        r"<!-- prose: off -->.*?(<!-- prose: on -->|\Z)|<!--.*?-->|^(```+|~~~+|:::+).*?^\2\s*$",
        lambda match: "\n" * match[0].count("\n"),
        source,
        flags=re.DOTALL | re.MULTILINE,
    )
    paragraph: list[str] = []
    start = 0
    for number, line in enumerate([*source.splitlines(), ""], 1):
        bare = line.strip()
        is_item = re.match(r"([*+-]|\d+\.)\s", bare) is not None
        is_code = re.match(r"(\t| {4})\S" if paragraph else r"\t| {4}", line) is not None
        is_prose = bare and not bare.startswith(("|", "#", ">", "(")) and not is_code
        if paragraph and (not is_prose or is_item):
            yield Text("text", start, " ".join(paragraph))
            paragraph = []
        if is_prose:
            start = start if paragraph else number
            paragraph.append(re.sub(r"^([*+-]|\d+\.)\s+", "", bare))


def python(source: str, *, in_cli: bool) -> Iterator[Text]:
    """Yield first lines of docstrings, the values of `help=` and `description=`, and other texts."""
    tree = ast.parse(source)
    parts = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    parts |= {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                is_command = in_cli and "Example: realitygap" in text and isinstance(node, ast.FunctionDef)
                yield Text(
                    "summary" if is_command else "docstring", node.body[0].lineno, text.split("\n\n")[0]
                )
                for paragraph in text.split("\n\n")[1:] if is_command else ():
                    if not paragraph.startswith(("Example:", "In Python:")):
                        yield Text("text", node.body[0].lineno, paragraph)
        elif isinstance(node, ast.JoinedStr):
            yield Text("string", node.lineno, "".join(map(_text_of, node.values)))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in parts:
            yield Text("string", node.lineno, node.value)
        elif isinstance(node, ast.keyword) and node.arg in ("help", "description"):
            words = "".join(
                part.value
                for part in ast.walk(node.value)
                if isinstance(part, ast.Constant) and isinstance(part.value, str)
            )
            if words:
                yield Text("help", node.value.lineno, words)


def _text_of(part: ast.expr) -> str:
    return part.value if isinstance(part, ast.Constant) else "{}"


def page(source: str) -> Iterator[Text]:
    """Yield the texts of a template between its tags."""
    plain = re.sub(r"\{#.*?#\}|\{%.*?%\}|<(script|style)\b.*?</\1>", _lines_of, source, flags=re.DOTALL)
    plain = re.sub(r"\{\{.*?\}\}", "{}", plain, flags=re.DOTALL)
    for match in re.finditer(r"[^<>]+", plain):
        yield Text("string", plain.count("\n", 0, match.start()) + 1, match[0])


def script(source: str) -> Iterator[Text]:
    """Yield the texts in quotes of a script."""
    for number, line in enumerate(source.splitlines(), 1):
        for match in re.finditer(r"\"([^\"]*)\"|'([^']*)'|`([^`]*)`", line):
            words = match[1] or match[2] or match[3] or ""
            yield Text("string", number, re.sub(r"\$\{[^}]*\}", "{}", words))


def _lines_of(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


if __name__ == "__main__":
    sys.exit(main())
