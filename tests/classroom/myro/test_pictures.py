"""Pictures, pixels and colors."""

import numpy as np
import pytest
from PIL import Image

from realitygap.classroom import myro
from realitygap.classroom.myro import (
    Color,
    MyroError,
    Picture,
    copyPicture,
    getBlue,
    getColor,
    getGray,
    getGreen,
    getHeight,
    getPixel,
    getPixels,
    getRed,
    getRGB,
    getRGBA,
    getWidth,
    getX,
    getY,
    loadPicture,
    makeArray,
    makeColor,
    makeDarker,
    makeLighter,
    makePicture,
    savePicture,
    setAlpha,
    setBlue,
    setColor,
    setGray,
    setGreen,
    setPixel,
    setRed,
    setRGB,
    setRGBA,
)  # fmt: skip


@pytest.fixture
def picture():
    """3 x 2 pixels whose red is 10 x + y."""
    made = makePicture(3, 2)
    for pixel in getPixels(made):
        setRGB(pixel, (10 * getX(pixel) + getY(pixel), 100, 200))
    return made


def test_pixels_come_column_by_column(picture):
    assert [getRed(pixel) for pixel in getPixels(picture)] == [0, 1, 10, 11, 20, 21]
    assert (getWidth(picture), getHeight(picture)) == (picture.getWidth(), picture.getHeight()) == (3, 2)
    assert repr(picture) == "<Picture instance (3 x 2)>"


def test_a_pixel_is_read_and_set_part_by_part(picture):
    pixel = getPixel(picture, 2, 1)
    assert (getRed(pixel), getGreen(pixel), getBlue(pixel), getGray(pixel)) == (21, 100, 200, 107)
    assert (getRGB(pixel), getRGBA(pixel)) == ((21, 100, 200), (21, 100, 200, 255))
    setRed(pixel, 300)
    setGreen(pixel, -4)
    setBlue(pixel, 12.9)
    assert getRGB(pixel) == (255, 0, 12)
    setGray(pixel, 7)
    setAlpha(pixel, 30)
    assert getRGBA(getPixel(picture, 2, 1)) == (7, 7, 7, 30)
    setRGBA(pixel, (1, 2, 3, 4))
    assert picture.getRGBA(2, 1) == (1, 2, 3, 4)
    assert picture.getAlpha(2, 1) == 4
    assert repr(pixel) == "<Pixel instance (r=1, g=2, b=3, a=4) at (2, 1)>"


def test_colors_are_made_compared_and_given(picture):
    setColor(getPixel(picture, 0, 0), makeColor(1, 2, 3))
    assert getColor(getPixel(picture, 0, 0)) == Color(1, 2, 3) == Color([1, 2, 3]) == Color("#010203")
    setPixel(picture, 1, 1, getPixel(picture, 0, 0))
    assert getPixel(picture, 1, 1) == getPixel(picture, 0, 0)
    assert getPixel(picture, 1, 0) != getPixel(picture, 0, 0)
    assert Color(1, 2, 3) + Color(250, 250, 250) == Color(251, 252, 253)
    assert Color(1, 2, 3) - Color(2, 1, 1) == Color(0, 1, 2)
    assert repr(myro.pink) == "<Color instance (r=255, g=175, b=175, a=255)>"


def test_colors_become_lighter_and_darker():
    color = makeColor(100, 200, 0)
    makeLighter(color)
    assert color.getRGB() == (154, 219, 89)
    makeDarker(color)
    assert color.getRGB() == (100, 142, 57)


def test_a_copy_can_change_while_the_picture_stays(picture):
    copied = copyPicture(picture)
    setRGB(getPixel(copied, 0, 0), (9, 9, 9))
    assert getRGB(getPixel(picture, 0, 0)) == (0, 100, 200)
    assert getRGB(getPixel(copied, 0, 0)) == (9, 9, 9)


@pytest.mark.parametrize("ending", ["png", "gif", "bmp"])
def test_a_picture_is_saved_and_loaded(picture, tmp_path, ending):
    name = str(tmp_path / f"picture.{ending}")
    savePicture(picture, name)
    again = loadPicture(name)
    assert [getRGB(pixel) for pixel in getPixels(again)] == [getRGB(pixel) for pixel in getPixels(picture)]
    assert makePicture(name).filename == name


def test_a_picture_is_saved_as_jpeg(tmp_path):
    name = str(tmp_path / "picture.jpg")
    savePicture(makePicture(16, 16, makeColor(200, 20, 20)), name)
    assert np.abs(np.array(getRGB(getPixel(makePicture(name), 8, 8))) - (200, 20, 20)).max() < 5


