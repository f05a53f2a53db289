"""A state that is left and taken up again: plain values and arrays in one file, written whole."""

from __future__ import annotations

import io
import json
import math
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from realitygap._limits import MOST_CHECKPOINT_BYTES, parse_json, read_file
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
"""First bytes of every zip file, and so of NumPy's .npz; each member in it has a check sum."""


def write_checkpoint(
    path: Path, kind: str, about: Mapping[str, Any], arrays: Mapping[str, npt.NDArray[Any]]
) -> None:
    """Write a checkpoint, a NumPy .npz file. An existing one is replaced once the new one is complete.

    Args:
        path: File to write.
        kind: Kind of the content, such as "population".
        about: JSON values.
        arrays: Arrays by name. They must not have objects.

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
    contents: dict[str, Any] = {_ABOUT: text, **arrays}
    np.savez(buffer, **contents)
    write_whole(path, buffer.getvalue())


def read_checkpoint(path: Path, kind: str) -> tuple[dict[str, Any], dict[str, npt.NDArray[Any]]]:
    """Read the values and the arrays that `write_checkpoint` wrote.

    Raises:
        RecordError: there is no such file, it is cut off or damaged, or it is none of this kind.
        RecordVersionError: another version wrote it, whose numbers or form may differ.
    """
    with reading(path):
        if path.is_dir() or not path.exists():
            what = "is a folder" if path.is_dir() else "does not exist"
            raise RecordError(f"{path} {what}, expected the checkpoint of a {kind}. Check the path.")
        data = read_file(path, MOST_CHECKPOINT_BYTES)
    if not data.startswith(_FIRST_BYTES):
        raise RecordError(f"{path} is no checkpoint of a {kind}. Check the path.")
    try:
        arrays = _arrays(data)
        about = parse_json(arrays.pop(_ABOUT).tobytes()) if _ABOUT in arrays else {}
    except (
        zipfile.BadZipFile,
        zipfile.LargeZipFile,
        ValueError,
        EOFError,
        OSError,
        LookupError,
        MemoryError,
        RuntimeError,
        SyntaxError,
        TypeError,
        struct.error,
    ) as error:
        raise RecordError(
            f"{path} is cut off or damaged, or was not written by realitygap ({error}). Take an earlier checkpoint."
        ) from error
    _check(path, kind, about)
    return about, arrays


def _arrays(data: bytes) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays in a file that `np.savez` wrote, none of which can be larger than the file.

    Raises:
        ValueError: one is compressed, or says that it is of another size than it is.
    """
    arrays: dict[str, npt.NDArray[Any]] = {}
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        for member in file.infolist():
            if member.compress_type != zipfile.ZIP_STORED or member.file_size > len(data):
                raise ValueError(f"{member.filename[:60]!r} in it is compressed")
            stream = io.BytesIO(file.read(member))
            version = np.lib.format.read_magic(stream)
            read_header = {
                (1, 0): np.lib.format.read_array_header_1_0,
                (2, 0): np.lib.format.read_array_header_2_0,
            }[version]
            shape, _, dtype = read_header(stream)
            if math.prod(shape) * dtype.itemsize != member.file_size - stream.tell():
                raise ValueError(f"{member.filename[:60]!r} in it does not have its stated size")
            stream.seek(0)
            name = member.filename.removesuffix(".npy")
            arrays[name] = np.lib.format.read_array(stream, allow_pickle=False)
    return arrays


def _check(path: Path, kind: str, about: Any) -> None:
    if not isinstance(about, dict) or about.get("format") != FORMAT or about.get("kind") != kind:
        raise RecordError(f"{path} is no checkpoint of a {kind}. Check the path.")
    for name, expected in (("version", FORMAT_VERSION), ("results_version", RESULTS_VERSION)):
        if about.get(name) != expected:
            raise RecordVersionError(
                f"{path} was written by realitygap {about.get('software')} with {name.replace('_', ' ')} "
                f"{about.get(name)}, expected {expected}: it would continue with other numbers. Use the "
                "version that wrote it."
            )
