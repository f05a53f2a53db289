"""The gap between two platforms: planned, measured, and explained."""
