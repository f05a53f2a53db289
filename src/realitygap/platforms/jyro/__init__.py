"""The platform `jyro`."""
