"""How much the outcomes depend on the model: maps over settings and Sobol' indices."""
