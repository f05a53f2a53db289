"""Questions, stories, and a guessing game, in the terminal or in a notebook's input line; speech is printed."""

from __future__ import annotations

import random
import re
from collections.abc import Sequence
from pathlib import Path

from realitygap._foreign_text import printable

from ._colors import Color
from ._mistakes import MyroError

_answers: dict[str, str] = {}
"""Earlier answers, for `useCache`."""


def ask(
    item: str | Sequence[str],
    title: str = "Information Request",
    useCache: bool = False,
    useDict: bool = False,
) -> str | dict[str, str]:
    """Ask for a value, or several.

    Args:
        item: Question, or a list of questions.
        title: Title above several questions.
        useCache: True to use earlier answers without asking again.
        useDict: True to return even one answer in a dictionary.

    Returns:
        The answer as text; for several the answers by what was asked for.
    """
    items = [item] if isinstance(item, str) else list(item)
    if len(items) > 1:
        print(title)
    answers = {question: _answer(question, reuse=bool(useCache)) for question in items}
    return answers if len(items) != 1 or useDict else answers[items[0]]


def _answer(question: str, *, reuse: bool) -> str:
    if not (reuse and question in _answers):
        _answers[question] = input(
            f"{question} " if question.endswith(("?", ":")) else f"{question}: "
        ).strip()
    return _answers[question]


def askQuestion(
    question: str, answers: Sequence[str] = ("Yes", "No"), title: str = "Myro Question", default: int = 0
) -> str:
    """Ask a question with given answers, until one of them is chosen by its number or its words.

    Args:
        question: The question.
        answers: Possible answers.
        title: Title above the question. Default: Myro's own.
        default: Index of the answer that Enter alone gives.

    Raises:
        MyroError: There are no answers to choose from.
    """
    if not 0 <= default < len(answers):
        raise MyroError(
            f"askQuestion: the answers are {list(answers)!r} and the default is number {default}, "
            "expected one of the answers."
        )
    if title != "Myro Question":
        print(title)
    print(question)
    for place, answer in enumerate(answers, 1):
        print(f"  {place}  {answer}")
    while True:
        given = input(f"Number [{default + 1}]: ").strip()
        if not given:
            return answers[default]
        for place, answer in enumerate(answers, 1):
            if given.lower() in (str(place), answer.lower()):
                return answer
        print(f"{given!r} is none of them; enter a number from 1 to {len(answers)}.")


def pickAFile() -> str:
    """Ask for the name of a file, until it is one that exists; Enter alone lists what is in the folder."""
    while True:
        given = Path(input("File: ").strip()).expanduser()
        if given.is_file():
            return str(given)
        folder = given if given.is_dir() else Path()
        names = sorted(
            entry.name + "/" * entry.is_dir() for entry in folder.iterdir() if entry.name[0] != "."
        )
        print(printable(f"In {folder.resolve()}: {', '.join(names) or 'nothing'}"))


def pickAFolder() -> str:
    """Ask for the name of a folder, until it is one that exists; Enter alone takes the present one."""
    while True:
        given = Path(input("Folder: ").strip() or ".").expanduser()
        if given.is_dir():
            return str(given)
        print(f"There is no folder {str(given)!r}.")


def pickAColor() -> Color:
    """Ask for a color, as "255 128 0" or "#ff8000", until it is one."""
    while True:
        given = input("Color (red green blue, each 0 to 255): ").replace(",", " ").strip()
        try:
            return Color(given) if given.startswith("#") else Color(*(float(part) for part in given.split()))
        except (MyroError, ValueError) as error:
            print(error)


def speak(message: object, async_: bool = False) -> None:
    """Print the text to speak, because realitygap has no voice.

    Args:
        message: Text to speak.
        async_: Taken and ignored: a print takes no time.
    """
    print(message)


def stopSpeaking() -> None:
    """Do nothing: `speak` prints its text immediately."""


def makeStory(story: str) -> str:
    """Return a story whose words in double quotation marks were replaced by what the reader answered.

    Args:
        story: Text such as 'The "animal" went to the "place".'; each such word is asked for once.
    """
    words = sorted(set(re.findall('"(.*?)"', story)))
    if not words:
        return story
    print("For each word below, enter what to put in its place.")
    answers = ask(words, useDict=True)
    for word in words:
        story = story.replace(f'"{word}"', answers[word] or f'"{word}"')
    return story


def numberGame(stop: int = 100, maxGuesses: int = 10) -> None:
    """Let the reader guess a number from 1 to `stop`."""
    secret = random.randint(1, stop)
    for count in range(1, maxGuesses + 1):
        guess = _guess(f"Try {count}: a number from 1 to {stop}")
        if guess == secret:
            speak(f"You guessed my secret number in {count} tries! It was {secret}.")
            return
        speak(
            f"On try number {count} you guessed {guess} and that is too {'low' if guess < secret else 'high'}."
        )
    speak(f"Sorry, but you did not guess it in {maxGuesses} tries. My number was {secret}.")


def _guess(question: str) -> int:
    while True:
        answer = _answer(question, reuse=False)
        try:
            return int(answer)
        except ValueError:
            print(f"{answer!r} is no whole number.")
