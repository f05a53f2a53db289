"""Limits on what the libraries of bags unpack: a few kilobytes can stand for gigabytes.

The libraries unpack a part of a bag as a whole, and have no limit. So their unpacking is replaced by ours.
"""

from __future__ import annotations

import bz2
import functools
from types import SimpleNamespace
from typing import Any

from realitygap._limits import LimitError
from realitygap.errors import from_extra

MOST_UNPACKED = 128 << 20
"""Maximum size of an unpacked part of a bag, such as a chunk of MCAP [bytes]. Writers make chunks of 1 to 4 MB."""
_PIECE = 1 << 20
_ZSTD_PIECE = 256
"""Packed bytes that are unpacked together: zstd has no limit of its own, and 4 bytes stand for 128 kB at most."""


@functools.cache
def limit_unpacking() -> None:
    """Make the libraries of bags refuse parts that are larger than `MOST_UNPACKED`, for the rest of the program.

    Raises:
        MissingExtraError: The extra `import` is not installed.
    """
    mcap = from_extra("mcap.stream_reader", "import")
    ros1 = from_extra("rosbags.rosbag1.reader", "import")
    ros2 = from_extra("rosbags.rosbag2.reader", "import")
    storage = from_extra("rosbags.rosbag2.storage_mcap", "import")
    unpack_chunk = mcap.get_chunk_data_stream

    def get_chunk_data_stream(chunk: Any, validate_crc: bool = False) -> Any:
        unpacked = _UNPACK[chunk.compression](chunk.data) if chunk.compression in _UNPACK else chunk.data
        part = SimpleNamespace(**vars(chunk) | {"data": unpacked, "compression": ""})
        return unpack_chunk(part, validate_crc)

    mcap.get_chunk_data_stream = get_chunk_data_stream
    ros1.decompressors |= {kind: unpack for kind, unpack in _UNPACK.items() if kind in ros1.decompressors}
    storage.DECOMPRESSORS |= {
        kind: lambda data, _, unpack=unpack: unpack(data)
        for kind, unpack in _UNPACK.items()
        if kind in storage.DECOMPRESSORS
    }
    for name in ("zstd", "zstandard"):  # one or the other, by its version
        if hasattr(ros2, name):
            setattr(ros2, name, _LimitedZstd(getattr(ros2, name)))


class _LimitedZstd:
    """A library of zstd whose `decompress` has a limit."""

    def __init__(self, library: Any) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Any:
        return getattr(self._library, name)

    def decompress(self, data: bytes) -> bytes:
        """Return what is packed."""
        return _unpack_zstd(data)

    def ZstdDecompressor(self) -> Any:  # noqa: N802  # the library's name
        """Return an object with `decompress`, and all else that the library's has."""
        return _LimitedZstd(self._library.ZstdDecompressor())


def _unpack_zstd(data: bytes) -> bytes:
    zstandard = from_extra("zstandard", "import")
    unpacked = bytearray()
    rest = bytes(data)
    while rest:
        decompressor, at = zstandard.ZstdDecompressor().decompressobj(), 0
        while not decompressor.eof:
            if at >= len(rest):
                raise ValueError("it is cut off")
            unpacked += decompressor.decompress(rest[at : at + _ZSTD_PIECE])
            at += _ZSTD_PIECE
            _check_size(unpacked)
        rest = decompressor.unused_data + rest[at:]
    return bytes(unpacked)


def _unpack_lz4(data: bytes) -> bytes:
    return _unpack_streams(from_extra("lz4.frame", "import").LZ4FrameDecompressor, data)


def _unpack_bz2(data: bytes) -> bytes:
    return _unpack_streams(bz2.BZ2Decompressor, data)


def _unpack_streams(new_decompressor: Any, data: bytes) -> bytes:
    """Return what is packed in one stream after another."""
    unpacked = bytearray()
    rest: bytes | None = bytes(data)
    while rest:
        decompressor = new_decompressor()
        while not decompressor.eof:
            piece = decompressor.decompress(rest, _PIECE)
            if not piece and decompressor.needs_input:
                raise ValueError("it is cut off")
            unpacked += piece
            _check_size(unpacked)
            rest = b""
        rest = decompressor.unused_data
    return bytes(unpacked)


def _check_size(unpacked: bytearray) -> None:
    if len(unpacked) > MOST_UNPACKED:
        raise LimitError(
            f"a part of it has more than {MOST_UNPACKED:,} bytes when it is unpacked, which is the limit"
        )


_UNPACK = {"zstd": _unpack_zstd, "lz4": _unpack_lz4, "bz2": _unpack_bz2}
