"""Cards of genomes and archives, for notebooks."""

from __future__ import annotations

from realitygap.drawing import Card, Table, card_of, picture_of

from ._archive import NoveltyArchive
from ._genome import Genome
from ._novelty import NearestArchive, PaperArchive

MOST_DRAWN = 200
"""Connections of a network that is drawn: a drawing of more is a tangle, and large."""


@card_of.register(Genome)
def genome_card(genome: Genome) -> Card:
    """Return the network of a genome, and its genes, which open."""
    n = len(genome.connections)
    lead = f"{genome.n_enabled} of {n} connections are enabled."
    rows = [
        [
            str(gene.innovation),
            f"{gene.source} → {gene.target}",
            f"{gene.weight:.4g}",
            "yes" if gene.enabled else "no",
        ]
        for gene in genome.connections
    ]
    genes = Table(["innovation", "from → to", "weight", "enabled"], rows, f"{n} genes", closed=True)
    return Card(
        repr(genome),
        lead=lead,
        parts=[picture_of(genome), genes] if n <= MOST_DRAWN else ["It is too large to be drawn.", genes],
        code=["genome.network().activate(inputs)", "genome.save('champion.json')"],
    )


@card_of.register(PaperArchive)
@card_of.register(NoveltyArchive)
def archive_card(archive: PaperArchive | NoveltyArchive) -> Card:
    """Return the number of archived behaviors, and the settings of the archive."""
    rows = [[name, f"{value}"] for name, value in archive.settings.model_dump(mode="json").items()]
    columns, n_rows = archive.grid_size
    return Card(
        repr(archive),
        lead=f"{len(archive)} behaviors on a grid of {columns} × {n_rows} cells.",
        parts=[Table(["setting", "value"], rows, "Settings", closed=True)],
    )


@card_of.register(NearestArchive)
def nearest_card(archive: NearestArchive) -> Card:
    """Return the number of archived behaviors, the threshold, and the range of each coordinate."""
    rows = []
    for k in range(len(archive.behaviors[0]) if len(archive) else 0):
        values = [float(behavior[k]) for behavior in archive.behaviors]
        rows.append([f"coordinate {k}", f"{min(values):.4g}", f"{max(values):.4g}"])
    lead = f"{len(archive)} behaviors; a new one enters with a novelty above {archive.threshold:.4g}."
    return Card(repr(archive), lead=lead, parts=[Table(["", "smallest", "largest"], rows)])
