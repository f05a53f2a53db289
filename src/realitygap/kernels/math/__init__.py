"""Arithmetic that knows no robot: bits, elementary functions, random numbers, lanes and vectors."""
