"""Containers that recordings come in: HDF5, zip files of arrays, pickled arrays."""
