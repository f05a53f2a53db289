"""What the pages of a study ask of the process that draws, and what they keep of its answers."""

from __future__ import annotations

from realitygap.lab import _messages as messages
from realitygap.lab._watcher import Watcher


def test_an_archive_is_asked_for_again_if_the_process_ends_before_it_answers(tmp_path):
    """An older archive of the condition was there, and stayed for good."""
    wishes = []

    class Silent:
        def want(self, wish, hear):
            wishes.append(wish)

    watcher = Watcher(tmp_path, Silent(), lambda: None)
    assert watcher.archive("a") is None
    old = messages.Archive(str(tmp_path), "a", {"replicate": 0})
    watcher._hear(old)
    watcher.look((1, 0))  # more runs are done
    watcher._hear(messages.FiguresDrawn(str(tmp_path), 0.0))
    assert watcher.archive("a") is old
    n_wishes = len(wishes)
    watcher._hear(messages.Ended(0))
    assert watcher.archive("a") is old
    assert len(wishes) == n_wishes + 1
    watcher._hear(new := messages.Archive(str(tmp_path), "a", {"replicate": 1}))
    assert watcher.archive("a") is new
