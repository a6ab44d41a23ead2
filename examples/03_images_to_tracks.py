"""From images to tracks: a source of frames, a detector, a tracker; here the embedded world is the camera.

Run: python examples/03_images_to_tracks.py
"""

import numpy as np

from airground.sim import WorldCamera, demo_scene
from airground.vision.detectors.registry import make_detector
from airground.vision.eyes import Eyes
from airground.vision.tracker import Tracker, TrackRecorder


def main() -> None:
    scene = demo_scene()
    # With a video of your own: open_source("drive.mp4") from airground.vision.sources.
    with WorldCamera(scene, rate_hz=20, duration_s=1.5) as camera:
        eyes, recorder = Eyes(make_detector("tag:family=36h11"), Tracker()), TrackRecorder()
        for frame in camera:
            look = eyes.look(frame)
            recorder.add(look.sightings, look.state)

    (robot,) = look.state.confirmed_tracks
    sigma = np.sqrt(np.diag(robot.covariance))
    print(f"target {robot.name} at {robot.uv.round(2)} px, to {sigma[:2].round(2)} px")
    print(f"moves at {robot.uv_dot.round(1)} px/s, to {sigma[2:].round(1)} px/s")
    truth = scene.truth(frame.t)[0]
    print("off the truth by", (robot.uv - truth.uv).round(2), "px")

    tracks = recorder.tracks()  # what airground.calibrate and write_tracks take
    print(len(tracks), "sightings of", ", ".join(tracks.targets))


if __name__ == "__main__":
    main()