def test_several_pictures_become_a_moving_gif(tmp_path):
    name = str(tmp_path / "moving.gif")
    savePicture([makePicture(4, 4, 0), makePicture(4, 4, 255), makePicture(4, 4, myro.red)], name)
    with Image.open(name) as image:
        assert image.n_frames == 3


def test_pictures_are_made_in_all_ways_of_myro():
    assert makePicture().width == 0
    assert getRGB(getPixel(makePicture(2, 2), 0, 0)) == (255, 255, 255)
    assert getRGB(getPixel(makePicture(2, 2, 40), 1, 1)) == (40, 40, 40)
    assert getRGB(getPixel(makePicture(2, 2, [1, 2, 3]), 1, 1)) == (1, 2, 3)
    assert getRGB(getPixel(makePicture(2, 1, list(range(6))), 1, 0)) == (3, 4, 5)
    assert getRGB(getPixel(makePicture(2, 1, [5, 6], "gray"), 1, 0)) == (6, 6, 6)
    assert getRGB(getPixel(Picture.from_array(np.full((2, 3), 9, dtype=np.uint8)), 2, 1)) == (9, 9, 9)


def test_pictures_are_turned_and_scaled(picture):
    picture.scale(2)
    assert (picture.width, picture.height) == (6, 4)
    picture.resize(3, 3)
    picture.rotate(90)
    assert (picture.width, picture.height) == (3, 3)


def test_arrays_have_rows_and_pictures_become_arrays(picture):
    array = makeArray(2, 3)
    array[1][2] = 7
    assert (len(array), array[1][2], array[0][2]) == (2, 7, 0)
    assert getRed(makeArray(picture)[2][1]) == 21
    assert len(makeArray(picture)) == 3


def test_color_spaces_agree_with_their_inverses():
    assert myro.hsv2rgb(*myro.rgb2hsv(10, 20, 30)) == pytest.approx((10, 20, 30))
    assert myro.hls2rgb(*myro.rgb2hls(0.1, 0.2, 0.3)) == pytest.approx((0.1, 0.2, 0.3))
    assert myro.yiq2rgb(*myro.rgb2yiq(0.1, 0.2, 0.3)) == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)
    assert myro.rgb2yuv(255, 255, 255) == [255, 128, 128]
    there_and_back = myro.yuv2rgb(*myro.rgb2yuv(200, 100, 50))
    assert np.abs(np.array(there_and_back) - (200, 100, 50)).max() < 20  # Myro's formulas are rough
    assert myro.color_rgb(255, 128, 0) == "#ff8000"
    assert myro.rgb_color("#ff8000") == (255, 128, 0)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (
            lambda picture: getPixel(picture, 3, 0),
            "x in a picture of 3 x 2 pixels is 3, expected a whole number from 0 to 2",
        ),
        (lambda picture: getPixel(makePicture(), 0, 0), "has no pixels"),
        (lambda picture: makeColor(1, 2, "3"), "A part of a color is '3'"),
        (lambda picture: Color(1, 2), "expected red, green and blue"),
        (lambda picture: Color("red"), "'red' is no color"),
        (lambda picture: setColor(getPixel(picture, 0, 0), (1, 2, 3)), "expected one made by makeColor"),
        (
            lambda picture: loadPicture("nowhere.jpg"),
            "The picture 'nowhere.jpg' cannot be opened: No such file",
        ),
        (lambda picture: makePicture(0, 5), "The width of a picture is 0"),
        (lambda picture: makePicture(1, 2, 3, 4, 5), "was given 5 values"),
        (lambda picture: makePicture(2, 2, [1, 2]), "the data has 2 bytes, expected 2 x 2 x 3"),
        (lambda picture: makePicture("http://example.org/a.jpg"), "address on the web"),
        (lambda picture: savePicture(picture, "a.nonsense"), "Names of pictures end in"),
        (lambda picture: savePicture([], "a.gif"), "the list is empty"),
        (lambda picture: savePicture(7, "a.gif"), "savePicture: the picture is 7"),
        (
            lambda picture: getWidth("a.jpg"),
            "getWidth: the picture is 'a.jpg', expected one made by takePicture",
        ),
        (lambda picture: list(getPixels(None)), "getPixels: the picture is None"),
        (lambda picture: getX(picture), "getX: the pixel is <Picture instance"),
        (lambda picture: getRed(picture), "getRed was given <Picture instance"),
        (lambda picture: setRed((1, 2, 3), 5), "setRed was given .1, 2, 3., expected a pixel"),
        (lambda picture: copyPicture("a.jpg"), "copyPicture: the picture is 'a.jpg'"),
    ],
)
def test_mistakes_with_pictures_are_said_plainly(picture, act, message):
    with pytest.raises(MyroError, match=message.replace("(", r"\(")):
        act(picture)
