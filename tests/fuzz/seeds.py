"""One small valid file of every kind that a user can hand to driftwalk, and the commands for it."""

from __future__ import annotations

import contextlib
import gzip
import io
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

import cv2
import numpy as np
import space_files
import xarray as xr
from drawn_blocks import camera_of, marker_of, moving_blocks
from finished_run import write_finished_run
from recovery_worlds import small_study
from text_seeds import text_files
from tracker_seeds import tracker_files

import driftwalk as dw
from driftwalk.cli.main import main
from driftwalk.core.files.rundir import RunDirectory

DATA = Path(str(files("driftwalk.datasets") / "tank30_ode_a"))
PIXELS = ("--scale", "0.001")
MODEL = ("--drag-coefficient", "0.5", "--force-std", "0.6mN")
FLOWS = ("own.nc", "other.nc", "classic.nc", "flow.csv")
FEW_RUNS = ("--runs", "4", "--duration", "10", "--blocks", "2")


@dataclass(frozen=True)
class Seed:
    """A folder with a valid input, the file in it that is damaged, and what is then run.

    In the words of a command ``@`` stands for the folder.
    """

    folder: Path
    target: str
    commands: tuple[tuple[str, ...], ...]

    @property
    def name(self) -> str:
        return f"{self.folder.name}/{self.target}"

    @property
    def is_netcdf(self) -> bool:
        content = (self.folder / self.target).read_bytes()
        # Other HDF5 has no dimensions, without which its variables cannot be written again.
        return content[:4] in (b"CDF\x01", b"CDF\x02") or b"_NCProperties" in content


def seeds(place: Path, *, runs: bool = True) -> list[Seed]:
    """Return the seeds, made under `place` where they are not yet.

    Parameters
    ----------
    place : Path
        Folder that keeps them: some take a minute to make.
    runs : bool
        Whether those of run directories are wanted, which are slow.
    """
    made = [*_recordings(place), *_settings(place), *_images(place)]
    return [*made, *_calibration(place), *_runs(place)] if runs else made


def readable_seeds(place: Path) -> list[Seed]:
    """Return the seeds of recordings and flow fields: what `driftwalk info` takes.

    Parameters
    ----------
    place : Path
        As of `seeds`.
    """
    fields = [
        replace(seed, commands=(("info", f"@/{seed.target}"),))
        for seed in _settings(place)
        if seed.target in FLOWS
    ]
    return [*_recordings(place), *fields]


