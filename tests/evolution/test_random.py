"""The key of the random numbers."""

from __future__ import annotations

from realitygap.evolution import random_key


def test_keys_are_64_bits_and_all_different() -> None:
    keys = [random_key(seed) for seed in range(300)]
    keys += [random_key(seed, name) for seed in range(300) for name in ("a", "b", "coverage-10", "1")]
    assert len(set(keys)) == len(keys)
    assert all(0 <= key < 2**64 for key in keys)
    assert max(keys) > 2**63


def test_a_key_stays_what_it_is() -> None:
    """Another key is another study: results of earlier versions could not be shown again."""
    assert random_key(1) == 9605869861189762251
    assert random_key(1, "coverage-10") == 2288172612970466197
