"""Motion models on a recording: what takes part, and how each is searched and judged.

`driftwalk.calibration.compare` compares them. It is not imported here, for it needs
`driftwalk.calibration.estimation`, which needs the modules of this folder.
"""

__all__: list[str] = []
