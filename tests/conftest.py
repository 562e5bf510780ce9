"""Tests open no window on whoever's screen they run, and leave no process behind when they hang."""

import os
import threading

import psutil
import pytest

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")


def _end_processes():
    for process in psutil.Process().children(recursive=True):
        process.kill()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    """Kill what a test has started shortly before its time is over: one that only waits for that fails by itself."""
    timer = threading.Timer(0.95 * float(item.config.getini("faulthandler_timeout")), _end_processes)
    timer.start()
    try:
        return (yield)
    finally:
        timer.cancel()
