"""Philox4x32-10 in whole numbers, and the streams that the kernels draw from.

Source: Salmon, Moraes, Dror & Shaw (2011), section 3.3.
"""

from __future__ import annotations

from collections.abc import Iterator

WORD = 2**32
NOISE, GENOME, CHILD, SPECIES = 1, 2, 3, 4  # purposes


def philox(counter: tuple[int, ...], key: tuple[int, ...]) -> tuple[int, ...]:
    """Ten rounds; counter word 0 and key word 0 come first."""
    x0, x1, x2, x3 = counter
    k0, k1 = key
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * x0, WORD)
        high1, low1 = divmod(0xCD9E8D57 * x2, WORD)
        x0, x1, x2, x3 = high1 ^ x1 ^ k0, low1, high0 ^ x3 ^ k1, low0
        k0, k1 = (k0 + 0x9E3779B9) % WORD, (k1 + 0xBB67AE85) % WORD
    return x0, x1, x2, x3


class Stream:
    """The numbers of one key, replicate, generation, individual, repeat and purpose, in order."""

    def __init__(
        self,
        key: int,
        replicate: int,
        generation: int,
        individual: int,
        purpose: int,
        repeat: int = 0,
    ) -> None:
        self.key = (key % WORD, key // WORD)
        self.tail = (individual * 2**8 + purpose, generation * 2**12 + repeat, replicate)
        self.taken = 0

    def words(self, block: int) -> tuple[int, ...]:
        return philox((block, *self.tail), self.key)

    def number(self, index: int) -> float:
        """Number `index`, uniform in (0, 1)."""
        return (self.words(index // 4)[index % 4] + 0.5) / WORD

    def __next__(self) -> float:
        self.taken += 1
        return self.number(self.taken - 1)

    def __iter__(self) -> Iterator[float]:
        return self

    def chance(self, probability: float) -> bool:
        return next(self) < probability

    def below(self, n: int) -> int:
        return int(next(self) * n)

    def signed(self, size: float) -> float:
        return (2.0 * next(self) - 1.0) * size
