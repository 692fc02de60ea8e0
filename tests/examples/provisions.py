"""For every page: the files that its examples name, and where less is computed than it says.

A page says "your recording"; here a reader has the bundled recording, or its first minutes. All
files are simulated. An example that would take minutes runs with the options or sizes of `instead`.
"""

from __future__ import annotations

import json
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray as xr
from chain_runs import chain_runs
from command_line import FLOW, GRID, RECORDING, here
from drifting_tracers import seeded_tank
from finished_run import write_finished_run
from glued_recordings import recordings
from made_once import made_once_in
from self_propelled import moving

import driftwalk as dw
from driftwalk.record.raw import ReadOptions
from examples.printed import Numbers
from examples.reading import ROOT

Names = dict[str, Any]


@dataclass(frozen=True)
class Page:
    """How the examples of a page run."""

    provide: Callable[[Path], Names] = lambda _: {}
    """Writes the files of the page into a folder, and returns Python names that it presumes."""
    instead: Mapping[str, str] = field(default_factory=dict)
    """From a text of the examples to the one that runs; every text has to be on the page."""
    not_run: Mapping[str, str] = field(default_factory=dict)
    """From a command, or a pattern of some, to the reason why no test runs it."""
    holds: tuple[str, ...] = ()
    """Expressions that are true after the last example."""
    makes: tuple[str, ...] = ()
    """Files that are there after the last example."""
    streams: bool = False
    """Whether a simulated tank is published as a tracker's stream, for two seconds."""
    numbers: Numbers = Numbers.ANY
    """How the numbers that the page shows compare, where a command runs as it is written.

    `Numbers.ANY` where the files differ from those of which the page shows the results.
    """
    numbers_of: Mapping[str, Numbers] = field(default_factory=dict)
    """The same for single commands, by a pattern."""
    by_chance: Mapping[str, float] = field(default_factory=dict)
    """From how a line begins to how far its numbers scatter: other last bits are other worlds."""
    draws: bool = True
    """Whether the commands draw their figures, which take most of a small run."""
    little: bool = False
    """Whether searches for models simulate little, with every stage of theirs."""
    needs: tuple[str, ...] = ()
    """Packages without which the examples are skipped."""
    slow: bool = False
    """Whether the page takes more than 0.3 s of processor time."""
    weekly: bool = False
    """Whether it takes long for commands that other tests run in CI."""
    parts_weekly: tuple[str, ...] = ()
    """Texts of single commands, or of other examples, of which the same holds."""

    @property
    def runs(self) -> Iterator[tuple[str, Page, list[pytest.MarkDecorator]]]:
        """What is appended to the name of each run of the page, what runs, and when."""
        yield "", self, [pytest.mark.study] * self.weekly or [pytest.mark.slow] * self.slow
        if self.parts_weekly:
            yield " whole", replace(self, parts_weekly=()), [pytest.mark.study]


def _files(*provisions: Callable[[Path], Names]) -> Callable[[Path], Names]:
    """Return a function that makes all of these provisions."""

    def provide(folder: Path) -> Names:
        names: Names = {}
        for one in provisions:
            names |= one(folder)
        return names

    return provide


def _block_and_dimer(folder: Path) -> Names:
    """Provide five minutes of a block and of a dimer."""
    recordings(folder, minutes=5.0)
    return {}


def _recording(seconds: float | None = None, name: str = "recording.csv") -> Callable:
    """Provide the bundled recording, or its first seconds."""

    def provide(folder: Path) -> Names:
        first, *lines = RECORDING.read_text(encoding="utf-8").splitlines()
        kept = lines if seconds is None else lines[: round(10 * seconds) + 1]
        (folder / name).write_text("\n".join([first, *kept, ""]), encoding="utf-8")
        return {}

    return provide


def _tracks(folder: Path) -> Names:
    """Provide ``tracks.csv``: synthetic tracers in pixels, as trackpy writes them."""
    seen = seeded_tank(1, tracers=1500, samples=8, false_links=0.01).recording
    table = seen[["x", "y"]].to_dataframe().reset_index()
    pixels = {
        "y": (0.16 - table["y"]) / 1e-4,
        "x": (0.17 + table["x"]) / 1e-4,
        "frame": (table["time"] / 0.05).round().astype(int),
        "particle": table["body"],
    }
    table.assign(**pixels)[list(pixels)].to_csv(folder / "tracks.csv", index=False)
    return {}


