"""MCAP files: what is read back is the flight, in messages that Foxglove knows."""

import sys
from datetime import UTC, datetime

import gymnasium as gym
import numpy as np
import pytest
from google.protobuf.json_format import MessageToDict
from gymnasium.error import DependencyNotInstalled
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

import hydrone_gym  # noqa: F401
from hydrone_gym import Weather
from hydrone_gym.evaluation import fly
from hydrone_gym.rendering.foxglove import write_mcap
from hydrone_gym.rendering.outdoors import CURRENT_SCALE, WIND_SCALE
from planners import CLRRT, StraightLine, TreeRecorder

TITLE = "Air to water, seed 12"
STORM = Weather(wind=4.0, current=0.3, wave_height=0.4, wave_period=2.5, sea="jonswap")
PLAIN = {"preserving_proto_field_name": True, "always_print_fields_with_no_presence": True}
KINDS = {"/vehicle": "FrameTransform", "/reference": "PoseInFrame", "/goal": "PoseInFrame", "/scene": "SceneUpdate"}


class Recording:
    """What an MCAP file holds: of each topic its times (ns) and messages, its schemas, its metadata."""

    def __init__(self, path):
        self.topics, self.names = {}, {}
        with path.open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory()])  # by the schemas in the file
            for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
                assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
                told = MessageToDict(decoded, **PLAIN)
                self.topics.setdefault(channel.topic, []).append((message.log_time, told))
                self.names[channel.topic] = schema.name
            ((self.metadata),) = [record.metadata for record in reader.iter_metadata()]

    def times(self, topic):
        return [time for time, _ in self.topics[topic]]

    def messages(self, topic):
        return [message for _, message in self.topics[topic]]

    def entity(self, topic, name, time):
        """Return the entity of a name that is shown at a time (s)."""
        updates = [message["entities"] for when, message in self.topics[topic] if when <= 1e9 * time + 1]
        return [entity for entities in updates for entity in entities if entity["id"] == name][-1]


