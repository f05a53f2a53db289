"""Photographs of sheets as the server keeps them: bounded, named safely, taken up again."""

from __future__ import annotations

import pytest

from realitygap.errors import StudyError
from realitygap.lab import _photos
from realitygap.lab._messages import Ended, Failure
from realitygap.lab._photos import MOST_WAITING, Photos


class _Idle:
    """A process that never says a word by itself."""

    made: list[_Idle] = []  # noqa: RUF012

    def __init__(self, work, root, hear):
        self.work, self.hear = work, hear
        self.made.append(self)

    def end(self):
        self.hear(Ended(0))


@pytest.fixture
def photos(tmp_path, monkeypatch):
    monkeypatch.setattr(_photos, "Child", _Idle)
    _Idle.made = []
    (tmp_path / "study").mkdir()
    return lambda: Photos(tmp_path / "study", tmp_path, lambda: None)


def test_names_lose_their_folders_and_what_cannot_be_printed(photos, tmp_path):
    kept = photos()
    for name, plain in (
        ("../../etc/passwd", "passwd"),
        ("C:\\photos\\a b.jpg", "a b.jpg"),
        ("\x00\n", "photo"),
        ("x" * 500, "x" * 80),
    ):
        assert kept.add(name.encode(), name, 1).name == plain
    names = {path.suffix for path in (tmp_path / "study" / "lab" / "photos").iterdir()}
    assert names == {".json", ".photo"}
    assert kept.picture("../../../../etc/passwd") is None


def test_empty_and_too_large_files_and_too_many_are_refused(photos):
    kept = photos()
    with pytest.raises(StudyError, match="The file is empty"):
        kept.add(b"", "a.jpg", 1)
    with pytest.raises(StudyError, match="at most 32 MB"):
        kept.add(bytes(33 << 20), "a.jpg", 1)
    for k in range(MOST_WAITING):
        kept.add(bytes([k]), "a.jpg", 1)
    with pytest.raises(StudyError, match="8 photographs wait"):
        kept.add(b"one more", "a.jpg", 1)
    assert len(_Idle.made) == 1  # one after the other


def test_the_same_photo_sent_twice_is_read_once(photos):
    kept = photos()
    one, other = kept.add(b"same", "a.jpg", 1), kept.add(b"same", "b.jpg", 1)
    assert one.mark == other.mark
    assert [each.state for each in kept.photos()] == ["reading"]


def test_photos_that_were_being_read_when_the_lab_ended_are_read_again_and_all_can_be_forgotten(
    photos, tmp_path
):
    kept = photos()
    mark = kept.add(b"first", "a.jpg", 3).mark
    kept.add(b"second", "b.jpg", 3)
    kept.end()
    again = photos()
    assert [each.state for each in reversed(again.photos())] == ["reading", "waiting"]
    _Idle.made[-1].hear(Failure("no sheet"))
    _Idle.made[-1].hear(Ended(1))
    assert next((each.state, each.said) for each in reversed(again.photos())) == ("refused", "no sheet")
    assert _Idle.made[-1].work.name == "b.jpg"  # its turn
    assert not (tmp_path / "study" / "lab" / "photos" / f"{mark}.photo").exists()
    _Idle.made[-1].hear(Ended(-9))
    assert again.photos()[0].said == "The process that read it ended. Send it again."
    for each in again.photos():
        again.forget(each.mark)
    assert photos().photos() == []
