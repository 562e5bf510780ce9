"""Processes of tests: none is waited for without end, and nothing that they start outlives them."""

import contextlib
import os
import signal
import subprocess
import time

import pytest

LIMIT = 240.0  # s; many times what any of them takes on a busy machine


@contextlib.contextmanager
def started(command, **options):
    """A process in a session of its own; it and what it has started there are killed when the block ends."""
    with subprocess.Popen(command, start_new_session=True, **options) as process:
        try:
            yield process
        finally:
            send(process, signal.SIGKILL)


def send(process, number):
    """Send a signal to a process and what it has started, as a terminal does."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, number)


def finish(process, limit=LIMIT):
    """Return what a process and what it started print on stdout and stderr until all have ended, limit in s."""
    try:
        return process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        send(process, signal.SIGKILL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            pytest.fail(f"no end within {limit} s, but: {process.communicate(timeout=10.0)}")
        pytest.fail(f"no end within {limit} s, nor when killed")


def completed(command, limit=LIMIT, **options):
    """Run a command to its end, as `subprocess.run` does with its output as text, limit in s."""
    with started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options) as process:
        out, err = finish(process, limit)
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def wait_until(true, process, limit=LIMIT):
    """Wait until something is true or the process has ended, limit in s."""
    until = time.monotonic() + limit
    while not true() and process.poll() is None:
        assert time.monotonic() < until, f"nothing within {limit} s"
        time.sleep(0.02)
