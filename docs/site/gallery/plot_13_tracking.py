"""
Blocks found in a video
=======================

The detector finds a block by its marker of two colours. The video is synthetic, with noise and
glare, so the truth is known.
"""

import matplotlib.pyplot as plt
import numpy as np

import driftwalk as dw

recording = dw.tank30_recording("without_noise").sel(time=slice(20.0, 22.0))
settings = dw.video_settings("moderate")
frames = list(dw.render_video(recording, settings))
truth = dw.video_truth(recording, settings)

# %%
# What the two halves of the marker look like is learnt from the first frame.

camera = dw.track.Camera.from_scale(640, 480, px_per_m=1500.0)
marker = dw.track.propose_markers([image for _, image in frames[:5]], camera).marker
detector = dw.track.TwoColourDetector(marker, camera)

figure, axes = plt.subplots(1, 2, figsize=(6.3, 2.6), layout="compressed")
for letter, k, ax in zip("ab", (0, len(frames) - 1), axes, strict=True):
    time, image = frames[k]
    found, rejected = detector.detect(image)
    ax.imshow(dw.track.explain_frame(image, found, rejected, camera=camera)[:, :, ::-1])
    ax.set(xlabel="column (px)", ylabel="row (px)")
    ax.set_title(f"({letter}) {time:.1f} s", loc="left")
    ax.label_outer()
    x, y = float(recording["x"][k, 0]), float(recording["y"][k, 0])
    print(f"off by {1e3 * np.hypot(found[0].x - x, found[0].y - y):.3f} mm")
