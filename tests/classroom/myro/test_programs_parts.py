"""Time, chance, questions, and functions together: what needs no robot."""

import random

import pytest

from realitygap.classroom import myro
from realitygap.classroom.myro import MyroError, _robot, timer, timeRemaining


@pytest.fixture
def clock(monkeypatch):
    """A wall clock that only moves when asked, by an eighth of a second each time."""

    class Ticking:
        time = 100.0

        def now(self):
            self.time += 0.125
            return self.time

        def sleep(self, seconds):
            self.time += seconds

    ticking = Ticking()
    monkeypatch.setattr(_robot, "_WALL", ticking)
    return ticking


def test_a_for_loop_runs_for_its_seconds(clock):
    times = list(timer(1))
    assert (times[0], times[-1], len(times)) == (0.125, 1.0, 8)


def test_a_timer_of_zero_runs_for_ever(clock):
    endless = timer(0)
    assert [next(endless) for _ in range(100)][-1] == 12.5


def test_a_while_loop_runs_for_its_seconds_and_again(clock):
    for _ in range(2):
        count = 0
        while timeRemaining(1):
            count += 1
        assert count == 9


def test_loops_at_two_places_have_timers_of_their_own(clock):
    inner = outer = 0
    while timeRemaining(2):
        outer += 1
        while timeRemaining(1):
            inner += 1
    assert inner == 18
    assert outer == 2


def test_a_loop_that_was_left_begins_anew_when_its_function_is_called_again(clock):
    def early():
        while timeRemaining(1):
            return True
        return False

    assert all(early() for _ in range(30))


def test_time_remaining_of_zero_is_for_ever(clock):
    assert timeRemaining(0)
    assert timeRemaining()


def test_waiting_passes_time(clock):
    before = myro.currentTime()
    myro.wait(5)
    assert myro.currentTime() - before == 5.125


@pytest.mark.parametrize("act", [lambda: myro.wait(-1), lambda: myro.wait("1"), lambda: list(timer(-1)),
                                 lambda: timeRemaining(-1)])  # fmt: skip
def test_times_that_are_none_are_refused(act):
    with pytest.raises(MyroError, match="expected a number"):
        act()


def test_functions_of_chance_give_all_their_values():
    random.seed(1)
    assert {myro.flipCoin() for _ in range(40)} == {"heads", "tails"}  # by chance alone fails 1 time in 2^39
    assert {myro.heads() for _ in range(40)} == {myro.tails() for _ in range(40)} == {True, False}
    assert all(0 <= myro.randomNumber() < 1 for _ in range(100))
    assert {myro.pickOne(3) for _ in range(100)} == {0, 1, 2}
    assert (
        {myro.pickOne("a", "b") for _ in range(40)}
        == {myro.pickOne(["a", "b"]) for _ in range(40)}
        == {"a", "b"}
    )
    assert {myro.pickOneInRange(5, 7) for _ in range(40)} == {5, 6}
    assert [myro.odd(3), myro.odd(4), myro.even(3), myro.even(0)] == [True, False, False, True]


@pytest.mark.parametrize("act", [lambda: myro.pickOne(), lambda: myro.pickOne(0), lambda: myro.pickOneInRange(5, 5),
                                 lambda: myro.pickOne("ab")])  # fmt: skip
def test_nothing_to_pick_is_refused(act):
    with pytest.raises(MyroError, match="expected"):
        act()


@pytest.fixture
def answers(monkeypatch):
    """What the reader enters, one after another."""

    def given(*lines):
        left = list(lines)
        monkeypatch.setattr("builtins.input", lambda prompt="": left.pop(0))
        return left

    return given


def test_ask_returns_one_answer_or_several_and_remembers_them(answers):
    answers(" Rosa ", "3", "blue", "red")
    assert myro.ask("Your name?") == "Rosa"
    assert myro.ask(["One"]) == "3"
    assert myro.ask(["a", "b"]) == {"a": "blue", "b": "red"}
    assert myro.ask("a", useCache=True) == "blue"