def _series(folder: Path) -> Names:
    """Provide ten seconds of a flow that grows weaker and stronger."""
    flow = dw.tank30_flow()
    time = xr.IndexVariable("time", [0.0, 2.5, 5.0, 7.5, 10.0], {"units": "s"})
    frames = [
        flow[["u", "v", "flag"]].assign(u=part * flow["u"], v=part * flow["v"])
        for part in (1.0, 0.8, 0.6, 0.8, 1.0)
    ]
    dw.save_flow(xr.concat(frames, dim=time).assign_attrs(flow.attrs), folder / "series.nc")
    return {}


def _flow(*names: str) -> Callable[[Path], Names]:
    """Provide the true flow of the bundled recording under some names."""

    def provide(folder: Path) -> Names:
        for name in names:
            if name.endswith(".csv"):
                shutil.copy(FLOW, folder / name)
            else:
                dw.save_flow(dw.tank30_flow(), folder / name)
        return {}

    return provide


def _search(name: str) -> Callable[[Path], Names]:
    """Provide a study file with the search of a small calibration."""

    def provide(folder: Path) -> Names:
        (folder / name).write_text(GRID, encoding="utf-8")
        return {}

    return provide


def _calibrated(folder: Path) -> Names:
    """Provide ``run/``: a calibration of few settings on the bundled recording."""
    write_finished_run(folder / "run")
    return {}


def _calibrated_twice(folder: Path) -> Names:
    """Provide ``runs/one`` and ``runs/two``: two such calibrations."""
    for name in ("one", "two"):
        write_finished_run(folder / "runs" / name)
    return {}


def _with_intervals(folder: Path) -> Names:
    """Provide ``run/calibration.nc`` with the intervals of a small bootstrap."""
    study = dw.load_study(folder / "search.toml")
    recording = dw.tank30_recording().isel(time=slice(1200))
    (folder / "run").mkdir()
    found = dw.calibrate(recording, study, flow=dw.tank30_flow())
    found.to_netcdf(folder / "run" / "calibration.nc", engine="h5netcdf")
    return {}


def _report(folder: Path) -> Names:
    """Provide ``report.html``, of a calibration."""
    dw.write_report(dw.report_page(write_finished_run(folder / "run")), folder / "report.html")
    return {}


def _simulated(folder: Path) -> Names:
    """Provide ``sim.nc``: a minute of the bundled example, simulated."""
    words = ("--flow", FLOW, "--duration", "1min", "-o", folder / "sim.nc")
    done = here("simulate", *words)
    assert done.code == 0, done.err
    return {}


def _diffusing(folder: Path) -> Names:
    """Provide ``mine.py`` with a model, ``recording.nc``, and ``run/``, a calibration of it."""
    (folder / "mine.py").write_text(MODEL_FILE, encoding="utf-8")
    recording = dw.tank30_recording().isel(time=slice(0, 600))
    dw.save_trajectory(recording, folder / "recording.nc")
    (folder / "grid.toml").write_text(GRID, encoding="utf-8")
    model = ("--model", f"{folder / 'mine.py'}:diffuse")
    words = ("--study", folder / "grid.toml", *model, "-o", folder / "run")
    done = here("calibrate", folder / "recording.nc", *words)
    assert done.code == 0, done.err
    return {"recording": recording}


def _minutes(**names: float) -> Callable[[Path], Names]:
    """Provide Python names of recordings: the bundled one, from 0 on, for some minutes each."""

    def provide(_: Path) -> Names:
        whole = dw.tank30_recording()
        return {name: whole.isel(time=slice(round(600 * long))) for name, long in names.items()}

    return provide


def _study(_: Path) -> Names:
    return {"study": dw.Study(), "flow": dw.tank30_flow()}


def _wide_tank(_: Path) -> Names:
    """Provide a tank that holds 64 blocks, and its flow."""
    study = dw.apply_overrides(dw.Study(), {"tank.diameter_m": 1.2})
    return {"dw": dw, "study": study, "flow": dw.jets_flow(diameter=1.2, swirl_speed=0.03)}


def _active_body(folder: Path) -> Names:
    """Provide ``recording.nc``: three minutes of an active body."""
    values = {"speed": 0.03, "rotational_diffusion": 0.5, "turn_rate": 0.3}
    seen = moving(dw.motion_model("active", clearance=0.015), values, 180.0, seed=3, noise=3e-4)
    dw.save_trajectory(seen, folder / "recording.nc")
    return {}


