"""Files from elsewhere: what is wrong with them is told in one line, soon and in little memory, and nothing runs."""

import hashlib
import io
import itertools
import os
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import yaml

from agents.agent_file import TENSORS, TEXT, AgentFile, read_agent, save_agent
from agents.network import Network
from agents.plain_data import MOST_BYTES, read_yaml, to_yaml
from hydrone_gym.cli import main

ID = "HydroneGym/Mission-v0"
SIZES = [68, 256, 256, 3]


def network(**changes):
    pairs = list(itertools.pairwise(SIZES))
    layers = {
        "weights": tuple(np.zeros(pair, np.float32) for pair in pairs),
        "biases": tuple(np.zeros(width, np.float32) for _, width in pairs),
    }
    return Network(**{**layers, "activation": "tanh", "output": "linear", **changes})


@pytest.fixture
def folder(tmp_path):
    save_agent(AgentFile(name="good", algorithm="PPO", environment=ID, network=network()), tmp_path / "agent")
    return tmp_path / "agent"


def rewrite(folder, **changes):
    content = yaml.safe_load((folder / TEXT).read_text())
    (folder / TEXT).write_text(yaml.safe_dump({**content, **changes}))


def rezip(folder, kind=zipfile.ZIP_DEFLATED, *, declared=None, **members):
    """Write the tensors anew, some of them as given, with the right SHA-256; `declared` falsifies a size."""
    good = np.load(folder / TENSORS)
    content = {f"{name}.npy": npy(good[name]) for name in good.files}
    content |= {f"{name}.npy": data for name, data in members.items()}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", kind) as archive:
        for name, data in content.items():
            if data is not None:
                archive.writestr(name, data)
    data = buffer.getvalue()
    if declared is not None:
        true, told = (size.to_bytes(4, "little") for size in declared)
        data = data.replace(true, told)
    (folder / TENSORS).write_bytes(data)
    rewrite(folder, tensors={"file": TENSORS, "sha256": hashlib.sha256(data).hexdigest()})


def npy(array, claimed=None):
    stream = io.BytesIO()
    np.save(stream, array)
    data = stream.getvalue()
    return data if claimed is None else data.replace(*(str(pair).encode() for pair in claimed))


ZEROS = 120_000_000  # bytes that a member unpacks to


def big(folder):
    rezip(folder, weight_0=bytes(ZEROS))


def big_and_said_to_be_small(folder):
    """The archive says 70,000 bytes and unpacks to thousands of times as much."""
    rezip(folder, declared=(ZEROS, 70_000), weight_0=bytes(ZEROS))


def packed_otherwise(folder):
    rezip(folder, zipfile.ZIP_BZIP2, weight_0=bytes(ZEROS))


def a_shape_that_no_memory_holds(folder):
    claim = ("(68, 256)", "(99999999, 99999)")
    data = npy(np.zeros((68, 256), np.float32))
    rezip(folder, weight_0=data.replace((claim[0] + ", }").ljust(40).encode(), (claim[1] + ", }").ljust(40).encode()))


def many_members(folder):
    rezip(folder, **{f"more_{k}": b"" for k in range(1000)})


def sizes_that_no_memory_holds(folder):
    rewrite(folder, network={"sizes": [68] + 30 * [4096] + [3], "activation": "tanh", "output": "linear"})


def an_alias_bomb(folder):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, 12)]
    (folder / TEXT).write_text("\n".join([*lines, "format: *a11"]))


def deep(folder):
    (folder / TEXT).write_text("format: " + 20_000 * "[")


def a_long_text(folder):
    (folder / TEXT).write_text("format: [" + 5_000_000 * "1," + "]")


BOMBS = {
    big: "weight_0.npy would unpack to 120000000 bytes, its shape (68, 256) says 69632",
    big_and_said_to_be_small: "tensors.npz does not hold the layers of a network: ",
    packed_otherwise: "weight_0.npy would unpack to",
    a_shape_that_no_memory_holds: "weight_0.npy must be float32 (68, 256), got float32 (99999999, 99999) in",
    many_members: "layers of sizes [68, 256, 256, 3] were noted, members are",
    sizes_that_no_memory_holds: "more than 50000000",
    an_alias_bomb: "line 2: an alias",
    deep: "line 1: nested more than 20 deep",
    a_long_text: f"more than {MOST_BYTES} bytes",
}


