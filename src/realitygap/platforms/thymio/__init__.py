"""The platform `thymio`."""