def _tumble_search(_: Path) -> Names:
    """Provide a study of few simulations, for a calibration that a page leaves to its defaults."""
    small = {"replicates": 1, "refined_replicates": 1, "bootstrap": 4}
    return {"SMALL": dw.apply_overrides(dw.Study(), {f"calibration.{k}": small[k] for k in small})}


def _robot_in_mujoco(folder: Path) -> Names:
    """Provide ``recording.csv``: ten seconds of the robot that the page simulates."""
    program = ROOT / "docs" / "examples" / "mujoco_robot.py"
    robot = dw.motion_model(f"command:{shlex.quote(sys.executable)} {shlex.quote(str(program))}")
    values = {"speed": 0.05, "turn_noise": 1.0}
    seen = moving(robot, values, 10.0, seed=1, noise=3e-4)
    dw.save_trajectory(seen, folder / "recording.csv")
    return {}


def _truth(_: Path) -> Names:
    """Provide a fit and the flow that is true for it."""
    recording = dw.tank30_recording().isel(time=slice(1200))
    return {"fit": dw.fit(recording, force_interval="16ms"), "true_flow": dw.tank30_flow()}


def _film(bodies: int, seconds: float) -> Callable[[Path], Names]:
    """Provide ``video.mp4``: simulated blocks, drawn as a camera would see them."""

    def provide(folder: Path) -> Names:
        path = dw.assembly_path(
            dw.Study(), dw.tank30_flow(), runs=[3], blocks=bodies, duration=seconds
        )
        small = dw.video_settings("moderate", width_px=480, height_px=360, px_per_m=1100.0)
        dw.write_video(folder / "video.mp4", dw.path_recording(path, run=3), small)
        return {}

    return provide


def _one_recording(folder: Path) -> Names:
    """Provide ``recording.nc``: two minutes of the bundled recording, with its tank."""
    dw.save_trajectory(dw.tank30_recording().isel(time=slice(1200)), folder / "recording.nc")
    return {}


def _several_worlds(folder: Path) -> Names:
    """Provide ``sim.nc``: four replicates of some seconds."""
    words = ("--flow", FLOW, "--duration", "5s", "--replicates", "4", "-o", folder / "sim.nc")
    done = here("simulate", *words)
    assert done.code == 0, done.err
    return {}


def _one_block(folder: Path) -> Names:
    """Provide ``one.nc``: two minutes of one block, with its tank."""
    dw.save_trajectory(dw.tank30_recording().isel(time=slice(1200)), folder / "one.nc")
    return {}


def _assembled(folder: Path) -> Names:
    """Provide ``blocks.csv``: two minutes of four simulated blocks, the run 3 of the default study.

    The bodies have letters for names.
    """
    path = dw.assembly_path(dw.Study(), dw.tank30_flow(), runs=[3], duration=120.0)
    blocks = dw.path_recording(path, run=3).assign_coords(body=list("ABCD"))
    dw.save_trajectory(blocks, folder / "blocks.csv")
    return {}


FEW_NODES = "--runs 20 --truths 20"


def _counted(folder: Path) -> Names:
    """Provide ``counts.csv``: outcomes of two blocks."""
    (folder / "counts.csv").write_text("class,count\n2,12\n1+1,8\n", encoding="utf-8")
    return {}


def _chains(folder: Path) -> Names:
    """Provide ``four/`` and ``real/``: runs of a chain, and as many recordings of another one."""
    for name, seed, runs in (("four", 1, 40), ("real", 2, 12)):
        (folder / name).mkdir()
        found = chain_runs(runs, seed)
        found.to_netcdf(folder / name / ("assembly.nc" if name == "four" else "tuesday.nc"))
    return {}


def _fitted(folder: Path) -> Names:
    """Provide ``fit/``: a run directory of a fit of a minute, and ``four/`` of what it builds."""
    fit, four = folder / "fit", folder / "four"
    words = ("--to", "60s", "--tank", "30cm", "--spline-spacing", "4cm", "--no-check")
    few = ("--runs", "20", "--duration", "20s", "--film", "none")

    def make() -> None:
        assert here("fit", RECORDING, *words, "-o", fit).code == 0
        assert here("assemble", fit, *few, "-o", four).code == 0

    made_once_in([fit, four], "fit and assembly of the pages", make)
    return {}


