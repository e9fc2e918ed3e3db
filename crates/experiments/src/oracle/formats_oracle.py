"""Logs in the formats that people keep them in, written by the formats' own Python packages.

Called by `cargo xtask oracle formats`: `write LOG.csv FOLDER` writes one log in all formats, `odd LOG.csv FOLDER` the
recordings that are hard to read, `long ROWS FOLDER` logs of one joint as long as wanted. Prints one line for each: its
path, and what it must give.
"""

import csv
import gzip
import json
import shutil
import struct
import sys
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.writer import Writer as Ros2McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

TOPIC = "/joint_states"
RULE = "=" * 80
DEFINITION = f"""std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{RULE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
# Periods between two episodes of a LeRobot dataset, as they are read.
BETWEEN_EPISODES = 10


class Log:
    """Times [s], positions and torques."""

    def __init__(self, file):
        with open(file, newline="", encoding="utf-8") as opened:
            header, *rows = csv.reader(opened)
        numbers = np.array([[float(cell) if cell.strip() else np.nan for cell in row] for row in rows])
        columns = dict(zip(header, numbers.T, strict=True))
        self.text = Path(file).read_bytes()
        self.joints = [name[2:] for name in header if name.startswith("q.")]
        self.t = columns["t"]
        self.q = np.stack([columns[f"q.{joint}"] for joint in self.joints], 1)
        self.tau = np.stack([columns[f"tau.{joint}"] for joint in self.joints], 1)
        self.columns = {"t": self.t}
        for prefix, signal in (("q", self.q), ("tau", self.tau)):
            self.columns |= {f"{prefix}.{joint}": signal[:, i].copy() for i, joint in enumerate(self.joints)}
        self.stamps = np.rint(self.t * 1e9).astype(np.int64)


def told(path, what):
    print(f"{path}\t{what}")


def fresh(path):
    """The path, with nothing there."""
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    return path


def write_csv(log, text, path):
    told(path, "csv")
    path.write_bytes(text)
    header, *rows = text.decode().splitlines()
    semicolons = [header.replace(",", ";")] + [row.replace(",", ";").replace(".", ",") for row in rows]
    other = path.with_name("semicolons.csv")
    other.write_text("\ufeff" + "\r\n".join(semicolons) + "\r\n", encoding="utf-8", newline="")
    told(other, "csv")
    other = path.with_name("tabs.csv")
    other.write_bytes(text.replace(b",", b"\t"))
    told(other, "csv")
    other = path.with_name("packed.csv.gz")
    other.write_bytes(gzip.compress(text))
    told(other, "csv")
    other = path.with_name("packed.csv.zst")
    with pa.CompressedOutputStream(str(other), "zstd") as stream:
        stream.write(text)
    told(other, "csv")


def write_numpy(log, folder):
    arrays = {"t": log.t, "q": log.q, "tau": log.tau}
    np.savez(folder / "arrays.npz", **arrays)
    np.savez_compressed(folder / "packed.npz", **arrays)
    np.savez_compressed(folder / "columns.npz", **log.columns)
    turned = {name: np.asfortranarray(array) for name, array in arrays.items()}
    np.savez_compressed(folder / "fortran.npz", **turned)
    turned = {name: np.ascontiguousarray(array.T) for name, array in arrays.items()}
    np.savez_compressed(folder / "transposed.npz", **turned)
    n = len(log.joints)
    records = np.zeros(len(log.t), dtype=[("t", "f8"), ("q", "f8", (n,)), ("note", "U7"), ("tau", ">f8", (n,))])
    for name, array in arrays.items():
        records[name] = array
    np.save(folder / "records.npy", records)
    for name in ("arrays.npz", "packed.npz", "columns.npz", "fortran.npz", "transposed.npz", "records.npy"):
        told(folder / name, "csv")


def write_hdf5(log, folder):
    arrays = {"t": log.t, "q": log.q, "tau": log.tau}
    with h5py.File(folder / "arrays.h5", "w") as file:
        for name, array in arrays.items():
            file.create_dataset(name, data=array)
    with h5py.File(folder / "packed.h5", "w", libver=("v110", "v114")) as file:
        for name, array in arrays.items():
            file.create_dataset(f"run/{name}", data=array, chunks=True, compression="gzip", shuffle=True, fletcher32=True)
    # As MATLAB writes version 7.3: a block of 512 bytes before, axes turned.
    with h5py.File(folder / "matlab73.mat", "w", userblock_size=512) as file:
        for name, array in arrays.items():
            data = np.atleast_2d(array.T)
            file.create_dataset(name, data=data).attrs["MATLAB_class"] = np.bytes_("double")
    with open(folder / "matlab73.mat", "r+b") as file:
        text = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: today HDF5 schema 1.00 ."
        file.write(text.ljust(116) + bytes(8) + b"\x00\x02IM")
    scipy.io.savemat(folder / "matlab5.mat", arrays)
    scipy.io.savemat(folder / "matlab5_packed.mat", arrays, do_compression=True)
    for name in ("arrays.h5", "packed.h5", "matlab73.mat", "matlab5.mat", "matlab5_packed.mat"):
        told(folder / name, "csv")


def joint_states(log):
    """The messages of a log: stamp [ns], names, positions, efforts."""
    for stamp, q, tau in zip(log.stamps, log.q, log.tau, strict=True):
        yield int(stamp), log.joints, q, tau


def write_mcap(messages, path, compression="ZSTD", topics=None):
    """Messages (with a topic before each where `topics` says so) by Foxglove's package."""
    with open(path, "wb") as file:
        writer = Ros2McapWriter(file, compression=CompressionType[compression])
        schema = writer.register_msgdef("sensor_msgs/msg/JointState", DEFINITION)
        for number, (stamp, names, q, tau) in enumerate(messages):
            message = {
                "header": {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "base"},
                "name": list(names),
                "position": list(map(float, q)),
                "velocity": [],
                "effort": list(map(float, tau)),
            }
            topic = topics[number % len(topics)] if topics else TOPIC
            writer.write_message(topic, schema, message, stamp, stamp)
        writer.finish()


