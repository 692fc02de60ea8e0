"""What was built, how often and when: classes, distributions, distances, survival."""
