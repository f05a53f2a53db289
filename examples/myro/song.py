"""A robot that plays a song from text and from a file: strings, tuples, files."""

import os
import tempfile

from myro import *

initialize("com5")

text = """
# the beginning of a song that everybody knows
C 1/4; C 1/4; G 1/4; G 1/4
A 1/4; A 1/4; G 1/2
C E 1/2; pause 1/8
"""

song = makeSong(text)
name = os.path.join(tempfile.mkdtemp(), "twinkle.txt")
saveSong(song, name)
again = readSong(name)
print(len(song), "notes,", len(again), "read again")

playSong(song, 0.4)
for frequency, *more, part in again[:2]:
    print(getNoteFromFrequency(frequency), part)
    beep(part / 2, frequency)
