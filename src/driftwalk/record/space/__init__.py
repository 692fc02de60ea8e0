"""3-D poses of motion capture and robots, projected onto the plane of the water."""
