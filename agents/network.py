"""A multilayer perceptron in float32, as a kernel: a row's output does not depend on the rows beside it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hydrone_gym._jit import kernel

_ACTIVATIONS: dict[str, Callable[[NDArray], NDArray]] = {
    "linear": lambda x: x,
    "relu": lambda x: np.maximum(x, np.float32(0.0)),
    "tanh": np.tanh,
}


@kernel
def _dense(x: NDArray, weights: NDArray, bias: NDArray, out: NDArray) -> None:
    """Write x W + b; x (n, i), weights (i, o), bias (o,), out (n, o), all float32.

    Sums run over inputs in order, whatever n is: a matrix product of a library would group them by the size of the
    batch, and a flight would depend on how many fly beside it.
    """
    for n in range(x.shape[0]):
        for j in range(bias.size):
            out[n, j] = bias[j]
        for i in range(x.shape[1]):
            value = x[n, i]
            for j in range(bias.size):
                out[n, j] += value * weights[i, j]


@dataclass(frozen=True, kw_only=True, eq=False)
class Network:
    """Layers with an activation between them.

    Raises ValueError for layers that do not fit each other, numbers that are not finite, an unknown activation.
    """

    weights: tuple[NDArray[np.float32], ...]  # (inputs, outputs) float32 of each layer
    biases: tuple[NDArray[np.float32], ...]  # (outputs,) float32 of each layer
    activation: str  # "tanh" or "relu", after every layer but the last
    output: str  # "linear", or "tanh" for policies that squash

    def __post_init__(self) -> None:
        """Check that the layers fit."""
        if self.activation not in ("tanh", "relu") or self.output not in ("linear", "tanh"):
            raise ValueError(f"unknown activation {self.activation!r} or output {self.output!r}")
        if not self.weights or len(self.weights) != len(self.biases):
            raise ValueError("a network needs as many biases as weights, and at least one")
        width = self.weights[0].shape[0]
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases)):
            if weight.dtype != np.float32 or bias.dtype != np.float32:
                raise ValueError(f"layer {k} must be float32, got {weight.dtype} and {bias.dtype}")
            if weight.ndim != 2 or bias.shape != weight.shape[1:] or weight.shape[0] != width:
                raise ValueError(f"layer {k} does not fit: weights {weight.shape}, bias {bias.shape}, inputs {width}")
            if not (np.isfinite(weight).all() and np.isfinite(bias).all()):
                raise ValueError(f"layer {k} holds numbers that are not finite")
            width = weight.shape[1]

    @property
    def sizes(self) -> list[int]:
        """Inputs of the first layer, then the outputs of each."""
        return [self.weights[0].shape[0], *(len(bias) for bias in self.biases)]

    def __call__(self, x: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the output (n, outputs) for inputs (n, inputs), both float32."""
        values = np.ascontiguousarray(x, np.float32)
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases)):
            out = np.empty((len(values), len(bias)), np.float32)
            _dense(values, weight, bias, out)
            values = _ACTIVATIONS[self.output if k == len(self.weights) - 1 else self.activation](out)
        return values
