"""NEAT and novelty search: genomes as arrays, networks, species, reproduction, and blocks of runs."""
