"""The playground: a simulated tank behind sliders."""
