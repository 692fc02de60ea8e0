"""Two-colour markers: two discs of different hue on each block."""
