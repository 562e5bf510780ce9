"""The weather of an environment's rows, and their vehicles as they are: what is drawn when an episode begins."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hydrone_gym.envs.options import Options
from hydrone_gym.simulation.conditions import (
    CONDITIONS,
    begin_conditions,
    climate_of,
    key_of,
    weather_at,
)
from hydrone_gym.simulation.simulation import STILL
from hydrone_gym.weather import Weather
from hydrone_gym.world.scenario import Scenario


class Outdoors:
    """The `Conditions` of a batch of rows; nothing at all while every episode is of the nominal vehicle in still air.

    An episode's weather comes from the seed of its row's generator and from how many episodes that row has begun since,
    never from the generator itself: the worlds of a seed are the same in every weather.
    """

    def __init__(self, options: Options, count: int, lanes: int) -> None:
        """Make room, if the options ask for weather."""
        self.conditions: NDArray[np.float64] = STILL
        self.extra: type | None = None  # class of the disturbance that the kernel knows
        self.streams = np.zeros((count, 3))  # the key of a row's episodes, two numbers, and how many have begun
        self.reseeded = np.ones(count, bool)  # rows whose stream is still to come from their generator's seed
        self._options, self._count, self._lanes = options, count, lanes
        self._weathers: list[Weather] = []  # that episodes are drawn from, the first one that of the options
        self._climates = np.zeros((0, 0))  # the same, packed
        if options.weathered:
            self._open(options.the_weather)

    @property
    def weathered(self) -> bool:
        """Whether rows have `Conditions`."""
        return self.conditions.size > 0

    def _open(self, weather: Weather) -> None:
        """Make room for weather such as this one."""
        if not self.weathered:
            self.conditions = np.zeros((-(-self._count // self._lanes), CONDITIONS * self._lanes))
        self._climate(self._options.the_weather)
        self.extra = self.extra if weather.extra is None else type(weather.extra)

    def admit(self, rows: np.ndarray, scenarios: Sequence[Scenario | None]) -> bool:
        """Make room for what scenarios carry; return whether that asks for another kernel or other memory.

        Where there was no weather, rows that are on their way go on in still air. Raises ValueError for disturbances of
        more than one class.
        """
        weathers = [each.weather for each in scenarios if each is not None and each.weather is not None]
        known = self.extra
        for weather in weathers:
            kind = known if weather.extra is None else type(weather.extra)
            if known is not None and kind is not known:
                raise ValueError(f"a scenario's disturbance must be a {known.__name__} here, got {weather.extra!r}")
            known = kind
        before = self.weathered, self.extra
        for weather in weathers:
            self._open(weather)
        if self.weathered and not before[0]:
            every = np.arange(self._count)
            self._draw(rows, every, np.zeros_like(every))
        return (self.weathered, self.extra) != before

    def begin(
        self,
        rows: np.ndarray,
        order: NDArray[np.int64],
        generators: Sequence[np.random.Generator],
        scenarios: Sequence[Scenario | None],
    ) -> None:
        """Draw weather and vehicles of the episodes that rows `order` (k,) begin, in what their `scenarios` carry."""
        new = order[self.reseeded[order]]
        if new.size:
            self.streams[new] = [(*key_of(generators[row]), 0.0) for row in new.tolist()]
            self.reseeded[new] = False
        if self.weathered:
            which = np.zeros(len(order), np.int64)
            for k, scenario in enumerate(scenarios):
                if scenario is not None and scenario.weather is not None:
                    which[k] = self._climate(scenario.weather)
            self._draw(rows, order, which)
        self.streams[order, 2] += 1.0

    def _draw(self, rows: np.ndarray, order: NDArray[np.int64], which: NDArray[np.int64]) -> None:
        begin_conditions(self.conditions, self._lanes, rows, order, self.streams, self._climates, which)

    def _climate(self, weather: Weather) -> int:
        """Index of a weather among those that episodes are drawn from."""
        if weather not in self._weathers:
            spread, depth = self._options.spread_in(weather), -self._options.world.lower[2]
            climate = climate_of(self._options.the_vehicle, weather, spread, depth)
            self._climates = np.vstack([*self._climates, climate])
            self._weathers.append(weather)
        return self._weathers.index(weather)

    def of_row(self, row: int) -> NDArray[np.float64]:
        """Return a row's conditions as those of a single environment, (1, CONDITIONS); empty without weather."""
        if not self.weathered:
            return STILL
        block = self.conditions[row // self._lanes].reshape(CONDITIONS, self._lanes)
        return block[:, row % self._lanes].reshape(1, -1).copy()

    def weather(self) -> dict[str, NDArray[np.float64]]:
        """Return what moves around all rows as of the last tick, see `weather_at`; nothing without weather."""
        return weather_at(self.conditions, self._lanes, self._count) if self.weathered else {}

    def restore(self, kept: NDArray[np.float64], extra: type | None, streams: NDArray[np.float64]) -> None:
        """Go back to what a snapshot kept: conditions, empty where there were none, their disturbance, and streams."""
        self.conditions, self.extra = kept.copy() if kept.size else STILL, extra
        self.streams[:], self.reseeded[:] = streams, False
        if kept.size:
            self._climate(self._options.the_weather)
