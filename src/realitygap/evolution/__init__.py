"""NEAT and novelty search: settings, genomes and what they become elsewhere, populations to ask and tell, archives."""

from ._archive import Member, NoveltyArchive, archive_members
from ._c import to_c
from ._distances import (
    DISTANCES,
    BehaviorDistance,
    CellOrder,
    behavior_distance,
    distance_kind,
    measure_of,
    pack_behaviors,
)
from ._export import to_networkx, to_onnx
from ._genome import Genome, GenomeRecord, Network, decode_all, genome_from_record, genome_record
from ._interface import (
    OUTPUTS,
    PAPER_INPUTS,
    WHEELS,
    Channels,
    ControllerInterface,
    inputs_of_robot,
    listed,
    paper_interface,
)
from ._json import interface_to_dict, to_text
from ._map_elites import (
    MOST_CELLS,
    MOST_CENTROIDS,
    Elite,
    MapElites,
    cells_of,
    check_width,
    cvt_centroids,
    cvt_points,
    place_in_cells,
    ribs_archive,
)
from ._novelty import (
    NearestArchive,
    NoveltySettings,
    PaperArchive,
    largest_cell_distance,
    sorted_cells_distance,
)
from ._picture import network_picture
from ._population import Population, random_key
from ._settings import NAMED_SETTINGS, NeatSettings

__all__ = [
    "DISTANCES",
    "MOST_CELLS",
    "MOST_CENTROIDS",
    "NAMED_SETTINGS",
    "OUTPUTS",
    "PAPER_INPUTS",
    "WHEELS",
    "BehaviorDistance",
    "CellOrder",
    "Channels",
    "ControllerInterface",
    "Elite",
    "Genome",
    "GenomeRecord",
    "MapElites",
    "Member",
    "NearestArchive",
    "NeatSettings",
    "Network",
    "NoveltyArchive",
    "NoveltySettings",
    "PaperArchive",
    "Population",
    "archive_members",
    "behavior_distance",
    "cells_of",
    "check_width",
    "cvt_centroids",
    "cvt_points",
    "decode_all",
    "distance_kind",
    "genome_from_record",
    "genome_record",
    "inputs_of_robot",
    "interface_to_dict",
    "largest_cell_distance",
    "listed",
    "measure_of",
    "network_picture",
    "pack_behaviors",
    "paper_interface",
    "place_in_cells",
    "random_key",
    "ribs_archive",
    "sorted_cells_distance",
    "to_c",
    "to_networkx",
    "to_onnx",
    "to_text",
]
