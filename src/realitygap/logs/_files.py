"""Several logs of one robot: by name, by folder, or by a pattern, each with its mapping."""

from __future__ import annotations

import glob
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from realitygap.errors import LogError

from ._guess import checked_guess, draft_log_map
from ._guess_values import usable
from ._log_map import LogMap, load_log_map
from ._open import BAG_ENDS, is_log_folder, map_beside

TEXT_ENDS = (".csv", ".tsv", ".txt", ".dat", ".log")


SHARED = ("robot", "speed", "track", "label", "arena", "controller")
"""Settings that must be the same in the mappings of several logs."""


@dataclass(frozen=True)
class MappedLog:
    """A log with its mapping.

    Attributes:
        path: The log.
        log_map: Its mapping.
        origin: Origin of the mapping, in words.
    """

    path: Path
    log_map: LogMap
    origin: str


def mapped_logs(
    names: str | Path | Iterable[str | Path],
    map_file: str | Path | None = None,
    *,
    step_s: float | None = None,
    draft: bool = False,
) -> list[MappedLog]:
    """Return the logs that names stand for, with their mappings.

    Args:
        names: A log, or several logs of one robot, as for `log_files`.
        map_file: The mapping of all. Default: that next to each log, or a guess by the names of its columns.
        step_s: Length of a step, instead of that of the mappings [s].
        draft: True to return a guess even if the values of its columns contradict it.

    Raises:
        LogError: A mapping has mistakes, or the logs are not of one robot.
    """
    logs = []
    given = [names] if isinstance(names, str | Path) else names
    names_files = map_file is not None and any(part.file for part in load_log_map(map_file).parts.values())
    # a mapping that names the files of its parts makes one log of a folder
    for path in map(Path, given) if names_files else log_files(given):
        log_map, origin = mapping_of(path, map_file, draft=draft)
        if step_s is not None:
            log_map = log_map.model_copy(update={"step_s": step_s})
        logs.append(MappedLog(path, log_map, origin))
    first = logs[0]
    for log in logs[1:]:
        for key in SHARED:
            ours, theirs = getattr(first.log_map, key), getattr(log.log_map, key)
            if ours != theirs:
                raise LogError(
                    f"{key} is {ours!r} in the mapping of {first.path}, and {theirs!r} in that of {log.path}. Expected "
                    "logs of one robot. Give all one mapping, or use them one by one."
                )
        ours, theirs = (", ".join(mapped.log_map.parts) for mapped in (first, log))
        if ours != theirs:
            raise LogError(
                f"{first.path} has {ours}, and {log.path} has {theirs}. "
                "Expected logs with the same parts. Give all one mapping, or use them one by one."
            )
    return logs


def mapping_of(
    path: str | Path, map_file: str | Path | None = None, *, draft: bool = False
) -> tuple[LogMap, str]:
    """Return the mapping of a log, and its origin in words.

    Args:
        path: The log.
        map_file: The mapping; that next to the log, or a guess by the names of its columns, if not given.
        draft: True to return a guess even if the values of its columns contradict it.

    Raises:
        LogError: The mapping has mistakes, or the names of the columns do not say enough.
    """
    file = map_beside(path) if map_file is None else Path(map_file)
    if map_file is not None or file.is_file():
        return load_log_map(file), str(file)
    guessed = "guessed by the names of the columns"
    try:
        log_map, notes = checked_guess(path)
    except LogError:
        if draft:
            return draft_log_map(path), guessed
        raise
    if not draft:
        log_map, left_out = usable(log_map)
        notes += left_out
    return log_map, "; ".join([guessed, *notes])


def log_files(names: Iterable[str | Path]) -> list[Path]:
    """Return the logs that names stand for, in order.

    Args:
        names: Files; folders, of which every log is taken, unless the folder is one log, such as a bag or a folder
            with a mapping `map.toml`; and patterns with `*`, `?`, or `[]`.

    Raises:
        LogError: A folder has no log, a pattern fits no file, or a log is named twice.
    """
    files: list[Path] = []
    for name in names:
        files += _files_of(Path(name))
    for k, path in enumerate(files):
        if any(path.resolve() == other.resolve() for other in files[:k]):
            raise LogError(f"{path} is named twice. Name each log once, so that its trials count once.")
    return files


def _files_of(path: Path) -> list[Path]:
    if path.is_dir() and not is_log_folder(path) and not map_beside(path).is_file():
        files = sorted(file for file in path.iterdir() if _is_log(file))
        if not files:
            ends = ", ".join((*TEXT_ENDS, ".parquet", *BAG_ENDS))
            raise LogError(f"{path} is a folder without a log. Expected files that end in {ends}, or bags.")
        return files
    if not path.exists() and glob.has_magic(str(path)):
        files = [Path(file) for file in sorted(glob.glob(str(path), recursive=True))]  # noqa: PTH207
        if not files:
            raise LogError(f"No file fits the pattern {path}. Name files, or correct the pattern.")
        return [log for file in files for log in _files_of(file)]
    return [path]


def _is_log(path: Path) -> bool:
    if path.is_dir():
        return is_log_folder(path)
    name = path.name.lower().removesuffix(".gz")
    return name.endswith((*TEXT_ENDS, ".parquet", *BAG_ENDS)) and not name.startswith(".")
