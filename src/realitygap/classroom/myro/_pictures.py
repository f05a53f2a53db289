"""Pictures and their pixels, as Myro's courses work on them."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol, cast

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from realitygap._image_file import eight_bits, open_image, plain

from ._colors import Color, HasColor, Rgb, Rgba, darker, has_color, lighter
from ._mistakes import MyroError, whole

_LARGEST = 20_000  # [pixels] along a side: beyond it a program asks for more memory than a computer has


class _Pixels(Protocol):
    """Pillow's access to the pixels of a picture with red, green, blue and alpha, by column and row."""

    def __getitem__(self, place: tuple[int, int], /) -> Rgba: ...

    def __setitem__(self, place: tuple[int, int], color: Rgba, /) -> None: ...


class Picture:
    """A picture of pixels, (0, 0) at the upper left, x to the right and y downwards; it shows itself in notebooks.

    Attributes:
        image: The pixels, as Pillow's image with red, green, blue and alpha.
        filename: File of the picture.
    """

    def __init__(self, original: Picture | PIL.Image.Image | str | None = None) -> None:
        if isinstance(original, str):
            self.image, self.filename = _opened(original), original
        elif isinstance(original, Picture):
            self.image, self.filename = original.image.copy(), original.filename
        else:
            self.image = PIL.Image.new("RGBA", (0, 0)) if original is None else original.convert("RGBA")
            self.filename = "Camera Image"
        self._reload()

    def _reload(self) -> None:
        self.width, self.height = self.image.size
        self.pixels = cast(_Pixels, self.image.load())

    @classmethod
    def from_array(cls, array: NDArray[np.uint8]) -> Picture:
        """Return a picture from a camera.

        Args:
            array: (h, w, 3) uint8 colors, or (h, w) uint8 grays.
        """
        return cls(PIL.Image.fromarray(np.ascontiguousarray(array)))

    def __repr__(self) -> str:
        return f"<Picture instance ({self.width} x {self.height})>"

    def _repr_png_(self) -> bytes | None:
        return self.png() if self.width and self.height else None

    def png(self) -> bytes:
        """Return the picture as the bytes of a PNG file."""
        buffer = io.BytesIO()
        self.image.save(buffer, "png")
        return buffer.getvalue()

    def load(self, filename: str) -> None:
        """Become the picture in a file.

        Raises:
            MyroError: It cannot be read.
        """
        self.image, self.filename = _opened(filename), filename
        self._reload()

    def getPixels(self) -> Iterator[Pixel]:
        """Yield each pixel, column by column from the left, each from the top."""
        return (Pixel(x, y, self) for x in range(self.width) for y in range(self.height))

    def getPixel(self, x: int, y: int) -> Pixel:
        """Return the pixel in column x and row y, both from 0.

        Raises:
            MyroError: There is none.
        """
        return Pixel(*self._place(x, y), self)

    def _place(self, x: object, y: object) -> tuple[int, int]:
        if not self.width or not self.height:
            raise MyroError("This picture has no pixels: its size is 0 x 0.")
        return (
            whole(f"x in a picture of {self.width} x {self.height} pixels", x, 0, self.width - 1),
            whole(f"y in a picture of {self.width} x {self.height} pixels", y, 0, self.height - 1),
        )

    def getColor(self, x: int, y: int) -> Color:
        """Return the color of a pixel."""
        return self.getPixel(x, y).getColor()

    def setColor(self, x: int, y: int, newColor: HasColor) -> None:
        """Color a pixel."""
        self.getPixel(x, y).setColor(newColor)

    def getRGB(self, x: int, y: int) -> Rgb:
        """Return red, green and blue of a pixel."""
        return self.getPixel(x, y).getRGB()

    def setRGB(self, x: int, y: int, rgb: Sequence[float]) -> None:
        """Set red, green and blue of a pixel."""
        self.getPixel(x, y).setRGB(rgb)

    def getRGBA(self, x: int, y: int) -> Rgba:
        """Return red, green, blue and alpha of a pixel."""
        return self.getPixel(x, y).getRGBA()

    def getAlpha(self, x: int, y: int) -> int:
        """Return the opacity of a pixel, 0 to 255."""
        return self.getPixel(x, y).getAlpha()

    def getWidth(self) -> int:
        """Return the number of columns of pixels."""
        return self.width

    def getHeight(self) -> int:
        """Return the number of rows of pixels."""
        return self.height

    def rotate(self, degreesCCwise: float) -> None:
        """Turn the picture to the left [degrees]; its size stays."""
        self.image = self.image.rotate(degreesCCwise)
        self._reload()

    def resize(self, x: float, y: float) -> None:
        """Make the picture x pixels wide and y high."""
        self.image = self.image.resize((_side("width", int(x)), _side("height", int(y))))
        self._reload()

    def scale(self, xfactor: float = 1, yfactor: float | None = None) -> None:
        """Make the picture larger or smaller by a factor, or by one each across and down."""
        self.resize(self.width * xfactor, self.height * (xfactor if yfactor is None else yfactor))


