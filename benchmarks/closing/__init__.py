"""The study `closing-the-gap`, version 2: does a calibrated simulator predict, and does what evolves in it transfer?

    python -m benchmarks.closing run results/closing-2              # hours; interrupt it, and run it again to resume
    python -m benchmarks.closing fit results/closing-2 cma-es       # outside calibrators: fits of all driven twins
    NPE/bin/python -m benchmarks.closing.npe results/closing-2      # in an environment with sbi and realitygap
    python -m benchmarks.closing run results/closing-2              # again: what evolves in these fits
    python -m benchmarks.closing collect results/closing-2 --out docs/data/closing-2
    python -m benchmarks.closing analyze docs/data/closing-2       # needs statsmodels and pandas
    python -m benchmarks.closing draw docs/data/closing-2 --out docs/images/closing-2

`run --small` uses a small plan on two other twins. `docs/data/closing-2/plan.toml` is the plan.
Seeds follow from the hash of the commit that fixed it.
"""
