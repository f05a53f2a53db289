"""Photos of all kinds are read; what is none, torn or too large gets one clear message."""

from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from realitygap.errors import VisionError
from realitygap.vision import find_sheet, read_photo, score_sheet

from .sheets import LAYOUT, SCAN, photo

ORIENTATION = 0x0112


def _file(picture: Image.Image, kind: str, **options: object) -> bytes:
    file = io.BytesIO()
    picture.save(file, kind, **options)
    return file.getvalue()


def _ramp(height: int = 420, width: int = 600) -> np.ndarray:
    """(h, w, 3) bright to the right in red, to the bottom in green."""
    y, x = np.mgrid[0:height, 0:width]
    return np.stack([255 * x // width, 255 * y // height, 0 * x], axis=2).astype(np.uint8)


def _bomb(width: int, height: int) -> bytes:
    """A PNG file of a few bytes that says it is very large."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(1 << 20), 9)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "is empty"),
        (b"\xff\xd8\xff\xe0 no more", "picture"),
        (b"%PDF-1.4", "expected JPEG, PNG, TIFF or WebP. It is a PDF: scan to JPEG or PNG"),
        (b"cells: 1 2 3\n" * 100, "no picture that can be read"),
        (
            b"\x00\x00\x00\x18ftypheic\x00\x00\x00\x00mif1heic" + bytes(500),
            "It looks like HEIC: export it as JPEG",
        ),
        (b"GIF89a" + bytes(500), "expected JPEG, PNG, TIFF or WebP"),
        (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "no picture that can be read"),
        (_bomb(60_000, 60_000), "too many pixels, expected at most 120 million"),
        (_bomb(19_000, 9_000), "19000 x 9000 pixels, expected 400 to 20000 each way and at most 120 million"),
        (_bomb(30_000, 500), "30000 x 500 pixels"),
        (_bomb(5000, 5000), "Is the file whole"),
        (_file(Image.new("RGB", (300, 2000)), "JPEG"), "300 x 2000 pixels, expected 400 to 20000"),
    ],
)
def test_files_that_are_no_photos_are_refused_with_a_remedy(data, said):
    with pytest.raises(VisionError, match=said) as refused:
        read_photo(data)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 300


def test_a_bomb_takes_no_memory():
    import tracemalloc

    tracemalloc.start()
    with pytest.raises(VisionError):
        read_photo(_bomb(19_000, 9_000))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 20_000_000


def test_a_file_of_too_many_bytes_is_not_read(tmp_path):
    path = tmp_path / "large.jpg"
    with path.open("wb") as file:
        file.truncate(65 << 20)
    with pytest.raises(VisionError, match="larger than 64 MiB"):
        read_photo(path)
    with pytest.raises(VisionError, match="larger than 64 MiB"):
        read_photo(bytes(65 << 20))


def test_a_photo_cut_off_is_refused():
    noise = np.random.default_rng(1).integers(0, 256, (400, 600, 3), np.uint8)
    with pytest.raises(VisionError, match="Is the file whole"):
        read_photo(_file(Image.fromarray(noise), "JPEG")[:50_000])


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(VisionError, match="cannot be read: No such file"):
        read_photo(tmp_path / "none.jpg")
    with pytest.raises(VisionError, match="cannot be read: Is a directory"):
        read_photo(tmp_path)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF", "WEBP"])
def test_torn_and_garbled_files_give_a_picture_or_one_message(kind):
    whole = _file(Image.fromarray(_ramp()), kind)
    rng = np.random.default_rng(5)
    for _ in range(40):
        data = bytearray(whole)
        for at in rng.integers(len(data), size=int(rng.integers(1, 8))):
            data[at] = int(rng.integers(256))
        if rng.uniform() < 0.5:
            data = data[: int(rng.integers(len(data)))]
        try:
            found = read_photo(bytes(data))
        except VisionError as refused:
            assert "\n" not in str(refused)  # noqa: PT017
        else:
            assert found.ndim == 3
            assert found.dtype == np.uint8


@pytest.mark.parametrize("turn", range(1, 9))
def test_a_photo_turned_by_the_camera_is_turned_back(turn):
    picture = Image.fromarray(_ramp())
    back = {2: 0, 3: 3, 4: 1, 5: 5, 6: 2, 7: 6, 8: 4}  # the transpositions that undo what Exif's numbers say
    held = picture.transpose(Image.Transpose(back[turn])) if turn > 1 else picture
    exif = Image.Exif()
    exif[ORIENTATION] = turn
    seen = read_photo(_file(held, "PNG", exif=exif))
    assert (seen == _ramp()).all()


@pytest.mark.parametrize(
    ("picture", "kind"),
    [
        (Image.fromarray(_ramp()).convert("CMYK"), "JPEG"),
        (Image.fromarray(_ramp()).convert("CMYK"), "TIFF"),
        (Image.fromarray(_ramp()).convert("RGBA"), "PNG"),
        (Image.fromarray(_ramp()).quantize(255), "PNG"),
        (Image.fromarray(_ramp()), "WEBP"),
    ],
)
def test_colors_of_all_kinds_of_files_are_read(picture, kind):
    seen = read_photo(_file(picture, kind, **({"quality": 95} if kind != "PNG" else {}))).astype(int)
    assert seen.shape == (420, 600, 3)
    assert np.abs(seen - _ramp()).mean() < 12


@pytest.mark.parametrize("kind", ["PNG", "TIFF"])
def test_sixteen_bits_of_gray_keep_their_steps(kind):
    gray = _ramp()[..., 0]
    seen = read_photo(_file(Image.fromarray(gray.astype(np.uint16) * 257), kind))
    assert (seen == gray[..., None]).all()


def test_transparent_pixels_are_white():
    picture = Image.new("RGBA", (500, 500), (10, 20, 30, 0))
    assert (read_photo(_file(picture, "PNG")) == 255).all()


def test_a_very_large_photo_is_halved():
    large = Image.new("RGB", (8000, 5000), (200, 100, 50))
    for kind in ("JPEG", "PNG"):
        seen = read_photo(_file(large, kind))
        assert seen.shape == (2500, 4000, 3)
        assert np.abs(seen[10, 10].astype(int) - (200, 100, 50)).max() <= 3


@pytest.mark.slow
def test_a_gray_photo_is_read_with_one_pen_and_refused_with_several():
    gray = _file(Image.open(io.BytesIO(photo(1, SCAN, n=1).jpeg)).convert("L"), "JPEG", quality=92)
    with pytest.raises(VisionError, match="The picture is gray, and its 8 pens are identified by color"):
        score_sheet(read_photo(gray), LAYOUT)
    assert len(score_sheet(read_photo(gray), LAYOUT, [0]).traces[0].cells) > 5


@pytest.mark.slow
def test_a_sheet_upside_down_is_found():
    image = read_photo(photo(1, SCAN).jpeg)
    turned = find_sheet(np.ascontiguousarray(image[::-1, ::-1]), LAYOUT)
    corner = np.array([LAYOUT.walls[:2]])
    column, row = find_sheet(image, LAYOUT).to_photograph(corner)[0]
    there = turned.to_photograph(corner)[0]
    assert there == pytest.approx((image.shape[1] - 1 - column, image.shape[0] - 1 - row), abs=1.0)
