"""Workers on other machines, or in other processes here, for whatever sweeps settings."""

from driftwalk.cluster.address import ClusterAddress, parse_address
from driftwalk.cluster.connect import Cluster, connect

__all__ = ["Cluster", "ClusterAddress", "connect", "parse_address"]
