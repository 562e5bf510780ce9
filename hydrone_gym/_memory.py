"""How kernels read and write named tuples of numbers: in arrays, in records, and across calls by address.

A *kind* is a `NamedTuple` class whose fields are numbers or kinds again; in memory it is its numbers one after the
other, or a stride apart: a block of lanes holds number k of lane i at ``k * lanes + i``. So what is stored is declared
once, as a class, and nobody spells its fields a second time: not the row of an episode, not the lane of a block, not
the model that Python packs, not the node of a tree.

All of this is one instruction a number in the machine code and one statement for the compiler's front end, where most
of the time of a first compilation goes.
"""

import functools
import itertools
import typing
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
from numpy.typing import NDArray

_DOUBLE, _LONG, _BYTE = ir.DoubleType(), ir.IntType(64), ir.IntType(8)


@functools.cache
def size_of(kind: type) -> int:
    """Count the numbers of a kind."""
    return sum(size_of(part) if _is_kind(part) else 1 for part in _parts(kind))


def offsets_of(kind: Any) -> Any:
    """Return a kind whose entries say after how many numbers each field begins."""
    sizes = [size_of(part) if _is_kind(part) else 1 for part in _parts(kind)]
    return kind(*(sum(sizes[:k]) for k in range(len(sizes))))


def fields_of(kind: type) -> list[tuple]:
    """Return the fields of a kind for a structured dtype: kinds become arrays of their numbers."""
    fields: list[tuple] = []
    for name, part in zip(kind._fields, _parts(kind), strict=True):  # type: ignore[attr-defined]
        fields.append((name, np.float64, (size_of(part),)) if _is_kind(part) else (name, np.float64))
    return fields


def packed(value: Any) -> NDArray[np.float64]:
    """Return the numbers of a kind, nested ones in their place: Python hands an array to a kernel fastest."""
    numbers: list[float] = []
    for entry in value:
        numbers.extend(packed(entry) if isinstance(entry, tuple) else [float(entry)])
    return np.array(numbers)


def unpacked(kind: Any, numbers: NDArray[np.float64]) -> Any:
    """Return the kind whose numbers these are, the inverse of `packed`."""
    left = iter(numbers.tolist())

    def build(part: Any) -> Any:
        return part(*(build(inner) if _is_kind(inner) else next(left) for inner in _parts(part)))

    return build(kind)


@functools.cache
def _parts(kind: Any) -> list[Any]:
    hints = typing.get_type_hints(kind)
    return [hints.get(name, float) for name in kind._fields]


def _is_kind(part: Any) -> bool:
    return isinstance(part, type) and issubclass(part, tuple)


@functools.cache
def _numba_type(kind: Any) -> Any:
    return types.BaseTuple.from_types([_numba_type(p) if _is_kind(p) else types.float64 for p in _parts(kind)], kind)


def _readable(kind: Any) -> bool:
    """Whether memory holds float64 numbers one after the other; anything else would be read as garbage."""
    return not isinstance(kind, types.Array) or (kind.layout == "C" and kind.dtype == types.float64)


def _start(builder: Any, kind: Any, value: Any) -> Any:
    """Pointer to the first number of an array, a record, or where a pointer leads."""
    if isinstance(kind, types.Array):
        value = builder.extract_value(value, 4)  # parent, meminfo, items, itemsize, data
    return builder.bitcast(value, _DOUBLE.as_pointer())


def _place(builder: Any, base: Any, place: Any, k: int) -> Any:
    """Pointer to number k of a kind at a place (at, i, stride)."""
    at, i, stride = place
    field = builder.mul(builder.add(at, ir.Constant(_LONG, k), flags=["nsw"]), stride, flags=["nsw"])
    return builder.gep(builder.gep(base, [field], inbounds=True), [i], inbounds=True)


