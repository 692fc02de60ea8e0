"""Parts of a tracking run, from the options: scale, detector, tracker and observer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from driftwalk.cli.options.tracking import TrackingOptions
from driftwalk.cli.terminal.output import print_note
from driftwalk.core.errors import ConfigurationError, InputError

if TYPE_CHECKING:
    from driftwalk.track import AssemblyObserver, Camera, Detector, Tracker, TwoColourMarker

# Images that are looked at before: the median of many hides what moves, that of a few glare; chosen
# by hand.
_FOR_BACKGROUND: Final = 25
_FOR_RIM: Final = 7
"""Images that are looked at where only the rim is searched: it stands still; chosen by hand."""
_FOR_COLOURS: Final = 60
"""Images among which a missing colour is looked for before the file is refused; chosen by hand."""
_LEAST_DISC_PX: Final = 2.0
"""Width of a disc below which the scale must be wrong: no pixel has its colour alone [px]."""
# Detections of something else in a frame: 1 per square metre in a tank of 30 cm; chosen by hand.
_CLUTTER_PER_FRAME: Final = 0.07
# A rim that stands a little above the water is seen larger; chosen by hand.
_RIM_OFF: Final = 0.03


class TrackingParts(NamedTuple):
    """The parts of a tracking run."""

    camera: Camera
    detector: Detector
    tracker: Tracker
    observer: AssemblyObserver | None
    diameter: float | None
    """Diameter of the tank [m]."""
    block_side: float | None
    """Side of a block [m]."""


def build_parts(options: TrackingOptions) -> TrackingParts:
    """Return the parts that the options ask for.

    Raises
    ------
    InputError
        When the options contradict each other, or what they name is not found in the images.
    """
    from driftwalk.track import sample_images

    _check(options)
    number = _FOR_BACKGROUND if options.markers == "blob" else _FOR_RIM
    images = sample_images(options.source, number, rate=options.fps)
    camera = find_camera(options, images)
    camera.check_size(images[0].shape[1], images[0].shape[0])
    detector, side = _detector(options, camera, images)
    diameter = options.tank or camera.tank_diameter_m
    tracker = tracker_for(options, camera, diameter)
    side = options.side if options.side is not None else side
    return TrackingParts(camera, detector, tracker, _observer(options, side), diameter, side)


def _check(options: TrackingOptions) -> None:
    """Check what is said about the motion before a long run begins."""
    if options.bodies is not None and options.bodies < 1:
        raise InputError(f"--bodies is the number of objects, 1 or more; got {options.bodies}")
    for name in ("max_speed", "lost_after", "side", "tank", "scale", "fps"):
        value = getattr(options, name)
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"--{name.replace('_', '-')} must be above zero, got {value:g}")
    if options.live is not None and options.live == options.live_nmea != 0:
        raise InputError(f"--live and --live-nmea take two ports, got {options.live} for both")


def find_camera(options: TrackingOptions, images: Sequence[Any]) -> Camera:
    """Return the camera with a scale: from its file, the rim, or the scale that is stated.

    Raises
    ------
    InputError
        When nothing gives a scale, two things do, or the rim is not found.
    """
    from driftwalk.track import Camera, camera_from_rim, load_camera, median_background

    known = load_camera(options.camera) if options.camera is not None else None
    lens = known.lens if known is not None else None
    if options.px_per_m is not None:
        if known is not None and known.homography_px_to_m is not None:
            raise ConfigurationError(f"--scale: {options.camera} has a scale already")
        rows, columns = images[0].shape[:2]
        return Camera.from_scale(columns, rows, px_per_m=options.px_per_m, lens=lens)
    still = median_background(list(images)) if len(images) > 2 else images[0]
    if known is not None and known.homography_px_to_m is not None:
        known.check_size(still.shape[1], still.shape[0])
        return known if options.tank is None else _centred(known, still, options)
    if options.tank is not None:
        return camera_from_rim(still, diameter=options.tank, lens=lens)
    raise InputError(
        "no scale: state --tank (the rim must be seen), or --camera with a plane, or --scale"
    )


def _centred(camera: Camera, still: Any, options: TrackingOptions) -> Camera:
    """Return a camera with its own scale, its origin moved to the middle of the tank."""
    from driftwalk.track import centre_on_rim

    stated = options.tank
    assert stated is not None
    try:
        centred, found = centre_on_rim(camera, still)
    except InputError as error:
        raise InputError(
            f"{options.camera} has a scale, and the tank's centre is not found: {error}; or leave "
            "--tank out: then the origin is the camera file's"
        ) from error
    if abs(found / stated - 1) > _RIM_OFF:
        print_note(
            f"warning: by the scale of {options.camera} the rim is {100 * found:.3g} cm wide, not "
            f"{100 * stated:.3g} cm: does it lie at another height than the board did?"
        )
    return centred


def _detector(
    options: TrackingOptions, camera: Camera, images: Sequence[Any]
) -> tuple[Detector, float | None]:
    """Return the detector, and the side of the blocks [m] where the markers say it."""
    from driftwalk.track import (
        BlobDetector,
        TagDetector,
        TwoColourDetector,
        load_markers,
        median_background,
        usual_polarity,
    )

    blob = {
        "polarity": options.polarity,
        "least_area_px": options.min_area_px,
        "most_area_px": options.max_area_px,
    }
    given: dict[str, Any] = {key: value for key, value in blob.items() if value is not None}
    if options.markers == "blob":
        background = median_background(list(images))
        if "polarity" not in given:
            given["polarity"] = usual_polarity(list(images), background)
            word = "dark or bright" if given["polarity"] == "both" else given["polarity"]
            print_note(f"objects that are {word} are followed; to follow others, give --polarity")
        return BlobDetector(background, camera, objects=options.bodies, **given), None
    if given:
        name = next(iter(given)).replace("_", "-")
        raise ConfigurationError(f"--{name} is for --markers blob")
    if options.markers.startswith("aruco:"):
        return TagDetector(options.markers.partition(":")[2], camera), None
    if options.markers in {"aruco", "aruco:"}:
        raise ConfigurationError("--markers aruco: name the dictionary too, such as aruco:4X4_50")
    marker = load_markers(options.markers)
    _check_size(marker, camera, options)
    _check_colours(marker, images, options)
    return TwoColourDetector(marker, camera), marker.block_side_m


def _check_size(marker: TwoColourMarker, camera: Camera, options: TrackingOptions) -> None:
    """Check that a disc is large enough to be seen: a scale is easily wrong by a hundred."""
    middle = np.array([[camera.width_px / 2, camera.height_px / 2]])
    per_px = math.sqrt(abs(float(np.linalg.det(camera.jacobian(middle)[0]))))
    width = marker.size_m / per_px
    if width < _LEAST_DISC_PX or width > camera.width_px:
        raise InputError(
            f"{options.markers}: a disc of {1e3 * marker.size_m:.3g} mm would be {width:.3g} "
            "pixels wide at this scale: check --tank, --scale or the camera file "
            "(a length without a unit is in metres)"
        )


def _check_colours(
    marker: TwoColourMarker, images: Sequence[Any], options: TrackingOptions
) -> None:
    """Check that both colours appear: before a camera perhaps later, in a file never."""
    from driftwalk.track import missing_colours, sample_images

    missing = missing_colours(marker, images)
    if missing is not None and options.is_camera:
        print_note(f"warning: {options.markers}: {missing} up to now (driftwalk markers teach)")
    elif missing is not None:
        more = sample_images(options.source, _FOR_COLOURS, rate=options.fps)
        missing = missing_colours(marker, more)
        if missing is not None:
            raise InputError(f"{options.markers}: {missing} (driftwalk markers teach)")


def tracker_for(options: TrackingOptions, camera: Camera, diameter: float | None) -> Tracker:
    """Return the tracker; its scales of speed and of clutter are those of the picture."""
    from driftwalk.track import Tracker, TrackerSettings

    wide = diameter
    if wide is None:
        # As wide as what the camera sees.
        corners = np.array([[0.0, 0.0], [camera.width_px - 1.0, camera.height_px - 1.0]])
        wide = math.dist(*camera.to_world(corners).tolist())
    given = {
        "max_speed": options.max_speed if options.max_speed is not None else wide,
        "bodies": options.bodies,
        "lost_after": options.lost_after,
        # A number for each picture, whatever the scale: how often something is mistaken for a body
        # hangs on the pixels, not on the metres.
        "clutter_density": _CLUTTER_PER_FRAME / (math.pi / 4.0 * wide**2),
    }
    settings: dict[str, Any] = {key: value for key, value in given.items() if value is not None}
    return Tracker(TrackerSettings(**settings))


def _observer(options: TrackingOptions, side: float | None) -> AssemblyObserver | None:
    from driftwalk.track import AssemblyObserver

    if options.side is not None and options.bodies is None:
        print_note("joins are not reported: --side needs --bodies, the number of blocks")
    if side is None or options.bodies is None or options.markers == "blob":
        return None
    return AssemblyObserver(options.bodies, side=side)
