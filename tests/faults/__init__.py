"""Fault campaigns: each injects many faults of one kind into real commands and functions, and checks what is promised.

    python -m tests.faults                          # every kind in full, for hours
    python -m tests.faults mutations --n 1000 --out docs/data/faults.jsonl

A kind is a module with `inject(seed, n, folder)`. It yields one text per fault: empty if everything held, else what
did not. Equal seeds inject equal faults, except that the moment of a kill depends on the machine's speed.
"""
