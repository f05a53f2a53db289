"""Myro in Python 3: the functions of its courses, on a robot, an emulator or a simulator."""
