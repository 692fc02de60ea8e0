"""The answers of datasets: their numbers under flat names, and their words."""
