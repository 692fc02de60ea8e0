"""NetCDF, HDF5 and MATLAB files, read within bounds."""