def _kept(folder: Path, make: Callable[[Path], None]) -> Path:
    """Make a folder, or take it as an earlier call made it."""
    if not folder.exists():
        partial = folder.with_name(f"{folder.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        make(partial)
        partial.rename(folder)
    return folder


def _recordings(place: Path) -> Iterator[Seed]:
    for kind, contents, options in text_files():
        folder = _kept(place / kind, lambda folder, contents=contents: _write(folder, contents))
        name = next(iter(contents))
        yield Seed(folder, name, _reading(f"@/{name}", options))
    yield from _binary_recordings(place)
    yield from _in_space(place)
    for kind, name, options, write in tracker_files():
        made = _kept(place / kind, lambda folder, write=write, name=name: write(folder / name))
        yield Seed(made, name, _reading(f"@/{name}", options))


def _in_space(place: Path) -> Iterator[Seed]:
    for kind, (name, content, options) in space_files.recordings().items():
        folder = _kept(place / kind, lambda at, one={name: content}: _write(at, one))
        yield Seed(folder, name, _reading(f"@/{name}", options))
    for mcap, ending in ((False, "db3"), (True, "mcap")):
        bag = _kept(
            place / f"ros-{ending}",
            lambda at, mcap=mcap: space_files.write_bag(at / "bag", mcap=mcap),
        )
        yield Seed(bag, f"bag/bag.{ending}", _reading(f"@/bag/bag.{ending}"))
        yield Seed(bag, "bag/metadata.yaml", _reading("@/bag"))
    for kind, (name, content, options) in space_files.fields().items():
        folder = _kept(place / kind, lambda at, one={name: content}: _write(at, one))
        yield Seed(folder, name, _of_field(f"@/{name}", options))
    old = _kept(place / "pivlab-old", lambda at: space_files.write_old_session(at / "session.mat"))
    yield Seed(old, "session.mat", _of_field("@/session.mat", space_files.SHIFTS))
    session = _kept(place / "pivlab", lambda at: space_files.write_session(at / "session.mat"))
    yield Seed(session, "session.mat", _of_field("@/session.mat", space_files.SHIFTS))


def _of_field(file: str, options: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    return (
        ("info", file, *options),
        ("flow", file, "--out", "@/flow-out.nc", "--tank", "circle:0.1@0.07,0.08", *options),
        ("simulate", "--flow", file, "--out", "@/out.nc", "--duration", "1", *MODEL),
    )


def _write(folder: Path, contents: dict[str, str | bytes]) -> None:
    for name, content in contents.items():
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())


def _reading(file: str, options: tuple[str, ...] = ()) -> tuple[tuple[str, ...], ...]:
    return (
        ("info", file, *options),
        ("info", file, *options, "--json", "--sort", "--tank", "fit", "--max-speed", "1"),
        ("read", file, "-o", "@/out.nc", *options),
        ("read", file, "-o", "@/out.csv", *options, "--sort"),
        ("flow", file, "--out", "@/flow-out.nc", "--tank", "30cm", *options),
        ("report", file, "--out", "@/report.html", *options),
        ("compare", file, str(DATA / "recording.csv"), "--permutations", "0", *options),
        ("classify", file, *options),
    )


def _binary_recordings(place: Path) -> Iterator[Seed]:
    def own(folder: Path) -> None:
        recording = dw.tank30_recording().isel(time=slice(0, 60))
        dw.save_trajectory(recording, folder / "a.nc")
        numbers = recording.drop_vars("body")
        numbers.to_netcdf(folder / "classic.nc", engine="scipy", format="NETCDF3_64BIT")

    def blocks(folder: Path) -> None:
        dw.save_trajectory(moving_blocks(20, bodies=3), folder / "a.nc")

    def movement(folder: Path) -> None:
        values = np.arange(80.0).reshape(20, 2, 1, 2)
        xr.Dataset(
            {"position": (("time", "space", "keypoint", "individual"), values)},
            coords={"time": 0.1 * np.arange(20), "space": ["x", "y"], "individual": ["a", "b"]},
            attrs={"time_unit": "seconds", "fps": 10.0, "ds_type": "poses"},
        ).to_netcdf(folder / "a.nc", engine="h5netcdf")

    def packed(folder: Path) -> None:
        text = "".join(f"{0.1 * k:.1f},{0.01 * k},{0.02 * k % 0.1}\n" for k in range(40))
        (folder / "a.csv").write_bytes(gzip.compress(b"t_s,x_m,y_m\n" + text.encode(), mtime=0))

    def simulation(folder: Path) -> None:
        _run("simulate", "--flow", DATA / "flow_true.csv", "--out", folder / "a.nc",
             "--duration", "5", "--replicates", "2", *MODEL)  # fmt: skip

    yield Seed(_kept(place / "own", own), "a.nc", _reading("@/a.nc"))
    yield Seed(place / "own", "classic.nc", _reading("@/classic.nc"))
    yield Seed(_kept(place / "blocks", blocks), "a.nc", _reading("@/a.nc"))
    yield Seed(_kept(place / "movement", movement), "a.nc", _reading("@/a.nc", PIXELS))
    yield Seed(_kept(place / "packed", packed), "a.csv", _reading("@/a.csv"))
    yield Seed(_kept(place / "simulation", simulation), "a.nc", _reading("@/a.nc"))


def _settings(place: Path) -> Iterator[Seed]:
    def make(folder: Path) -> None:
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            main(["study", "new"])
        flow = dw.tank30_flow()
        dw.save_flow(flow, folder / "own.nc")
        other = flow[["u", "v"]].isel(x=slice(0, 12), y=slice(0, 10))
        for name in ("u", "v"):
            other[name].attrs = {"units": "m/s"}
        other.attrs = {}
        other.to_netcdf(folder / "other.nc", engine="h5netcdf")
        other.to_netcdf(folder / "classic.nc", engine="scipy", format="NETCDF3_64BIT")
        grid = 0.02 * np.arange(10)
        nodes = [(x, y) for y in grid for x in grid]
        table = "".join(f"{x:.2f},{y:.2f},{0.1 * x:.4f},{-0.1 * y:.4f}\n" for x, y in nodes)
        circle = [(0.1 * k, 0.05 * np.cos(k), 0.05 * np.sin(k)) for k in range(30)]
        _write(folder, {
            "study.toml": printed.getvalue(),
            "short.toml": '[tank]\ndiameter_m = 0.3\n[forces]\nforce_std_N = "0.6mN"\n',
            "flow.csv": "x,y,u,v\n" + table,
            "tank.csv": "-0.1,-0.1\n0.1,-0.1\n0.1,0.1\n-0.1,0.1\n",
            "a.csv": "t_s,x_m,y_m\n" + "".join(f"{t:.1f},{x:.4f},{y:.4f}\n" for t, x, y in circle),
        })  # fmt: skip

    folder = _kept(place / "settings", make)
    out = ("--out", "@/out.nc", "--duration", "2", "--replicates", "1")
    for name in ("study.toml", "short.toml"):
        yield Seed(folder, name, (
            ("study", "check", f"@/{name}"),
            ("simulate", "--flow", "@/flow.csv", "--study", f"@/{name}", *out, *MODEL),
            ("classify", "@/a.csv", "--study", f"@/{name}"),
        ))  # fmt: skip
    for name in FLOWS:
        yield Seed(folder, name, (
            ("simulate", "--flow", f"@/{name}", *out, *MODEL),
            ("simulate", "--flow", f"@/{name}", *out, *MODEL, "--backend", "reference"),
        ))  # fmt: skip
    yield Seed(folder, "tank.csv", (("info", "@/a.csv", "--tank", "polygon:@/tank.csv"),))


def _images(place: Path) -> Iterator[Seed]:
    def make(folder: Path) -> None:
        settings = dw.video_settings("moderate", width_px=240, height_px=180, px_per_m=560.0)
        video = dw.write_video(folder / "video.mkv", moving_blocks(4, bodies=2), settings)
        (folder / "images").mkdir()
        for index, frame in enumerate(dw.open_source(video)):
            cv2.imwrite(str(folder / "images" / f"{index}.png"), frame.image)
        times = "".join(f"{index}.png,{0.1 * index:.1f}\n" for index in range(4))
        _write(folder / "images", {"times.csv": f"file,time_s\n{times}"})
        dw.track.save_markers(folder / "markers.toml", marker_of(settings))
        dw.track.save_camera(folder / "camera.toml", camera_of(settings))

    folder = _kept(place / "film", make)
    common = ("--out", "@/tracked.nc", "--bodies", "2")
    known = ("--markers", "@/markers.toml", "--camera", "@/camera.toml")
    blob = ("--markers", "blob", "--scale", "560px/m")
    for target in ("markers.toml", "camera.toml"):
        yield Seed(folder, target, (("track", "@/images", *known, *common),))
    for target in ("images/times.csv", "images/1.png"):
        yield Seed(folder, target, (("track", "@/images", *blob, *common),))
    yield Seed(folder, "video.mkv", (("track", "@/video.mkv", *blob, *common),))


def _calibration(place: Path) -> Iterator[Seed]:
    def finished(folder: Path) -> None:
        write_finished_run(folder)

    def unfinished(folder: Path) -> None:
        specification = {"kind": "fit", "study": dw.Study().to_dict()}
        with RunDirectory(folder, specification=specification) as run:
            run.write("recording.nc", (place / "own" / "a.nc").read_bytes())

    commands = (_report(),) * 4 + (
        ("assemble", "@", "--out", "@-made", "--film", "none", *FEW_RUNS),
    )
    yield from _of_folder(_kept(place / "calibration", finished), commands)
    yield from _of_folder(_kept(place / "unfinished", unfinished), (_report(),))


def _runs(place: Path) -> Iterator[Seed]:
    def fit(folder: Path) -> None:
        _run("fit", DATA / "recording.csv", "--out", folder, "--tank", "30cm",
             "--to", "30", "--spline-spacing", "0.06")  # fmt: skip

    def assembly(folder: Path) -> None:
        _run("assemble", "--flow", DATA / "flow_true.csv", "--out", folder, "--film", "none",
             *FEW_RUNS, *MODEL)  # fmt: skip

    def sensitivity(folder: Path) -> None:
        _run("sensitivity", "--flow", DATA / "flow_true.csv", "--out", folder, *FEW_RUNS, *MODEL,
             "--realisations", "2", "--sobol", "8", "--vary", "drag-coefficient=0.2,0.6",
             "--vary", "force-std=0.2mN,0.6mN")  # fmt: skip

    def recovery(folder: Path) -> None:
        truth = folder.with_name("truth.toml")
        truth.write_text(small_study().to_toml())
        _run(
            "study", "recover", "--study", truth, "--flow", DATA / "flow_true.csv", "--out", folder
        )

    yield from _of_folder(_kept(place / "fit", fit), (_report(),))
    classify = (("classify", "@/path.nc"), ("classify", "@/path.nc", "--replicate", "1"))
    yield from _of_folder(_kept(place / "assembly", assembly), (_report(),), {"path.nc": classify})
    yield from _of_folder(_kept(place / "sensitivity", sensitivity), (_report(),))
    yield from _of_folder(_kept(place / "recovery", recovery), (_report(),))


def _report() -> tuple[str, ...]:
    return ("report", "@", "--out", "@-report.html")


def _of_folder(
    folder: Path,
    commands: tuple[tuple[str, ...], ...],
    further: dict[str, tuple[tuple[str, ...], ...]] | None = None,
) -> Iterator[Seed]:
    """Yield a seed for each file of a run directory."""
    for path in sorted(folder.iterdir()):
        if path.suffix in (".nc", ".json"):
            yield Seed(folder, path.name, (*commands, *(further or {}).get(path.name, ())))


def _run(*words: object) -> None:
    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(io.StringIO()) as err,
    ):
        code = main([str(word) for word in words])
    if code != 0:
        raise RuntimeError(f"driftwalk {' '.join(map(str, words))}: {err.getvalue()}")
