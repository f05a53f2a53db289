"""A state that is left and taken up again: plain values and arrays in one file, written whole."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from realitygap._version import __version__
from realitygap.errors import RecordError, RecordVersionError
from realitygap.records._files import reading
from realitygap.records._output import write_whole
from realitygap.records._version import RESULTS_VERSION

FORMAT = "realitygap checkpoint"
FORMAT_VERSION = 1
_ABOUT = "about"
"""The member of the file that says what it is, as JSON; the others are the arrays."""

_FIRST_BYTES = b"PK"
"""Of every zip file, and so of NumPy's .npz; each member in it has a check sum."""


def write_checkpoint(
    path: Path, kind: str, about: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]
) -> None:
    """Write a checkpoint, a NumPy .npz file; one that is there gives way once the new one is complete.

    Args:
        path: the file.
        kind: what it holds, such as "population".
        about: JSON values.
        arrays: by name; not of objects.

    Raises:
        RecordError: it cannot be written; a file that was there is as it was.
    """
    header = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "kind": kind,
        "results_version": RESULTS_VERSION,
        "software": __version__,
        **about,
    }
    buffer = io.BytesIO()
    text = np.frombuffer(json.dumps(header).encode("utf-8"), np.uint8)
    np.savez(buffer, allow_pickle=False, **{_ABOUT: text, **arrays})
    write_whole(path, buffer.getvalue())


def read_checkpoint(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """What `write_checkpoint` wrote: the values and the arrays.

    Raises:
        RecordError: there is no such file, it is cut off or damaged, or it is none of this kind.
        RecordVersionError: another version wrote it, whose numbers or form may differ.
    """
    with reading(path):
        if path.is_dir() or not path.exists():
            what = "is a folder" if path.is_dir() else "does not exist"
            raise RecordError(f"{path} {what}, expected the checkpoint of a {kind}. Check the path.")
        data = path.read_bytes()
    if not data.startswith(_FIRST_BYTES):
        raise RecordError(f"{path} is no checkpoint of a {kind}. Check the path.")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as found:
            arrays = {name: found[name] for name in found.files}
        about = json.loads(arrays.pop(_ABOUT).tobytes()) if _ABOUT in arrays else {}
    except (
        zipfile.BadZipFile,
        ValueError,
        EOFError,
        OSError,
        KeyError,
        NotImplementedError,
        TypeError,
    ) as error:
        raise RecordError(
            f"{path} is cut off or damaged, or was not written by realitygap ({error}). Take an earlier checkpoint."
        ) from error
    _check(path, kind, about)
    return about, arrays


def _check(path: Path, kind: str, about: Any) -> None:
    if not isinstance(about, dict) or about.get("format") != FORMAT or about.get("kind") != kind:
        raise RecordError(f"{path} is no checkpoint of a {kind}. Check the path.")
    for name, expected in (("version", FORMAT_VERSION), ("results_version", RESULTS_VERSION)):
        if about.get(name) != expected:
            raise RecordVersionError(
                f"{path} was written by realitygap {about.get('software')} with {name.replace('_', ' ')} "
                f"{about.get(name)}, expected {expected}: it would go on with other numbers. Use the version that "
                "wrote it."
            )
