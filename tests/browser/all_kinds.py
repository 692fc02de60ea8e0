"""A section of every kind that a page can have, small, and every text in it replaced by another."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

# What a program reads; everything else in a page is text for people.
STRUCTURE: Final = frozenset({"format", "view", "kind", "data", "style", "shape"})

ARENA: Final = {"shape": "circle", "diameter_m": 0.3}
WAY: Final = {
    "time": [0.0, 0.1, 0.2, 0.3],
    "x": [0.0, 0.01, 0.02, 0.0],
    "y": [0.0, 0.0, 0.01, 0.02],
}
GRID: Final = [[0.1, 0.2], [0.3, None]]
PAIR: Final = [[0.0, 0.0], [1.0, 0.0]]


def axis(name: str) -> dict[str, Any]:
    return {"name": name, "label": "an axis", "unit": "N", "values": [0.1, 0.2]}


def number() -> dict[str, Any]:
    return {
        **{"label": "drag coefficient", "symbol": "C_d", "value": 0.4, "unit": "1"},
        **{"low": 0.3, "high": 0.5, "confidence": 0.95, "note": "a note"},
    }


def trajectory() -> dict[str, Any]:
    return {
        **{"kind": "trajectory", "arena": ARENA, **WAY, "theta": [0.0, 0.1, 0.2, 0.3]},
        **{"gaps": [[0.1, 0.2]], "speed": {"edges": [0.0, 0.1, 0.2], "density": [4.0, 6.0]}},
        "facts": [number()],
    }


def colour_map() -> dict[str, Any]:
    excerpt = [[[0.0, 0.01, 0.02]] * 2] * 2
    return {
        **{"kind": "map", "x": axis("force_std"), "y": axis("drag_coefficient"), "value": GRID},
        **{"standard_error": GRID, "status": [[0, 0], [0, 8]], "statuses": {"8": "not computed"}},
        **{"best": {"x": 0.1, "y": 0.1, "value": 0.1}, "found": {"x": 0.12, "y": 0.11}},
        **{"noise_floor": 0.05, "noise_floor_upper": 0.07, "refined": None, "arena": ARENA},
        "region": {"x": [0.1, 0.2, 0.2], "y": [0.1, 0.1, 0.2], "confidence": 0.95},
        "cells": {
            **{"excerpt_time": [0.0, 0.1, 0.2], "excerpt_x": excerpt, "excerpt_y": excerpt},
            "density": [[GRID] * 2] * 2,
            **{"ks_step_length": GRID, "ks_turning_angle": GRID},
        },
        "recording": {
            **{"density": [[0.5, 0.2], [0.2, 0.1]], "excerpt_x": [0.0, 0.01, 0.02]},
            **{"step_length_edges": [0.0, 0.1, 0.2], "turning_angle_edges": [-1.0, 0.0, 1.0]},
            "excerpt_y": [0.0, 0.01, 0.0],
        },
    }


def lines() -> dict[str, Any]:
    series = [
        {
            **{
                "name": style,
                "x": [0.0, 1.0, 2.0],
                "y": [1.0, 3.0, 2.0][: 2 if style == "step" else 3],
            },
            **{"low": None, "high": None, "style": style},
        }
        for style in ("line", "points", "step")
    ]
    return {
        **{"kind": "lines", "x": {"label": "time", "unit": "s"}, "series": series},
        **{
            "y": {"label": "height", "unit": "m"},
            "marks": [{"x": 1.0, "y": None, "label": "here"}],
        },
    }


def classes() -> dict[str, Any]:
    item = {"class": "2", "cells": PAIR, "count": 6, "share": 0.6, "low": 0.4, "high": 0.8}
    series = [
        {"name": "parameters found", "items": [item, {**item, "class": "1+1", "note": "few"}]}
    ]
    return {"kind": "classes", "confidence": 0.95, "runs": 10, "series": series}


def l1_map() -> dict[str, Any]:
    return {
        **{"kind": "l1_map", "x": axis("force_std"), "y": axis("drag_coefficient"), "value": GRID},
        **{"reference": {"x": 0.1, "y": 0.1}, "noise": 0.05, "label": "l1 distance"},
        **{"classes": ["2", "1+1"], "cells": [PAIR, []], "shares": [[[0.5, 0.5]] * 2] * 2},
        "over_time": over_time(2),
    }


def over_time(rows: int) -> dict[str, Any]:
    return {
        **{"time": [0.0, 1.0], "classes": ["2", "other"], "cells": [PAIR, []]},
        **{"count": [[[[0, 6], [10, 4]]] * 2] * rows, "runs": [[10, 10]] * rows},
        "reference": [[0.0, 0.5], [1.0, 0.5]],
    }


def replay() -> dict[str, Any]:
    still = [[0.0, 0.0, 0.0], [0.03, 0.03, 0.03]]
    run = {
        **{
            "name": "run 1",
            "x": still,
            "y": still,
            "theta": still,
            "assembly": [[0, 0, 0], [1, 0, 0]],
        },
        "events": [{"time": 0.1, "blocks": [0, 1], "class": "2"}],
        "classes": [{"time": 0.0, "class": "1+1"}, {"time": 0.1, "class": "2"}],
    }
    return {
        "kind": "replay",
        "arena": ARENA,
        "side": 0.03,
        "time": [0.0, 0.1, 0.2],
        "runs": [run],
        "cells": {"2": PAIR},
    }


def every_kind() -> list[dict[str, Any]]:
    """Return a section of each kind."""
    field = {"x": [0.0, 0.1], "y": [0.0, 0.1], "u": GRID, "v": GRID}
    kinds: list[dict[str, Any]] = [
        {"kind": "summary", "paragraphs": ["What was done."], "numbers": [number()]},
        {"kind": "warnings", "items": ["a warning", "another"]},
        trajectory(),
        {
            **{"kind": "flow", "arena": ARENA, **field, "origin": [[0, 1], [2, 0]]},
            **{"count": [[1, 2], [3, 4]], "standard_error": GRID},
        },
        colour_map(),
        lines(),
        {
            **{"kind": "image_grid", "arena": ARENA, "x": axis("x"), "y": axis("y"), "value": GRID},
            **{"label": "height", "unit": "m", "diverging": True, "limits": [-1.0, 1.0]},
        },
        classes(),
        {
            **{"kind": "class_times", "time": [0.0, 1.0]},
            "classes": [
                {"class": "2", "cells": PAIR, "share": [0.0, 1.0], "low": None, "high": None}
            ],
        },
        l1_map(),
        {"kind": "setting_times", "settings": ["one", "another"], "over_time": over_time(1)},
        {
            "kind": "biplot",
            "axes": [{"label": "first", "share": 0.7}, {"label": "second", "share": 0.2}],
            "points": {"x": [0.0, 1.0], "y": [1.0, 0.0], "names": ["a", "b"], "values": None},
            "arrows": [{"name": "along", "x": 1.0, "y": 0.5, "cells": PAIR}],
        },
        {
            **{"kind": "class_graph", "height": 120.0},
            "classes": [{"class": "2", "cells": PAIR, "x": 1.0, "y": 0.5}],
            "arrows": [{"x": [0.0, 1.0], "y": [0.5, 0.5], "at": 0.4, "share": 0.7, "label": "9"}],
        },
        replay(),
        {"kind": "table", "columns": ["first", "second"], "rows": [["a word", 1.0], ["b", None]]},
        {
            **{"kind": "manifest", "command": "driftwalk calibrate r.csv", "cite": "Cite it so."},
            **{"bibtex": "@software{x}", "entries": {"study": {"name": ["one", {"two": "three"}]}}},
            "inputs": [{"role": "recording", "name": "r.csv", "sha256": "00"}],
        },
        {"kind": "empty", "reason": "There is nothing."},
    ]
    return [
        {"id": f"section-{place}", "title": section["kind"], "note": "A note.", **section}
        for place, section in enumerate(kinds)
    ]


def page_of(sections: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a page with sections."""
    return {
        **{"format": "driftwalk page", "version": 1, "view": "report", "title": "Calibration"},
        **{"subtitle": "run", "state": {"finished": False, "progress": 0.5, "words": "half"}},
        **{"driftwalk_version": "0.1.0", "created_utc": "2026-01-01", "sections": sections},
    }


def with_texts(value: Any, text: Callable[[], str], *, keys: bool = True) -> Any:
    """Return a page, or a part of one, with every text and every name of an entry replaced."""
    if isinstance(value, str):
        return text()
    if isinstance(value, list):
        return [with_texts(item, text) for item in value]
    if not isinstance(value, dict):
        return value
    if not keys:
        return {text(): with_texts(item, text, keys=False) for item in value.values()}
    return {
        key: item
        if key in STRUCTURE and not isinstance(item, (dict, list))
        else with_texts(item, text, keys=key != "entries")
        for key, item in value.items()
    }
