"""Reads a replay page: what its timeline does, message by message."""

import base64
import re
from typing import NamedTuple

import msgspec
import numpy as np
import zstandard


class Timeline(NamedTuple):
    """The recording of a page."""

    seconds: float
    messages: list  # (time in s, message)
    buffers: list  # bytes

    def values(self, node, name):
        """Return what a property or attribute of a node is set to, and when: [(time, value)]."""
        found = []
        for time, message in self.messages:
            if message.get("name") != node:
                continue
            for part in (message, message.get("props", {}), message.get("updates", {})):
                if name in part:
                    found.append((time, self._array(part[name])))
        return found

    def at(self, time, node, name):
        """Return the value in force at a time (s)."""
        return [value for when, value in self.values(node, name) if when <= time + 1e-6][-1]

    def _array(self, value):
        if isinstance(value, dict) and "__binary_index" in value:
            return np.frombuffer(self.buffers[value["__binary_index"]], value["dtype"])
        return value


def read_page(path):
    """Return the text and the timeline of a page."""
    text = path.read_text(encoding="utf-8")
    packed = base64.b64decode(re.search(r'__VISER_EMBED_DATA__="([^"]+)"', text)[1])
    size = int.from_bytes(packed[:8], "little")
    content = zstandard.ZstdDecompressor().decompress(packed[8:], max_output_size=size)
    end = 8 + int.from_bytes(content[:8], "little")
    recording = msgspec.msgpack.decode(content[8:end])
    buffers = []
    for length in recording["binaryBufferLengths"]:
        begin = -(-end // 8) * 8
        end = begin + length
        buffers.append(content[begin:end])
    return text, Timeline(recording["durationSeconds"], recording["messages"], buffers)
