"""References: the program, the paper whose method it implements, the methods that a run used."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Final, NamedTuple

PAPER_TITLE: Final = "A trajectory-based calibration method for stochastic motion models"
PAPER_AUTHORS: Final = (
    ("Di Mario", "Ezequiel"),
    ("Mermoud", "Grégory"),
    ("Mastrangeli", "Massimo"),
    ("Martinoli", "Alcherio"),
)
"""Family and given names."""
PAPER_VENUE: Final = "IEEE/RSJ International Conference on Intelligent Robots and Systems (IROS)"
PAPER_YEAR: Final = 2011
"""The paper whose method driftwalk implements, as in CITATION.cff."""
PROGRAM: Final = "The driftwalk developers"
TITLE: Final = (
    "driftwalk: calibrated stochastic motion models of floating, drifting and stirred robots"
)


class Method(NamedTuple):
    """A published method, and the results that were computed with it."""

    results: tuple[str, ...]
    """Files of a run directory, each of which says that it was used."""
    what: str
    """Its part in them."""
    work: str
    """Authors, title, journal, volume, year, page."""
    under: str = ""
    """Entry of the run's specification that has to be set; ``""``: always used."""


METHODS: Final = (
    Method(
        ("fit.nc",),
        "restricted likelihood",
        "Patterson and Thompson, Recovery of inter-block information when block sizes are unequal, "
        "Biometrika 58 (1971) 545",
    ),
    Method(
        ("fit.nc",),
        "particle filter at the wall",
        "Gordon, Salmond and Smith, Novel approach to nonlinear/non-Gaussian Bayesian state "
        "estimation, IEE Proceedings F 140 (1993) 107",
        under="wall",
    ),
    Method(
        ("calibration.nc", "comparison.nc"),
        "distance between motions",
        "Fasano and Franceschini, A multidimensional version of the Kolmogorov-Smirnov test, "
        "Monthly Notices of the Royal Astronomical Society 225 (1987) 155",
    ),
    Method(
        ("comparison.nc",),
        "search of the parameters",
        "Hansen and Ostermeier, Completely derandomized self-adaptation in evolution strategies, "
        "Evolutionary Computation 9 (2001) 159",
    ),
    Method(
        ("model_calibration.nc",),
        "synthetic likelihood",
        "Wood, Statistical inference for noisy nonlinear ecological dynamic systems, "
        "Nature 466 (2010) 1102",
    ),
    Method(
        ("model_calibration.nc",),
        "draws of the parameters",
        "Foreman-Mackey, Hogg, Lang and Goodman, emcee: The MCMC Hammer, Publications of the "
        "Astronomical Society of the Pacific 125 (2013) 306",
    ),
    Method(
        ("model_calibration.nc",),
        "errors of a simulated covariance",
        "Hartlap, Simon and Schneider, Why your model parameter confidences might be too "
        "optimistic, Astronomy and Astrophysics 464 (2007) 399",
    ),
    Method(
        ("assembly.nc",),
        "intervals of the shares",
        "Clopper and Pearson, The use of confidence or fiducial limits illustrated in the case of "
        "the binomial, Biometrika 26 (1934) 404",
    ),
    Method(
        ("assembly.nc",),
        "courses of first contact and completion",
        "Kaplan and Meier, Nonparametric estimation from incomplete observations, Journal of the "
        "American Statistical Association 53 (1958) 457",
    ),
    Method(
        ("sobol.nc",),
        "sensitivity indices",
        "Saltelli et al., Variance based sensitivity analysis of model output: design and "
        "estimator for the total sensitivity index, Computer Physics Communications 181 (2010) 259",
    ),
    Method(
        ("calibration.nc", "check.nc", "assembly.nc", "sensitivity.nc", "recovery.nc"),
        "random numbers",
        "Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3, International "
        "Conference for High Performance Computing (SC), 2011",
    ),
)
"""Methods of others, in the order in which they are listed."""


def methods_used(results: Collection[str], specification: Mapping[str, Any]) -> list[Method]:
    """Return the methods that a run used.

    Parameters
    ----------
    results : collection of str
        Names of the files in the run directory.
    specification : mapping
        The run's specification, as its manifest holds it.

    Examples
    --------
    >>> [method.what for method in methods_used(["fit.nc"], {})]
    ['restricted likelihood']
    """
    return [
        method
        for method in METHODS
        if any(name in results for name in method.results)
        and (not method.under or specification.get(method.under))
    ]


def citation(version: str) -> str:
    """Return how to cite driftwalk and the paper, as a sentence.

    Parameters
    ----------
    version : str
        The version that made the results.

    Examples
    --------
    >>> citation("0.1.0").split(",")[0]
    'The driftwalk developers'
    """
    names = [f"{given} {family}" for family, given in PAPER_AUTHORS]
    authors = f"{', '.join(names[:-1])} and {names[-1]}"
    return (
        f"{PROGRAM}, {TITLE}, version {version}; and the paper whose method it implements: "
        f"{authors}, {PAPER_TITLE}, {PAPER_VENUE}, {PAPER_YEAR}."
    )


def bibtex(version: str) -> str:
    """Return how to cite driftwalk and the paper, for BibTeX.

    Parameters
    ----------
    version : str
        The version that made the results.

    Examples
    --------
    >>> bibtex("0.1.0").splitlines()[0]
    '@software{driftwalk,'
    """
    authors = " and ".join(f"{family}, {given}" for family, given in PAPER_AUTHORS)
    return (
        f"@software{{driftwalk,\n  author = {{{{{PROGRAM}}}}},\n  title = {{{{{TITLE}}}}},\n"
        f"  version = {{{version}}}\n}}\n\n"
        f"@inproceedings{{dimario2011trajectory,\n  author = {{{authors}}},\n"
        f"  title = {{{{{PAPER_TITLE}}}}},\n  booktitle = {{{PAPER_VENUE}}},\n"
        f"  year = {{{PAPER_YEAR}}}\n}}\n"
    )
