"""Songs as lists of notes: `(frequency [Hz], part of a whole note)`, or two frequencies for a chord."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

from realitygap._limits import MOST_TABLE_BYTES, read_file

from ._mistakes import MyroError, number

Note = tuple[float, float] | tuple[float, float, float]
"""Frequency [Hz], perhaps a second one [Hz], part of a whole note."""

_NAME = re.compile(r"([a-g])([#b]?)(\d?)", re.IGNORECASE)
_STEPS = {"c": 0, "d": 2, "e": 4, "f": 5, "g": 7, "a": 9, "b": 11}  # half tones above C
_NAMES = ("C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B")
_A4 = 440.0  # [Hz]
_OCTAVE = 5  # of a note without a number


def frequency(name: str) -> float:
    """Return the frequency of a note [Hz], from its name ("C", "C#5", "Bb3", "pause") or from a number as text.

    Octaves run from 0 (low) to 9; a note without one is of octave 5, where C is 523.3 Hz. Equal temperament,
    A4 = 440 Hz, to four digits, as Myro's own table has them.

    Raises:
        MyroError: It is neither a note nor a number.
    """
    text = name.strip()
    if text.lower() in ("pause", "rest"):
        return 0
    match = _NAME.fullmatch(text)
    if match is None:
        try:
            return float(text)
        except ValueError:
            raise MyroError(
                f"{name!r} is no note, expected a name from C to B, perhaps with # or b and an octave from 0 to 9 "
                '("C", "F#4", "Bb5"), "pause", or a frequency in Hz.'
            ) from None
    letter, accidental, octave = match.groups()
    half_tones = _STEPS[letter.lower()] + {"#": 1, "b": -1, "": 0}[accidental.lower()]
    half_tones += 12 * (int(octave or _OCTAVE) - 4) - _STEPS["a"]
    return float(f"{_A4 * 2 ** (half_tones / 12):.4g}")


_LADDER = {frequency(f"{name}{octave}"): f"{name}{octave}" for octave in range(10) for name in _NAMES} | {
    0: "pause"
}


def getNoteFromFrequency(hz: float) -> str:
    """Return the name of the note nearest to a frequency [Hz], with its octave; sharps and no flats: "A#4".

    Raises:
        MyroError: It is not a number of at least 0.
    """
    value = number("getNoteFromFrequency: the frequency", hz, 0)
    name = _LADDER[min(_LADDER, key=lambda known: abs(known - value))]
    return name.capitalize() if name == "pause" else name


def makeSong(text: str) -> list[Note]:
    """Return a song from text: notes between semicolons or on separate lines, as "C 1/4; E G 1/4; pause .5".

    Args:
        text: Notes with a name (or a frequency), an optional second one, and their part of a whole note ("1/4" or
            ".25"). Text after a # at the beginning of a note is ignored.

    Returns:
        A song for `playSong`: `(frequency, part)` or `(frequency, frequency, part)` for each note.

    Raises:
        MyroError: A note cannot be read; the text says which.
    """
    return _parse(text.replace(";", "\n").splitlines(), "the song")


text2song = makeSong


def readSong(filename: str) -> list[Note]:
    """Return a song from a file, written as for `makeSong`.

    Raises:
        MyroError: There is no such file, or a note cannot be read.
    """
    try:
        text = read_file(Path(filename), MOST_TABLE_BYTES).decode()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise MyroError(f"readSong: {filename!r} cannot be read: {reason}.") from error
    return _parse(text.replace(";", "\n").splitlines(), str(filename))


def _parse(lines: Iterable[str], where: str) -> list[Note]:
    song: list[Note] = []
    for line_number, line in enumerate(lines, 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            song.append(_note(words))
        except MyroError as error:
            raise MyroError(f"Note {line_number} of {where} is {line.strip()!r}: {error}") from None
    return song


def _note(words: list[str]) -> Note:
    if len(words) == 2:
        return (frequency(words[0]), _part(words[1]))
    if len(words) == 3:
        return (frequency(words[0]), frequency(words[1]), _part(words[2]))
    raise MyroError(
        f"It has {len(words)} words, expected a note, perhaps a second one, and how long it lasts."
    )


def _part(text: str) -> float:
    try:
        part = float(Fraction(text)) if "/" in text else float(text)
    except (ValueError, ZeroDivisionError):
        raise MyroError(f"{text!r} is no part of a whole note, expected something like 1/4 or .25.") from None
    return number("The part of a whole note", part, 0)


def song2text(song: Iterable[Note]) -> str:
    """Return a song as text that `makeSong` reads again: "C5 0.25; E5 G5 0.25; "."""
    return "".join(f"{_line(note)}; " for note in song)


def _line(note: Note) -> str:
    return " ".join([*(getNoteFromFrequency(hz) for hz in note[:-1]), f"{note[-1]:g}"])


def saveSong(song: Iterable[Note] | str, filename: str, append: bool = False) -> None:
    """Write a song, or the text of one, to a file.

    Args:
        song: Song of `makeSong`.
        filename: Name of the file.
        append: True to append to an existing file. Differs: Myro's default is 1, but it overwrites the file. Here a
            program without this argument gets the same result as in Myro.

    Raises:
        MyroError: The file cannot be written.
    """
    lines = song.replace(";", "\n").splitlines() if isinstance(song, str) else [_line(note) for note in song]
    try:
        with Path(filename).open("a" if append else "w") as file:
            file.writelines(f"{line.strip()}\n" for line in lines)
    except OSError as error:
        raise MyroError(f"saveSong: {filename!r} cannot be written: {error.strerror}.") from error
