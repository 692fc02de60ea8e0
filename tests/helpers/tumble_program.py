"""A program that runs and tumbles, and one thing that it does wrong, named by its arguments.

It is written for tests of `driftwalk.motion.ProgramModel` and uses the standard library alone.
`tumble_program.py FAULT [FILE]`: most faults show in requests for more than eight times, so that
the two short worlds at the beginning are sound.
"""

from __future__ import annotations

import itertools
import json
import math
import os
import random
import signal
import sys
import time
from pathlib import Path

FAULT, FILE = (*sys.argv[1:], "", "")[:2]
SHORT = 8
PARAMETERS = [
    {"name": "speed", "unit": "m/s", "low": 0.01, "high": 0.1, "meaning": "speed of a run"},
    {"name": "tumble_rate", "unit": "1/s", "low": 0.1, "high": 10, "scale": "log"},
]


def world(seed, x, y, theta, times, speed, tumble_rate):
    """Return x and y of one world."""
    chance = random.Random(seed)
    xs, ys = [x], [y]
    for before, after in itertools.pairwise(times):
        step = after - before
        if chance.random() < -math.expm1(-tumble_rate * step):
            theta = chance.uniform(-math.pi, math.pi)
        xs.append(xs[-1] + speed * step * math.cos(theta))
        ys.append(ys[-1] + speed * step * math.sin(theta))
    return xs, ys


def positions(asked):
    start = asked["start"]
    rows = [
        world(*one, asked["times_s"], **asked["parameters"])
        for one in zip(asked["seeds"], start["x_m"], start["y_m"], start["theta_rad"], strict=True)
    ]
    return {"id": asked["id"], "x_m": [x for x, _ in rows], "y_m": [y for _, y in rows]}


def first_time():
    """Return whether no copy of the program was here before, and remember that one was."""
    if Path(FILE).exists():
        return False
    Path(FILE).touch()
    return True


def give_up():
    print("\n".join(f"line {k} of the last words" for k in range(20)), file=sys.stderr)
    os._exit(3)


def faulty(asked):  # noqa: C901
    """Return the answer to a request for worlds, as an object or as text."""
    answer = positions(asked)
    x = answer["x_m"]
    if FAULT == "own-chance":
        return {**answer, "x_m": [[value + random.random() for value in row] for row in x]}
    if FAULT == "of-the-batch":
        return {**answer, "x_m": [x[0]] * len(x)}
    if FAULT == "of-the-process":
        return {**answer, "x_m": [[value + os.getpid() for value in row] for row in x]}
    if FAULT == "all-null":
        return {**answer, "x_m": [None] * len(x)}
    if len(asked["times_s"]) <= SHORT:
        return answer
    if FAULT == "die-once" and first_time():
        give_up()
    if FAULT == "die":
        give_up()
    if FAULT == "signal":
        os.kill(os.getpid(), signal.SIGSEGV)
    if FAULT == "hang-or-error" and asked["parameters"]["speed"] > 0.06:
        return {"id": asked["id"], "error": "too fast"}
    if FAULT in ("hang", "hang-or-error"):
        print("still at it", file=sys.stderr, flush=True)
        while True:
            os.system(f"sleep 0.05; echo >> {FILE or os.devnull}")
    if FAULT == "no-line-break":
        sys.stdout.write('{"id": ')
        sys.stdout.flush()
        time.sleep(600)
    if FAULT == "endless":
        while True:
            sys.stdout.write("0, " * 100_000)
    if FAULT == "close-output":
        os.close(1)
        time.sleep(600)
    if FAULT == "errors":
        print("many words\n" * 200_000, file=sys.stderr, flush=True)
    if FAULT == "null":
        return {**answer, "x_m": [[*x[0][:-1], None], *x[1:]], "y_m": [*answer["y_m"][:-1], None]}
    if FAULT == "nan":
        return {**answer, "x_m": [[*x[0][:-1], math.nan], *x[1:]]}
    wrong = {
        "garbage": "starting the engine",
        "list": [1, 2],
        "id": {**answer, "id": asked["id"] + 1},
        "no-y": {"id": asked["id"], "x_m": x},
        "shape": {**answer, "x_m": x[:1] * 9},
        "ragged": {**answer, "x_m": [x[0][:-1], *x[1:]]},
        "text": {**answer, "y_m": [["1.5"] * len(row) for row in x]},
        "true": {**answer, "y_m": [[True] * len(row) for row in x]},
        "theta": {**answer, "theta_rad": [[0.5] * len(row) for row in x]},
        "wrong-theta": {**answer, "theta_rad": 0.5},
        "error": {"id": asked["id"], "error": "the speed\nis too high"},
    }
    return wrong.get(FAULT, answer)


def parameters():
    speed = PARAMETERS[0]
    wrong = {
        "no-list": {},
        "no-name": {"parameters": [{"low": 0, "high": 1}]},
        "steps": {"parameters": [{**speed, "step": 0.03, "refined_step": 0.01}]},
        "no-step": {"parameters": [{**speed, "step": 0}]},
        "text-step": {"parameters": [{**speed, "refined_step": "fine"}]},
        "no-high": {"parameters": [{"name": "speed", "low": 0}]},
        "unknown-key": {"parameters": [{**speed, "units": "m/s"}]},
        "twice": {"parameters": [speed, speed]},
        "empty-range": {"parameters": [{**speed, "high": 0}]},
        "no-parameters": {"error": "no license"},
    }
    return wrong.get(FAULT, {"parameters": PARAMETERS})


def main():
    if FAULT == "no-start":
        sys.exit("the license has expired")
    for line in sys.stdin:
        asked = json.loads(line)
        answer = parameters() if asked.get("request") == "parameters" else faulty(asked)
        print(answer if isinstance(answer, str) else json.dumps(answer), flush=True)
    if FAULT == "last-words":
        Path(FILE).write_text("ended by itself", encoding="utf-8")


main()
