"""A robot driven by hand, in its process: who says nothing has it stop."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from realitygap.lab import _hand
from realitygap.lab._hand import Hand, kinds_of
from realitygap.lab._messages import Activity, HandWork
from realitygap.robot_families import Reading, default_family
from tests.interrupted import INTERRUPTED

pytestmark = pytest.mark.slow

PORT = "emulator://s2?fluke=2&speed=1"


def wait_for(is_so: Callable[[], bool], seconds: float = 300.0) -> None:
    end = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.02)


@pytest.fixture
def hand(tmp_path: Path, forked_children: None) -> Iterator[Hand]:
    yield from connected(tmp_path)


@pytest.fixture
def hand_in_new_python(tmp_path: Path) -> Iterator[Hand]:
    yield from connected(tmp_path)


def connected(tmp_path: Path) -> Iterator[Hand]:
    hand = Hand(HandWork(PORT), tmp_path, lambda: None)
    wait_for(lambda: hand.senses is not None or hand.is_over)
    assert hand.outcome is None
    yield hand
    hand.end()


def x(hand: Hand) -> float:
    assert hand.senses is not None
    assert hand.senses.pose is not None
    return hand.senses.pose[0]


def drive_until_it_moves(hand: Hand) -> None:
    """Say it ten times a second, as the page does: a busy process may come to a word when that is too old."""
    until = time.monotonic() + 300.0
    while not hand.senses.moves:
        assert time.monotonic() < until, "it does not move"
        hand.drive(1.0, 0.0, hand.n_stops)
        time.sleep(0.1)


def test_a_word_moves_the_robot_and_silence_stops_it(hand):
    began = x(hand)
    drive_until_it_moves(hand)
    wait_for(lambda: not hand.senses.moves)  # nothing more was said
    time.sleep(0.5)  # for a last word that was held up
    wait_for(lambda: not hand.senses.moves)
    stood = x(hand)
    assert stood > began + 0.005
    time.sleep(0.5)
    assert x(hand) == pytest.approx(stood, abs=1e-3)


def test_stop_is_heard_while_it_drives(hand):
    drive_until_it_moves(hand)
    hand.stop_robot()
    wait_for(lambda: not hand.senses.moves)


def test_a_handle_that_is_held_when_somebody_presses_stop_drives_no_more(hand):
    drive_until_it_moves(hand)
    hand.stop_robot()
    wait_for(lambda: not hand.senses.moves)
    for pause in (
        0.1,
        0.1,
        0.6,
        1.2,
    ):  # ten times a second, as the page says it, and over a network that holds words back
        time.sleep(pause)
        hand.drive(1.0, 0.0, 0)
        assert not hand.senses.moves
    time.sleep(0.3)
    assert not hand.senses.moves
    hand.release()
    drive_until_it_moves(hand)


def test_a_press_that_began_before_a_stop_and_whose_first_word_comes_after_it_drives_nowhere(hand):
    began = x(hand)
    hand.stop_robot()
    hand.drive(1.0, 0.0, 0)
    time.sleep(0.8)
    assert x(hand) == pytest.approx(began, abs=1e-6)


def test_command_that_is_no_number_moves_nothing(hand):
    hand.drive(float("nan"), float("nan"), 0)
    began = x(hand)
    time.sleep(0.5)
    assert x(hand) == pytest.approx(began, abs=1e-6)
    assert hand.outcome is None


def test_what_a_visitor_asked_for_is_known_until_it_is_done(hand):
    activities: tuple[Activity, ...] = ("place", "preflight", "picture")
    for what in activities:
        hand.want(what)
        assert hand.doing == what
        wait_for(lambda: not hand.doing)
    assert hand.preflight is not None
    assert hand.picture


def test_a_robot_that_is_not_there_is_told_in_words(tmp_path):
    hand = Hand(HandWork("/dev/no-such-port"), tmp_path, lambda: None)
    wait_for(lambda: hand.is_over)
    assert hand.is_failed
    assert "/dev/no-such-port" in str(hand.outcome)


def test_sensors_are_those_that_the_family_describes_and_the_robot_has(monkeypatch):
    bumpers = (Reading("Bumper", "1 when pressed", 1.0),)
    family = replace(default_family(), channel_readings={"bump": bumpers, "light": bumpers})
    monkeypatch.setattr(_hand, "find_family", lambda name: family)
    assert kinds_of(SimpleNamespace(bump=list, line=list), PORT) == ["bump"]


def test_its_process_ends_with_the_lab(hand_in_new_python):
    hand = hand_in_new_python
    hand._child._process.stdin.close()  # as when the lab is killed
    wait_for(lambda: hand.is_over)
    assert hand._child._process.wait() in INTERRUPTED
