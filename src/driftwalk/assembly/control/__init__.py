"""Control of self-assembly: which agitation at which moment, to reach a target class in time."""
