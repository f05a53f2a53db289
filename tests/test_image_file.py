"""Images of every mode of Pillow have the pixels that their files mean, not those of `convert`."""

from __future__ import annotations

import ast
import io
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import realitygap
from realitygap._image_file import UnknownImageError, eight_bits, on_white, open_image, plain
from realitygap.world import load_arena

SHADES = np.array([0, 1, 85, 170, 205, 254, 255])
OPAQUE = np.full(len(SHADES), 255)
SOME_CLEAR = np.array([255, 0, 255, 128, 255, 255, 0])
COLORS = np.stack([SHADES, SHADES[::-1], np.roll(SHADES, 2)], -1)


def row(*channels):
    """One row of pixels."""
    return np.stack(channels, -1)[None].astype(np.uint8)


def gray(shades=SHADES, alpha=OPAQUE):
    """The colors and the opacity of gray pixels."""
    return np.stack([shades] * 3, -1), alpha


def stored(image, kind, **options):
    """The bytes of an image in a file."""
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def palette(**options):
    """The bytes of a PNG file with a palette."""
    image = Image.frombytes("P", (len(SHADES), 1), bytes(range(len(SHADES))))
    image.putpalette(COLORS.astype(np.uint8).tobytes())
    return stored(image, "PNG", **options)


def png(bits, color_type, pixels, transparency=b""):
    """The bytes of a PNG file of one row, which Pillow may not be able to write."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    n_channels = {0: 1, 2: 3}[color_type]
    width = len(pixels) * 8 // bits // n_channels
    header = struct.pack(">IIBBBBB", width, 1, bits, color_type, 0, 0, 0)
    parts = [chunk(b"IHDR", header)] + ([chunk(b"tRNS", transparency)] if transparency else [])
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        [*parts, chunk(b"IDAT", zlib.compress(b"\0" + pixels)), chunk(b"IEND", b"")]
    )


def big_endian(shades):
    """The bytes of 16 bits."""
    return (shades * 257).astype(">u2").tobytes()


ONE_BIT = np.array([255, 0, 255, 0, 0, 0, 0, 0])
TWO_BITS, FOUR_BITS = np.array([0, 85, 170, 255]), np.array([0, 17, 34, 255])
THIRD_CLEAR, NOT_205 = np.where(np.arange(7) == 2, 0, 255), np.where(SHADES == 205, 0, 255)

CASES = {
    "1": (stored(Image.fromarray(SHADES[None] > 99), "PNG"), gray(np.where(SHADES > 99, 255, 0))),
    "1, transparent": (png(1, 0, b"\xa0", b"\0\1"), gray(ONE_BIT, 255 - ONE_BIT)),
    "L": (stored(Image.fromarray(SHADES[None].astype(np.uint8)), "PNG"), gray()),
    "L, transparent": (
        stored(Image.fromarray(SHADES[None].astype(np.uint8)), "PNG", transparency=205), gray(alpha=NOT_205)
    ),
    "L, 2 bits": (png(2, 0, b"\x1b"), gray(TWO_BITS, OPAQUE[:4])),
    "L, 2 bits, transparent": (png(2, 0, b"\x1b", b"\0\2"), gray(TWO_BITS, THIRD_CLEAR[:4])),
    "L, 4 bits, transparent": (png(4, 0, b"\x01\x2f", b"\0\2"), gray(FOUR_BITS, THIRD_CLEAR[:4])),
    "LA": (stored(Image.fromarray(row(SHADES, SOME_CLEAR)), "PNG"), gray(alpha=SOME_CLEAR)),
    "P": (palette(), (COLORS, OPAQUE)),
    "P, transparent": (palette(transparency=bytes(SOME_CLEAR.tolist())), (COLORS, SOME_CLEAR)),
    "P, one color transparent": (palette(transparency=2), (COLORS, THIRD_CLEAR)),
    "RGB": (stored(Image.fromarray(row(*COLORS.T)), "PNG"), (COLORS, OPAQUE)),
    "RGB, transparent": (
        stored(Image.fromarray(row(*COLORS.T)), "PNG", transparency=tuple(COLORS[2].tolist())), (COLORS, THIRD_CLEAR)
    ),
    "RGB, 16 bits, transparent": (png(16, 2, big_endian(COLORS), big_endian(COLORS[2])), (COLORS, THIRD_CLEAR)),
    "RGBA": (stored(Image.fromarray(row(*COLORS.T, SOME_CLEAR)), "PNG"), (COLORS, SOME_CLEAR)),
    "I;16": (stored(Image.fromarray((SHADES[None] * 257).astype(np.uint16)), "PNG"), gray()),
    "I;16, transparent": (png(16, 0, big_endian(SHADES), big_endian(SHADES[4])), gray(alpha=NOT_205)),
    "I;16B": (stored(Image.frombytes("I;16B", (7, 1), big_endian(SHADES)), "TIFF"), gray()),
    "I": (b"P5 7 1 65535\n" + big_endian(SHADES), gray()),
    "I, to 1,000": (b"P5 7 1 1000\n" + (SHADES * 1000 // 255).astype(">u2").tobytes(), gray()),
    "F": (stored(Image.fromarray((SHADES[None] / 255).astype(np.float32)), "TIFF"), gray()),
    "CMYK": (stored(Image.fromarray(row(*(255 - COLORS).T, 0 * SHADES), "CMYK"), "TIFF"), (COLORS, OPAQUE)),
}  # fmt: skip
"""The bytes of a file of each mode, and the colors and the opacity of its pixels, 0 to 255."""


@pytest.mark.parametrize(("data", "expected"), CASES.values(), ids=CASES)
def test_file_of_each_mode_has_its_pixels(data, expected):
    colors, alpha = expected
    with open_image(io.BytesIO(data), 512) as image:
        found = plain(image)
    assert found.mode in ("L", "LA", "RGB", "RGBA", "I;16")
    pixels = np.asarray(eight_bits(found).convert("RGBA"))[0]
    assert np.abs(pixels[:, :3].astype(int) - colors).max() <= 1
    assert (pixels[:, 3] == alpha).all()
    on_paper = colors * (alpha / 255)[:, None] + 255 - alpha[:, None]
    assert np.abs(np.asarray(on_white(found).convert("RGB"))[0].astype(int) - on_paper).max() <= 1


@pytest.mark.parametrize("mode", ["La", "PA", "RGBa", "RGBX", "YCbCr", "LAB", "HSV", "I;16L", "I;16N"])
def test_other_modes_of_pillow_become_plain_ones(mode):
    found = plain(Image.new(mode, (3, 2)))
    assert found.mode in ("L", "LA", "RGB", "RGBA", "I;16")
    assert found.size == (3, 2)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.array([[0.0, 200.0]], np.float32), "not from 0, black, to 1, white"),
        (np.array([[0.0, np.nan]], np.float32), "not from 0, black, to 1, white"),
        (np.array([[0, 70_000]], np.int32), "which number is white is not known"),
    ],
)
def test_image_whose_white_is_unknown_is_refused(values, message):
    data = stored(Image.fromarray(values), "TIFF")
    with open_image(io.BytesIO(data), 512) as image, pytest.raises(ValueError, match=message):
        plain(image)


def test_format_that_starts_a_program_is_refused():
    with (
        pytest.raises(UnknownImageError),
        open_image(io.BytesIO(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"), 512),
    ):
        pytest.fail("it is open")


def test_every_module_that_opens_images_makes_them_plain():
    for path in Path(realitygap.__file__).parent.rglob("*.py"):
        names = {
            alias.name
            for node in ast.walk(ast.parse(path.read_text("utf-8")))
            if isinstance(node, ast.ImportFrom) and node.module == "realitygap._image_file"
            for alias in node.names
        }
        assert "open_image" not in names or "plain" in names, path


@pytest.mark.parametrize("name", CASES)
def test_floor_of_each_mode_is_as_it_lies_on_white_paper(tmp_path, name):
    data, (colors, alpha) = CASES[name]
    (tmp_path / "floor.png").write_bytes(data)  # readers look at what is in a file, not at its ending
    width = len(colors)
    (tmp_path / "arena.toml").write_text(
        f"wall = [[0, 0, {width}, 0], [{width}, 0, {width}, 1], [{width}, 1, 0, 1], [0, 1, 0, 0]]\n"
        f'start = [0.4, 0.5, 0.0]\n[floor]\nimage = {{ file = "floor.png", width = {width}.0 }}\n'
    )
    on_paper = colors * (alpha / 255)[:, None] + 255 - alpha[:, None]
    found = load_arena(tmp_path / "arena.toml").floor.image.gray[0]
    assert np.abs(found - on_paper @ [0.299, 0.587, 0.114]).max() <= 2