class Pixel:
    """A pixel of a picture. If you color it, you change the picture.

    Attributes:
        x, y: Column and row, from 0 at the upper left.
        picture: The picture it belongs to.
    """

    __slots__ = ("picture", "x", "y")

    def __init__(self, x: int, y: int, picture: Picture) -> None:
        self.x, self.y, self.picture = x, y, picture

    def __repr__(self) -> str:
        red, green, blue, alpha = self.getRGBA()
        return f"<Pixel instance (r={red}, g={green}, b={blue}, a={alpha}) at ({self.x}, {self.y})>"

    def __eq__(self, other: object) -> bool:
        return self.getRGBA() == other.getRGBA() if has_color(other) else NotImplemented

    __hash__ = None  # type: ignore[assignment]  # equal pixels may differ a moment later

    def __add__(self, other: HasColor) -> Color:
        return Color(self.getColor() + other)

    def __sub__(self, other: HasColor) -> Color:
        return Color(self.getColor() - other)

    def getX(self) -> int:
        """Return its column, from 0 at the left."""
        return self.x

    def getY(self) -> int:
        """Return its row, from 0 at the top."""
        return self.y

    def getPixel(self, x: int, y: int) -> Pixel:
        """Return another pixel of the same picture."""
        return self.picture.getPixel(x, y)

    def getColor(self) -> Color:
        """Return its color."""
        return Color(self.getRGBA())

    def setColor(self, newColor: HasColor) -> None:
        """Give it a color, or that of another pixel."""
        if not has_color(newColor):
            raise MyroError(
                f"setColor: the color is {newColor!r}, expected one made by makeColor(red, green, blue)."
            )
        self.picture.pixels[self.x, self.y] = newColor.getRGBA()

    def getRGB(self) -> Rgb:
        """Return red, green and blue, each 0 to 255."""
        return self.picture.pixels[self.x, self.y][:3]

    def setRGB(self, rgb: Sequence[float]) -> None:
        """Set red, green and blue; the pixel becomes opaque."""
        self.setColor(Color(rgb))

    def getRGBA(self) -> Rgba:
        """Return red, green, blue and alpha, each 0 to 255."""
        return self.picture.pixels[self.x, self.y]

    def setRGBA(self, rgba: Sequence[float]) -> None:
        """Set red, green, blue and alpha."""
        self.setColor(Color(rgba))

    def getAlpha(self) -> int:
        """Return the opacity of the pixel, 0 to 255."""
        return self.getRGBA()[3]

    def setAlpha(self, alpha: float) -> None:
        """Set how opaque it is, 0 to 255."""
        self.setColor(Color(*self.getRGB(), alpha))

    def makeLighter(self) -> None:
        """Move each part of its color by 35 % towards white."""
        self.setRGB(lighter(self.getRGB()))

    def makeDarker(self) -> None:
        """Leave 65 % of each part of its color."""
        self.setRGB(darker(self.getRGB()))


