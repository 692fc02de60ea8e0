"""The loop of a tracking command: frames in, a recording and live output out."""
