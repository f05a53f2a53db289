"""Evolve robot controllers, measure the reality gap, shrink it."""
