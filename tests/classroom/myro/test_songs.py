"""Notes, and songs from text and files."""

import pytest

from realitygap.classroom.myro import (
    MyroError,
    getNoteFromFrequency,
    makeSong,
    readSong,
    saveSong,
    song2text,
    text2song,
)  # fmt: skip
from realitygap.classroom.myro._songs import frequency

# Myro's own table, a note of each octave and all of the middle one
TABLE = {
    "c0": 16.35, "a0": 27.5, "d#1": 38.89, "gb2": 92.5, "bb3": 233.1, "c4": 261.6, "a4": 440.0, "e9": 10550,
    "c5": 523.3, "c#5": 554.4, "db5": 554.4, "d5": 587.3, "eb5": 622.3, "e5": 659.3, "f5": 698.5, "f#5": 740.0,
    "g5": 784.0, "ab5": 830.6, "a5": 880.0, "bb5": 932.3, "b5": 987.8, "c6": 1047, "a7": 3520, "b8": 7902,
    "pause": 0,
}  # fmt: skip


@pytest.mark.parametrize(("name", "hz"), TABLE.items())
def test_notes_have_the_frequencies_of_myros_table(name, hz):
    assert frequency(name) == hz
    assert frequency(name.upper()) == hz


def test_a_note_without_an_octave_is_of_octave_5():
    assert frequency("C") == frequency("c5") == 523.3


def test_each_note_is_found_again_by_its_frequency():
    for octave in range(10):
        for name in ("C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B"):
            assert getNoteFromFrequency(frequency(f"{name}{octave}")) == f"{name}{octave}"
    assert getNoteFromFrequency(441) == "A4"
    assert getNoteFromFrequency(0) == "Pause"


def test_a_song_is_read_from_text_with_chords_fractions_comments_and_pauses():
    text = "# a song\nC 1/4; e 1/4\n\nG C6 .5\npause 1/8; 440 1"
    assert makeSong(text) == [
        (523.3, 0.25), (659.3, 0.25), (784.0, 1047.0, 0.5), (0, 0.125), (440.0, 1.0),
    ]  # fmt: skip
    assert text2song is makeSong


@pytest.mark.parametrize(
    ("text", "wrong"),
    [("C 1/4; H 1/4", "Note 2 of the song is 'H 1/4': 'H' is no note"), ("C", "It has 1 words"),
     ("C 1/0", "'1/0' is no part"), ("C long", "'long' is no part"), ("C E G B 1", "It has 5 words"),
     ("C -1", "expected a number of at least 0")],
)  # fmt: skip
def test_a_wrong_note_is_named(text, wrong):
    with pytest.raises(MyroError, match=wrong.replace("(", r"\(")):
        makeSong(text)


def test_a_song_becomes_text_and_a_song_again():
    song = makeSong("C 1/4; E G .5; pause .125")
    assert song2text(song) == "C5 0.25; E5 G5 0.5; Pause 0.125; "
    assert makeSong(song2text(song)) == song


def test_a_song_is_written_and_read_as_a_song_or_as_text(tmp_path):
    name = str(tmp_path / "song.txt")
    song = makeSong("C 1/4; E G .5")
    saveSong(song, name)
    saveSong(song, name)
    assert readSong(name) == song
    saveSong("A 1; B 1", name, append=True)
    assert readSong(name) == [*song, (880.0, 1.0), (987.8, 1.0)]


def test_a_file_that_cannot_be_read_or_written_is_named(tmp_path):
    with pytest.raises(MyroError, match=r"readSong: '.*no.txt' cannot be read: No such file"):
        readSong(str(tmp_path / "no.txt"))
    with pytest.raises(MyroError, match=r"saveSong: .* cannot be written"):
        saveSong([], str(tmp_path))
