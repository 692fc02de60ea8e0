"""The innovations filter of the fit: its parameters, its series, and one pass over them."""
