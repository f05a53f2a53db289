"""The right source for a log, by its name and what is in it."""

from __future__ import annotations

from pathlib import Path

from realitygap._named_file import NamedFileError, named_file
from realitygap.errors import LogError

from ._bags import BagSource
from ._log_map import TextFormat
from ._parquet import ParquetSource, lerobot_source
from ._recording import RecordingSource
from ._source import Source
from ._text import TextSource

BAG_ENDS = (".mcap", ".db3", ".bag")
KINDS = (
    "a text table (CSV and the like), Parquet, MCAP, a bag of ROS (folder, .db3, .bag), a folder of a LeRobot dataset, "
    "or a recording of `realitygap robot drive --record`"
)


def map_beside(path: str | Path) -> Path:
    """Return the default mapping of a log: LOG.map.toml, or map.toml in a folder."""
    path = Path(path)
    return path / "map.toml" if path.is_dir() else path.with_name(f"{path.name.split('.')[0]}.map.toml")


def map_name(path: Path) -> str:
    """Return the name of the default mapping of a log, for messages."""
    return "map.toml in the folder" if path.is_dir() else map_beside(path).name


def is_log_folder(path: Path) -> bool:
    """Return whether a folder is one log: a bag, or a dataset."""
    return (path / "meta" / "info.json").is_file() or (path / "metadata.yaml").is_file()


def open_source(path: Path, text: TextFormat | None = None) -> Source:
    """Return the source of a log.

    Args:
        path: A file, or the folder of a bag or a dataset.
        text: Format of a text file, as far as it is known.

    Raises:
        LogError: There is no such file, or it is none of the known kinds.
        MissingExtraError: It is a bag, and the extra `import` is not installed.
    """
    if not path.exists():
        raise LogError(f"There is no file {path}. Name a log: {KINDS}.")
    _refuse_pipes(path)
    if path.is_dir():
        if (path / "meta" / "info.json").is_file():
            return lerobot_source(path)
        if (path / "metadata.yaml").is_file():
            return BagSource(path)
        raise LogError(
            f"{path} is a folder, and neither a bag (metadata.yaml) nor a LeRobot dataset (meta/info.json). If its "
            "files belong together, name them in the mapping: `file` of [commands], [poses] ..."
        )
    end = path.suffix.lower()
    if end in BAG_ENDS:
        return BagSource(path)
    if end == ".parquet":
        return ParquetSource(path, [path])
    if end == ".jsonl":
        return RecordingSource(path)
    return TextSource(path, text or TextFormat())


def _refuse_pipes(path: Path) -> None:
    """Raise an error if a log, or a file in the folder of a bag, is not a plain file, or is elsewhere.

    Libraries open the files of a bag by their names, and would wait for the other end of a pipe.
    """
    if not path.is_dir():
        if not path.is_file():
            raise LogError(
                f"{path} is a pipe or a device, expected a plain file. Save its content in a file."
            )
        return
    try:
        for entry in path.iterdir():
            named_file(path, entry.name, or_folder=True)
    except OSError as error:
        raise LogError(f"Cannot read {path}: {error.strerror or error}.") from None
    except NamedFileError as error:
        raise LogError(f"{path}: {error}") from None
