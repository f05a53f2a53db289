"""Pictures of plain shapes as pixels."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from realitygap.drawing import Disc, Line, Picture, Text, hex_of, rgb_of, to_image, to_png

GROUND = (254, 254, 254)


def drawn(*shapes: Line | Disc | Text, width: int = 100) -> np.ndarray:
    return np.asarray(to_image(Picture("a", "b", 0.0, 0.0, 2.0, 1.0, shapes), width))


def test_an_area_is_where_it_should_be() -> None:
    pixels = drawn(Line(((0.5, 0.5), (1.0, 0.5), (1.0, 1.0), (0.5, 1.0)), None, closed=True, fill="#ff0000"))
    assert pixels.shape == (50, 100, 3)
    red = (pixels == (255, 0, 0)).all(axis=2)
    rows, columns = np.nonzero(red)
    assert (rows.min(), columns.min()) == (0, 25)
    assert (rows.max(), columns.max()) == pytest.approx((24, 49), abs=1)
    assert tuple(pixels[40, 40]) == GROUND


def test_a_line_is_as_wide_as_it_says_and_closes() -> None:
    corners = ((0.5, 0.25), (1.5, 0.25), (1.5, 0.75), (0.5, 0.75))
    pixels = drawn(Line(corners, "#0000ff", 4.8, closed=True), width=300)
    dark = (pixels < 128)[..., 0]
    assert dark[:, 150].sum() == pytest.approx(2 * 3, abs=1)  # 4.8 pt of 480 are 3 pixels of 300
    assert dark[75, :].sum() == pytest.approx(2 * 3, abs=1)


def test_dashes_cover_their_share() -> None:
    whole = drawn(Line(((0.0, 0.5), (2.0, 0.5)), "#000000", 5.0), width=480)
    dashed = drawn(Line(((0.0, 0.5), (2.0, 0.5)), "#000000", 5.0, (20.0, 60.0)), width=480)
    share = (dashed[120] == 0).sum() / (whole[120] == 0).sum()
    assert share == pytest.approx(0.25, abs=0.03)


def test_a_disc_has_a_rim() -> None:
    pixels = drawn(Disc(1.0, 0.5, 48.0, "#000000", "#00ff00", 9.6), width=100)
    assert tuple(pixels[25, 50]) == (0, 255, 0)
    assert tuple(pixels[25, 60]) == (0, 0, 0)
    assert tuple(pixels[25, 65]) == GROUND


def test_text_is_drawn() -> None:
    pixels = drawn(Text(1.0, 0.5, "robot", 20.0), width=480)
    rows, columns = np.nonzero((pixels < 100).all(axis=2))
    assert columns.mean() == pytest.approx(240, abs=6)
    assert rows.mean() == pytest.approx(120, abs=6)


def test_a_png_is_the_image() -> None:
    picture = Picture("a", "b", 0.0, 0.0, 2.0, 1.0, (Disc(1.0, 0.5, 50.0),))
    with Image.open(io.BytesIO(to_png(picture, 80))) as image:
        assert np.array_equal(np.asarray(image), np.asarray(to_image(picture, 80)))


def test_an_empty_rectangle_is_refused() -> None:
    with pytest.raises(ValueError, match="expected more than 0"):
        to_image(Picture("a", "b", 0.0, 0.0, 0.0, 1.0, ()))


@pytest.mark.parametrize(
    ("name", "rgb"),
    [
        ("red", (255, 0, 0)),
        ("Light Blue", (173, 216, 230)),
        ("gray50", (127, 127, 127)),
        ("#0a0B0c", (10, 11, 12)),
    ],
)
def test_colors_have_names(name: str, rgb: tuple[int, int, int]) -> None:
    assert rgb_of(name) == rgb
    assert rgb_of(hex_of(name)) == rgb
