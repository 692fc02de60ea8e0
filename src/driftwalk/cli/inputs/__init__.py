"""What the arguments of a command name: recordings, studies, runs and flows, read and checked."""
