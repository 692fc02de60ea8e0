"""Kinetics: continuous-time Markov, semi-Markov and hidden semi-Markov chains of the classes."""
