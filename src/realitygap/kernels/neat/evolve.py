"""One step of evolution: from a generation that was tried to the next one, in its species."""

from __future__ import annotations

from realitygap.kernels.compile.decorators import shared

from .reproduction import reproduce
from .species import speciate


@shared
def next_generation(
    old, fitness, species_of, species, rules, innovations, key, replicate, generation, children, parents
):
    """Breed `children` from `old` and place them in species; arguments as in `reproduce` and `speciate`.

    Where `children.full` is set, a gene found no room and everything written is worth nothing.
    """
    reproduce(
        old, fitness, species_of, species, rules, innovations, key, replicate, generation, children, parents
    )
    if not children.full[0]:
        speciate(children, old, fitness, species_of, species, rules, key, replicate, generation + 1)
