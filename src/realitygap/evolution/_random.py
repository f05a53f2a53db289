"""The key of the random numbers."""

from __future__ import annotations

import hashlib


def random_key(seed: int, name: str | None = None) -> int:
    """Return the 64-bit key of a study's random numbers, or of one condition's.

    Args:
        seed: Seed of the study.
        name: Name of the condition; None if all conditions share their random numbers.
    """
    text = f"realitygap:{seed}" if name is None else f"realitygap:{seed}:{name}"
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "little")
