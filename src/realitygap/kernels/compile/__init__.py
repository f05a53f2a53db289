"""The compiler of kernels, and the cache of compiled kernels.

Kernels import `decorators` alone. `progress` imports no Numba: a command can import it without delay.
"""
