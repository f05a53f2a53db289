"""Files of the lab's folder: those that pages list, and a refusal of all names that lead outside it."""

from __future__ import annotations

import contextlib
import os
import re
import stat
from collections.abc import Collection
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from realitygap._limits import parse_toml
from realitygap.errors import StudyError
from realitygap.platforms import Platform, names_a_port, platform_of, split_spec
from realitygap.robot_families import default_family, find_family, ports_in_words
from realitygap.robots import split_port
from realitygap.runs import NAME_PATTERN
from realitygap.settings import shown
from realitygap.study import Study, python_functions

LONGEST_TEXT = 200_000
"""Largest length of a study file [letters]."""

_SOCKETS = ("socket", "rfc2217")
_PYTHON = "python:"
"""A platform from a file, which is not imported here."""
_PROSE = ("name", "title", "note", "published_source", "change")


def last_change(path: Path) -> float | None:
    """Return when a plain file or a folder was changed [s]; None if it is a link or something else, or unreadable."""
    try:
        status = path.lstat()
    except OSError:
        return None
    is_usable = stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode)
    return status.st_mtime if is_usable else None


def plain_files(folder: Path, endings: Collection[str]) -> list[Path]:
    """Return the plain files of a folder with one of these endings, the last one changed first.

    Links, folders, pipes, and files that cannot be read are left out: pages do not open them.
    """
    found = []
    with contextlib.suppress(OSError):
        for path in folder.iterdir():
            changed = last_change(path) if path.suffix.lower() in endings else None
            if changed is not None and not path.is_dir():
                found.append((-changed, path))
    return [path for _, path in sorted(found)]


def is_name(text: str) -> bool:
    """Return True if files of the lab can have this name."""
    return re.fullmatch(NAME_PATTERN, text) is not None and len(text) <= 80


def check_name(text: str) -> None:
    """Raise a StudyError if files of the lab cannot have this name."""
    if not is_name(text):
        raise StudyError(
            "Use letters, digits, '.', '-', and '_'. Start with a letter or digit. You entered "
            f"{shown(text)}."
        )


def files_outside(root: Path, text: str) -> tuple[list[str], dict[str, Any]]:
    """Return a mistake for each file outside a folder that a study file names, and its values without these files.

    Raises:
        StudyError: The text is far too long, or not TOML.
    """
    if len(text) > LONGEST_TEXT:
        raise StudyError(
            f"The file has {len(text):,} letters, expected at most {LONGEST_TEXT:,}: a study file in TOML."
        )
    try:
        data = parse_toml(text)
    except ValueError as error:
        raise StudyError(f"This is not TOML: {error}. Expected a study file.") from error
    mistakes: list[str] = []
    return mistakes, _without_outside(root, data, "", mistakes)


def refuse_code(study: Study, allow_code: bool) -> None:
    """Refuse a study with functions of Python files, unless the lab may run code.

    Raises:
        StudyError: It has such a function.
    """
    functions = python_functions(study)
    if functions and not allow_code:
        raise StudyError(
            f"{shown(functions[0].kind)} runs code on the lab's machine, which this lab does not allow. Read the file. "
            "If you trust it, start the lab with: realitygap lab --allow-code"
        )


def refuse_outside(root: Path, text: str) -> None:
    """Refuse a name, such as sim:FILE, that would be a file outside a folder.

    Raises:
        StudyError: It would.
    """
    for part in (text, *text.split(":")):
        if not _is_within(root, part):
            raise StudyError(
                f"{shown(text)} would be a file outside the lab's folder, and the lab reads none there. Put the file "
                "into that folder, and enter its name alone."
            )


def refuse_port(root: Path, port: str) -> None:
    """Refuse a robot's port by which another file than a device could be opened, or one outside a folder.

    A library for serial ports knows names that write what is said into any file.

    Raises:
        StudyError: It is no device, socket or emulator, or an emulator with a file outside the folder.
    """
    family_name, name = split_port(port)
    family = find_family(family_name) or default_family()
    base, _, options = name.partition("?")
    for key, value in parse_qsl(options):
        if key in ("arena", *family.port_files):
            refuse_outside(root, value)
    scheme, colon, rest = base.partition("://")
    if not colon:
        is_below_dev = base.startswith("/") and base != "/dev" and _is_within(Path("/dev"), base)
        is_address = bool(family.addresses) and re.fullmatch(family.addresses, base) is not None
        if is_address or (not options and (is_below_dev or re.fullmatch(r"COM\d+", base, re.IGNORECASE))):
            return
    elif scheme in _SOCKETS:
        if not options and re.fullmatch(r"[^/?#@]+:\d+/?", rest):
            return
    elif scheme == "emulator":
        return
    raise StudyError(f"{shown(port)} is no port that the lab opens. Expected {ports_in_words()}.")


def refuse_camera(root: Path, spec: str) -> None:
    """Refuse a camera or a video whose file, or whose lens, would be outside a folder.

    Raises:
        StudyError: It would.
    """
    name, _, query = spec.partition("?")
    refuse_outside(root, name)
    for _, value in parse_qsl(query):
        refuse_outside(root, value)


def refuse_platform(root: Path, spec: str) -> None:
    """Refuse a platform that there is not, or whose port or file is not in a folder.

    Raises:
        StudyError: There is no such platform, or it is not there.
    """
    has_port = names_a_port(spec)
    (refuse_port if has_port else refuse_outside)(root, spec)
    file = split_spec(spec)[1]
    is_open = has_port or spec.startswith(_PYTHON)
    if not is_open and platform_in(root, spec).needs_rest and not (root / file).exists():
        raise StudyError(f"There is no file {shown(file)} in the lab's folder.")


def platform_in(root: Path, spec: str) -> Platform:
    """Return the platform that a visitor named, with its file from a folder.

    Raises:
        StudyError: There is no such platform, or it cannot be made of this.
    """
    name, file = split_spec(spec)
    try:
        return platform_of(f"{name}:{root / file}" if file and (root / file).is_file() else spec)
    except StudyError as error:
        raise StudyError(str(error).replace(f"{root}{os.sep}", "")) from None


def _without_outside(root: Path, value: Any, place: str, mistakes: list[str]) -> Any:
    """Return a value with empty texts in place of files outside a folder; add a mistake for each."""
    if isinstance(value, dict):
        return {
            key: each
            if key in _PROSE
            else _without_outside(root, each, f"{place}.{key}" if place else key, mistakes)
            for key, each in value.items()
        }
    if isinstance(value, list):
        return [
            _without_outside(root, each, f"{place}[{number}]", mistakes)
            for number, each in enumerate(value, 1)
        ]
    if isinstance(value, str):
        try:
            refuse_outside(root, value)
        except StudyError as error:
            mistakes.append(f"{place}: {error}")
            return ""
    return value


def _is_within(root: Path, part: str) -> bool:
    try:
        return (root / part).resolve().is_relative_to(root.resolve())
    except (OSError, ValueError, RuntimeError):
        return False
