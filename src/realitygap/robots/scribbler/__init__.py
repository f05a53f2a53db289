"""The Parallax Scribbler (S1, S2, S3), alone or with a Fluke (1, 2), over its serial or Bluetooth port."""
