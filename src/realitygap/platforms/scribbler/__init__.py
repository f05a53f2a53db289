"""The platform `scribbler`."""