def _opened(filename: str) -> PIL.Image.Image:
    try:
        with open_image(Path(filename).expanduser(), _LARGEST) as image:
            return eight_bits(plain(image)).convert("RGBA")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no picture that can be read"
        raise MyroError(f"The picture {filename!r} cannot be opened: {reason}.") from error


def _side(name: str, value: object) -> int:
    return whole(f"The {name} of a picture", value, 1, _LARGEST)


def makePicture(*args: Any) -> Picture:
    """Return a picture: empty, from a file, or of a size and perhaps a color.

    `makePicture()`, `makePicture("photo.jpg")`, `makePicture(width, height)` (white),
    `makePicture(width, height, color)`, `makePicture(width, height, gray)`, `makePicture(width, height, data)`
    and `makePicture(width, height, data, mode)` with the bytes of all pixels, row by row, in mode "color"
    (3 a pixel) or "gray" (1 a pixel).

    Raises:
        MyroError: None of these was meant.
    """
    if not args:
        return Picture()
    if len(args) == 1 and isinstance(args[0], (str, Path)):
        return _from_file_or_web(str(args[0]))
    if len(args) == 2:
        return _filled(*args, (255, 255, 255, 255))
    if len(args) == 3 and isinstance(args[2], (int, float)):
        gray = whole("makePicture: the gray", args[2], 0, 255)
        return _filled(args[0], args[1], (gray, gray, gray, 255))
    if len(args) == 3 and (has_color(args[2]) or len(args[2]) == 3):
        return _filled(args[0], args[1], Color(args[2]).getRGBA())
    if len(args) in (3, 4):
        return _from_bytes(*args)
    raise MyroError(
        f"makePicture was given {len(args)} values, expected a file's name, or width and height, perhaps with a color."
    )


def _from_file_or_web(filename: str) -> Picture:
    if filename.startswith(("http://", "https://")):
        raise MyroError(
            f"makePicture: {filename!r} is an address on the web, which is left out. Download the picture and give the "
            "name of its file."
        )
    return Picture(filename)


def _filled(width: object, height: object, rgba: Rgba) -> Picture:
    return Picture(PIL.Image.new("RGBA", (_side("width", width), _side("height", height)), rgba))


def _from_bytes(width: object, height: object, data: bytes | Iterable[int], mode: str = "color") -> Picture:
    size = (_side("width", width), _side("height", height))
    form, per_pixel = ("RGB", 3) if mode.lower() == "color" else ("L", 1)
    raw = bytes(data)
    if len(raw) != size[0] * size[1] * per_pixel:
        raise MyroError(
            f"makePicture: the data has {len(raw)} bytes, expected {size[0]} x {size[1]} x {per_pixel} "
            f"for mode {mode!r}."
        )
    return Picture(PIL.Image.frombytes(form, size, raw))


def loadPicture(filename: str) -> Picture:
    """Return the picture in a file.

    Raises:
        MyroError: It cannot be read.
    """
    return Picture(filename)


def copyPicture(picture: Picture) -> Picture:
    """Return a copy, which can be changed while the picture stays."""
    return Picture(_a_picture("copyPicture", picture))


def savePicture(picture: Picture | Sequence[Picture | str], filename: str) -> None:
    """Write a picture to a file, whose ending says how (.jpg, .png, .gif); a list of pictures becomes a moving GIF.

    Args:
        picture: The picture; or several, or names of files, for a GIF that shows them one after another.
        filename: Name of the file.

    Raises:
        MyroError: The file cannot be written.
    """
    several = picture if isinstance(picture, Sequence) and not isinstance(picture, str) else [picture]
    pictures = [_as_picture(item) for item in several]
    if not pictures:
        raise MyroError("savePicture: the list is empty, expected pictures.")
    images = [_flat(item.image, filename) for item in pictures]
    path = Path(filename).expanduser()
    try:
        if len(images) > 1:
            images[0].save(path, save_all=True, append_images=images[1:], loop=0)
        else:
            images[0].save(path)
    except (OSError, ValueError) as error:
        raise MyroError(
            f"savePicture: {filename!r} cannot be written: {getattr(error, 'strerror', None) or error}. "
            "Names of pictures end in .jpg, .png or .gif."
        ) from error


