"""Damage to a member of a zip file, packed again: its checksum is right, its content is not."""

from __future__ import annotations

import io
import random
import zipfile

from mutate import BYTES, TEXT, mutated

MARK = b"PK\x03\x04"


def inside_zip(content: bytes, rng: random.Random) -> bytes:
    """Return a zip file with one member damaged, left out or doubled.

    Parameters
    ----------
    content : bytes
        A valid zip file.
    rng : Random
        Decides which member and what.
    """
    with zipfile.ZipFile(io.BytesIO(content)) as whole:
        members = [(name, whole.read(name)) for name in sorted(whole.namelist())]
    at = rng.randrange(len(members))
    name, inside = members[at]
    damage = rng.randrange(8)
    if damage == 0:
        del members[at]
    elif damage == 1:
        members[at] = (name + "x", inside)
    elif damage == 2:
        members.append((rng.choice(members)[0] + "2", inside))
    else:
        is_text = name.endswith((".xml", ".rels"))
        members[at] = (name, mutated(inside, TEXT if is_text else BYTES, rng))
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as whole:
        for name, inside in members:
            whole.writestr(zipfile.ZipInfo(name), inside)
    return packed.getvalue()
