"""The calibration of infrared range sensors: where the robot stands, the likelihood of readings, and the fit."""
