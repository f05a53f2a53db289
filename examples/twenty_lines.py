"""Evolve, plot, replay, measure the gap, calibrate, and measure the gap again, in twenty lines.

The robot is a twin: a robot with worn motors in MuJoCo. It writes its files into the current folder.

    uv run --extra twin python examples/twenty_lines.py
"""

from pathlib import Path

import realitygap as rg

study = rg.load_study("paper")
results = study.run("results/twenty-lines", replicates=10)
print(results.best())
results.plot().save("coverage.svg")
results.paths("novelty-50").save("paths.svg")
results.replay("novelty-50", run=6).save("run-6.gif")
page = results.report()
table = results.to_polars()
print(f"{len(table):,} trials, report: {page}")

Path("worn.toml").write_text(rg.robots.twin.sample_twin("worn", seed=1).to_toml())

before = rg.measure_gap("sim", "twin:worn.toml", controllers=results, n_controllers=8, trials=4)
print("RMS gap before:", before.rms)

fit = rg.calibrate("track", robot="twin:worn.toml")
after = rg.measure_gap(fit.simulator(), "twin:worn.toml", controllers=results, n_controllers=8, trials=4)
print("RMS gap after: ", after.rms)
after.plot().save("gap.svg")
