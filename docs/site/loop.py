"""The loop of the front page: a film, the track in it, the fitted flow, and blocks that assemble.

    python docs/site/loop.py FIT docs/site/theme/loop.svg

FIT is a finished `driftwalk fit` of the recording that `driftwalk demo` fits, such as ``demo/fit``.
Everything that is drawn comes from driftwalk: rendered frames, the recording, the flow of the fit,
and one simulated run with its parameters.
"""

from __future__ import annotations

import base64
import sys
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
import xarray as xr

import driftwalk as dw

SCENE_S: Final = 3.0
SCENES: Final = 4
SIZE: Final = 400
RADIUS: Final = 188
FRAMES: Final = 14
SEED: Final = 5
"""A run whose four blocks are one assembly after 25 s."""
BEFORE_S, AFTER_S = 60.0, 6.0
SHADES: Final = ("#9ecae1", "#6baed6", "#3182bd", "#08519c")


def write(fit: Path, target: Path) -> None:
    """Write the loop as one SVG that CSS moves."""
    with xr.open_dataset(fit / "recording.nc", decode_times=False) as recording:
        film, track = _film(), _track(recording)
    with xr.open_dataset(fit / "flow.nc") as flow:
        blocks, moves = _blocks(flow.load())
        arrows = _arrows(flow)
    total = SCENE_S * SCENES
    rules = [
        f"#loop *{{animation-duration:{total:g}s;animation-iteration-count:infinite;"
        "animation-timing-function:linear;transform-box:view-box}",
        *(_shown(scene, *span) for scene, span in enumerate(((0, 1), (1, 3), (2, 4), (3, 4)))),
        "@keyframes draw{0%,25%{stroke-dashoffset:1}48%,100%{stroke-dashoffset:0}}",
        ".track{animation-name:draw;stroke-dasharray:1}",
        *(_frame(k) for k in range(FRAMES)),
        *moves,
        "@media (prefers-reduced-motion:reduce){#loop *{animation:none}.scene0{opacity:0}}",
    ]
    middle = SIZE // 2
    tank = f'<circle cx="{middle}" cy="{middle}" r="{RADIUS}"'
    target.write_text(
        f'<svg id="loop" viewBox="0 0 {SIZE} {SIZE}" xmlns="http://www.w3.org/2000/svg" role="img" '
        'aria-label="A film of a block in a round tank, its track, the flow that was fitted to it, '
        'and four blocks that assemble in this flow">'
        f"<style>{''.join(rules)}</style>"
        f'<clipPath id="tank">{tank}/></clipPath>{tank} class="water"/>'
        f'<g clip-path="url(#tank)"><g class="scene0">{film}</g></g>'
        f'<g class="scene2">{arrows}</g><g class="scene1">{track}</g><g class="scene3">{blocks}</g>'
        f'{tank} class="rim"/></svg>\n',
        encoding="utf-8",
    )


def _shown(scene: int, first: int, end: int) -> str:
    """Return the rule by which a scene comes, and goes."""
    low, high = (100.0 * at / SCENES for at in (first, end))
    begin = f"0%,{low:g}%{{opacity:0}}{low + 2:g}%" if first else "0%"
    stop = f"{min(high, 98):g}%{{opacity:1}}{min(high + 2, 100):g}%,100%{{opacity:0}}"
    return (
        f"@keyframes s{scene}{{{begin}{{opacity:1}}{stop}}}.scene{scene}{{animation-name:s{scene}}}"
    )