def write_ros2(messages, path, plugin):
    """Messages by rosbags."""
    types = get_typestore(Stores.ROS2_HUMBLE)
    header, time = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    state = types.types["sensor_msgs/msg/JointState"]
    with Ros2Writer(fresh(path), version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection(TOPIC, state.__msgtype__, typestore=types)
        for stamp, names, q, tau in messages:
            message = state(header(time(stamp // 10**9, stamp % 10**9), "base"), list(names), q, np.zeros(0), tau)
            writer.write(connection, stamp, types.serialize_cdr(message, state.__msgtype__))


def write_ros1(messages, path, compression=None):
    """Messages by rosbags."""
    types = get_typestore(Stores.ROS1_NOETIC)
    header, time = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    state = types.types["sensor_msgs/msg/JointState"]
    writer = Ros1Writer(fresh(path))
    if compression:
        writer.set_compression(Ros1Writer.CompressionFormat[compression])
    with writer:
        connection = writer.add_connection(TOPIC, state.__msgtype__, typestore=types)
        for stamp, names, q, tau in messages:
            message = state(header(0, time(stamp // 10**9, stamp % 10**9), "base"), list(names), q, np.zeros(0), tau)
            writer.write(connection, stamp, types.serialize_ros1(message, state.__msgtype__))


def write_messages(log, folder):
    for compression in ("NONE", "LZ4", "ZSTD"):
        path = folder / f"{compression.lower()}.mcap"
        write_mcap(joint_states(log), path, compression)
        told(path, "csv")
    for name, plugin in (("ros2_sqlite", StoragePlugin.SQLITE3), ("ros2_mcap", StoragePlugin.MCAP)):
        write_ros2(joint_states(log), folder / name, plugin)
        told(folder / name, "csv")
    for compression in (None, "BZ2", "LZ4"):
        path = folder / f"ros1_{str(compression).lower()}.bag"
        write_ros1(joint_states(log), path, compression)
        told(path, "csv")


def write_lerobot(log, path, version, rows_in_group=700):
    """A dataset of two episodes."""
    fresh(path)
    (path / "meta").mkdir(parents=True)
    (path / "data/chunk-000").mkdir(parents=True)
    n, rows = len(log.joints), len(log.t)
    names = [f"{joint}.pos" for joint in log.joints] + [f"{joint}.effort" for joint in log.joints]
    number = {"dtype": "int64", "shape": [1], "names": None}
    info = {
        "codebase_version": version,
        "fps": round(1 / (log.t[1] - log.t[0])),
        "total_episodes": 2,
        "total_frames": rows,
        "features": {
            "observation.state": {"dtype": "float64", "shape": [2 * n], "names": names},
            "action": {"dtype": "float32", "shape": [n], "names": {"motors": names[:n]}},
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            "episode_index": number,
            "frame_index": number,
        },
    }
    (path / "meta/info.json").write_text(json.dumps(info))
    half = rows // 2
    tables = []
    for episode, part in enumerate((slice(0, half), slice(half, rows))):
        count = part.stop - part.start
        state = np.concatenate([log.q, log.tau], 1)[part]
        fixed = pa.FixedSizeListArray.from_arrays(pa.array(state.ravel()), 2 * n)
        frames = np.arange(count)
        tables.append(
            pa.table(
                {
                    "observation.state": fixed,
                    "action": pa.array(list(log.q[part].astype(np.float32)), pa.list_(pa.float32())),
                    "timestamp": pa.array((frames / info["fps"]).astype(np.float32)),
                    "episode_index": pa.array(np.full(count, episode)),
                    "frame_index": pa.array(frames),
                }
            )
        )
    if version.startswith("v2"):
        for episode, table in enumerate(tables):
            pq.write_table(table, path / f"data/chunk-000/episode_{episode:06d}.parquet")
    else:
        pq.write_table(pa.concat_tables(tables), path / "data/chunk-000/file-000.parquet", row_group_size=rows_in_group)
    return info["fps"], half


def write_datasets(log, folder):
    for version in ("v2.1", "v3.0"):
        path = folder / f"lerobot_{version[:2]}"
        fps, half = write_lerobot(log, path, version)
        told(path, "episodes")
    # The same two stretches, with the time that the reader gives them.
    t = np.concatenate([np.arange(half) / fps, np.zeros(len(log.t) - half)])
    start = t[half - 1] + BETWEEN_EPISODES / fps
    t[half:] = start + np.arange(len(log.t) - half) / fps
    write_rows(folder / "episodes.csv", log.joints, t, log.q, log.tau)


def write_rows(path, joints, t, q, tau):
    header = ["t", *(f"q.{joint}" for joint in joints), *(f"tau.{joint}" for joint in joints)]
    with open(path, "w", newline="\n", encoding="utf-8") as file:
        file.write(",".join(header) + "\n")
        for row in np.column_stack([t, q, tau]):
            file.write(",".join("" if np.isnan(x) else repr(float(x)) for x in row) + "\n")


def write(source, folder):
    log = Log(source)
    write_csv(log, log.text, folder / "csv.csv")
    write_numpy(log, folder)
    write_hdf5(log, folder)
    write_messages(log, folder)
    write_datasets(log, folder)


def odd(source, folder):
    log = Log(source)
    (folder / "csv.csv").write_bytes(log.text)
    random = np.random.default_rng(1)
    n = len(log.joints)

    def in_another_order():
        for stamp, names, q, tau in joint_states(log):
            order = random.permutation(n)
            yield stamp, [names[i] for i in order], q[order], tau[order]

    write_mcap(in_another_order(), folder / "names_in_another_order_each_time.mcap")
    told(folder / "names_in_another_order_each_time.mcap", "csv")
    write_ros2(in_another_order(), folder / "names_in_another_order_each_time", StoragePlugin.SQLITE3)
    told(folder / "names_in_another_order_each_time", "csv")

    messages = list(joint_states(log))
    shuffled = messages.copy()
    for start in range(0, len(shuffled) - 50, 50):
        part = shuffled[start : start + 50]
        random.shuffle(part)
        shuffled[start : start + 50] = part
    write_mcap(shuffled, folder / "stamps_out_of_order.mcap")
    told(folder / "stamps_out_of_order.mcap", "csv")
    far = messages[len(messages) // 2 :] + messages[: len(messages) // 2]
    write_mcap(far, folder / "stamps_far_out_of_order.mcap")
    told(folder / "stamps_far_out_of_order.mcap", "refused: more than 256 before it")

    def with_another_robot(other):
        for stamp, names, q, tau in joint_states(log):
            yield stamp, names, q, tau
            yield stamp, other, q + 1, tau + 1

    others = [f"other_{joint}" for joint in log.joints]
    write_mcap(with_another_robot(others), folder / "two_robots_on_one_topic.mcap")
    told(folder / "two_robots_on_one_topic.mcap", "csv")
    write_ros1(with_another_robot(others), folder / "two_robots_on_one_topic.bag")
    told(folder / "two_robots_on_one_topic.bag", "csv")

    def by_halves():
        for stamp, names, q, tau in joint_states(log):
            half = n // 2
            yield stamp, names[:half], q[:half], tau[:half]
            yield stamp, names[half:], q[half:], tau[half:]

    write_mcap(by_halves(), folder / "one_robot_in_two_messages.mcap")
    told(folder / "one_robot_in_two_messages.mcap", "refused: no message names all joints")
    write_mcap(joint_states(log), folder / "two_topics.mcap", topics=["/left/joint_states", "/right/joint_states"])
    told(folder / "two_topics.mcap", "refused: more than one topic could be the log")

    holed = log.tau.copy()
    holed[len(holed) // 3, 0] = np.nan
    holed[2 * len(holed) // 3 :: 997, -1] = np.nan
    write_rows(folder / "holes.csv", log.joints, log.t, log.q, holed)
    log.tau = holed
    write_mcap(joint_states(log), folder / "efforts_that_are_nan.mcap")
    told(folder / "efforts_that_are_nan.mcap", "holes")
    np.savez(folder / "efforts_that_are_nan.npz", t=log.t, q=log.q, tau=log.tau)
    told(folder / "efforts_that_are_nan.npz", "holes")


def long(rows, folder):
    """A pendulum at 1 kHz, one joint, in pieces."""
    rows, piece = int(rows), 100_000
    pieces = [(start, min(start + piece, rows)) for start in range(0, rows, piece)]

    def signals(start, end):
        t = np.arange(start, end) / 1e3
        phase = 0.7 * t + 0.4 * np.sin(0.31 * t)
        q = np.sin(phase) + 0.2 * np.sin(5.3 * t)
        noise = np.random.default_rng(start).normal(size=len(t))
        return t, q, 9.81 * np.sin(q) - 3.0 * q + 0.1 * noise

    with open(folder / "long.csv", "w", newline="\n", encoding="utf-8") as file:
        file.write("t,q.hinge,tau.hinge\n")
        for start, end in pieces:
            t, q, tau = signals(start, end)
            file.writelines(f"{a!r},{b!r},{c!r}\n" for a, b, c in zip(t.tolist(), q.tolist(), tau.tolist(), strict=True))
    told(folder / "long.csv", "csv")
    t, q, tau = (np.concatenate(parts) for parts in zip(*(signals(*piece) for piece in pieces), strict=True))
    np.savez(folder / "long.npz", t=t, q=q, tau=tau)
    np.savez_compressed(folder / "long_packed.npz", t=t, q=q, tau=tau)
    scipy.io.savemat(folder / "long.mat", {"t": t, "q": q, "tau": tau}, do_compression=True)
    with h5py.File(folder / "long.h5", "w") as file:
        for name, array in (("t", t), ("q", q), ("tau", tau)):
            file.create_dataset(name, data=array, chunks=True, compression="gzip")
    log = Log.__new__(Log)
    log.joints, log.t, log.q, log.tau = ["hinge"], t, q[:, None], tau[:, None]
    write_lerobot(log, folder / "long_lerobot", "v3.0", 100_000)
    for name in ("long.npz", "long_packed.npz", "long.mat", "long.h5", "long_lerobot"):
        told(folder / name, "csv")
    cdr = struct.Struct("<4sIII5s3xII6s2xIdIId").pack
    ros1 = struct.Struct("<IIII4sII5sIdIId").pack
    stamps = np.rint(t * 1e9).astype(np.int64).tolist()
    with open(folder / "long.mcap", "wb") as file:
        writer = McapWriter(file, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/JointState", "ros2msg", DEFINITION.encode())
        channel = writer.register_channel(TOPIC, "cdr", schema)
        for stamp, a, b in zip(stamps, q.tolist(), tau.tolist(), strict=True):
            writer.add_message(channel, stamp, cdr_message(cdr, stamp, a, b), stamp)
        writer.finish()
    told(folder / "long.mcap", "csv")
    types = get_typestore(Stores.ROS2_HUMBLE)
    with Ros2Writer(fresh(folder / "long_ros2"), version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection(TOPIC, "sensor_msgs/msg/JointState", typestore=types)
        for stamp, a, b in zip(stamps, q.tolist(), tau.tolist(), strict=True):
            writer.write(connection, stamp, cdr_message(cdr, stamp, a, b))
    told(folder / "long_ros2", "csv")
    types = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(fresh(folder / "long.bag")) as writer:
        connection = writer.add_connection(TOPIC, "sensor_msgs/msg/JointState", typestore=types)
        for stamp, a, b in zip(stamps, q.tolist(), tau.tolist(), strict=True):
            seconds, rest = divmod(stamp, 10**9)
            writer.write(connection, stamp, ros1(0, seconds, rest, 4, b"base", 1, 5, b"hinge", 1, a, 0, 1, b))
    told(folder / "long.bag", "csv")


def cdr_message(pack, stamp, position, effort):
    """A JointState of the joint `hinge` in plain CDR, little endian."""
    seconds, rest = divmod(stamp, 10**9)
    # Header, stamp, frame_id, names; then an array aligned to 8, an empty one, and one more.
    return pack(b"\0\1\0\0", seconds, rest, 5, b"base\0", 1, 6, b"hinge\0", 1, position, 0, 1, effort)


if __name__ == "__main__":
    TASKS = {"write": write, "odd": odd, "long": long}
    target = Path(sys.argv[3])
    target.mkdir(parents=True, exist_ok=True)
    TASKS[sys.argv[1]](sys.argv[2], target)
