"""The calibration of infrared range sensors: the robot's placements, the likelihood of readings, and the fit."""
