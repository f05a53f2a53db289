"""Aseba's playground as an emulated Thymio II, with a witness."""
