"""NEAT and novelty search: settings, genomes and what they become elsewhere, populations to ask and tell, archives."""

from ._archive import NoveltyArchive
from ._archive_members import Member, archive_members
from ._distances import DISTANCES, BehaviorDistance, behavior_distance, distance_kind
from ._genome import ConnectionGene, Genome, Network, NodeGene, decode_all, genome_from_record, genome_record
from ._graph import to_networkx
from ._interface import PAPER_INPUTS, ControllerInterface, Sense, inputs_of_ranges, paper_interface
from ._novelty import (
    NearestArchive,
    NoveltySettings,
    PaperArchive,
    euclidean,
    largest_cell_distance,
    sorted_cells_distance,
)
from ._onnx import to_onnx
from ._picture import network_picture
from ._population import Population
from ._random import random_key
from ._settings import NAMED_SETTINGS, NeatSettings

__all__ = [
    "DISTANCES",
    "NAMED_SETTINGS",
    "PAPER_INPUTS",
    "BehaviorDistance",
    "ConnectionGene",
    "ControllerInterface",
    "Genome",
    "Member",
    "NearestArchive",
    "NeatSettings",
    "Network",
    "NodeGene",
    "NoveltyArchive",
    "NoveltySettings",
    "PaperArchive",
    "Population",
    "Sense",
    "archive_members",
    "behavior_distance",
    "decode_all",
    "distance_kind",
    "euclidean",
    "genome_from_record",
    "genome_record",
    "inputs_of_ranges",
    "largest_cell_distance",
    "network_picture",
    "paper_interface",
    "random_key",
    "sorted_cells_distance",
    "to_networkx",
    "to_onnx",
]
