"""Calibrations: trials on a target, and fits to them."""
