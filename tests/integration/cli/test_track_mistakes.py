"""What goes wrong in a lab: each is said in one line, and nothing that was tracked is lost."""

from __future__ import annotations

import json
import signal
from pathlib import Path

import numpy as np
import pytest
from command_line import apart, here, refusal

import driftwalk as dw

cv2 = pytest.importorskip("cv2")

from filmed_blocks import TANK, film, images_of, network_camera  # noqa: E402


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory) -> list[object]:
    """Return video and options for `track`; two blocks, 24 frames."""
    return film(tmp_path_factory.mktemp("film"))


def image_folder(folder: Path, images: list[np.ndarray]) -> Path:
    folder.mkdir()
    for number, image in enumerate(images):
        cv2.imwrite(str(folder / f"{number:03d}.png"), image)
    return folder


@pytest.mark.slow
def test_what_is_no_video_or_holds_no_frame(words: list[object], tmp_path: Path) -> None:
    """In a process of its own: what OpenCV's libraries print would not be seen otherwise."""
    text, none, cut = (tmp_path / name for name in ("text.mp4", "none.avi", "cut.mkv"))
    text.write_text("no video")
    cv2.VideoWriter(str(none), cv2.VideoWriter_fourcc(*"MJPG"), 10.0, (64, 48)).release()
    cut.write_bytes(Path(str(words[0])).read_bytes()[:3000])
    out = tmp_path / "r.nc"
    for path, message in (
        (text, "is not a video that OpenCV can read"),
        (none, "holds no frame"),
        (cut, "holds no frame"),
    ):
        assert message in refusal(apart("track", path, *words[1:], "-o", out))
    assert "no such camera" in refusal(apart("track", "camera:77", *words[1:], "-o", out))
    assert not out.exists()


@pytest.mark.slow
def test_images_of_different_sizes(words: list[object], tmp_path: Path) -> None:
    images = images_of(Path(str(words[0])))
    images[12] = images[12][:-10]
    folder = image_folder(tmp_path / "images", images)
    done = here("track", folder, *words[1:], "-o", tmp_path / "r.nc", "--fps", "10Hz")
    assert "frame 12 is 240 x 170 pixels, the frames before are 240 x 180" in refusal(done)


def test_a_folder_that_does_not_say_when(words: list[object], tmp_path: Path) -> None:
    folder = image_folder(tmp_path / "images", images_of(Path(str(words[0])))[:3])
    (folder / "notes.txt").write_text("not an image")
    assert dw.track.frame_count(folder) == 3
    track = ("track", folder, *words[1:], "-o", tmp_path / "r.nc")
    assert "(--fps)" in refusal(here(*track))
    assert "--fps must be above zero" in refusal(here(*track, "--fps", "0"))


@pytest.mark.slow
def test_a_colour_that_never_appears(words: list[object], tmp_path: Path) -> None:
    other = Path(str(words[2])).read_text(encoding="utf-8").splitlines()
    first = other.index("[colour_1]")
    for at, line in enumerate(other[first : first + 8], start=first):
        if line.startswith("a_star"):
            other[at] = "a_star = 10.0"
        if line.startswith("b_star"):
            other[at] = "b_star = -60.0"
    markers = tmp_path / "blue.toml"
    markers.write_text("\n".join(other))
    said = refusal(here("track", words[0], "--markers", markers, *TANK, "-o", tmp_path / "r.nc"))
    assert "colour 1 (blue) never appears; seen instead: " in said
    assert "red (a*" in said
    assert "green (a*" in said


@pytest.mark.slow
def test_a_scale_at_which_the_markers_do_not_fit_the_block(
    words: list[object], tmp_path: Path
) -> None:
    out = tmp_path / "m.toml"
    teach = ("markers", "teach", words[0], "--side", "3cm", "-o", out, "--overwrite")
    good = here(*teach, *TANK)
    assert good.code == 0, good.err
    assert "warning" not in good.err
    # A tank twice as wide as it is: discs 28 mm apart, on a block of 30 mm.
    wrong = here(*teach, "--tank", "60cm")
    assert wrong.code == 0, wrong.err
    assert "and the block's side is 30 mm" in wrong.err
    assert "check --tank" in wrong.err


