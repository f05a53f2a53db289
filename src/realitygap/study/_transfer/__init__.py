"""Controllers evolved in simulation and tried on a target: strategies, and what came of them."""
