"""Ground of the package: errors, seeds, provenance, arrays, units. Imports numpy at most."""
