"""How far two platforms are apart: arrays in, values out; no platform is run here."""
