"""Aseba's playground in place of a Thymio II, for tests."""
