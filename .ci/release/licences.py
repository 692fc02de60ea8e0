"""Licences of what an installation brings along."""

from __future__ import annotations

import re
from email.message import Message
from typing import Final

# What BSD-3-Clause code may ask its users to install beside it.
FREE: Final = re.compile(
    r"\b(BSD|0BSD|MIT|Apache|PSF|Python Software Foundation|ISC|HPND|Zlib|MPL|MIT-CMU|Unlicense"
    r"|CC0|public domain|matplotlib)\b",
    re.IGNORECASE,
)
# These would bind whoever passes driftwalk on. The exceptions of compilers' libraries do not.
BINDING: Final = re.compile(
    r"\b(AGPL|GPLv?\d|GNU (Affero )?General Public)\b|\bGPL-", re.IGNORECASE
)
EXCEPTION: Final = re.compile(r"GPL-3\.0-or-later WITH GCC-exception-3\.1", re.IGNORECASE)
LONGEST_NAME: Final = 200
"""Characters; a licence field that is longer holds the licence itself, not its name."""


def licence_of(metadata: Message) -> str:
    """Return the licence of a package, from the field that states it best."""
    if metadata["License-Expression"]:
        return str(metadata["License-Expression"])
    classifiers = [
        one.rpartition(" :: ")[2]
        for one in metadata.get_all("Classifier", [])
        if one.startswith("License ::")
    ]
    if classifiers:
        return " / ".join(classifiers)
    return str(metadata["License"] or "").strip()[:LONGEST_NAME]


def binding_licence(licence: str) -> str:
    """Say why a licence is not known to leave users free; empty if it is."""
    named = EXCEPTION.sub("", licence)
    if BINDING.search(named):
        return f"'{licence}' binds whoever passes it on"
    return "" if FREE.search(named) else f"'{licence}' is not known here"
