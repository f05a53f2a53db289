"""Compiled numerics: arrays in, arrays out.

No classes with behavior, files, clocks, logs or exceptions here; the packages above check what comes in and
name what goes out. All arithmetic is strict IEEE float64 with elementary functions of our own, so that a
result does not depend on the machine.
"""
