"""The generator against its published vectors and a plain one; streams that never meet."""

from __future__ import annotations

import itertools
import random

import numpy as np
import pytest

from realitygap.kernels.math import philox
from tests.reference import philox as reference
from tests.reference.effort import cases
from tests.reference.philox import Stream

pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered")  # wanted, when not compiled

# Random123, kat_vectors: counter, key, result.
KNOWN = [
    ("00000000 00000000 00000000 00000000", "00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]

LIMITS = {
    "replicate": 2**32 - 1,
    "generation": philox.MAX_GENERATIONS - 1,
    "individual": philox.MAX_INDIVIDUALS - 1,
    "repeat": philox.MAX_REPEATS - 1,
    "purpose": 255,
}


def words(text: str) -> tuple[int, ...]:
    return tuple(int(word, 16) for word in text.split())


def kernel_philox(counter: tuple[int, ...], key: tuple[int, ...]) -> tuple[int, ...]:
    return tuple(int(word) for word in philox.philox(*map(np.uint32, (*counter, *key))))


def number(stream, index):
    """Number `index` of a stream, as kernels take it."""
    return philox.unit(philox.draw_words(stream, index >> 2)[index & 3])


def stream_of(key: int, **fields: int) -> tuple[np.uint32, ...]:
    names = ("replicate", "generation", "individual", "repeat", "purpose")
    stream: tuple[np.uint32, ...] = philox.make_stream(
        np.uint64(key), *(np.int64(fields[name]) for name in names)
    )
    return stream


@pytest.mark.parametrize(("counter", "key", "result"), KNOWN)
def test_philox_gives_the_known_answers(counter: str, key: str, result: str) -> None:
    assert reference.philox(words(counter), words(key)) == words(result)
    assert kernel_philox(words(counter), words(key)) == words(result)


def test_random_counters_equal_the_reference() -> None:
    rng = random.Random(1)
    for _ in range(cases(2_000, 100)):
        counter = tuple(rng.getrandbits(32) for _ in range(4))
        key = (rng.getrandbits(32), rng.getrandbits(32))
        assert kernel_philox(counter, key) == reference.philox(counter, key)


def test_streams_equal_the_reference() -> None:
    rng = random.Random(2)
    for _ in range(cases(300, 30)):
        key = rng.getrandbits(64)
        fields = {name: rng.choice([0, 1, limit, rng.randint(0, limit)]) for name, limit in LIMITS.items()}
        stream = stream_of(key, **fields)
        plain = Stream(key, **fields)
        for index in [0, 1, 2, 3, 4, 7, 400, 3 * 10**6 + 1]:
            assert number(stream, np.int64(index)) == plain.number(index)
        assert tuple(map(int, philox.draw_words(stream, np.int64(87)))) == plain.words(87)


def test_different_streams_never_share_a_counter_even_at_the_limits_of_the_fields() -> None:
    """Every combination of small, middle and largest values gives another counter: no field runs into another."""
    values = {name: sorted({0, 1, 2, limit // 2, limit - 1, limit}) for name, limit in LIMITS.items()}
    seen = set()
    combinations = list(itertools.product(*values.values()))
    for combination in combinations[:: cases(1, 10)]:
        stream = stream_of(0, **dict(zip(values, combination, strict=True)))
        seen.add(tuple(map(int, stream[:3])))
    assert len(seen) == len(combinations[:: cases(1, 10)])


def test_the_purposes_are_different() -> None:
    purposes = {name: int(value) for name, value in vars(philox).items() if name.startswith("PURPOSE_")}
    assert len(set(purposes.values())) == len(purposes)
    assert max(purposes.values()) < 256
    first = [philox.PURPOSE_NOISE, philox.PURPOSE_GENOME, philox.PURPOSE_CHILD, philox.PURPOSE_SPECIES]
    assert list(map(int, first)) == [1, 2, 3, 4]
    assert (reference.NOISE, reference.GENOME, reference.CHILD, reference.SPECIES) == (1, 2, 3, 4)


def test_unit_is_never_zero_or_one_and_centered() -> None:
    lowest, highest = philox.unit(np.uint32(0)), philox.unit(np.uint32(2**32 - 1))
    assert lowest > 0.0
    assert highest < 1.0
    assert lowest + highest == 1.0  # so words come in pairs whose mean is one half
    assert philox.unit(np.uint32(2**31)) + philox.unit(np.uint32(2**31 - 1)) == 1.0


def test_numbers_are_uniform() -> None:
    """Mean, variance and correlation of neighbors; each bound is four standard errors: 1 in 16,000 by chance."""
    n = cases(200_000, 4_000)
    stream = stream_of(12345, replicate=3, generation=2, individual=1, repeat=0, purpose=3)
    numbers = np.array([number(stream, np.int64(index)) for index in range(n)])
    assert abs(numbers.mean() - 1 / 2) < 4 * np.sqrt(1 / 12 / n)
    assert abs(numbers.var() - 1 / 12) < 4 * np.sqrt(1 / 180 / n)
    assert abs(np.corrcoef(numbers[:-1], numbers[1:])[0, 1]) < 4 / np.sqrt(n)


def test_neighboring_streams_are_unrelated() -> None:
    """Number 0 of streams that differ in one field: four standard errors each, five fields: 1 in 3,000."""
    n = cases(20_000, 1_000)
    for name, limit in LIMITS.items():
        fields = {"replicate": 1, "generation": 1, "individual": 1, "repeat": 1, "purpose": 1}
        m = min(n, limit)
        numbers = [number(stream_of(7, **{**fields, name: value}), np.int64(0)) for value in range(m)]
        assert abs(np.mean(numbers) - 1 / 2) < 4 * np.sqrt(1 / 12 / m), name
        assert len(set(numbers)) > 0.999 * m
