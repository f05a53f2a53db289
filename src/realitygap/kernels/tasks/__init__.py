"""Measurements of tasks: cells, scores, mazes, XOR, and poles on a cart."""
