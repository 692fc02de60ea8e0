"""Who is joined to whom, frame by frame."""