def _further(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Code of an intrinsic (memory, count, ...): pointer to what lies a number of float64 further on."""
    return builder.gep(_start(builder, sig.args[0], args[0]), [args[1]], inbounds=True)


class View(types.Type):
    """Where a kind lies one number after the other: ``view.name`` reads a field when it is asked for, and no other."""

    def __init__(self, kind: type) -> None:
        """Remember the kind."""
        self.kind = kind
        super().__init__(name=f"View({kind.__module__}.{kind.__qualname__})")


@register_model(View)
class _ViewModel(models.PrimitiveModel):
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _DOUBLE.as_pointer())


def _field(kind: Any, name: str) -> tuple[int, Any]:
    """After how many numbers a field begins, and its Numba type."""
    part = _parts(kind)[kind._fields.index(name)]
    return offsets_of(kind)[kind._fields.index(name)], View(part) if _is_kind(part) else types.float64


@infer_getattr
class _ViewFields(AttributeTemplate):
    key = View

    def generic_resolve(self, view, name):
        return _field(view.kind, name)[1] if name in view.kind._fields else None


@lower_getattr_generic(View)
def _read_field(context, builder, view, value, name):
    offset, kind = _field(view.kind, name)
    place = builder.gep(value, [ir.Constant(_LONG, offset)], inbounds=True)
    return place if isinstance(kind, View) else builder.load(place, align=8)


@intrinsic
def view(typingctx, memory, at, kind):
    """Look at memory, from number `at` on, as a kind; see `View`."""
    if not _readable(memory):
        return None

    return View(kind.instance_class)(memory, types.intp, kind), _further


@intrinsic
def pointer(typingctx, memory):
    """Pointer to the float64 numbers of an array or of a record: ``p[k]`` reads and writes, unchecked."""
    if not _readable(memory):
        return None
    result = types.CPointer(types.float64)
    return result(memory), lambda context, builder, sig, args: _start(builder, sig.args[0], args[0])


@intrinsic
def shifted(typingctx, memory, count):
    """Pointer to what lies a number of float64 further on."""
    if not _readable(memory):
        return None
    result = types.CPointer(types.float64)

    return result(memory, types.intp), _further


@intrinsic
def gather(typingctx, memory, at, i, stride, kind):
    """Read a kind, or a float: its number k lies at index ``(at + k) * stride + i``."""
    if not _readable(memory):
        return None
    result = _numba_type(kind.instance_class) if isinstance(kind, types.NamedTupleClass) else types.float64

    def read(context, builder, wanted, take):
        if not isinstance(wanted, types.BaseTuple):
            return take()
        return context.make_tuple(builder, wanted, [read(context, builder, part, take) for part in wanted])

    def code(context, builder, sig, args):
        base, count = _start(builder, sig.args[0], args[0]), itertools.count()
        take = lambda: builder.load(_place(builder, base, args[1:4], next(count)), align=8)  # noqa: E731
        return read(context, builder, result, take)

    return result(memory, types.intp, types.intp, types.intp, kind), code


def _flat(builder: Any, kind: Any, value: Any) -> list[Any]:
    """The numbers of a tuple, nested ones in their place."""
    if not isinstance(kind, types.BaseTuple):
        return [value]
    parts = [builder.extract_value(value, k) for k in range(len(kind))]
    return [number for part, entry in zip(kind, parts) for number in _flat(builder, part, entry)]


@intrinsic
def scatter(typingctx, memory, at, i, stride, value):
    """Write a named tuple, or a float: its number k goes to index ``(at + k) * stride + i``."""
    writable = _readable(memory) and getattr(memory, "mutable", True)
    if not writable or any(t != types.float64 for t in _leaves(value)):
        return None

    def code(context, builder, sig, args):
        base = _start(builder, sig.args[0], args[0])
        for k, number in enumerate(_flat(builder, sig.args[4], args[4])):
            builder.store(number, _place(builder, base, args[1:4], k), align=8)
        return context.get_dummy_value()

    return types.none(memory, types.intp, types.intp, types.intp, value), code


def _leaves(kind: Any) -> list[Any]:
    return [leaf for part in kind for leaf in _leaves(part)] if isinstance(kind, types.BaseTuple) else [kind]


@intrinsic
def select(typingctx, condition, value, otherwise):
    """Choose between two named tuples of one kind without a branch, which keeps a loop over lanes vectorised."""
    if value != otherwise:
        return None

    def choose(context, builder, kind, condition, a, b):
        if not isinstance(kind, types.BaseTuple):
            return builder.select(condition, a, b)
        pairs = zip(kind, _entries(builder, a, len(kind)), _entries(builder, b, len(kind)))
        return context.make_tuple(builder, kind, [choose(context, builder, k, condition, x, y) for k, x, y in pairs])

    def code(context, builder, sig, args):
        return choose(context, builder, sig.return_type, *args)

    return value(types.boolean, value, value), code


@intrinsic
def zero_like(typingctx, value):
    """A tuple of the same kind, all of whose numbers are zero."""
    return value(value), lambda context, builder, sig, args: context.get_constant_null(sig.return_type)


@intrinsic
def call(typingctx, address, *arguments):
    """Call a `hydrone_gym._jit.unit` by its address; arrays and records are handed over as pointers to their data."""
    if not all(map(_readable, arguments)):
        return None

    def code(context, builder, sig, args):
        given = []
        for kind, value in zip(sig.args[1], _entries(builder, args[1], len(sig.args[1]))):
            number = isinstance(kind, types.Integer)
            given.append(value if number else builder.bitcast(_start(builder, kind, value), _BYTE.as_pointer()))
        kinds = [value.type for value in given]
        function = builder.inttoptr(args[0], ir.FunctionType(ir.VoidType(), kinds).as_pointer())
        builder.call(function, given)
        return context.get_dummy_value()

    return types.none(types.intp, types.StarArgTuple.from_types(arguments)), code


def _entries(builder: Any, value: Any, count: int) -> list[Any]:
    return [builder.extract_value(value, k) for k in range(count)]
