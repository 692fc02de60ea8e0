"""Names of files as text that a dataset, a manifest or a page can hold."""

from __future__ import annotations

from pathlib import PurePath


def text_of_name(name: str | PurePath) -> str:
    r"""Return a name or a path as text that every file can hold.

    Python keeps the bytes of a name that are not of the locale's encoding as lone surrogates, which
    neither UTF-8 nor HDF5 take. Bytes of UTF-8, all of them in the locale C, become what they
    mean; others are spelled.

    Parameters
    ----------
    name : str or path
        As the operating system or the command line gave it.

    Examples
    --------
    >>> text_of_name("K\udcc3\udca4fer.csv")
    'Käfer.csv'
    >>> print(text_of_name("K\udce4fer.csv"))
    K\xe4fer.csv
    """
    return str(name).encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
