"""A Scribbler for real client programs: bytes in front, any simulated robot behind."""
