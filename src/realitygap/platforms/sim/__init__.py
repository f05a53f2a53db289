"""The platform `sim`."""
