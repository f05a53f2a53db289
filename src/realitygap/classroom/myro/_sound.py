"""Tones, notes and songs, the speaker of the robot, and its lights."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

from ._base import Base
from ._mistakes import MyroError, choice, is_on, number, whole
from ._songs import Note

WHOLE_NOTE = 0.545
"""Default duration of a whole note [s]."""

_HIGHEST = 65535  # [Hz], a word on the wire
_HEARD = 10_000  # the highest tone that a Scribbler 2 plays [Hz]; a higher one becomes this
_PIECE = 5.0  # the longest tone in one command [s]; a longer one is played in pieces: a Scribbler 2 knows up to 8.2 s


class Plays:
    """A player of tones, which can also play notes and songs."""

    def _tone(self, duration: float, hz: float, hz2: float | None) -> None:
        raise NotImplementedError

    def beep(self, duration: Any = 0.5, frequency1: Any = None, frequency2: Any = None) -> None:
        """Play a tone and return when it has ended.

        Args:
            duration: Duration [s]. A list of frequencies here plays each for half a second.
            frequency1: Frequency [Hz]; 0 is silence. Default: a random one. A list plays each in turn.
            frequency2: Frequency of a second tone at the same time [Hz].

        Raises:
            MyroError: The duration or a frequency is not a number of at least 0.
        """
        if isinstance(duration, Sequence) and not isinstance(duration, str):
            duration, frequency1, frequency2 = 0.5, duration, frequency1
        if frequency1 is None:
            frequency1 = random.randrange(200, 10000)
        if isinstance(frequency1, Sequence) and not isinstance(frequency1, str):
            seconds: Sequence[Any] = [None] * len(frequency1) if frequency2 is None else frequency2
            for hz, hz2 in zip(frequency1, seconds, strict=False):
                self.beep(duration, hz, hz2)
            return
        self._tone(
            number("beep: the duration", duration, 0, 600),
            number("beep: the frequency", frequency1, 0, _HIGHEST),
            None if frequency2 is None else number("beep: the second frequency", frequency2, 0, _HIGHEST),
        )

    def playNote(self, tup: Note, wholeNoteDuration: float = WHOLE_NOTE) -> None:
        """Play one note of a song: `(frequency, part)` or `(frequency, frequency, part)`.

        Raises:
            MyroError: It is not such a note.
        """
        if not isinstance(tup, Sequence) or isinstance(tup, str) or len(tup) not in (2, 3):
            raise MyroError(
                f"playNote: the note is {tup!r}, expected (frequency, part of a whole note); makeSong() makes a song "
                "of them from text."
            )
        part = number("playNote: the part of a whole note", tup[-1], 0)
        self.beep(part * number("playNote: the whole note's duration", wholeNoteDuration, 0), *tup[:-1])

    def playSong(self, song: Sequence[Note], wholeNoteDuration: float = WHOLE_NOTE) -> None:
        """Play a song that `makeSong` or `readSong` made; a whole note lasts `wholeNoteDuration` [s]."""
        if isinstance(song, str):
            raise MyroError(
                "playSong: the song is text, expected what makeSong(text) or readSong(filename) returns."
            )
        for note in song:
            self.playNote(note, wholeNoteDuration)


class Sound(Plays, Base):
    """The robot's speaker."""

    _volume = 1
    _start_song = "tada"

    def _tone(self, duration: float, hz: float, hz2: float | None) -> None:
        while duration > 0:
            piece = min(duration, _PIECE)
            self.driver.beep(piece, min(hz, _HEARD), None if hz2 is None else min(hz2, _HEARD))
            duration -= piece

    def setVolume(self, value: str | int) -> None:
        """Switch the robot's speaker on ("on", 1) or off ("off", 0); the robot remembers it."""
        self._volume = int(is_on("setVolume: the value", value))
        self.driver.set_loud(bool(self._volume))

    def getVolume(self) -> int:
        """Return 1 if the speaker is on, otherwise 0, as last set by `setVolume`."""
        return self._volume

    def setS2Volume(self, value: int) -> None:
        """Set how loud the speaker of a Scribbler 2 is, 0 to 100."""
        self.driver.set_s2_volume(whole("setS2Volume: the value", value, 0, 100))

    def setStartSong(self, songName: str) -> None:
        """Remember a name for `getStartSong`; as in Myro, the robot itself never learns of it."""
        self._start_song = songName

    def getStartSong(self) -> str:
        """Return the name that `setStartSong` remembered; "tada" before."""
        return self._start_song


_LEDS = {
    "left": "left", 0: "left",
    "center": "center", "middle": "center", 1: "center",
    "right": "right", 2: "right",
    "front": "front", "back": "back", "all": "all",
}  # fmt: skip


class Lights(Base):
    """Three on the robot, one ahead and one behind on the Fluke."""

    def setLED(self, position: str | int, value: str | float) -> None:
        """Switch a light.

        Args:
            position: "left", "center", "right" (or 0, 1, 2), "all" of these; with a Fluke "front" and "back".
            value: "on" or 1, "off" or 0; for "back" also how bright, 0 to 1.
        """
        led = choice("setLED: the position", position, _LEDS)
        if led == "back" and not isinstance(value, str):
            self.setLEDBack(value)
        else:
            self.driver.set_led(led, is_on("setLED: the value", value))

    def setLEDFront(self, value: str | float) -> None:
        """Switch the light on the Fluke's front on ("on", 1) or off ("off", 0)."""
        self.driver.set_led("front", is_on("setLEDFront: the value", value))

    def setLEDBack(self, value: str | float) -> None:
        """Set how bright the light on the Fluke's back is: 0 (off) to 1; what is beyond is limited."""
        if isinstance(value, str):
            value = int(is_on("setLEDBack: the value", value))
        self.driver.set_led("back", min(max(number("setLEDBack: the value", value), 0.0), 1.0))