def numbers(part):
    """The numbers of a vector or a quaternion, or of a list of them."""
    return np.array([numbers(p) for p in part] if isinstance(part, list) else [part[k] for k in "xyzw" if k in part])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A flight of the CL-RRT, its trees, its environment, and what was read back."""
    env = gym.make("HydroneGym/AirToWater-v0")
    recorder = TreeRecorder(CLRRT.for_env(env, seed=12))
    flight = fly(env, recorder, seed=12)
    path = tmp_path_factory.mktemp("mcap") / "flight.mcap"
    write_mcap(flight, env.unwrapped.simulation, path, title=TITLE, trees=recorder.trees)
    return flight, recorder.trees, env, Recording(path)


@pytest.fixture(scope="module")
def stormy(tmp_path_factory):
    """A flight in weather and what was read back of it."""
    env = gym.make("HydroneGym/AirToWater-v0", weather=STORM, num_obstacles=3)
    flight = fly(env, StraightLine.for_env(env), seed=2)
    path = tmp_path_factory.mktemp("mcap") / "storm.mcap"
    write_mcap(flight, env.unwrapped.simulation, path, title="")
    return flight, Recording(path)


def test_messages_have_the_names_that_foxglove_knows(written, stormy):
    names = {topic: f"foxglove.{kind}" for topic, kind in KINDS.items()}
    assert written[-1].names == {**names, "/tree": "foxglove.SceneUpdate"}
    weather = {"/weather/scene": "foxglove.SceneUpdate", "/weather/surface": "foxglove.PoseInFrame"}
    weather |= dict.fromkeys(("/weather/wind", "/weather/water"), "foxglove.Vector3")
    assert stormy[-1].names == {**names, **weather}


def test_every_tick_is_there_at_its_time(written):
    flight, _, _, recording = written
    ticks = [round(50_000_000 * k) for k in range(len(flight.trace.times))]
    for topic in ("/vehicle", "/reference"):
        assert recording.times(topic) == ticks
        stamps = [datetime.fromisoformat(message["timestamp"]) for message in recording.messages(topic)]
        since = [stamp - datetime(1970, 1, 1, tzinfo=UTC) for stamp in stamps]
        assert [round(1e9 * passed.total_seconds()) for passed in since] == ticks
    assert recording.times("/goal") == [0]
    assert all(np.all(np.diff(recording.times(topic)) > 0) for topic in recording.topics)
    assert ticks[-1] == pytest.approx(1e9 * flight.time)
    assert recording.metadata == {"title": TITLE, "outcome": "GOAL", "time": f"{flight.time:g}"}


def test_vehicle_reference_and_goal_are_where_they_were(written):
    flight, _, _, recording = written
    frames = [(m["parent_frame_id"], m["child_frame_id"]) for m in recording.messages("/vehicle")]
    assert set(frames) == {("world", "vehicle")}
    places = numbers([message["translation"] for message in recording.messages("/vehicle")])
    np.testing.assert_array_equal(places, flight.trace.states[:, :3])
    turns = Rotation.from_quat(numbers([message["rotation"] for message in recording.messages("/vehicle")]))
    np.testing.assert_allclose(turns.as_euler("ZXY"), flight.trace.states[:, [5, 3, 4]], atol=1e-9)
    poses = [message["pose"] for message in recording.messages("/reference")]
    np.testing.assert_array_equal(numbers([pose["position"] for pose in poses]), flight.trace.references[:, :3])
    yaws = Rotation.from_quat(numbers([pose["orientation"] for pose in poses])).as_euler("ZXY")
    np.testing.assert_allclose(yaws, flight.trace.references[:, [3]] * [1.0, 0.0, 0.0], atol=1e-9)
    (goal,) = recording.messages("/goal")
    assert tuple(numbers(goal["pose"]["position"])) == flight.scenario.goal


def test_obstacles_darken_when_the_flight_detects_them(written):
    flight, _, env, recording = written
    observation, _ = env.reset(options={"scenario": flight.scenario})
    seen = 0
    for period in range(len(flight.references) + 1):
        known = observation["obstacles"][observation["obstacles"][:, 3] > 0.0]
        for k, sphere in enumerate(flight.scenario.obstacles):
            (drawn,) = recording.entity("/scene", f"obstacle {k}", min(0.5 * period, flight.time))["spheres"]
            np.testing.assert_array_equal(numbers(drawn["pose"]["position"]), sphere[:3])
            np.testing.assert_array_equal(numbers(drawn["size"]), 2.0 * sphere[3])
            assert (drawn["color"]["a"] == 1.0) == (known == sphere).all(axis=1).any()
        seen = len(known)
        if period < len(flight.references):
            observation, *_ = env.step(flight.references[period])
    assert 3 < seen < len(flight.scenario.obstacles)


def test_the_path_grows_period_by_period(written):
    flight, _, _, recording = written
    periods = len(flight.references)
    for period in (0, 7, periods - 1):
        (line,) = recording.entity("/scene", f"path {period}", flight.time)["lines"]
        flown = flight.trace.states[10 * period : 10 * period + 11, :3]
        np.testing.assert_allclose(numbers(line["points"]), flown, atol=0.0006)
    shown = [(time, e["id"]) for time, m in recording.topics["/scene"] for e in m["entities"] if "path" in e["id"]]
    assert shown[:-1] == [(500_000_000 * (k + 1), f"path {k}") for k in range(periods - 1)]
    assert shown[-1] == (round(1e9 * flight.time), f"path {periods - 1}")


def test_the_scene_has_water_box_goal_and_a_vehicle_that_goes_with_its_frame(written):
    flight, _, env, recording = written
    world = env.unwrapped.simulation.world
    water, zone = recording.entity("/scene", "water", 0.0)["cubes"]
    for cube, (low, high) in ((water, (world.lower[2], 0.0)), (zone, (-world.zone, world.zone))):
        middle, size = numbers(cube["pose"]["position"]), numbers(cube["size"])
        np.testing.assert_allclose(middle - 0.5 * size, (*world.lower[:2], low), atol=1e-12)
        np.testing.assert_allclose(middle + 0.5 * size, (*world.upper[:2], high), atol=1e-12)
    corners = np.concatenate([numbers(s["points"]) for s in recording.entity("/scene", "box", 0.0)["lines"]])
    np.testing.assert_array_equal([corners.min(axis=0), corners.max(axis=0)], [world.lower, world.upper])
    (goal,) = recording.entity("/scene", "goal", 0.0)["spheres"]
    assert tuple(numbers(goal["pose"]["position"])) == flight.scenario.goal
    vehicle = recording.entity("/scene", "vehicle", 0.0)
    assert (vehicle["frame_id"], vehicle["frame_locked"]) == ("vehicle", True)
    assert all(0 <= i < len(part["points"]) for part in vehicle["triangles"] for i in part["indices"])


def test_trees_are_those_of_their_period(written):
    flight, trees, _, recording = written
    assert recording.times("/tree") == [500_000_000 * k for k in range(len(flight.references))]
    for period in (0, 7, 20, len(trees) - 1):
        air, water, plan = recording.entity("/tree", "tree", 0.5 * period)["lines"]
        tree = trees[period]
        rest = np.setdiff1d(np.arange(len(tree.edges)), tree.path)
        for line, edges in (
            (plan, tree.edges[np.sort(tree.path)]),
            (air, tree.edges[rest][tree.air[rest]]),
            (water, tree.edges[rest][~tree.air[rest]]),
        ):
            np.testing.assert_allclose(numbers(line["points"]).reshape(-1, 2, 3), edges, atol=0.0006)


def test_weather_is_that_of_the_flight(stormy):
    flight, recording = stormy
    for name in ("wind", "water"):
        np.testing.assert_array_equal(numbers(recording.messages(f"/weather/{name}")), flight.trace.weather[name])
    surface = numbers([message["pose"]["position"] for message in recording.messages("/weather/surface")])
    np.testing.assert_array_equal(surface[:, :2], flight.trace.states[:, :2])
    elevations = surface[:, 2]
    np.testing.assert_array_equal(elevations, flight.trace.weather["elevation"])
    assert np.ptp(elevations) > 0.1
    for tick in (0, 100):
        wind, current, *waves = recording.messages("/weather/scene")[tick]["entities"][0]["lines"]
        for line, name, scale in ((wind, "wind", WIND_SCALE), (current, "water", CURRENT_SCALE)):
            start, end = numbers(line["points"])[:2]
            np.testing.assert_allclose(end - start, scale * flight.trace.weather[name][tick], atol=0.002)
        assert len(waves) == 10


def test_a_missing_folder_and_a_missing_extra_are_named(written, tmp_path, monkeypatch):
    flight, _, env, _ = written
    simulation = env.unwrapped.simulation
    with pytest.raises(FileNotFoundError, match=r"folder of the MCAP file does not exist: .*nowhere"):
        write_mcap(flight, simulation, tmp_path / "nowhere" / "flight.mcap", title="")
    monkeypatch.setitem(sys.modules, "mcap_protobuf.writer", None)
    with pytest.raises(DependencyNotInstalled, match=r'pip install "hydrone-gym\[mcap\]"'):
        write_mcap(flight, simulation, tmp_path / "flight.mcap", title="")
    assert not list(tmp_path.iterdir())