def _pixels(folder: Path) -> Names:
    """Provide tables that need an option: pixels, a clock without a unit, an unnamed body."""
    rows = [f"{10 + k}\t{20 + k}\t1\t{30 + k}\t40\t1\t" for k in range(20)]
    text = "\n".join(["X1\tY1\tProbId1\tX2\tY2\tProbId2\t", *rows, ""])
    (folder / "trajectories.txt").write_text(text, encoding="utf-8")
    clock = 1_400_000_000_000_000_000 + 5_000_000 * np.arange(301)
    stamps = [f"{t},{0.001 * k:.3f},0" for k, t in enumerate(clock)]
    (folder / "imu.csv").write_text("\n".join(["timestamp,x,y", *stamps, ""]), encoding="utf-8")
    places = [f"{40 * n + k},{30 * n + k},{k},{n}" for k in range(5) for n in range(17)]
    lines = ["x,y,frame,Teilchen", *places, ""]
    (folder / "tracks.csv").write_text("\n".join(lines), encoding="utf-8")
    return {}


def _poses(folder: Path) -> Names:
    """Provide a file of SLEAP's, and one that is nearly such."""
    step = np.arange(100.0)
    nodes = np.stack(
        [np.stack([200 + step, 300 + 0 * step]), np.stack([190 + step, 300 + step])], 1
    )
    with h5py.File(folder / "flies.analysis.h5", "w") as file:
        file["tracks"] = nodes[None]
        file["node_names"] = np.array(["thorax", "abdomen"], "S")
        file["track_names"] = np.array(["fly"], "S")
        file["point_scores"] = np.full((1, 2, 100), 0.9)
    with h5py.File(folder / "results.h5", "w") as file:
        file["tracks"], file["track_names"] = nodes, np.array(["fly"], "S")
    return {}


def _pendulum(folder: Path) -> Names:
    """Provide a log of the format that the page adds."""
    (folder / "log.txt").write_text("#pendulum\n0|1.5|2\n1|3|4\n", encoding="utf-8")
    return {"ReadOptions": ReadOptions, "LOG": folder / "log.txt"}


def _markers(folder: Path) -> Names:
    """Provide ``video.mp4`` with its ``markers.toml``."""
    _film(4, 4.0)(folder)
    words = ("--tank", "30cm", "--side", "3cm", "-o", folder / "markers.toml")
    done = here("markers", "teach", folder / "video.mp4", *words)
    assert done.code == 0, done.err
    return {}


def _wide_tracks(folder: Path) -> Names:
    """Provide ``tracks.csv``: a simulated block of 4 cm, in pixels of 0.5 mm at 25 Hz."""
    study = dw.apply_overrides(
        dw.Study(),
        {
            "tank.diameter_m": 0.4,
            "block.side_m": 0.04,
            "block.mass_kg": 0.024,
            "simulation.duration_s": 120.0,
            "simulation.sample_rate_Hz": 25.0,
            "observation.position_noise_m": 3e-4,
            "observation.orientation_noise_rad": 0.01,
        },
    )
    flow, wider = dw.tank30_flow(), 0.4 / 0.3
    arena = {"shape": "circle", "diameter_m": 0.4, "center_m": [0.0, 0.0]}
    flow = flow.assign_coords(x=wider * flow["x"], y=wider * flow["y"])
    flow = flow.assign_attrs(arena=json.dumps(arena), cell_size_m=wider * flow.attrs["cell_size_m"])
    path = dw.simulate(study, flow).isel(replicate=0, body=0)
    columns = [
        np.arange(path.sizes["time"]),
        1e3 + path["x"].values / 5e-4,
        1e3 - path["y"].values / 5e-4,
        np.degrees(-path["theta"].values),
    ]
    heads = "frame,x_px,y_px,theta_deg"
    table = np.stack(columns, axis=1)
    np.savetxt(folder / "tracks.csv", table, "%.4f", ",", header=heads, comments="")
    return {}


MODEL_FILE = """\
import numpy as np


def diffuse(scene, *, diffusivity=(1e-6, 1e-4, "m2/s")):
    spread = np.sqrt(2 * diffusivity * np.diff(scene.times, prepend=0.0))
    x, y = (np.cumsum(spread * scene.random.normal(spread.size), axis=1) for _ in "xy")
    return scene.start.x[:, None] + x, scene.start.y[:, None] + y
"""
STUDY = "a study of hours, which the page names to repeat it"
OTHERS = "needs recordings of others, which are not part of the project"
LONG = "a calibration of minutes, whose results the page gives; the how-to pages run it smaller"
INSTALLS = "installs, builds or tests the project; CI runs it"
DEMO = "takes a minute or two; has a test"
DOCKER = "needs Docker"
TIMES = "measures times, for minutes on a quiet machine"
KS_SCATTER = 0.008
"""Of two KS distances of half an hour simulated in a fitted flow, three standard deviations: other
last bits of the flow are another world, and four machines gave 0.019 to 0.023."""
FEW_RUNS = "--runs 20 --film none"
CAMERA = {"camera:0": "video.mp4"}  # no camera here: a file in its place
# A minute of 2 x 2 settings instead of half a day.
FEW_OF_YIELD = "--blocks 2 --duration 20s --fresh-runs 20"
FEW_SETTINGS = "--runs 10 --realisations 2 --duration 1min"

