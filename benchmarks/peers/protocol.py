"""How run.py talks to a simulator in another environment: lines of JSON. Standard library only.

The worker first prints one line that lists what it can run, then answers each line ``[name, seconds]`` by running that
for so many CPU seconds.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from typing import TextIO


def begin() -> TextIO:
    """Stay on one core and return where answers go; call before the simulator is imported.

    One core, so that thread pools cannot hide what a step costs. Answers travel over the original standard output;
    whatever a library prints goes to standard error.
    """
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {sorted(os.sched_getaffinity(0))[0]})
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    return answers


def serve(answers: TextIO, version: str, runs: dict[str, tuple[int, Callable[[], float]]]) -> None:
    """Answer requests. Each run is (physics substeps a control step, function that returns control steps done)."""
    for _, run in runs.values():
        run()
    listing = {"version": version, "runs": {name: substeps for name, (substeps, _) in runs.items()}}
    print(json.dumps(listing), file=answers, flush=True)
    for line in sys.stdin:
        name, seconds = json.loads(line)
        run = runs[name][1]
        steps, start = 0.0, time.process_time()
        while True:
            steps += run()
            elapsed = time.process_time() - start
            if elapsed >= seconds:
                break
        print(json.dumps(steps / elapsed), file=answers, flush=True)