def test_a_question_is_asked_until_one_of_its_answers_comes(answers, capsys):
    answers("7", "Maybe", "2", "", "no")
    assert myro.askQuestion("Dance?", ["Yes", "No"]) == "No"
    assert myro.askQuestion("Again?") == "Yes"
    assert myro.askQuestion("Again?") == "No"
    assert "'Maybe' is none of them" in capsys.readouterr().out
    with pytest.raises(MyroError, match="expected one of the answers"):
        myro.askQuestion("What?", [])


def test_files_folders_and_colors_are_asked_for_until_they_are_there(answers, tmp_path, capsys):
    file = tmp_path / "here.txt"
    file.write_text("")
    answers(str(tmp_path), str(file), "/no/where", str(tmp_path), "blue", "1 2", "1, 2, 3", "#ff8000")
    assert myro.pickAFile() == str(file)
    assert "here.txt" in capsys.readouterr().out
    assert myro.pickAFolder() == str(tmp_path)
    assert myro.pickAColor() == myro.Color(1, 2, 3)
    assert myro.pickAColor() == myro.Color(255, 128, 0)


def test_a_story_is_filled_in(answers):
    answers("dog", "Rome")
    assert myro.makeStory('The "animal" of "place": a "animal".') == "The dog of Rome: a dog."
    assert myro.makeStory("No gaps.") == "No gaps."


def test_the_number_game_ends(answers, capsys, monkeypatch):
    monkeypatch.setattr("random.randint", lambda low, high: 42)
    answers("fifty", "50", "40", "42")
    myro.numberGame()
    out = capsys.readouterr().out
    assert "too high" in out
    assert "too low" in out
    assert "in 3 tries" in out
    answers(*["1"] * 10)
    myro.numberGame(maxGuesses=10)
    assert "did not guess it in 10 tries" in capsys.readouterr().out


def test_speak_prints_its_text(capsys):
    myro.speak("Hello")
    myro.stopSpeaking()
    myro.computer.speak("Again")
    assert capsys.readouterr().out == "Hello\nAgain\n"


def test_loop_calls_functions_in_turn_with_the_round_where_they_take_one(capsys):
    calls = []

    def one():
        calls.append("one")

    def two(turn):
        calls.append(turn)
        return turn * 10

    assert myro.loop(one, two, 2) == "ok"
    assert calls == ["one", 1, "one", 2]
    assert "loop #2: running two()...  => 20" in capsys.readouterr().out
    with pytest.raises(MyroError, match="without functions"):
        myro.loop(3)
    with pytest.raises(MyroError, match="how often"):
        myro.loop(one, two)


def test_functions_run_together_and_their_results_come_in_order():
    assert myro.doTogether(lambda: 1, lambda: 2) == [1, 2]
    assert myro.doTogether(lambda: None, lambda: None) is None
    with pytest.raises(MyroError, match="two or more functions, without parentheses"):
        myro.doTogether(print)


def test_a_mistake_in_one_of_the_functions_comes_out():
    def wrong():
        raise ValueError("wrong")

    with pytest.raises(ValueError, match="wrong"):
        myro.doTogether(wrong, lambda: 1)


def test_get_filenames_returns_sorted_names_that_match_a_pattern(tmp_path, monkeypatch):
    for name in ("b1.jpg", "a1.jpg", "c.txt"):
        (tmp_path / name).write_text("")
    monkeypatch.chdir(tmp_path)
    assert myro.getFilenames("*1.jpg") == ["a1.jpg", "b1.jpg"]


def test_the_computer_plays_by_ringing_and_waiting(clock, capsys):
    before = clock.time
    myro.beep(2, 440)
    assert clock.time - before == pytest.approx(2)
    myro.computer.playSong(myro.makeSong("C 1/2; pause 1/2"), 1)
    myro.beepScale(0.1, 100, 400)
    assert clock.time - before == pytest.approx(3.3)
    assert capsys.readouterr().out == "\a" * 5
    with pytest.raises(MyroError, match="factor above 1"):
        myro.beepScale(0.1, 100, 400, 1)


def test_pythons_own_set_still_works():
    assert myro.set() == set()
    assert myro.set([1, 1, 2]) == {1, 2}
