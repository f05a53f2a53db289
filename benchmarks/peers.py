"""Compare realitygap with its peers on the same work, in one sitting.

    python benchmarks/peers.py [--only NAME] [--json] [--fresh]

Each peer runs in an environment of its own, which the first call builds in the cache folder (`--fresh` builds
it anew); `realitygap` in the one that runs this file. Figure after figure, ours and the peers' are measured one
after the other, each in a process of its own, and the median of repeats counts. What cannot be built or does not
end in time is said to be not measured, with the reason.

Example: python benchmarks/peers.py --only neat_python
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

import enki_peer
import irsim_peer
import jyro_peer
import kheperax_peer
import multineat_peer
import neat_python_peer
import ours
from environments import Peer, PeerError, build_environment, machine, measure
from work import FIGURES

PEERS = (
    jyro_peer.PEER,
    enki_peer.PEER,
    irsim_peer.PEER,
    kheperax_peer.PEER,
    neat_python_peer.PEER,
    multineat_peer.PEER,
)


def compare(peers: Sequence[Peer], *, fresh: bool = False) -> dict[str, Any]:
    """Every figure that some of these peers have, ours beside it.

    Returns:
        `figures`: by figure and name, `median`, `low`, `high` (and `ratio`, how many times faster we are), or
        `not_measured` with the reason; `engine`: what takes our own time; `versions`, `machine`, and `load`, the
        processes that wanted a core in the minute before the start and before the end.
    """
    load = [_load()]
    pythons, reasons = {}, {}
    for peer in (ours.PEER, *peers):
        try:
            pythons[peer.name] = build_environment(peer, fresh=fresh)
        except PeerError as error:
            reasons[peer.name] = str(error)
    versions: dict[str, Any] = {}

    def one(peer: Peer, figure: str) -> dict[str, Any]:
        if peer.name in reasons:
            return {"not_measured": reasons[peer.name]}
        print(f"{figure}: {peer.title} ...", file=sys.stderr)
        try:
            answer = measure(peer, pythons[peer.name], figure)
        except PeerError as error:
            return {"not_measured": str(error)}
        versions[peer.name] = answer.pop("versions")
        return answer

    figures = {}
    for figure in FIGURES:
        concerned = [peer for peer in peers if figure in peer.figures]
        if concerned:
            figures[figure] = {peer.name: one(peer, figure) for peer in (ours.PEER, *concerned)}
            add_ratios(figure, figures[figure])
    engine = one(ours.PEER, "engine")
    return {
        "figures": figures,
        "engine": engine,
        "versions": versions,
        "machine": machine(),
        "load": [*load, _load()],
    }


def add_ratios(figure: str, answers: dict[str, dict[str, Any]]) -> None:
    """How many times faster we are than each peer that was measured, where we were."""
    own = answers[ours.PEER.name].get("median")
    for name, answer in answers.items():
        if own is not None and name != ours.PEER.name and "median" in answer:
            theirs = answer["median"]
            answer["ratio"] = own / theirs if FIGURES[figure].is_rate else theirs / own


def _load() -> float | None:
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def text_of(value: float) -> str:
    """A number with three digits that count."""
    if value >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def print_report(result: dict[str, Any]) -> None:
    """The report for people, ratios first."""
    titles = {peer.name: peer.title for peer in (ours.PEER, *PEERS)}
    for figure, answers in result["figures"].items():
        about = FIGURES[figure]
        print(f"{about.title} [{about.unit}]")
        for name, answer in answers.items():
            if "not_measured" in answer:
                print(f"  {titles[name]:12} not measured: {answer['not_measured'].splitlines()[0]}")
                continue
            ratio = f"ours is {text_of(answer['ratio'])} times as fast" if "ratio" in answer else ""
            span = f"({text_of(answer['low'])} to {text_of(answer['high'])})"
            print(f"  {titles[name]:12} {text_of(answer['median']):>12} {span:26} {ratio}")
        print()
    about = result["machine"]
    print(f"Machine: {about['cpu']}, {about['cores']} cores, {about['system']}; load {result['load']}")
    for name, versions in result["versions"].items():
        print(f"{titles[name]}: " + ", ".join(f"{package} {number}" for package, number in versions.items()))


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description="realitygap beside its peers, on the same work in one sitting.",
        epilog="Example: python benchmarks/peers.py --only neat_python",
    )
    names = [peer.name for peer in PEERS]
    parser.add_argument("--only", choices=names, metavar="NAME", help=f"one peer: {', '.join(names)}")
    parser.add_argument("--json", action="store_true", help="print data instead of a table")
    parser.add_argument("--fresh", action="store_true", help="build the peers' environments anew")
    options = parser.parse_args()
    peers = [peer for peer in PEERS if options.only in (None, peer.name)]
    result = compare(peers, fresh=options.fresh)
    if options.json:
        print(json.dumps(result, indent=2))
    else:
        print_report(result)
    return 0


if __name__ == "__main__":
    sys.exit(main())
