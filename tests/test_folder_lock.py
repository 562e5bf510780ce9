"""A folder has one writer at a time, and none once that has ended, however it ended."""

import contextlib
import multiprocessing
import os
import select
import subprocess
import sys

import pytest

from hydrone_gym._folder_lock import held
from tests.processes import LIMIT, started

HOLD = """if True:
    import os, sys, time
    from hydrone_gym._folder_lock import held
    with held(sys.argv[1]):
        if sys.argv[2] == "alone" or os.fork() == 0:
            print("held", flush=True)
        time.sleep(60)
"""


@contextlib.contextmanager
def holder(folder, how="alone"):
    with started([sys.executable, "-c", HOLD, folder, how], stdout=subprocess.PIPE) as process:
        assert select.select([process.stdout], [], [], LIMIT)[0]
        assert process.stdout.readline() == b"held\n"
        yield process


def end(process):
    process.kill()
    process.wait(LIMIT)


def test_a_held_folder_is_made_refused_to_others_and_left_as_it_was(tmp_path):
    folder = tmp_path / "a" / "b"
    with held(folder):
        with pytest.raises(BlockingIOError) as stop, held(folder):
            pass
        assert str(stop.value) == f"{folder} is in use by another run (pid {os.getpid()})"
        with held(tmp_path):
            pass
    assert list(folder.iterdir()) == []
    with held(folder):
        pass


def test_another_process_is_named_and_lets_go_when_killed(tmp_path):
    with holder(tmp_path) as process:
        with pytest.raises(BlockingIOError, match=rf"in use by another run \(pid {process.pid}\)"), held(tmp_path):
            pass
        end(process)
        with held(tmp_path):
            pass


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
def test_a_child_that_outlives_its_killed_parent_does_not_hold_on(tmp_path):
    with holder(tmp_path, "fork") as process:
        end(process)
        with held(tmp_path):
            pass


def _try(folder, start, turns, counts):
    assert start.wait(LIMIT)
    for _ in range(turns):
        try:
            with held(folder):
                counter = folder / "counter"
                counter.write_text(str(int(counter.read_text()) + 1))
                counts.value += 1
        except BlockingIOError:
            pass


def test_of_many_at_once_only_one_is_ever_inside(tmp_path):
    (tmp_path / "counter").write_text("0")
    context = multiprocessing.get_context("spawn")
    start, counts = context.Event(), [context.Value("i", 0) for _ in range(3)]
    processes = [context.Process(target=_try, args=(tmp_path, start, 300, count), daemon=True) for count in counts]
    for process in processes:
        process.start()
    start.set()
    for process in processes:
        process.join(LIMIT)
        assert process.exitcode == 0
    assert sum(count.value for count in counts) == int((tmp_path / "counter").read_text()) > 0


def test_a_folder_that_cannot_be_held_says_why(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="file"), held(tmp_path / "file"):
        pass
