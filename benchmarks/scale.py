"""What a million evaluation flights cost: processor time by policy, disk, and what going on and summing up take.

    python -m benchmarks.scale                 # about three minutes
    python -m benchmarks.scale --worlds 100

Everything is measured on a few hundred flights and `ROWS` rows and stated for a million; all of it grows in proportion.
Times are of processors, not of clocks. A cluster has one process that sends worlds out and writes rows: what a flight
costs there says how many cores it can keep busy. Ray's is one of two nodes on this machine.
"""

import argparse
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.tables import Sheet
from benchmarks.timing import machine, save
from hydrone_gym.evaluation import Record, evaluate, read_records
from hydrone_gym.evaluation.plan import make_plan
from hydrone_gym.evaluation.records import HEADER, to_line
from hydrone_gym.evaluation.run import carry_out
from hydrone_gym.evaluation.run_folder import RunFolder
from hydrone_gym.evaluation.summary import summarise
from hydrone_gym.evaluation.tables import markdown, tables_of

POLICIES = ("straight-line", "straight-line-shield", "ppo", "ppo-shield", "clrrt")
BATCHES = ("ppo", "ppo-shield")
ROWS = 100_000
MILLION = 1_000_000


def spent(call: Callable[..., Any], *arguments: Any, **options: Any) -> tuple[float, Any]:
    """Return the processor time of this process (s), and what the call returned."""
    start = time.process_time()
    result = call(*arguments, **options)
    return time.process_time() - start, result


def a_flight(worlds: int, suite: str, policy: str, **options: Any) -> float:
    """Return what one more flight takes of this process (s): so many worlds less a tenth of them, all else is equal."""

    def fly(count: int) -> tuple[float, list[Record]]:
        plan = make_plan(suite, policy, worlds=count)
        with tempfile.TemporaryDirectory() as folder:
            return spent(carry_out, plan, RunFolder(Path(folder), plan), **options)

    fly(1)  # compiles, starts workers
    (few, fewer), (many, more) = fly(worlds // 10), fly(worlds)
    return (many - few) / (len(more) - len(fewer))


def flights(worlds: int) -> dict[str, float]:
    """Return the processor time a flight takes (s), by policy: alone in paper-20, then a thousand worlds in a batch."""
    alone = {policy: a_flight(worlds, "paper-20", policy) for policy in POLICIES}
    return alone | {f"{policy}, in batches": a_flight(1000, "held-out", policy) for policy in BATCHES}


def checkpoint(folder: Path) -> dict[str, float]:
    """Return what `ROWS` rows take: bytes on disk, and s and bytes of memory to read and to sum them up."""
    flown = evaluate("paper-20", ["straight-line", "clrrt"], worlds=20)
    rows = [replace(flown[k % len(flown)], world=k // len(flown)) for k in range(ROWS)]
    path = folder / "rows.csv"
    path.write_text("".join((f"{HEADER}\n", *map(to_line, rows))), encoding="utf-8")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    reading, records = spent(read_records, path)
    memory = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    summing, _ = spent(lambda: markdown(tables_of(summarise(records))))
    return {"bytes": path.stat().st_size / ROWS, "read": reading / ROWS, "sum": summing / ROWS, "memory": memory / ROWS}


def driver(backend: str) -> float:
    """Return the processor time a flight costs the process that sends the worlds out and writes the rows (s)."""
    return a_flight(200, "paper-20", "straight-line", jobs=2, backend=backend)


def on_two_nodes() -> float:
    """Return the same for Ray, whose cluster has two nodes with one core each."""
    import ray
    from ray.cluster_utils import Cluster

    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        cluster.add_node(num_cpus=1)
        cluster.wait_for_nodes()
        ray.init(address=cluster.address, log_to_driver=False)
        return driver("ray")
    finally:
        ray.shutdown()
        cluster.shutdown()


def sheets(measured: dict[str, Any]) -> list[Sheet]:
    """Return the tables."""
    drivers, stored = measured["driver"], measured["checkpoint"]
    costs = [
        (policy, f"{1e3 * s:.1f}", f"{1.0 / s:,.0f}", f"{MILLION * s / 3600.0:.1f}")
        for policy, s in measured["flights"].items()
    ]
    slowest = measured["flights"]["clrrt"]
    sent = [(name, f"{1e3 * s:.2f}", f"{MILLION * s / 60.0:.0f}", f"{slowest / s:,.0f}") for name, s in drivers.items()]
    disk = f"{stored['bytes'] * MILLION / 1e6:.0f} MB"
    held = [("rows.csv", disk), ("to read it when going on", f"{stored['read'] * MILLION:.0f} s")]
    held += [("memory of the rows read", f"{stored['memory'] * MILLION / 1e9:.1f} GB")]
    held += [("statistics and tables, two policies", f"{stored['sum'] * MILLION:.0f} s")]
    return [
        Sheet("A flight, of one core", ("policy", "ms", "flights a second", "hours a million"), costs),
        Sheet(
            "The process that sends worlds out",
            ("workers", "ms a flight", "minutes a million", "cores it keeps busy with clrrt"),
            sent,
        ),
        Sheet("A folder of a million rows", ("", ""), held),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--worlds", type=int, default=50, help="of each mission that a policy flies alone")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        measured: dict[str, Any] = {"flights": flights(options.worlds), "checkpoint": checkpoint(Path(folder))}
    measured["driver"] = {"loky": driver("loky"), "ray, two nodes": on_two_nodes()}
    for sheet in sheets(measured):
        Console().print(sheet)
    print(machine())
    print(save("scale", "python -m benchmarks.scale", measured))


if __name__ == "__main__":
    main()
