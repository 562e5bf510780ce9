"""One description of each table, printed to a terminal or written as Markdown."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.table import Table


@dataclass
class Sheet:
    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    notes: list[str] = field(default_factory=list)

    def __rich__(self) -> Table:
        """For the terminal."""
        table = Table(title=self.title, caption="\n".join(self.notes) or None, title_justify="left")
        for k, column in enumerate(self.columns):
            table.add_column(column, justify="right" if k else "left")
        for row in self.rows:
            table.add_row(*row)
        return table

    def markdown(self) -> str:
        """For RESULTS.md."""
        marks = ["---", *["---:"] * (len(self.columns) - 1)]
        lines = [self.columns, tuple(marks), *self.rows]
        text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
        return f"### {self.title}\n\n{text}\n" + "".join(f"\n{note}\n" for note in self.notes)


BEGIN, END = "<!-- measured -->\n", "<!-- end of what was measured -->\n"


def put_into(page: Path, section: str) -> None:
    """Put what was measured (Markdown) between the marks of a page; ValueError if it has none."""
    before, mark, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    _, end, after = rest.partition(END)
    if not mark or not end:
        raise ValueError(f"{page} must hold {BEGIN.strip()} and {END.strip()}")
    page.write_text(f"{before}{mark}\n{section}\n{end}{after}", encoding="utf-8")


def number(value: float) -> str:
    """Three significant digits, thousands apart."""
    if value != value:
        return "–"
    if abs(value) >= 1000:
        digits = max(0, len(str(int(abs(value)))) - 3)
        return f"{round(value, -digits):,.0f}"
    return f"{value:.3g}"


def environments(measured: dict[str, Any]) -> Sheet:
    rows = []
    for name, entry in measured.items():
        ends = entry.get("outcomes", {})
        total = sum(ends.values())
        shares = ", ".join(
            f"{word.lower().replace('_', ' ')} {100 * n / total:.0f} %"
            for word, n in sorted(ends.items())
            if n >= total / 200
        )
        spread = "–" if entry["spread"] != entry["spread"] else f"± {100 * entry['spread']:.0f} %"
        length = number(entry["mean_length"]) if total else "–"
        rows.append((name, number(entry["rate"]), spread, length, shares or "–"))
    return Sheet(
        "Environment steps a CPU second",
        ("environment", "steps/s", "spread", "steps an episode", "how episodes ended"),
        rows,
        [
            '"near": references within 1.5 m of the vehicle; "uniform": anywhere in the action space (egocentric: in '
            "its box). Resets and the drawing of references are included; a call that only begins a row's next episode "
            "is no step."
        ],
    )


def edges(measured: dict[str, Any]) -> Sheet:
    first = measured["CL-RRT, one at a time"]["rate"]
    rows = [(name, number(entry["rate"]), f"{entry['rate'] / first:.2f}") for name, entry in measured.items()]
    return Sheet("Tree edges of 0.5 s a CPU second", ("edges", "edges/s", "of CL-RRT's"), rows)


def learning(measured: dict[str, Any]) -> Sheet:
    rows = [(name, number(entry["rate"]), f"± {100 * entry['spread']:.0f} %") for name, entry in measured.items()]
    return Sheet("PPO inside Stable-Baselines3, transitions a CPU second", ("", "steps/s", "spread"), rows)


def threads(measured: dict[str, Any]) -> Sheet:
    rows = [
        (f"{size} rows", *(number(measured["steps_per_second"][f"{size} rows, {k}"]) for k in (1, 2)), f"{ratio:.2f}")
        for size, ratio in measured["ratio"].items()
    ]
    return Sheet("Environment steps a wall-clock second", ("vector env", "1 thread", "2 threads", "ratio"), rows)


def neighbour(measured: dict[str, Any]) -> Sheet:
    if "skipped" in measured:
        return Sheet("Beside a busy process", ("not measured",), [(measured["skipped"],)])
    rows = [
        (name, number(entry["quiet"]), number(entry["crowded"]), f"{entry['ratio']:.2f}")
        for name, entry in measured.items()
    ]
    return Sheet(
        "Environment steps a wall-clock second beside busy processes",
        ("vector env", "alone", "beside", "ratio"),
        rows,
        ["Pinned to as many cores as threads, with one busy process on each: a fair share is 0.5."],
    )


def memory(measured: dict[str, Any]) -> Sheet:
    top, run = measured["peak"], measured["growth"]
    samples = run["megabytes"]
    rows = [
        (f"peak with {top['num_envs']} rows", f"{top['peak']:.0f}"),
        ("of which Python and imports", f"{top['imports']:.0f}"),
        (f"after {run['steps'] / 10:,.0f} steps with {run['num_envs']} rows", f"{samples[1]:.1f}"),
        (f"after {run['steps']:,.0f} steps, {run['episodes']:,} episodes", f"{samples[-1]:.1f}"),
    ]
    return Sheet("Memory", ("", "MB"), rows)


def start(measured: dict[str, Any]) -> Sheet:
    words = {"single": "first step, single", "vector": "first step, 64 rows", "plan": "first plan, CL-RRT"}
    rows = [
        (words[name], *(f"{entry[kind][clock]:.2f}" for kind in ("cold", "warm") for clock in ("wall", "cpu")))
        for name, entry in measured.items()
    ]
    columns = ("launch to", "cold, s", "cold, CPU s", "cached, s", "cached, CPU s")
    return Sheet("Seconds from launching Python", columns, rows, ["Cold: no kernel has been compiled yet."])


def rendering(measured: dict[str, Any]) -> Sheet:
    rows = [(name, number(entry["rate"]), f"± {100 * entry['spread']:.0f} %") for name, entry in measured.items()]
    return Sheet("Pictures a CPU second", ("picture", "pictures/s", "spread"), rows)


def versions(measured: dict[str, Any]) -> Sheet:
    rows = [
        (str(size), str(kernels), str(most))
        for size, kernels, most in zip(measured["num_envs"], measured["kernels"], measured["most"], strict=True)
    ]
    return Sheet(
        "Compiled versions as the number of rows changes",
        ("rows", "kernels used so far", "most versions of any"),
        rows,
        ["More rows meet rarer cases of the scenario generator, whose kernels are then used for the first time."],
    )


def c_reference(measured: dict[str, Any]) -> Sheet:
    loads = list(measured["nanoseconds"])
    names = list(measured["nanoseconds"][loads[0]])
    words = {"1": "scalar", "16": "16 lanes"}
    rows = []
    for name in names:
        program, lanes = name.split(", ")
        times = (f"{measured['nanoseconds'][load][name]:.1f}" for load in loads)
        rows.append((f"{program}, {words[lanes]}", *times))
    ratios = "; ".join(f"{name}: {ratio:.2f}" for name, ratio in measured["ratios"].items())
    notes = [
        f"Ratios with both media: {ratios}.",
        f"Largest difference between the results of C and Numba: {max(measured['difference'].values()):.3g}. "
        f"C flags: {measured['flags']}. The fast-math rows give other results and are for information.",
    ]
    return Sheet("CPU nanoseconds a substep", ("", *loads), rows, notes)


BUILDERS: dict[str, Callable[[dict[str, Any]], Sheet]] = {
    "environments": environments,
    "edges": edges,
    "learning": learning,
    "threads": threads,
    "neighbour": neighbour,
    "memory": memory,
    "start": start,
    "rendering": rendering,
    "versions": versions,
    "c_reference": c_reference,
}
