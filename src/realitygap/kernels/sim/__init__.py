"""The platform `sim`: trials in lanes, their physics, and their sensors."""
