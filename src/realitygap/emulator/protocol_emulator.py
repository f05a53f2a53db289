"""What pyserial looks for when it is asked to open emulator://."""

from ._port import EmulatedPort as Serial

__all__ = ["Serial"]
