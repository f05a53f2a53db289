"""The study on how far calibration closes the gap to twins."""