def _film() -> str:
    recording = dw.tank30_recording("without_noise").sel(time=slice(20.0, 20.0 + FRAMES * 0.2))
    settings = dw.video_settings("moderate")
    shown = []
    frames = [image for _, image in dw.render_video(recording, settings)]
    for k in range(FRAMES):
        image = frames[k * len(frames) // FRAMES]
        height, width = image.shape[:2]
        side = min(height, width)
        left, top = (width - side) // 2, (height - side) // 2
        square = cv2.resize(image[top : top + side, left : left + side], (280, 280))
        _, data = cv2.imencode(".jpg", square, [cv2.IMWRITE_JPEG_QUALITY, 55])
        text = base64.b64encode(data.tobytes()).decode()
        shown.append(
            f'<image class="f{k}" width="{SIZE}" height="{SIZE}" '
            f'href="data:image/jpeg;base64,{text}"/>'
        )
    return "".join(shown)


def _frame(k: int) -> str:
    """Return the rule by which a frame of the film is shown: the last one stays."""
    low = 25.0 * k / FRAMES
    return (
        f"@keyframes f{k}{{0%,{low:.4g}%{{opacity:0}}{low + 0.01:.4g}%,100%{{opacity:1}}}}"
        f".f{k}{{animation-name:f{k}}}"
        if k
        else ""
    )


def _track(recording: xr.Dataset) -> str:
    part = recording.isel(body=0).sel(time=slice(20.0, 110.0)).isel(time=slice(None, None, 3))
    x, y = _place(part["x"].values, part["y"].values)
    kept = np.isfinite(x) & np.isfinite(y)
    points = "L".join(f"{a:.0f} {b:.0f}" for a, b in zip(x[kept], y[kept], strict=True))
    return f'<path class="track" pathLength="1" d="M{points}"/>'


def _arrows(flow: xr.Dataset) -> str:
    speed = np.hypot(flow["u"], flow["v"]).values
    top, every = float(np.nanmax(speed)), 4
    drawn: dict[str, list[str]] = {}
    for row in range(every // 2, flow.sizes["y"], every):
        for column in range(every // 2, flow.sizes["x"], every):
            here = {"x": column, "y": row}
            place = np.hypot(flow["x"].values[column], flow["y"].values[row])
            if place > 0.135 or not np.isfinite(speed[row, column]):
                continue
            (x,), (y,) = _place(flow["x"].values[[column]], flow["y"].values[[row]])
            u, v = (26.0 / top * float(flow[name].isel(here)) for name in ("u", "v"))
            shade = SHADES[min(int(len(SHADES) * speed[row, column] / top), len(SHADES) - 1)]
            tip = (x + u, y - v)
            ends = [
                (tip[0] - 0.3 * u + s * 0.18 * v, tip[1] + 0.3 * v + s * 0.18 * u) for s in (1, -1)
            ]
            (a, b), (c, d) = ends
            drawn.setdefault(shade, []).append(
                f"M{x:.0f} {y:.0f}L{tip[0]:.1f} {tip[1]:.1f}M{a:.1f} {b:.1f}L{tip[0]:.1f} "
                f"{tip[1]:.1f}L{c:.1f} {d:.1f}"
            )
    return "".join(
        f'<path class="arrow" stroke="{shade}" d="{"".join(parts)}"/>'
        for shade, parts in drawn.items()
    )


def _blocks(flow: xr.Dataset) -> tuple[str, list[str]]:
    """Return four blocks, and the rules by which they move until they are one assembly."""
    study: Any = dw.Study(
        forces={"drag_coefficient": 0.3928, "force_std_N": 0.6154e-3, "force_interval_s": 0.016},
        assembly={"blocks": 4, "duration_s": 240.0, "seed": SEED},
    )
    path = dw.assembly_path(study, flow, sample_interval=1.0).isel(run=0)
    joined = (path["assembly"] == path["assembly"].isel(block=0)).all("block").values
    done = float(path["time"].values[joined.argmax()]) if joined.any() else 200.0
    print(f"one assembly after {done:g} s")
    part = path.sel(time=slice(max(done - BEFORE_S, 0.0), done + AFTER_S))
    x, y = _place(part["x"].values, part["y"].values)
    theta = -np.degrees(np.unwrap(part["theta"].values, axis=0))
    at = np.linspace(75.0, 98.0, part.sizes["time"])
    side = 0.03 / 0.15 * RADIUS
    rules, shapes = [], []
    for k in range(part.sizes["block"]):
        steps = [
            f"translate({a:.0f}px,{b:.0f}px) rotate({c:.0f}deg)"
            for a, b, c in zip(x[:, k], y[:, k], theta[:, k], strict=True)
        ]
        frames = "".join(
            f"{place:.4g}%{{transform:{step}}}" for place, step in zip(at, steps, strict=True)
        )
        rules.append(
            f"@keyframes b{k}{{0%{{transform:{steps[0]}}}{frames}100%{{transform:{steps[-1]}}}}}"
            f".b{k}{{animation-name:b{k};transform:{steps[-1]}}}"
        )
        low = -0.5 * side
        shapes.append(
            f'<g class="b{k}"><rect class="block" x="{low:.1f}" y="{low:.1f}" width="{side:.1f}" '
            f'height="{side:.1f}"/></g>'
        )
    return "".join(shapes), rules


def _place(x: Any, y: Any) -> tuple[Any, Any]:
    """Return places in the tank [m] as those in the picture."""
    scale = RADIUS / 0.15
    return SIZE / 2 + scale * x, SIZE / 2 - scale * y


if __name__ == "__main__":
    write(Path(sys.argv[1]), Path(sys.argv[2]))