SCRIPT = """
import resource, sys
from pathlib import Path
from agents.agent_file import read_agent

with open("/proc/self/statm") as file:
    taken = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + 100_000_000,) * 2)
used = int(sum(resource.getrusage(resource.RUSAGE_SELF)[:2]))
resource.setrlimit(resource.RLIMIT_CPU, (used + 8,) * 2)
for folder in sys.argv[1:]:
    try:
        read_agent(Path(folder))
    except ValueError as error:
        print(error)
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs the limits of Linux")
def test_bombs_are_refused_in_little_time_and_memory(folder, tmp_path):
    """In a process that may use 8 s of the processor for all and 100 MB beyond what importing takes."""
    folders = [shutil.copytree(folder, tmp_path / bomb.__name__) for bomb in BOMBS]
    for bomb, copy in zip(BOMBS, folders, strict=True):
        bomb(copy)
    command = [sys.executable, "-c", SCRIPT, *map(str, folders)]
    run = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert (run.returncode, run.stderr) == (0, "")
    for (bomb, message), copy, line in zip(BOMBS.items(), folders, run.stdout.splitlines(), strict=True):
        assert line.startswith(f"{copy / TEXT}: "), bomb
        assert message in line


def text(words):
    return lambda folder: (folder / TEXT).write_text(words)


def changed(**changes):
    return lambda folder: rewrite(folder, **changes)


def members(**arrays):
    return lambda folder: rezip(folder, **{name: None if data is None else npy(data) for name, data in arrays.items()})


def cut(name, size):
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:size])


def instead(name, make):
    """Put something else where a file is."""

    def harm(folder):
        (folder / name).unlink()
        make(folder / name)

    return harm


def resigned(folder):
    """Half of an archive, rightly signed."""
    data = (folder / TENSORS).read_bytes()[:5000]
    (folder / TENSORS).write_bytes(data)
    rewrite(folder, tensors={"file": TENSORS, "sha256": hashlib.sha256(data).hexdigest()})


NAN = np.full((68, 256), np.nan, np.float32)
FOREIGN = {
    "truncated tensors": (cut(TENSORS, 5000), "damaged or another one"),
    "truncated and signed": (resigned, "does not hold the layers"),
    "no tensors": (lambda folder: (folder / TENSORS).unlink(), "are missing"),
    "missing member": (members(bias_1=None), "were noted, members are"),
    "another member": (members(more=np.zeros(3)), "were noted, members are"),
    "wrong shape": (members(bias_0=np.zeros(255, np.float32)), "bias_0.npy must be float32 (256,), got float32 (255,)"),
    "wrong type": (members(bias_0=np.zeros(256, np.float16)), "bias_0.npy must be float32 (256,), got float16"),
    "pickled": (members(bias_2=np.array([{}] * 3)), "bias_2.npy must be float32 (3,), got object (3,)"),
    "not numbers": (members(weight_0=NAN), "layer 0 holds numbers that are not finite"),
    "infinite": (members(bias_2=np.full(3, np.inf, np.float32)), "layer 2 holds numbers that are not finite"),
    "no array": (lambda folder: rezip(folder, bias_2=b"x"), "does not hold the layers"),
    "python tag": (text("format: !!python/object/apply:os.mkdir [ran]"), "could not determine a constructor"),
    "wrong tag": (text("format: !!timestamp x"), "no YAML"),
    "empty text": (text(""), "not an agent"),
    "a list": (text("[1, 2]"), "not an agent"),
    "twice": (text("format: a\nversion: 1\nformat: b"), "'format' stands there twice"),
    "truncated text": (cut(TEXT, 40), "no YAML: line 3: could not find expected"),
    "binary text": (lambda folder: (folder / TEXT).write_bytes(b"\xff\x00\xfe"), "no YAML"),
    "a huge number": (text(f"format: {9 * 10**4000}9999999999999999"), "not an agent"),
    "name of numbers": (changed(name=[1]), '"name" must be a text, got [1]'),
    "notes of numbers": (changed(notes=3), '"notes" must be a mapping, got 3'),
    "no sizes": (changed(network={}), "sizes must be whole numbers from 1 to 4096"),
    "negative sizes": (changed(network={"sizes": [68, -1, 3]}), "sizes must be whole numbers from 1 to 4096"),
    "other sizes": (changed(network={"sizes": [68, 4096, 3]}), "members are"),
    "other tensors": (changed(tensors={"file": "../../x"}), "its tensors x are missing"),
    "text is a folder": (instead(TEXT, os.mkdir), "not a trained agent"),
    "tensors are a folder": (instead(TENSORS, os.mkdir), "are missing"),
    "text is endless": (instead(TEXT, lambda path: path.symlink_to("/dev/zero")), "not a trained agent"),
    "tensors are endless": (instead(TENSORS, lambda path: path.symlink_to("/dev/zero")), "are missing"),
    "a link to itself": (instead(TENSORS, lambda path: path.symlink_to(path)), "are missing"),
    "tensors are a pipe": (instead(TENSORS, os.mkfifo), "are missing"),
}


@pytest.mark.skipif(sys.platform == "win32", reason="needs links and pipes")
@pytest.mark.parametrize("case", FOREIGN)
def test_a_folder_that_is_no_agent_is_told_in_one_line(folder, capsys, monkeypatch, tmp_path, case):
    monkeypatch.chdir(tmp_path)
    harm, message = FOREIGN[case]
    harm(folder)
    assert (
        main(
            ["fly", "--policy", str(folder), "--mission", "air-to-water", "--no-figures", "--out", str(tmp_path / "o")]
        )
        == 2
    )
    printed = capsys.readouterr()
    (line,) = [line for line in printed.err.splitlines() if "compiling" not in line]
    assert line.startswith("hydrone: error: ")
    assert message in line
    assert len(line) < 700
    assert not (tmp_path / "ran").exists()
    assert not (tmp_path / "o").exists()


def test_a_link_to_an_agent_is_one(folder, tmp_path):
    (tmp_path / "link").symlink_to(folder)
    assert read_agent(tmp_path / "link").name == "good"


def test_plain_data_comes_back(tmp_path):
    """Also what stands in two places, which YAML would write as an alias."""
    shared = {"a": [1, 2.5, None, "x: y"]}
    (tmp_path / "x.yaml").write_text(to_yaml({"one": shared, "two": shared}))
    assert read_yaml(tmp_path / "x.yaml") == {"one": shared, "two": shared}


def test_what_cannot_be_read_again_is_not_made():
    wide = network(
        weights=(np.zeros((68, 5000), np.float32), np.zeros((5000, 3), np.float32)),
        biases=(np.zeros(5000, np.float32), np.zeros(3, np.float32)),
    )
    with pytest.raises(ValueError, match="sizes must be whole numbers from 1 to 4096"):
        AgentFile(name="wide", algorithm="PPO", environment=ID, network=wide)
