"""Kinds in memory: what is written is read, wherever and however far apart its numbers lie."""

from typing import NamedTuple

import numpy as np
import pytest
from numba import types
from numba.core.errors import TypingError

from hydrone_gym import _memory
from hydrone_gym._jit import kernel, unit
from hydrone_gym._memory import call, gather, packed, pointer, scatter, select, shifted, view, zero_like


class Pair(NamedTuple):
    x: float
    y: float


class Nest(NamedTuple):
    first: Pair
    middle: float
    last: Pair


@kernel
def move(source, at, i, stride, target):
    nest = gather(source, at, i, stride, Nest)
    scatter(target, at, i, stride, Nest(nest.last, 2.0 * nest.middle, nest.first))


@kernel
def look(memory, at):
    nest = view(memory, at, Nest)
    nest_sum = nest.first.x + 10.0 * nest.middle + 100.0 * nest.last.y
    return nest_sum, pointer(memory)[0], shifted(memory, 2)[1]


@kernel
def choose(condition, numbers):
    nest = gather(numbers, 0, 0, 1, Nest)
    return select(condition > 0.0, nest, Nest(nest.last, 0.0, nest.first))


@kernel
def call_it(address, numbers):
    call(address, numbers, numbers.size)


@pytest.mark.parametrize(("at", "i", "stride"), [(0, 0, 1), (2, 0, 1), (0, 3, 4), (1, 2, 5)])
def test_numbers_lie_where_they_are_said_to(at, i, stride):
    source, target = np.arange(64.0), np.full(64, -1.0)
    move(source, at, i, stride, target)
    a, b, c, d, e = (float((at + k) * stride + i) for k in range(5))
    expected = np.full(64, -1.0)
    expected[[int(a), int(b), int(c), int(d), int(e)]] = [d, e, 2.0 * c, a, b]
    np.testing.assert_array_equal(target, expected)


def test_views_read_one_number():
    memory = np.arange(20.0)
    assert look(memory, 3) == (3.0 + 10.0 * 5.0 + 100.0 * 7.0, 0.0, 3.0)
    memory[3] = np.nan  # not looked at through any other field
    assert np.isnan(look(memory, 3)[0])


def test_layout():
    nest = Nest(Pair(1.0, 2.0), 3.0, Pair(4.0, 5.0))
    np.testing.assert_array_equal(packed(nest), [1, 2, 3, 4, 5])
    assert _memory.size_of(Nest) == 5
    assert _memory.offsets_of(Nest) == (0, 2, 3)
    assert [(name, *shape) for name, _, *shape in _memory.fields_of(Nest)] == [
        ("first", (2,)),
        ("middle",),
        ("last", (2,)),
    ]


@kernel
def nothing(numbers):
    return zero_like(gather(numbers, 0, 0, 1, Nest))


def test_zero_of_a_kind():
    zero = nothing(np.arange(1.0, 6.0))
    assert packed(zero).tolist() == [0.0] * 5
    assert zero._fields == Nest._fields


def test_select_takes_all_of_one():
    numbers = np.arange(1.0, 6.0)
    assert packed(choose(1.0, numbers)).tolist() == [1, 2, 3, 4, 5]
    assert packed(choose(-1.0, numbers)).tolist() == [4, 5, 0, 1, 2]


def test_a_unit_is_called_by_its_address():
    def triple(numbers, count):
        for k in range(count):
            numbers[k] *= 3.0

    compiled = unit(types.void(types.CPointer(types.float64), types.int64), triple, "hydrone_gym._memory")
    numbers = np.arange(4.0)
    call_it(compiled.address, numbers)
    np.testing.assert_array_equal(numbers, [0.0, 3.0, 6.0, 9.0])


def test_only_numbers_are_written():
    @kernel
    def write(memory, value):
        scatter(memory, 0, 0, 1, value)

    write(np.zeros(3), 1.0)
    with pytest.raises(TypingError):
        write(np.zeros(3), True)
