"""Control of self-assembly: a policy, what it reaches over time, and the decisions of one run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from driftwalk.core.units import percent
from driftwalk.plot.assembly_courses import TIME_LABEL
from driftwalk.plot.parts import style
from driftwalk.plot.parts.outcome_classes import check_kind
from driftwalk.schema.shapes import short_class

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes


def plot_policy(policy: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the modes that a policy chooses with all the time left, by class and time in it.

    Parameters
    ----------
    policy : xarray.Dataset
        A `control_policy`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_policy(policy)``
    """
    from matplotlib.patches import Patch

    check_kind(policy, "control_policy", "action", "age", "phase")
    ax = style.axes_or_new(ax, height_mm=90.0)
    names = [str(name) for name in policy["class"].values]
    # Most blocks assemble through the classes listed last; those of one assembly need no mode.
    shown = [at for at, name in enumerate(names) if "+" in name][-12:]
    action = policy["action"].values[-1, shown]
    used = np.unique(action)
    age = policy["age"].values
    width = np.diff(age, append=2.0 * age[-1])
    for row, modes in enumerate(action):
        ax.barh(
            np.full(age.size, row), width, left=age, height=0.8,
            color=[_color(mode) for mode in modes.tolist()],
        )  # fmt: skip
    ax.set_yticks(range(len(shown)), [short_class(names[at]) for at in shown])
    ax.set_xlim(0.0, min(2.0 * float(age[-1]), float(policy.attrs["by_s"])))
    ax.set_xlabel("time in the class (s)")
    ax.set_title(f"with {policy['phase'].values[-1]:g} s left or more", loc="left")
    labels = policy["mode"].values
    keys = [Patch(color=_color(mode), label=_words(labels[mode])) for mode in used.tolist()]
    ax.legend(handles=keys, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def plot_control_shares(test: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the share of the worlds in the target over time, for each arm of a test.

    Parameters
    ----------
    test : xarray.Dataset
        A `control_test`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_control_shares(test)``
    """
    check_kind(test, "control_test", "share", "time", "reached_low")
    ax = style.axes_or_new(ax, height_mm=70.0)
    time = test["time"].values
    for at, name in enumerate(test["arm"].values):
        [line] = ax.plot(time, test["share"].values[at], label=str(name))
        ends = [[test[f"reached_{end}"].values[at]] for end in ("low", "high")]
        # Next to each other, past the end.
        place = time[-1:].repeat(2) + 0.02 * (at + 1) * (time[-1] - time[0])
        ax.plot(place, np.ravel(ends), color=line.get_color(), lw=2.0, alpha=0.5)
    ax.set(xlim=(time[0], None), ylim=(0.0, None), xlabel=TIME_LABEL)
    ax.set_ylabel(f"share of runs in {short_class(str(test.attrs['target']))}")
    ax.spines[["top", "right"]].set_visible(False)
    ax.set_title(f"bars: {percent(test.attrs['confidence'])} intervals at the end", loc="left")
    style.legend_below(ax, 2)
    return ax


def plot_control_run(test: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw the classes of one run, coloured by the mode that was chosen.

    Parameters
    ----------
    test : xarray.Dataset
        A `control_test`.
    ax : matplotlib.axes.Axes, optional
        Where to draw; a new figure when left out.

    Returns
    -------
    matplotlib.axes.Axes
        The axes drawn on.

    Raises
    ------
    InputError
        When the dataset is of another kind.

    Examples
    --------
    ``plot_control_run(test)``
    """
    check_kind(test, "control_test", "film_class", "film_mode", "time")
    ax = style.axes_or_new(ax, height_mm=90.0)
    time, classes = test["time"].values, test["film_class"].values
    modes = test["film_mode"].values
    visited = list(dict.fromkeys(classes.tolist()))
    row = {at: k for k, at in enumerate(visited)}
    labels = test["mode"].values
    for mode in np.unique(modes[:-1]).tolist():
        at = np.flatnonzero(modes[:-1] == mode)
        ax.barh(
            [row[one] for one in classes[at].tolist()], time[at + 1] - time[at], left=time[at],
            height=0.8, label=_words(labels[mode]), color=_color(mode),
        )  # fmt: skip
    ax.set_yticks(
        range(len(visited)), [short_class(str(test["class"].values[at])) for at in visited]
    )
    ax.set(xlim=(time[0], time[-1]), xlabel=TIME_LABEL)
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return ax


def _words(mode: Any) -> str:
    return str(mode).replace(" x ", " × ")


def _color(mode: int) -> tuple[float, float, float, float]:
    """Return the colour of a mode by its number, the same in all figures of a policy."""
    from matplotlib.colors import to_rgba

    # After all hues the same ones paler.
    paler, hue = divmod(mode, len(style.PALETTE))
    return to_rgba(style.PALETTE[hue], 1.0 / (1.0 + paler))
