"""Hashes, fingerprints and the manifest."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import driftwalk
from driftwalk.core.errors import FormatError, InputError
from driftwalk.core.provenance import (
    differing_keys,
    file_sha256,
    fingerprint_of,
    manifest,
    plain,
    read_manifest,
    refuse_other_version,
    write_manifest,
)

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.text("abc", min_size=1, max_size=2), inner, max_size=3)
    ),
    max_leaves=8,
)
SPECIFICATIONS = st.dictionaries(st.text("abc", min_size=1, max_size=2), VALUES, max_size=4)


def test_sha256_of_a_published_vector(tmp_path: Path) -> None:
    """FIPS 180-2, appendix B.1: SHA-256 of "abc"."""
    (tmp_path / "abc").write_bytes(b"abc")
    expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
    assert file_sha256(tmp_path / "abc") == expected


def test_sha256_of_a_missing_file_names_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot read .*nothing"):
        file_sha256(tmp_path / "nothing")


def test_manifest_says_all_of_it(tmp_path: Path) -> None:
    recording = tmp_path / "recording.csv"
    recording.write_bytes(b"abc")
    made = manifest(
        command=["driftwalk", "calibrate", "my recording.csv"],
        study={"tank": {"diameter_m": 0.3}, "folder": Path("run"), "n": np.int64(3)},
        seeds={"calibration": 7},
        inputs={"recording": recording},
        instruction_set="avx2",
    )
    assert made["command"] == "driftwalk calibrate 'my recording.csv'"
    assert made["study"] == {"tank": {"diameter_m": 0.3}, "folder": "run", "n": 3}
    assert made["seeds"] == {"calibration": 7}
    assert made["inputs"]["recording"]["sha256"] == file_sha256(recording)
    assert made["inputs"]["recording"]["size_bytes"] == 3
    assert made["software"]["driftwalk"] == driftwalk.__version__
    assert made["software"]["numpy"] == np.__version__
    assert made["machine"]["instruction_set"] == "avx2"
    assert made["machine"]["cpu_count"] >= 1
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", made["created_utc"])


def test_manifest_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "manifest.json"
    made = manifest(command="demo", study={"a": [1.5, "ü"]}, seeds={}, inputs={})
    write_manifest(path, made)
    assert read_manifest(path) == made


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'{"a": 1,\n "b" 2}', "line 2, column 6: expected JSON"),
        (b"[1]", "expected an object, got list"),
        (b"\xff\xfe\x00", "bytes that are not text"),
        (b"", "line 1, column 1: expected JSON"),
    ],
)
def test_damaged_manifest(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "manifest.json").write_bytes(content)
    with pytest.raises(FormatError, match=message):
        read_manifest(tmp_path / "manifest.json")


@pytest.mark.slow
@given(SPECIFICATIONS)
@settings(deadline=None, max_examples=100)
def test_fingerprint_survives_json_and_order(specification: dict[str, object]) -> None:
    again = json.loads(json.dumps(plain(specification)))
    reversed_order = dict(reversed(again.items()))
    assert fingerprint_of(reversed_order) == fingerprint_of(specification)


@pytest.mark.slow
@given(SPECIFICATIONS, SPECIFICATIONS)
@settings(deadline=None, max_examples=200)
def test_fingerprints_differ_exactly_when_keys_do(
    one: dict[str, object], other: dict[str, object]
) -> None:
    assert (fingerprint_of(one) == fingerprint_of(other)) == (differing_keys(one, other) == [])


def test_a_manifest_of_another_version_is_refused_with_both_versions() -> None:
    refuse_other_version("run", manifest(command="demo", study={}, seeds={}, inputs={}))
    made = {"manifest_version": 99, "software": {"driftwalk": "9.9.9"}}
    with pytest.raises(InputError, match=r"run: .* 9\.9\.9 \(manifest version 99, .* reads 1\)"):
        refuse_other_version("run", made)
    for odd in ({}, {"manifest_version": "1"}, {"manifest_version": 2, "software": "1.0"}):
        with pytest.raises(InputError, match="driftwalk of another version"):
            refuse_other_version("run", odd)


def test_differing_keys_are_dotted() -> None:
    one = {"study": {"tank": {"diameter_m": 0.3}, "same": 1}, "seed": 1}
    other = {"study": {"tank": {"diameter_m": 0.5}, "same": 1.0}, "extra": None}
    assert differing_keys(one, other) == ["extra", "seed", "study.tank.diameter_m"]


def test_arrays_count_by_type_shape_and_content() -> None:
    values = np.arange(6.0)
    prints = {
        fingerprint_of({"a": array})
        for array in (values, values.reshape(2, 3), values.astype("f4"), values + 1e-12)
    }
    assert len(prints) == 4
    assert fingerprint_of({"a": values[::2]}) == fingerprint_of({"a": values[::2].copy()})


def test_non_finite_numbers_stay_apart() -> None:
    prints = {fingerprint_of({"a": x}) for x in (float("nan"), float("inf"), -float("inf"), None)}
    assert len(prints) == 4


def test_value_without_a_form_is_refused() -> None:
    with pytest.raises(InputError, match="cannot describe a object"):
        fingerprint_of({"a": object()})


def test_import_loads_numpy_at_most() -> None:
    code = (
        "import sys; import driftwalk.core.files.rundir, driftwalk.sweep;"
        "print([m for m in ('xarray', 'scipy', 'pandas', 'filelock') if m in sys.modules])"
    )
    source = str(Path(driftwalk.__file__ or "").parents[1])
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {source!r}); {code}"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == "[]"


def test_half_a_surrogate_survives_a_manifest(tmp_path: Path) -> None:
    path = tmp_path / "manifest.json"
    write_manifest(path, {"study": {"recording": "K\udce4fer.csv"}})
    assert read_manifest(path) == {"study": {"recording": "K\udce4fer.csv"}}
