"""The platform `jyro`: its trials, its robots step by step, and whole scenes."""
