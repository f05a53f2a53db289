"""The study of a Thymio in simulators by other authors: does `sim` predict controllers after a calibration?

    python -m benchmarks.closing_thymio run results/thymio                           # an hour; run it again to resume
    python -m benchmarks.closing_thymio run results/thymio --families enki           # without the playground
    python -m benchmarks.closing_thymio run results/playground --plan playground
    python -m benchmarks.closing_thymio write results/thymio                         # the data of the page
    python -m benchmarks.closing_thymio write results/playground --playground

`realitygap twin build-enki` builds Enki first. `run --small` takes minutes, and shows no result. Without a folder,
`write` makes tables and figures from the stored summary.
"""
