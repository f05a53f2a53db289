"""Myro's speech, printed here instead of spoken; stories and a guessing game."""

from __future__ import annotations

import random
import re

from ._ask import ask


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
        answer = ask(question)
        try:
            return int(answer)
        except ValueError:
            print(f"{answer!r} is no whole number.")
