"""How fast, and in how much memory, a text recording of ten million rows is read.

    python benchmarks/bench_read.py [--rows 10000000] [--form NAME]

Each form is written once and read in a fresh process, because the peak of the memory is that of a
process. The share is that of the file's size which the reading takes besides what Python and its
libraries have. Checked, else the script fails: the positions that come back are those that were
written.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from timing import machine

TARGET_MB_S = 20.0
TARGET_SHARE = 1.5
PIECE = 100_000
FORMS = ("csv", "theta", "bodies", "comma", "utf16", "iso", "animalta")
EPOCH = np.datetime64("2024-05-01T12:00:00", "ms")


def places(rows: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield frame, x, y [um] and angle [1e-4 rad] of a synthetic path, piece by piece."""
    for start in range(0, rows, PIECE):
        frame = np.arange(start, min(start + PIECE, rows))
        angle = 2.0 * np.pi * frame / 5000.0
        x, y = (np.rint(120_000 * f(angle)).astype(int) for f in (np.cos, np.sin))
        yield frame, x, y, frame * 7 % 31_415


def decimal(values: np.ndarray, digits: int) -> list[str]:
    whole, part = np.divmod(np.abs(values), 10**digits)
    signs = np.where(values < 0, "-", "")
    pairs = zip(signs, whole.tolist(), part.tolist(), strict=True)
    return [f"{sign}{w}.{p:0{digits}d}" for sign, w, p in pairs]


def lines(form: str, rows: int) -> Iterator[list[str]]:
    """Yield the lines of a file, its header first."""
    headers = {"theta": "t,x,y,theta", "bodies": "t,x,y,body", "iso": "time,x,y"}
    headers |= {"comma": "t;x;y", "animalta": "Frame;Time;X_Arena0_Ind0;Y_Arena0_Ind0"}
    yield [headers.get(form, "t,x,y")]
    for frame, x, y, angle in places(rows):
        columns = [decimal(frame * 25 // (2 if form == "bodies" else 1), 3)]
        if form == "bodies":
            columns = [decimal(frame // 2 * 25, 3)]
        if form == "iso":
            columns = [(EPOCH + 25 * frame).astype(str).tolist()]
        columns += [decimal(x, 6), decimal(y, 6)]
        if form == "theta":
            columns.append(decimal(angle, 4))
        if form == "bodies":
            columns.append([("left", "right")[k % 2] for k in frame.tolist()])
        if form == "animalta":
            columns = [frame.astype(str).tolist(), decimal(frame * 4, 2), *columns[1:]]
        mark = ";" if form in ("comma", "animalta") else ","
        text = [mark.join(row) for row in zip(*columns, strict=True)]
        yield [line.replace(".", ",") for line in text] if form == "comma" else text


def write(path: Path, form: str, rows: int) -> None:
    encoding = "utf-16" if form == "utf16" else "utf-8"
    with path.open("w", encoding=encoding) as file:
        for part in lines(form, rows):
            file.write("\n".join(part) + "\n")


def read(path: Path, form: str, rows: int) -> None:
    """Read a file and print its time and the peak of the memory; stop where a number is wrong."""
    import pandas  # noqa: F401  # loaded by the reading, not a part of it
    import xarray  # noqa: F401

    import driftwalk as dw

    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    options = {"metres_per_pixel": 1.0} if form == "animalta" else {}
    begin = time.process_time()
    recording = dw.load(path, **options)
    seconds = time.process_time() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    samples = recording["x"].to_numpy()
    found = samples[np.isfinite(samples)] if form == "bodies" else samples[:, 0]
    at = 0
    for _, x, _, _ in places(rows):
        part = found.ravel()[at : at + x.size]
        if not (part == x / 1e6).all():
            sys.exit(f"wrong answer: other positions than were written, near row {at}")
        at += x.size
    if found.size != rows:
        sys.exit(f"wrong answer: {found.size} positions of {rows}")
    print(seconds, before * 1024, peak * 1024)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rows", type=int, default=10_000_000)
    parser.add_argument("--form", choices=FORMS)
    parser.add_argument("--read", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.read is not None:
        read(options.read, options.form, options.rows)
        return
    print(machine())
    print(f"\n{'form':<10} {'MB':>6} {'s':>6} {'MB/s':>6} {'target':>7} {'peak MB':>8}", end="")
    print(f" {'of that Python':>14} {'share':>6} {'target':>7}")
    for form in [options.form] if options.form else FORMS:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "recording.csv"
            write(path, form, options.rows)
            # UTF-16 has two bytes for a letter, and its plain text has one.
            size = path.stat().st_size / (2 if form == "utf16" else 1)
            words = ["--read", str(path), "--form", form, "--rows", str(options.rows)]
            answer = subprocess.run(
                [sys.executable, __file__, *words], check=True, capture_output=True, text=True
            )
        seconds, before, peak = map(float, answer.stdout.split())
        print(
            f"{form:<10} {size / 1e6:>6.0f} {seconds:>6.1f} {size / 1e6 / seconds:>6.1f} "
            f"{TARGET_MB_S:>7.0f} {peak / 1e6:>8.0f} {before / 1e6:>14.0f} "
            f"{(peak - before) / size:>6.2f} {TARGET_SHARE:>7.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
