"""Addresses of workers and the options of jobs, as the command line takes them."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from driftwalk.cluster import parse_address
from driftwalk.cluster.address import JOB_SYSTEMS, job_options
from driftwalk.core.errors import ConfigurationError


@given(count=st.integers(1, 10_000), kind=st.sampled_from(["local", *JOB_SYSTEMS]))
def test_a_kind_and_a_number_are_read(kind: str, count: int) -> None:
    address = parse_address(f"{kind}:{count}")
    assert (address.kind, address.workers, address.words) == (kind, count, f"{kind}:{count}")


def test_a_scheduler_keeps_its_address() -> None:
    address = parse_address("tcp://10.0.0.1:8786")
    assert (address.kind, address.url) == ("scheduler", "tcp://10.0.0.1:8786")


def test_options_are_json_where_they_can_be() -> None:
    given_options = ["queue=short", "cores=2", "walltime=02:00:00", 'job_extra_directives=["-A x"]']
    assert parse_address("slurm", given_options).options == {
        "queue": "short",
        "cores": 2,
        "walltime": "02:00:00",
        "job_extra_directives": ["-A x"],
    }


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        ("lokal:2", [], "did you mean 'local'"),
        ("local", [], "without a number"),
        ("local:0", [], "without a number"),
        ("slurm:-1", [], "without a number"),
        ("tcp://", [], "workers are"),
        ("slurm:2", ["queue"], "is NAME=VALUE"),
        ("local:2", ["queue=x"], "not for worker processes"),
        ("tcp://host:1", ["queue=x"], "not for a scheduler"),
    ],
)
def test_mistakes_are_named(text: str, options: list[str], words: str) -> None:
    with pytest.raises(ConfigurationError, match=words):
        parse_address(text, options)


@pytest.mark.parametrize(
    ("walltime", "lifetime"), [("02:00:00", 6840), ("1-00:00:00", 82080), ("00:10", 540)]
)
def test_a_worker_ends_before_its_walltime(walltime: str, lifetime: int) -> None:
    """By 5 %, or a minute where that is more."""
    options = job_options(parse_address("slurm:1", [f"walltime={walltime}"]))
    assert options["worker_extra_args"] == ["--lifetime", f"{lifetime}s"]


def test_a_worker_has_one_thread() -> None:
    options = job_options(parse_address("slurm:1", ["cores=8"]))
    assert options["processes"] == options["cores"] == 8
    assert options["memory"] == "2GB"
