"""Which motion model explains a recording: held-out scores, then evidence of summaries."""
