"""References: the program, the paper whose method it implements, the methods that a run used."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
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
    """A published method as a part of runs of some kind, which declares it."""

    what: str
    """Its part in them."""
    work: str
    """Authors, title, journal, volume, year, page."""
    under: str = ""
    """Entry of the run's specification that has to be set; ``""``: always used."""
    dataset: str = ""
    """Dataset of the run that says that it was used; ``""``: always used."""


RESTRICTED_LIKELIHOOD: Final = Method(
    "restricted likelihood",
    "Patterson and Thompson, Recovery of inter-block information when block sizes are unequal, "
    "Biometrika 58 (1971) 545",
)
PARTICLE_FILTER: Final = Method(
    "particle filter at the wall",
    "Gordon, Salmond and Smith, Novel approach to nonlinear/non-Gaussian Bayesian state "
    "estimation, IEE Proceedings F 140 (1993) 107",
    under="wall",
)
KS_DISTANCE: Final = Method(
    "distance between motions",
    "Fasano and Franceschini, A multidimensional version of the Kolmogorov-Smirnov test, "
    "Monthly Notices of the Royal Astronomical Society 225 (1987) 155",
)
EVOLUTION_STRATEGY: Final = Method(
    "search of the parameters",
    "Hansen and Ostermeier, Completely derandomized self-adaptation in evolution strategies, "
    "Evolutionary Computation 9 (2001) 159",
)
SYNTHETIC_LIKELIHOOD: Final = Method(
    "synthetic likelihood",
    "Wood, Statistical inference for noisy nonlinear ecological dynamic systems, "
    "Nature 466 (2010) 1102",
)
ENSEMBLE_SAMPLER: Final = Method(
    "draws of the parameters",
    "Foreman-Mackey, Hogg, Lang and Goodman, emcee: The MCMC Hammer, Publications of the "
    "Astronomical Society of the Pacific 125 (2013) 306",
)
SIMULATED_COVARIANCE: Final = Method(
    "errors of a simulated covariance",
    "Hartlap, Simon and Schneider, Why your model parameter confidences might be too "
    "optimistic, Astronomy and Astrophysics 464 (2007) 399",
)
EXACT_INTERVALS: Final = Method(
    "intervals of the shares",
    "Clopper and Pearson, The use of confidence or fiducial limits illustrated in the case of "
    "the binomial, Biometrika 26 (1934) 404",
)
SURVIVAL_CURVES: Final = Method(
    "courses of first contact and completion",
    "Kaplan and Meier, Nonparametric estimation from incomplete observations, Journal of the "
    "American Statistical Association 53 (1958) 457",
)
SOBOL_INDICES: Final = Method(
    "sensitivity indices",
    "Saltelli et al., Variance based sensitivity analysis of model output: design and "
    "estimator for the total sensitivity index, Computer Physics Communications 181 (2010) 259",
    dataset="sobol",
)
HIDDEN_STATES: Final = Method(
    "chains with hidden states where the tank is not well mixed",
    "Napp, Thorsley and Klavins, Hidden Markov models for non-well-mixed reaction networks, "
    "American Control Conference, 2009, 737",
)
SEVERAL_TESTS: Final = Method(
    "correction for several tests",
    "Holm, A simple sequentially rejective multiple test procedure, Scandinavian Journal of "
    "Statistics 6 (1979) 65",
)
DIRICHLET_EMULATOR: Final = Method(
    "emulator of the shares of the classes",
    "Milios, Camoriano, Michiardi, Rosasco and Filippone, Dirichlet-based Gaussian processes for "
    "large-scale calibrated classification, Advances in Neural Information Processing Systems, "
    "2018",
)
NODES_OF_EMULATOR: Final = Method(
    "choice of further nodes",
    "Järvenpää et al., Efficient acquisition rules for model-based approximate Bayesian "
    "computation, Bayesian Analysis 14 (2019) 595",
)
SELF_CHECK: Final = Method(
    "self-check of the posterior",
    "Cook, Gelman and Rubin, Validation of software for Bayesian models using posterior "
    "quantiles, Journal of Computational and Graphical Statistics 15 (2006) 675",
)
LOGARITHMIC_SCORE: Final = Method(
    "score that the width of the posterior is chosen by",
    "Good, Rational decisions, Journal of the Royal Statistical Society B 14 (1952) 107",
)
SUCCESSIVE_HALVING: Final = Method(
    "successive halving of the settings",
    "Karnin, Koren and Somekh, Almost optimal exploration in multi-armed bandits, International "
    "Conference on Machine Learning, 2013",
)
COMPASS_SEARCH: Final = Method(
    "compass search in ranges",
    "Kolda, Lewis and Torczon, Optimization by direct search, SIAM Review 45 (2003) 385",
    under="ranges",
)
CONFIDENCE_SEQUENCE: Final = Method(
    "confidence sequence of a difference of yields",
    "Robbins, Statistical methods related to the law of the iterated logarithm, Annals of "
    "Mathematical Statistics 41 (1970) 1397",
)
INDIFFERENCE_ZONE: Final = Method(
    "number of runs for a difference that does not matter",
    "Kim and Nelson, A fully sequential procedure for indifference-zone selection in simulation, "
    "ACM Transactions on Modeling and Computer Simulation 11 (2001) 251",
)
DECISION_PROCESS: Final = Method(
    "value iteration", "Puterman, Markov Decision Processes, Wiley, 1994, chapter 4"
)
DRAWN_POLICIES: Final = Method(
    "policies of drawn probabilities",
    "Strens, A Bayesian framework for reinforcement learning, International Conference on Machine "
    "Learning, 2000",
)
ROLLOUTS: Final = Method(
    "rollouts",
    "Sutton and Barto, Reinforcement Learning, 2nd edition, MIT Press, 2018, chapter 5",
)
PROBABILITY_MATCHING: Final = Method(
    "choice of the modes in rollouts",
    "Thompson, On the likelihood that one unknown probability exceeds another in view of the "
    "evidence of two samples, Biometrika 25 (1933) 285",
)
INTERVAL_OF_DIFFERENCE: Final = Method(
    "interval of the difference of two shares",
    "Newcombe, Interval estimation for the difference between independent proportions: "
    "comparison of eleven methods, Statistics in Medicine 17 (1998) 873",
)
RANDOM_NUMBERS: Final = Method(
    "random numbers",
    "Salmon, Moraes, Dror and Shaw, Parallel random numbers: as easy as 1, 2, 3, International "
    "Conference for High Performance Computing (SC), 2011",
)


def methods_used(
    methods: Sequence[Method], results: Collection[str], specification: Mapping[str, Any]
) -> list[Method]:
    """Return the methods that a run used.

    Parameters
    ----------
    methods : sequence of Method
        Those of its kind.
    results : collection of str
        Names of the files in the run directory.
    specification : mapping
        The run's specification, as its manifest holds it.

    Examples
    --------
    >>> methods = [RESTRICTED_LIKELIHOOD, PARTICLE_FILTER]
    >>> [method.what for method in methods_used(methods, ["fit.nc"], {})]
    ['restricted likelihood']
    """
    return [
        method
        for method in methods
        if (not method.dataset or f"{method.dataset}.nc" in results)
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
