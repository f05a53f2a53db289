"""Families of robots, a folder each: protocol, driver, emulator, platforms, and robot files.

No other package names a family. They ask `realitygap.robot_families`, which reads the `FAMILY` of each folder.
"""
