"""An inbox, in which processes without a folder's lock leave chunks for the process that has it.

Only the holder of the lock publishes, by renaming out of its own inbox. Results of a worker of an earlier program go to
an inbox that no longer exists. So they can neither overlap with later plans nor reappear after `--fresh`.
"""

from __future__ import annotations

import contextlib
import re
import secrets
import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from realitygap.errors import RecordError
from realitygap.records._chunk import ChunkName, encode_chunk
from realitygap.records._files import write_durably, writing

_NAME = re.compile(r"\.inbox-[0-9a-f]{16}")
_WAITS = (0.0, 0.01, 0.1, 0.0)
"""Pauses after attempts to remove an inbox [s]."""


@dataclass(frozen=True)
class Delivery:
    """A chunk that was left in an inbox.

    Attributes:
        condition: Name of the condition.
        first: First replicate.
        n_runs: Number of replicates in it.
        condition_hash: Hash of the condition as resolved.
    """

    condition: str
    first: int
    n_runs: int
    condition_hash: str

    @property
    def name(self) -> ChunkName:
        """The stem of its file name."""
        return ChunkName(self.condition, self.first, self.first + self.n_runs - 1)


class MissingInboxError(RecordError):
    """The inbox is not there: its sitting has ended, or this machine does not see the folder."""


def deliver(inbox: Path, condition: str, first: int, frame: pl.DataFrame, condition_hash: str) -> None:
    """Write the rows of one or more whole replicates into an inbox, synced and sealed.

    Twice the same is once: the second takes the place of the first.

    Args:
        inbox: Inbox of the folder of results; see `ResultsFolder.inbox`.
        condition: Name.
        first: The first replicate in `frame`.
        frame: Columns as in `SCHEMA`, rows sorted by replicate, generation and individual, without a gap.
        condition_hash: Hash of the condition as resolved.

    Raises:
        MissingInboxError: there is no such inbox, or no longer.
        RecordError: the disk is full, or the inbox cannot be written.
        ValueError: the rows are not fit to be published.
    """
    chunk, data = encode_chunk(inbox, condition, first, frame, condition_hash)
    try:
        write_durably(chunk.path, data, replace=True)
    except RecordError as error:
        if not inbox.is_dir():
            raise MissingInboxError(f"{inbox} is not there.") from error
        raise


def make_inbox(folder: Path) -> Path:
    """Return a new inbox in a folder, with a name that never was and never will be.

    Raises:
        RecordError: the folder cannot be written.
    """
    inbox = _fresh_name(folder)
    with writing(inbox):
        inbox.mkdir()
    return inbox


def remove_inbox(inbox: Path) -> None:
    """Remove an inbox and what is in it; what a network file system keeps for a moment goes the next time.

    It gets a name that no worker knows first. A chunk that a worker delivers while the files are removed would
    otherwise stay, and with it the inbox. A worker that had found the inbox just before may still make a file in it;
    it does so once, so the removal is repeated.
    """
    unknown = _fresh_name(inbox.parent)
    with contextlib.suppress(OSError):
        inbox = inbox.rename(unknown)
    for wait in _WAITS:
        shutil.rmtree(inbox, ignore_errors=True)
        if not inbox.exists():
            return
        time.sleep(wait)


def _fresh_name(folder: Path) -> Path:
    return folder / f".inbox-{secrets.token_hex(8)}"


def is_inbox(name: str) -> bool:
    """Return whether a folder is an inbox, of this program or an earlier one."""
    return _NAME.fullmatch(name) is not None