@pytest.mark.slow
def test_a_picture_that_does_not_fit_on_the_disk_leaves_no_markers_either(
    words: list[object], tmp_path: Path
) -> None:
    out = tmp_path / "m.toml"
    teach = ("markers", "teach", words[0], "--side", "3cm", *TANK, "-o", out)
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (8192, 8192))"
    assert "m.png: files of this size are not allowed" in refusal(apart(*teach, before=limit))
    assert list(tmp_path.iterdir()) == []


def test_a_video_without_colours_teaches_nothing_and_says_what_to_do(tmp_path: Path) -> None:
    folder = tmp_path / "grey"
    folder.mkdir()
    for number in range(3):
        image = np.full((60, 80, 3), 90 + number, np.uint8)
        assert cv2.imwrite(str(folder / f"{number}.png"), image)
    teach = ("markers", "teach", folder, "--fps", "10Hz", "--scale", "200px/m")
    for scale in ("0", "-1mm"):
        wrong = refusal(here(*teach[:-1], scale, "-o", tmp_path / "m.toml"))
        assert "--scale must be above zero" in wrong
    said = refusal(here(*teach, "-o", tmp_path / "m.toml"))
    assert "seen: all is grey; take a video in brighter, even light" in said


@pytest.mark.fast_cases(5)
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--bodies", "0"), "--bodies is the number of objects"),
        (("--max-speed", "0"), "--max-speed must be above zero"),
        (("--lost-after=-1s",), "--lost-after must be above zero"),
        (("--scale", "0"), "--scale must be above zero"),
        (("--tank", "30"), "pixels wide at this scale: check --tank"),
        (("--live", "5000", "--live-nmea", "5000"), "take two ports, got 5000 for both"),
        (("--live", "70000"), "a port is a number from 0 to 65535"),
        (("--markers", "aruco:4X4_50"), "nothing was tracked in 24 frames"),
        (("--markers", "aruco:9X9"), "no dictionary '9X9'"),
        (("--markers", "aruco"), "name the dictionary too, such as aruco:4X4_50"),
        (("--overlay", "o.gif"), "an overlay is written as .mp4"),
    ],
)
def test_options_that_cannot_be(
    words: list[object], options: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    out = tmp_path / "r.nc"
    done = here("track", *words, "-o", out, *options)
    assert done.code == 2
    assert done.err.splitlines()[-1].startswith("driftwalk: error: ")
    assert message in done.err
    assert not out.exists()


@pytest.mark.slow
def test_a_second_run_does_not_replace_the_first(words: list[object], tmp_path: Path) -> None:
    out, overlay = tmp_path / "r.nc", tmp_path / "o.avi"
    track = ("track", *words, "-o", out, "--overlay", overlay)
    assert here(*track).code == 0
    before = out.read_bytes()
    assert "r.nc exists already" in refusal(here(*track))
    assert "o.avi exists already" in refusal(
        here("track", *words, "-o", tmp_path / "s.nc", "--overlay", overlay)
    )
    assert out.read_bytes() == before
    assert here(*track, "--overwrite").code == 0


@pytest.mark.slow
def test_a_file_that_breaks_off_keeps_what_came_before(words: list[object], tmp_path: Path) -> None:
    cut, out = tmp_path / "cut.mkv", tmp_path / "r.nc"
    whole = Path(str(words[0])).read_bytes()
    cut.write_bytes(whole[: len(whole) * 6 // 10])
    done = apart("track", cut, *words[1:], "-o", out)
    assert done.code == 0, done.err
    notes = done.err.splitlines()
    assert len(notes) == 3
    assert "frames, at 1.4 s of 2.4 s" in notes[1]
    assert notes[2] == f"next: driftwalk classify {out}"
    recording = dw.load(out)
    assert 13 <= recording.sizes["time"] <= 15
    assert recording.attrs["complete"] == "no"


@pytest.mark.slow
def test_a_camera_that_disappears(words: list[object], tmp_path: Path) -> None:
    """A camera in the network, looked at for the scale first, ends after 45 frames."""
    out = tmp_path / "r.nc"
    with network_camera(Path(str(words[0])), shown=45) as camera:
        done = here("track", camera, *words[1:], "--bodies", "2", "-o", out, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["interrupted"] == f"{camera} stopped after 45 frames"
    counts = found["counts"]
    assert counts["frames"] + counts["dropped"] + counts["stale"] == 45
    recording = dw.load(out)
    assert recording.attrs["complete"] == "yes"
    assert recording.attrs["tracked_from"] == camera
    assert recording.sizes["time"] == counts["frames"] > 10
    assert np.isfinite(recording["x"].values).mean() > 0.9


def test_a_tag_too_many_does_not_end_the_run(tmp_path: Path) -> None:
    """Three tags, two blocks: the third is tracked, but not looked at for joins."""
    tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    image = np.full((180, 240, 3), 255, np.uint8)
    for number, column in enumerate((20, 90, 160)):
        image[60:110, column : column + 50] = tags.generateImageMarker(number, 50)[..., None]
    dark = [np.clip(image.astype(int) - 2 * step, 0, 255) for step in range(8)]
    folder = image_folder(tmp_path / "tags", dark)
    done = here(
        "track", folder, "--markers", "aruco:4X4_50", "--scale", "500px/m", "--fps", "10",
        "--bodies", "2", "--side", "10cm", "-o", tmp_path / "r.nc",
    )  # fmt: skip
    assert done.code == 0, done.err
    assert done.err.count("is one more than --bodies") == 1


@pytest.mark.slow
def test_a_killed_run_leaves_a_recording_that_can_be_read(
    words: list[object], tmp_path: Path
) -> None:
    """Killed in the tenth frame, between two saves, which here come after each frame."""
    out = tmp_path / "r.nc"
    before = """
import os
import driftwalk.cli.recordings.track as tracking
from driftwalk.track import TwoColourDetector
tracking._SAVE_EVERY_S = 0.0
tracking._SAVING_SHARE = 1e9
whole, calls = TwoColourDetector.detect, []
def detect(self, image):
    calls.append(1)
    if len(calls) == 10:
        os.kill(os.getpid(), signal.SIGKILL)
    return whole(self, image)
TwoColourDetector.detect = detect
"""
    done = apart("track", *words, "-o", out, before=before)
    assert done.code == -signal.SIGKILL
    recording = dw.load(out)
    assert recording.attrs["complete"] == "no"
    assert recording.sizes["time"] == 9
    assert np.isfinite(recording["x"].values).all()
    assert here("info", out).code == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "command",
    [
        ("track", "video.mkv", "--markers", "m.toml", "-o", "r.nc"),
        ("watch", "video.mkv", "--markers", "m.toml"),
        ("markers", "teach", "video.mkv", "-o", "new.toml"),
        ("camera", "calibrate", "a.png", "--squares", "9x7", "--square", "2cm", "-o", "c.toml"),
    ],
)
def test_without_opencv(command: tuple[str, ...], words: list[object]) -> None:
    folder = Path(str(words[0])).parent
    if command[0] == "camera":
        cv2.imwrite(str(folder / "a.png"), np.zeros((8, 8, 3), np.uint8))
    options = () if command[0] == "camera" else TANK
    before = "import sys\nsys.modules['cv2'] = None\n"
    done = apart(*command, *options, before=before, cwd=folder)
    assert "needs OpenCV: pip install 'driftwalk[track]'" in refusal(done)