PAGES: dict[str, Page] = {
    "README.md": Page(
        provide=_files(_recording(), _wide_tracks, _film(1, 4.0)),
        not_run={"make *": INSTALLS},
        makes=("mine/fit.nc",),
        numbers=Numbers.SAME,
        # Thousand runs in a fitted flow; the size of a compressed file.
        numbers_of={
            "driftwalk assemble *": Numbers.RUNS,
            "driftwalk report *": Numbers.CLOSE,
        },
        draws=False,
        slow=True,
    ),
    "CONTRIBUTING.md": Page(
        not_run={"make *": INSTALLS, ".ci/*": INSTALLS},
    ),
    "docs/explanation/assembly.md": Page(
        provide=_wide_tank,
        not_run={"python studies/*": STUDY},
        holds=("tank.x.shape == tank.assembly.shape == (64,)",),
    ),
    "docs/explanation/motion-models.md": Page(
        provide=_files(_minutes(recording=0.5), _tumble_search),
        # The block of the recording is slower than the page's robot.
        instead={
            "dw.calibrate(recording, model)": "dw.calibrate(recording, model, study=SMALL)",
            "(0.1, 0.6,": "(0.02, 0.12,",
        },
        holds=("0.02 < found['estimate'].sel(parameter='speed') < 0.12",),
        draws=False,
        slow=True,
    ),
    "docs/explanation/performance.md": Page(
        not_run={"make bench": TIMES, "python benchmarks/*": TIMES},
    ),
    "docs/explanation/sweeps.md": Page(
        holds=("speed.shape == (2, 2, 3)", "pool.submit(abs, -1).result() == 1")
    ),
    "docs/how-to/add-a-format.md": Page(
        provide=_pendulum,
        holds=(
            "LOADER.sniff(LOG.read_bytes(), LOG) == 0.9",
            "LOADER.read(LOG, ReadOptions()).bodies[0].x.tolist() == [1.5, 3.0]",
        ),
    ),
    "docs/how-to/assemble.md": Page(
        provide=_files(_recording(300.0), _flow("flow_true.csv"), _assembled, _series),
        instead={
            "fit bot.nc": "fit --no-check bot.nc",
            "assemble fit/": f"assemble fit/ {FEW_RUNS}",
            "--flow series.nc": f"--flow series.nc {FEW_RUNS}",
            "runs=100)": "runs=4)",
        },
        holds=(
            "sizes['size_to'].values[-1] == 16",
            "times['proportion'].dims == ('time', 'class')",
        ),
        numbers=Numbers.SAME,
        draws=False,
        slow=True,
        parts_weekly=("-o discs/", "-o many/"),
    ),
    "docs/how-to/calibrate-a-moving-body.md": Page(
        provide=_active_body,
        instead={
            "--model active ": "--model active --parameter clearance=0.015 ",
            "run-tumble+wall --parameter turn_rate=0": "active+diffusion --parameter turn_rate=0.3 "
            "--parameter clearance=0.015 --bootstrap 20",
        },
        makes=("run/model_calibration.nc", "known/model_calibration.nc", "drawn/posterior.csv"),
        draws=False,
        weekly=True,
    ),
    "docs/how-to/calibrate-your-own-model.md": Page(
        provide=_files(_minutes(recording=0.5), _tumble_search),
        instead={"dw.calibrate(recording, model)": "dw.calibrate(recording, model, study=SMALL)"},
        holds=(
            "0 <= found['estimate'].sel(parameter='speed') <= 0.1",
            "TestTumble().model().name == 'tumble'",
            "own.parameters[0].high == 5e-5",
            "(other.name, other.parameters[1].scale) == ('simulator', 'log')",
            "sim.attrs['model'] == 'tumble'",
        ),
        draws=False,
        slow=True,
    ),
    "docs/how-to/compare-models.md": Page(
        provide=_recording(20.0),
        instead={"-o compare": "--models inertial,active+wall --bootstrap 0 -o compare"},
        makes=("compare/comparison.nc",),
        draws=False,
        little=True,
        weekly=True,
    ),
    "docs/how-to/design-an-experiment.md": Page(
        provide=_files(_flow("flow_true.csv"), _truth),
        instead={
            "recordings = 30": "recordings = 2",
            '["5min", "10min", "20min", "40min"]': '["40s", "1min"]',
            "--duration 10min": "--duration 40s --bootstrap 10",
            "--recordings 20": "--recordings 2",
            '"recover.recordings": 10': '"recover.recordings": 2, "calibration.bootstrap": 5',
            '"recover.durations_s": ["10min"]': '"recover.durations_s": ["40s"]',
        },
        holds=(
            "'duration' in found['coverage'].dims",
            "recovered.attrs['kind'] == 'model_recovery'",
        ),
        draws=False,
        little=True,
        weekly=True,
    ),
    "docs/how-to/dimer.md": Page(
        provide=_block_and_dimer,
        instead={"circle:30cm": "circle:32cm"},
        holds=("len(known) == 2",),
        draws=False,
        weekly=True,
    ),
    "docs/how-to/fit.md": Page(
        provide=_files(
            _recording(),
            _recording(60.0, "first.csv"),
            _recording(90.0, "second.csv"),
            _search("small.toml"),
            _study,
            _flow("piv.csv"),
            _minutes(first=1, second=1.5),
        ),
        instead={
            "assemble ": f"assemble {FEW_RUNS} ",
            "sensitivity fit/": "sensitivity fit/ --runs 4 --realisations 2 --duration 20s",
            "fit first.csv": "fit --no-check first.csv",
            "fit disc.csv": "fit --no-check first.csv",
            "fit raft.csv": "fit --no-check first.csv",
            "fit recording.csv --mass": "fit --no-check first.csv --mass",
            "fit recording.csv --flow": "fit --no-check first.csv --flow",
            "fit recording.csv --law": "fit --no-check first.csv --law",
            "fit recording.csv --wall": "fit --no-check first.csv --wall",
            "fit recording.csv --compare": "fit --no-check first.csv --to 40s --compare",
            "fit recording.csv --switching-times 10min,20min": "fit --no-check first.csv "
            "--switching-times 20s,40s",
        },
        numbers_of={"driftwalk fit recording.csv --tank *": Numbers.SAME},
        by_chance={"KS distance": KS_SCATTER},
        holds=("bool(fit['converged'])", "flow.attrs['kind'] == 'flow_field'"),
        draws=False,
        slow=True,
        parts_weekly=(
            *("sensitivity fit/", "simulate fit/", "-o raft/", "-o both/", "--switching-times"),
            *("switched/fit.nc", "-o paper/", "--compare-laws"),
        ),
    ),
    "docs/how-to/flow-field.md": Page(
        provide=_files(_recording(), _tracks),
        numbers=Numbers.SAME,
        holds=("u.shape == (2,)", "water.attrs['tracks_used'] == 1500"),
        slow=True,
    ),
    "docs/how-to/install.md": Page(
        not_run={"pip install *": INSTALLS, "driftwalk demo --quick": DEMO, "docker *": DOCKER},
    ),
    "docs/how-to/load-a-recording.md": Page(
        provide=_files(_recording(60.0), _pixels, _poses),
        numbers=Numbers.SAME,
        slow=True,
    ),
    "docs/how-to/report.md": Page(
        provide=_files(_recording(60.0), _calibrated, _simulated, _fitted),
        draws=False,
        slow=True,
    ),
    "docs/how-to/take-your-tracks-elsewhere.md": Page(
        provide=_files(_one_recording, _several_worlds, _calibrated),
        makes=("tracks/README.md", "one/replicate_3.csv", "film/recording.gif", "paper/ks_map.pdf"),
        weekly=True,
    ),
    "docs/how-to/control.md": Page(
        provide=_files(_fitted),
        instead={
            "--by 5min --every 5s --vary flow-scale=0,0.5,1,1.5 "
            "--vary force-std=0.2mN,0.55mN,1.2mN": "--by 20s --every 5s --vary flow-scale=0,1 "
            "--blocks 4 --rounds 1 --worlds 20",
            "--worlds 2000": "--worlds 20",
            # Whether a stream is followed is tested with a real one, in test_control_live.py.
            "control run policy/ --live 127.0.0.1:5000 | python pumps.py": "control run --help",
            "control run policy/ --live 127.0.0.1:5000": "control run --help",
        },
        holds=("found.attrs['worlds'] == 40",),
        makes=("policy/policy.nc", "test/control_test.nc"),
        draws=False,
        slow=True,
    ),
    "docs/how-to/kinetics.md": Page(
        provide=_files(_assembled, _chains),
        holds=("found.attrs['target'] == 'T'", "found.sizes['class'] == 7"),
        makes=("kinetics/kinetics.nc", "to-T/kinetics.nc", "both.html", "eight/manifest.json"),
        draws=False,
        slow=True,
    ),
    "docs/how-to/outcomes-alone.md": Page(
        provide=_files(_counted, _chains, _flow("flow.nc")),
        instead={
            "--mass 11.6g -o": f"--mass 11.6g --blocks 2 --after 4s {FEW_NODES} -o",
            "infer-outcomes real/": f"infer-outcomes real/ {FEW_NODES} --after 20s",
            "after=20.0": "after=4.0, runs=20, truths=20",
        },
        holds=("found.attrs['blocks'] == 2",),
        makes=("posterior.html", "from-real/posterior.nc"),
        draws=False,
        weekly=True,
    ),
    "docs/how-to/sensitivity.md": Page(
        provide=_files(_calibrated, _flow("flow_true.csv", "flow.nc", "piv.csv")),
        instead={
            "sensitivity run/ -o": f"sensitivity run/ {FEW_SETTINGS} "
            "--vary drag-coefficient=0.3:0.6:0.3 --vary force-std=0.3mN:0.6mN:0.3mN -o",
            "--force-std 0.55mN -o": f"--force-std 0.55mN {FEW_SETTINGS} "
            "--vary drag-coefficient=0.3:0.6:0.3 -o",
            "sensitivity run/ --vary": f"sensitivity run/ {FEW_SETTINGS} --vary",
            "--sobol 64": "--sobol 8 --runs 4 --realisations 2 --duration 20s",
        },
        holds=(
            "dw.outcome_distribution(again).attrs['complete'] == float(setting['complete'])",
            "rules['l1_distance'].shape == (2,)",
        ),
        draws=False,
        weekly=True,
    ),
    "docs/how-to/yield.md": Page(
        provide=_files(_fitted),
        instead={
            "--target T --by 2min --vary flow-scale=0.5:1.5": f"--target 2 {FEW_OF_YIELD} "
            "--runs 1300 --by 10s --vary flow-scale=0.5:1.5",
            "--target T --vary flow-scale=0,0.5,1,1.5": f"--target 2 {FEW_OF_YIELD} "
            "--runs 960 --vary flow-scale=0,0.5,1,1.5",
            "--target T --by 2min --vary tank=25cm,30cm --vary blocks=4,5": "--target 2 --by 10s "
            f"{FEW_OF_YIELD} --runs 160 --vary tank=25cm,30cm --vary blocks=2,3",
            'target="T",': 'target="2", blocks=2, duration="20s", fresh_runs=20,',
            'by="2min",': 'by="10s", selection_runs=1300,',
        },
        holds=("found.attrs['target'] == '2'",),
        makes=("yield/yields.nc", "listed/yields.nc", "tanks/yields.nc", "yield.html"),
        draws=False,
        weekly=True,
    ),
    "docs/how-to/simulate.md": Page(
        provide=_files(_flow("flow.nc"), _diffusing, _fitted),
        holds=("run.sizes['replicate'] == 8", "like.attrs['model'] == 'active'"),
        makes=("block.nc", "beetle.nc", "own.nc", "like.nc", "found.nc"),
        draws=False,
        slow=True,
    ),
    "docs/how-to/track.md": Page(
        provide=_files(_film(4, 6.0), _one_block, _calibrated),
        instead={
            **CAMERA,
            "fit recording.nc": "fit one.nc --no-check",  # the page: a recording of one block
            "report recording.nc": "report one.nc",
            "assemble run/": f"assemble run/ {FEW_RUNS}",
            '"assembly.duration_s": 60.0': '"assembly.duration_s": 2.0',
        },
        makes=("markers.png", "recording.html", "video.mkv"),
        draws=False,
        weekly=True,
    ),
    "docs/how-to/use-as-a-library.md": Page(
        provide=_files(_recording(120.0), _search("study.toml")),
        holds=("result.attrs['kind'] == 'calibration'",),
        makes=("figures/ks_map.png",),
        slow=True,
    ),
    "docs/how-to/use-a-cluster.md": Page(
        provide=_calibrated_twice,
        holds=("table.shape == (2, 2)", "'drag_coefficient' in table"),
        not_run={"pip install *": INSTALLS, "driftwalk *": "needs workers; has a test"},
        slow=True,
    ),
    "docs/how-to/take-the-model-to-your-simulator.md": Page(
        provide=_calibrated,
        instead={
            "import mujoco, floating_block": "import os, sys\n\nos.chdir('tank')\n"
            "sys.path.insert(0, '.')\nimport mujoco, floating_block",
        },
        holds=("0.99 < data.time < 1.01", "mujoco.set_mjcb_passive(None) is None"),
        needs=("mujoco",),
        weekly=True,
    ),
    "docs/how-to/use-a-simulator.md": Page(
        provide=_robot_in_mujoco,
        instead={
            "python3 mujoco_robot.py": f"{shlex.quote(sys.executable)} mujoco_robot.py",
            "-o run": "--replicates 1 --bootstrap 4 -o run",
        },
        not_run={"pip install *": INSTALLS, "driftwalk *ode_model.py*": "needs ODE; has a test"},
        makes=("run/calibration.nc",),
        needs=("mujoco",),
        draws=False,
        little=True,
        weekly=True,
    ),
    "docs/how-to/view.md": Page(
        provide=_files(_recording(60.0), _calibrated, _markers, _search("study.toml")),
        instead=CAMERA,
        not_run={
            "ssh -L 8765:127.0.0.1:8765 cluster driftwalk view run/": "needs another machine",
        },
        draws=False,
        slow=True,
        parts_weekly=tuple(
            f"play {word}"
            for word in ("run/", "--study", "--tank", "--body-shape", "--live", "--model")
        ),
    ),
    "docs/reference/datasets.md": Page(
        provide=_files(_search("search.toml"), _with_intervals, _minutes(recording=0.5)),
        slow=True,
    ),
    "docs/reference/live-stream.md": Page(
        streams=True,
        holds=("message['type'] == 'frame'", "printed.count('\\n') > 3"),
        slow=True,
    ),
    "docs/reference/models-on-recordings.md": Page(not_run={"python studies/*": STUDY}),
    "docs/reference/page-data.md": Page(provide=_report, holds=("values.size > 1",), slow=True),
    "docs/reference/study-file.md": Page(),
    "docs/tutorials/first-calibration.md": Page(
        provide=_search("small.toml"),
        instead={
            "calibrate recording.csv --study study.toml": "calibrate recording.csv --to 900s "
            "--study small.toml"
        },
        not_run={"make demo": INSTALLS, ". .venv/bin/activate": INSTALLS},
        numbers=Numbers.SAME,
        # Both simulate in a fitted flow; of half an hour in one world chance makes what it likes.
        numbers_of={"driftwalk compare *": Numbers.ANY},
        by_chance={"KS distance": KS_SCATTER},
        draws=False,
        weekly=True,
    ),
    "docs/tutorials/your-own-model.md": Page(
        holds=("len(track) == 2000",),
        makes=("run/calibration.nc", "compare/comparison.nc"),
        numbers=Numbers.CLOSE,
        draws=False,
        weekly=True,
    ),
    "docs/validation.md": Page(
        not_run={
            "D=*": LONG,
            "driftwalk calibrate $D/*": LONG,
            "python studies/*": STUDY,
            "make studies-tracking *": STUDY,
            "driftwalk *video.mkv *": "docs/how-to/track.md runs the same on another video",
            "driftwalk *mouse*": OTHERS,
            "cd studies/real": OTHERS,
            "driftwalk calibrate $DATA/*": OTHERS,
            "S=*": OTHERS,
            "for b in *": OTHERS,
            "python table.py *": OTHERS,
            "python picture.py *": OTHERS,
        },
    ),
}
NOT_COMPARED: dict[str, str] = {
    "driftwalk calibrate recording.nc --model active *": "10 min of search: a test takes less",
    "driftwalk study recover *": "takes hours: a test takes few and short recordings",
    "driftwalk report run/ *": "the size of a page with all figures, which a test leaves out",
    "driftwalk calibrate recording.csv --study *": "takes minutes: a test has a smaller search",
    "driftwalk compare recording.csv sim.nc": "of half an hour in one world",
    "driftwalk fit recording.csv --flow piv.csv *": "of half an hour: a test takes a part of it",
}
"""Commands whose shown numbers no test compares with fresh ones, and why."""
"""The pages with examples. Each of `ELSEWHERE` has a test of its own."""
ELSEWHERE = {"docs/tutorials/notebook.md": "tests/integration/test_notebook.py"}
