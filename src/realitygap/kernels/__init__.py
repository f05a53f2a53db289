"""Compiled numerics: arrays in, arrays out.

No classes with behavior, files, clocks, logs or exceptions here; the packages above check what comes in and
name what goes out. All arithmetic is strict IEEE float64 with elementary functions of our own, so that a
result does not depend on the machine.

Each folder imports only those above it in this list:

* `compile`: the compiler of kernels, and the cache of compiled kernels
* `math`: bits, elementary functions, random numbers, lanes
* `neat`: genomes, networks, species, novelty, blocks of runs
* `tasks`: measurements of tasks
* `jyro`, `sim`: the trials of the two simulators

Other packages import the modules themselves (`realitygap.kernels.neat.genome`). No package here imports its
modules, so that a program loads only the kernels that it uses.
"""
