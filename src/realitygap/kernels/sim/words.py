"""Random words of a step of `sim`: a separate purpose for each use, so that no two share a word.

A use of w words takes the blocks step * ceil(w / 4) and on of its purpose's stream; so switching one kind of noise
on or off, or adding a sensor of another kind, leaves all other noise as it is.
"""

from __future__ import annotations

import numpy as np

from realitygap.kernels.compile.decorators import inlined, stage
from realitygap.kernels.math.lanes import LANES
from realitygap.kernels.math.philox import philox


@stage
def _draw(block, purpose, c1, c2, c3, k0, k1, w0, w1, w2, w3):
    for lane in range(LANES):
        named = np.uint32((c1[lane] & np.uint32(0xFFFFFF00)) | purpose)
        a, b, c, d = philox(np.uint32(block), named, c2[lane], c3[lane], k0, k1)
        w0[lane] = a
        w1[lane] = b
        w2[lane] = c
        w3[lane] = d


@inlined
def blocks_of(words):
    """Return the number of blocks of four that `words` words take."""
    return (words + 3) >> 2


@stage
def draw_words_of(purpose, step, n_words, counters, key, words):
    """The words of a step for one purpose.

    Args:
        purpose: A `PURPOSE_...`.
        step: Number of the reading or the motion, from 0 on.
        n_words: How many, at least 1.
        counters: (3, LANES) the fixed words of each trial's random numbers, of whatever purpose.
        key: uint64.
        words: (4 * blocks_of(n_words) or more, LANES) written.
    """
    k0 = np.uint32(np.uint64(key) & np.uint64(0xFFFFFFFF))
    k1 = np.uint32(np.uint64(key) >> np.uint64(32))
    blocks = blocks_of(n_words)
    for b in range(blocks):
        _draw(
            step * blocks + b, np.uint32(purpose), counters[0], counters[1], counters[2], k0, k1,
            words[4 * b], words[4 * b + 1], words[4 * b + 2], words[4 * b + 3],
        )  # fmt: skip
