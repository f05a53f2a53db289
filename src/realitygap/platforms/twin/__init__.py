"""The platform `twin`."""
