"""The platform `enki`."""
