"""Rows in weather without an environment: their conditions, and the two ways to advance them."""

import numpy as np

from hydrone_gym.simulation.conditions import CONDITIONS, begin_conditions, climate_of
from hydrone_gym.simulation.simulation import Simulation
from hydrone_gym.vehicle import HYDRONE
from hydrone_gym.weather import Weather
from tests.simulation.batches import lane_major

DEPTH = 5.0


def conditions_for(rows, lanes, weather=None, *, vehicle=HYDRONE, spread=None, seed=0):
    """Conditions of rows that stand where their episodes begin; row i draws from its own key."""
    weather = weather or Weather()
    blocks = -(-len(rows) // lanes)
    conditions, order = np.zeros((blocks, CONDITIONS * lanes)), np.arange(len(rows))
    streams = np.random.default_rng(seed).integers(0, 2**32, (len(rows), 3)).astype(np.float64)
    climates = climate_of(vehicle, weather, weather.spread if spread is None else spread, DEPTH)[None]
    begin_conditions(conditions, lanes, rows, order, streams, climates, np.zeros(len(rows), np.int64))
    return conditions


def play_in_weather(simulation: Simulation, rows, references, conditions, obstacles=None):
    """Advance rows through (K, n, 4) references; return them, and each row's distances to its spheres (n, M)."""
    n, lanes = len(rows), simulation.lanes
    spheres = np.zeros((n, 0, 4)) if obstacles is None else obstacles
    count = spheres.shape[1]
    rows = rows.copy()
    flat = lane_major(spheres, lanes)
    closest = np.full((len(flat), count * lanes), np.inf)
    for reference in references:
        simulation.advance(rows, np.ascontiguousarray(reference), flat, closest, count, weather=conditions)
    near = closest.reshape(len(flat), count, lanes).transpose(0, 2, 1)
    return rows, near.reshape(len(flat) * lanes, count)[:n]