writePictureTo = savePicture


def _as_picture(item: object) -> Picture:
    return Picture(item) if isinstance(item, str) else _a_picture("savePicture", item)


def _flat(image: PIL.Image.Image, filename: str) -> PIL.Image.Image:
    """Return a picture without alpha if the format has none or nothing is transparent, so that GIF colors are exact."""
    is_opaque = image.getchannel("A").getextrema() == (255, 255)
    return (
        image.convert("RGB") if is_opaque or filename.lower().endswith((".jpg", ".jpeg", ".bmp")) else image
    )


def _a_picture(function: str, value: object) -> Picture:
    """Return the picture that a function was given.

    Raises:
        MyroError: It was given something else.
    """
    if isinstance(value, Picture):
        return value
    raise MyroError(
        f"{function}: the picture is {value!r}, expected one made by takePicture() or makePicture(...)."
    )


def _a_pixel(function: str, value: object) -> Pixel:
    if isinstance(value, Pixel):
        return value
    raise MyroError(
        f"{function}: the pixel is {value!r}, expected one of getPixel(picture, x, y) or getPixels(picture)."
    )


def _colored(function: str, value: object) -> Pixel | Color:
    """Return the pixel or color that a function was given."""
    if isinstance(value, (Pixel, Color)):
        return value
    raise MyroError(
        f"{function} was given {value!r}, expected a pixel of getPixel(picture, x, y), or a color of makeColor(...)."
    )


def getWidth(picture: Picture) -> int:
    """Return the number of columns of pixels of a picture."""
    return _a_picture("getWidth", picture).width


def getHeight(picture: Picture) -> int:
    """Return the number of rows of pixels of a picture."""
    return _a_picture("getHeight", picture).height


def getPixel(picture: Picture, x: int, y: int) -> Pixel:
    """Return the pixel in column x and row y, both from 0 at the upper left.

    Raises:
        MyroError: There is none.
    """
    return _a_picture("getPixel", picture).getPixel(x, y)


def getPixels(picture: Picture) -> Iterator[Pixel]:
    """Yield each pixel of a picture, for loops: `for pixel in getPixels(picture):`."""
    return _a_picture("getPixels", picture).getPixels()


def setPixel(picture: Picture, x: int, y: int, color: HasColor) -> None:
    """Color the pixel in column x and row y."""
    _a_picture("setPixel", picture).setColor(x, y, color)


def getX(pixel: Pixel) -> int:
    """Return the column of a pixel, from 0 at the left."""
    return _a_pixel("getX", pixel).x


def getY(pixel: Pixel) -> int:
    """Return the row of a pixel, from 0 at the top."""
    return _a_pixel("getY", pixel).y


def getRed(pixel: Pixel | Color) -> int:
    """Return the red value of a pixel or a color, 0 to 255."""
    return _colored("getRed", pixel).getRGB()[0]


def getGreen(pixel: Pixel | Color) -> int:
    """Return the green value of a pixel or a color, 0 to 255."""
    return _colored("getGreen", pixel).getRGB()[1]


def getBlue(pixel: Pixel | Color) -> int:
    """Return the blue value of a pixel or a color, 0 to 255."""
    return _colored("getBlue", pixel).getRGB()[2]


def getGray(pixel: Pixel | Color) -> int:
    """Return the brightness of a pixel or a color, 0 to 255: the mean of red, green and blue, rounded down."""
    return sum(_colored("getGray", pixel).getRGB()) // 3


def getAlpha(pixel: Pixel | Color) -> int:
    """Return the opacity of a pixel or a color, 0 to 255."""
    return _colored("getAlpha", pixel).getAlpha()


