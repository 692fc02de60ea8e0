"""`python -m driftwalk`: the command line, of the Python that runs it."""

from driftwalk.cli.main import run

if __name__ == "__main__":
    run()
