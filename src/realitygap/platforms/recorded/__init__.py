"""The platform `recorded`."""
