"""Small valid files of motion capture, robots and PIV, and the options that they need."""

from __future__ import annotations

import h5py
import numpy as np
from rosbags import rosbag2, typesys
from scipy.io import savemat

SHIFTS = ("--scale", "1mm", "--frame-interval", "10ms")


def recordings() -> dict[str, tuple[str, str, tuple[str, ...]]]:
    """Return the name of a file, its text and its options, by kind."""
    poses = [
        (k, 0.1 * k, 0.1 * np.cos(0.03 * k), 0.2, 0.1 * np.sin(0.05 * k), np.sin(0.1 * k))
        for k in range(40)
    ]
    motive = (
        "Format Version,1.23,Take Name,a,Export Frame Rate,10,Rotation Type,Quaternion,Length "
        "Units,Meters\n\n,Type" + ",Rigid Body" * 7 + "\n,Name" + ",Block" * 7 + "\n,ID" + ",1" * 7
        + "\n,," + ",".join(["Rotation"] * 4 + ["Position"] * 3)
        + "\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z\n"
    )  # fmt: skip
    vicon = (
        "Objects\n10\n,,Global Angle Block:Block,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n"
        ",,rad,rad,rad,mm,mm,mm\n"
    )
    euroc = (
        "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
        "q_RS_z []\n"
    )
    rows = {
        "optitrack": lambda k, t, x, y, z, s: f"{k},{t},0,{s},0,{np.sqrt(1 - s * s)},{x},{y},{z}",
        "vicon": lambda k, t, x, y, z, s: f"{k},0,0,0,{s},{1e3 * x},{1e3 * z},{1e3 * y}",
        "tum": lambda k, t, x, y, z, s: f"{t} {x} {z} {y} 0 0 {s} {np.sqrt(1 - s * s)}",
        "euroc": lambda k, t, x, y, z, s: (
            f"{1403636580838555648 + 100000000 * k},{x},{z},{y},{np.sqrt(1 - s * s)},0,0,{s}"
        ),
        "in-space": lambda k, t, x, y, z, s: f"{t},{x},{y},{z},0,{s},0,{np.sqrt(1 - s * s)}",
    }
    heads = {
        "optitrack": ("take.csv", motive, ()),
        "vicon": ("capture.csv", vicon, ()),
        "tum": ("trajectory.txt", "# timestamp tx ty tz qx qy qz qw\n", ()),
        "euroc": ("data.csv", euroc, ()),
        "in-space": (
            "poses.csv",
            "by hand\nt_s,x_m,y_m,z_m,qx,qy,qz,qw\n",
            ("--up", "y", "--header-line", "2"),
        ),
    }
    return {
        kind: (name, head + "".join(rows[kind](*row) + "\n" for row in poses), options)
        for kind, (name, head, options) in heads.items()
    }


def write_bag(path, *, mcap: bool) -> None:
    """Write a bag of two bodies."""
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    types, kind = store.types, "geometry_msgs/msg/PoseArray"
    plugin = rosbag2.StoragePlugin.MCAP if mcap else rosbag2.StoragePlugin.SQLITE3
    with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection("/blocks", kind, typestore=store)
        for k in range(20):
            stamp = types["builtin_interfaces/msg/Time"](k // 10, k % 10 * 10**8)
            header = types["std_msgs/msg/Header"](stamp, "tank")
            pose = types["geometry_msgs/msg/Pose"](
                types["geometry_msgs/msg/Point"](0.01 * k, 0.02 * k, 0.0),
                types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.6, 0.8),
            )
            message = types[kind](header, [pose, pose])
            writer.write(connection, 10**8 * k, store.serialize_cdr(message, kind))


def fields() -> dict[str, tuple[str, str, tuple[str, ...]]]:
    """Return the name of a file of PIV, its text and its options, by kind."""
    nodes = [(16.0 * i, 16.0 * j, 0.1 * i, -0.1 * j) for j in range(9, 0, -1) for i in range(1, 9)]
    vec = (
        'TITLE="a" VARIABLES="X mm", "Y mm", "U m/s", "V m/s", "CHC", DATASETAUXDATA '
        'MicrosecondsPerDeltaT="2000" ZONE I=8, J=9, F=POINT\n'
    )
    davis = '#DaVis 8.1.6 2D-vector 8 9 8 "position" "mm" "position" "mm" "velocity" "m/s"\n'
    joined = {
        "openpiv": "".join("\t".join(map(str, (*node, 0, 0))) + "\n" for node in nodes),
        "insight": "".join(", ".join(map(str, (*node, 1))) + "\n" for node in nodes),
        "davis": "".join("\t".join(map(str, node)) + "\n" for node in nodes).replace(".", ","),
    }
    return {
        "openpiv": ("field.txt", "# x\ty\tu\tv\tflags\tmask\n" + joined["openpiv"], SHIFTS),
        "grid": ("grid.txt", joined["openpiv"], SHIFTS),
        "insight": ("field.vec", vec + joined["insight"], ()),
        "davis": ("B00001.txt", davis + joined["davis"], ()),
    }


def write_old_session(path) -> None:
    """Write a session of PIVlab with one frame in MATLAB's old format."""
    x, y = np.meshgrid(16.0 * np.arange(1, 9), 16.0 * np.arange(1, 10))
    savemat(path, {"x_0": x, "y_0": y, "u_0": 0.01 * y, "v_0": 0.01 * x})


def write_session(path) -> None:
    """Write a session of PIVlab with two frames."""
    x, y = np.meshgrid(16.0 * np.arange(1, 9), 16.0 * np.arange(1, 10))
    with h5py.File(path, "w", userblock_size=512) as file:
        for frame in range(2):
            for name, values in (("x", x), ("y", y), ("u", 0.01 * y), ("v", 0.01 * x)):
                file[f"{name}_{frame}"] = values.T
            file[f"typevector_{frame}"] = np.ones(x.T.shape)
    # As MATLAB begins it, and no NetCDF to what damages NetCDF.
    path.write_bytes(b"MATLAB 7.3 MAT-file".ljust(512) + path.read_bytes()[512:])
