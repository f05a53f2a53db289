"""Fits of a simulator to what was observed of a robot: arrays in, values out; no platform is run here."""