def getColor(pixel: Pixel | Color) -> Color:
    """Return the color of a pixel."""
    return _colored("getColor", pixel).getColor()


def getRGB(pixel_or_color: Pixel | Color) -> Rgb:
    """Return red, green and blue of a pixel or a color, each 0 to 255."""
    return _colored("getRGB", pixel_or_color).getRGB()


def getRGBA(pixel_or_color: Pixel | Color) -> Rgba:
    """Return red, green, blue and alpha of a pixel or a color, each 0 to 255."""
    return _colored("getRGBA", pixel_or_color).getRGBA()


def setRed(pixel: Pixel | Color, value: float) -> None:
    """Set how red a pixel is; limited to 0..255."""
    _, green, blue = _colored("setRed", pixel).getRGB()
    pixel.setRGB((value, green, blue))


def setGreen(pixel: Pixel | Color, value: float) -> None:
    """Set how green a pixel is; limited to 0..255."""
    red, _, blue = _colored("setGreen", pixel).getRGB()
    pixel.setRGB((red, value, blue))


def setBlue(pixel: Pixel | Color, value: float) -> None:
    """Set how blue a pixel is; limited to 0..255."""
    red, green, _ = _colored("setBlue", pixel).getRGB()
    pixel.setRGB((red, green, value))


def setGray(pixel: Pixel | Color, value: float) -> None:
    """Make a pixel gray; limited to 0..255."""
    _colored("setGray", pixel).setRGB((value, value, value))


def setAlpha(pixel: Pixel | Color, value: float) -> None:
    """Set how opaque a pixel or a color is; limited to 0..255."""
    _colored("setAlpha", pixel).setAlpha(value)


def setColor(pixel: Pixel | Color, color: HasColor) -> None:
    """Give a pixel a color."""
    _colored("setColor", pixel).setColor(color)


def setRGB(pixel_or_color: Pixel | Color, rgb: Sequence[float]) -> None:
    """Set red, green and blue of a pixel or a color: `setRGB(pixel, (255, 128, 0))`."""
    _colored("setRGB", pixel_or_color).setRGB(rgb)


def setRGBA(pixel_or_color: Pixel | Color, rgba: Sequence[float]) -> None:
    """Set red, green, blue and alpha of a pixel or a color."""
    _colored("setRGBA", pixel_or_color).setRGBA(rgba)


def makeLighter(color: Pixel | Color) -> None:
    """Move each part of a pixel or a color by 35 % towards white."""
    _colored("makeLighter", color).makeLighter()


def makeDarker(color: Pixel | Color) -> None:
    """Leave 65 % of each part of a pixel or a color."""
    _colored("makeDarker", color).makeDarker()


class Array:
    """Numbers in rows, or a picture as columns: `Array(2, 3)[0][1]`, `Array(picture)[x][y]`."""

    def __init__(self, n: int | Picture = 0, *more: int, value: object = 0) -> None:
        self.data: Any = n if isinstance(n, Picture) else _nested((n, *more), value)

    def __len__(self) -> int:
        return self.data.width if isinstance(self.data, Picture) else len(self.data)

    def __getitem__(self, index: int) -> Any:
        return _Column(self.data, index) if isinstance(self.data, Picture) else self.data[index]

    def __setitem__(self, index: int, value: object) -> None:
        self.data[index] = value


class _Column:
    def __init__(self, picture: Picture, column: int) -> None:
        self.picture, self.column = picture, column

    def __getitem__(self, row: int) -> Pixel:
        return self.picture.getPixel(self.column, row)


def _nested(sizes: tuple[int, ...], value: object) -> list[object]:
    size = whole("makeArray: a size", sizes[0], 0, _LARGEST**2)
    return [value] * size if len(sizes) == 1 else [_nested(sizes[1:], value) for _ in range(size)]


def makeArray(n: int | Picture = 0, *more: int, value: object = 0) -> Array:
    """Return an array of one or more sizes, filled with a value: `makeArray(2, 3)[0][1]`; or a picture's columns."""
    return Array(n, *more, value=value)
