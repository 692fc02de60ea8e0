"""Shards: bit for bit, verified, of one specification."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from driftwalk.core.errors import InputError, RunDirectoryError
from driftwalk.core.files.shards import pack_shard, remove_shards, unpack_shard
from driftwalk.sweep import MemoryStore, ShardStore, Store, collect, grid

UNITS = grid(a=range(6)).units(2)
SPECIFICATION = {"study": {"tank": {"diameter_m": 0.3}}, "seed": 1}


def arrays_of(value: float) -> dict[str, npt.NDArray[np.generic]]:
    rng = np.random.default_rng(int(value))
    return {
        "x": rng.normal(size=(2, 3)),
        "status": np.array([0, 4], dtype=np.int8),
        "nan": np.array([np.nan, -0.0], dtype=">f4"),
    }


@pytest.fixture
def store(tmp_path: Path) -> ShardStore:
    return ShardStore(tmp_path / "shards", fingerprint=SPECIFICATION)


def shard(store: ShardStore, index: int = 0) -> Path:
    return store.folder / f"{UNITS[index].id}.npz"


def reopened(store: ShardStore) -> ShardStore:
    return ShardStore(store.folder, fingerprint=SPECIFICATION)


def test_what_is_read_is_what_was_written(store: ShardStore) -> None:
    written = arrays_of(1)
    store.write(UNITS[0], written)
    read = reopened(store).read(UNITS[0])
    assert read.keys() == written.keys()
    for name, array in written.items():
        assert read[name].dtype == array.dtype
        assert read[name].shape == array.shape
        assert read[name].tobytes() == array.tobytes()


def test_missing_and_has(store: ShardStore) -> None:
    store.write(UNITS[1], arrays_of(1))
    assert [store.has(unit) for unit in UNITS] == [False, True, False]
    assert reopened(store).missing(UNITS) == [UNITS[0], UNITS[2]]
    with pytest.raises(RunDirectoryError, match="absent or damaged"):
        store.read(UNITS[0])


def test_numpy_reads_a_shard(store: ShardStore) -> None:
    store.write(UNITS[0], arrays_of(1))
    with np.load(shard(store), allow_pickle=False) as archive:
        assert archive["x"].tobytes() == arrays_of(1)["x"].tobytes()


def test_shards_are_immutable_and_reproducible(store: ShardStore, tmp_path: Path) -> None:
    store.write(UNITS[0], arrays_of(1))
    before = shard(store).read_bytes()
    store.write(UNITS[0], arrays_of(2))
    assert shard(store).read_bytes() == before
    other = ShardStore(tmp_path / "other", fingerprint=SPECIFICATION)
    other.write(UNITS[0], arrays_of(1))
    assert shard(other).read_bytes() == before


def test_shard_cut_at_any_length_is_missing() -> None:
    whole = pack_shard("unit", "fingerprint", arrays_of(1))
    for length in range(len(whole)):
        assert unpack_shard(whole[:length], "unit", "fingerprint") is None, length
    assert unpack_shard(whole, "unit", "fingerprint") is not None


def test_shard_with_any_byte_damaged_is_missing() -> None:
    whole = pack_shard("unit", "fingerprint", arrays_of(1))
    for place in range(len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << (place % 8)
        assert unpack_shard(bytes(damaged), "unit", "fingerprint") is None, place


def test_damaged_shard_is_replaced(store: ShardStore) -> None:
    store.write(UNITS[0], arrays_of(1))
    shard(store).write_bytes(b"PK damaged")
    again = reopened(store)
    assert again.missing(UNITS) == UNITS
    again.write(UNITS[0], arrays_of(1))
    assert again.read(UNITS[0])["x"].tobytes() == arrays_of(1)["x"].tobytes()


def test_shard_of_another_unit_or_sweep_is_missing(store: ShardStore, tmp_path: Path) -> None:
    store.write(UNITS[0], arrays_of(1))
    shard(store, 1).write_bytes(shard(store).read_bytes())
    other = ShardStore(tmp_path / "other", fingerprint={**SPECIFICATION, "seed": 2})
    shard(other).write_bytes(shard(store).read_bytes())
    assert not store.has(UNITS[1])
    assert not other.has(UNITS[0])


def test_other_specification_is_refused_by_key(store: ShardStore) -> None:
    changed = {"study": {"tank": {"diameter_m": 0.5}}, "seed": 2}
    with pytest.raises(RunDirectoryError, match=r"differs in seed, study\.tank\.diameter_m;"):
        ShardStore(store.folder, fingerprint=changed)
    ShardStore(store.folder, fingerprint=dict(reversed(SPECIFICATION.items())))


def test_many_differing_keys_are_counted(store: ShardStore) -> None:
    many = {f"key_{i}": i for i in range(20)}
    with pytest.raises(RunDirectoryError, match=r"key_0, key_1, .* and 16 more;"):
        ShardStore(store.folder, fingerprint=many)


def test_damaged_specification_is_refused(store: ShardStore) -> None:
    (store.folder / "specification.json").write_text("{")
    with pytest.raises(RunDirectoryError, match="start again"):
        reopened(store)


def test_objects_and_bad_names_are_refused(store: ShardStore) -> None:
    with pytest.raises(InputError, match="array 'a' cannot be stored"):
        store.write(UNITS[0], {"a": np.array([object(), None])})
    with pytest.raises(InputError, match=r"array name '\.\./a'"):
        store.write(UNITS[0], {"../a": np.zeros(2)})
    assert store.missing(UNITS) == UNITS


def test_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    with pytest.raises(RunDirectoryError, match="is a file, expected a directory"):
        ShardStore(tmp_path / "file", fingerprint={})
    with pytest.raises(RunDirectoryError, match="cannot make the directory"):
        ShardStore(tmp_path / "file" / "shards", fingerprint={})


def test_remove_takes_only_shards(store: ShardStore) -> None:
    store.write(UNITS[0], arrays_of(1))
    (store.folder / "notes.txt").write_text("mine")
    remove_shards(store.folder)
    assert [path.name for path in store.folder.iterdir()] == ["notes.txt"]
    stranger = store.folder / "data.npz"
    stranger.write_bytes(b"no shard")
    remove_shards(store.folder)
    assert stranger.exists()


@pytest.mark.parametrize("kind", ["memory", "shards"])
def test_collect_joins_in_order_of_the_units(kind: str, tmp_path: Path) -> None:
    store: Store = MemoryStore() if kind == "memory" else ShardStore(tmp_path, fingerprint={})
    for unit in reversed(UNITS):
        store.write(unit, {"a": unit.settings["a"] * 10})
    assert collect(store, UNITS)["a"].tolist() == [0, 10, 20, 30, 40, 50]


def test_collect_refuses_what_does_not_fit() -> None:
    store = MemoryStore()
    store.write(UNITS[0], {"a": np.zeros(2)})
    store.write(UNITS[1], {"a": np.zeros((2, 3))})
    with pytest.raises(InputError, match=f"unit {UNITS[1].id} gave"):
        collect(store, UNITS[:2])
    with pytest.raises(InputError, match="at least one work unit"):
        collect(store, [])
