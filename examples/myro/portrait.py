"""What a course does with pictures: take, gray, negative, count, keep; loops over pixels."""

import os
import tempfile

from myro import *

initialize("com5")
autoCamera()

picture = takePicture()
print(picture.getWidth(), "x", picture.getHeight())

small = copyPicture(picture)
small.resize(64, 48)
for pixel in getPixels(small):
    gray = (getRed(pixel) + getGreen(pixel) + getBlue(pixel)) / 3
    setRGB(pixel, (gray, gray, gray))

negative = makePicture(getWidth(small), getHeight(small))
dark = 0
for x in range(getWidth(small)):
    for y in range(getHeight(small)):
        old = getPixel(small, x, y)
        new = getPixel(negative, x, y)
        setColor(new, makeColor(255 - getRed(old), 255 - getGreen(old), 255 - getBlue(old)))
        if getGray(old) < 128:
            dark = dark + 1
setColor(getPixel(negative, 0, 0), red)

folder = tempfile.mkdtemp()
savePicture(negative, os.path.join(folder, "negative.png"))
savePicture([small, negative], os.path.join(folder, "both.gif"))
again = loadPicture(os.path.join(folder, "negative.png"))
print("Dark pixels:", 0 <= dark <= 64 * 48, "corner:", getRGB(getPixel(again, 0, 0)))
