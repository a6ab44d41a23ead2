"""From a known homography: image velocities to metres per second, and back.

Run: python examples/01_velocities.py
"""

import numpy as np

import airground as ag

# A camera 4 m above a floor, tilted by 60 degrees; image_from_ground maps metres to pixels at any scale.
image_from_ground = np.array(
    [
        [800.0, 320.0 * 0.866, 320.0 * 2.0],
        [0.0, 240.0 * 0.866 - 400.0, 240.0 * 2.0 + 2771.0],
        [0.0, 0.866, 2.0],
    ]
)


def main() -> None:
    model = ag.LimitedHomography.from_homography(image_from_ground)
    uv = np.array([320.0, 400.0])
    print("px per m, least and most over all headings:", model.pixels_per_metre(uv).round(1))

    xy_dot = model.ground_velocity(
        uv, [30.0, -5.0]
    )  # what moves 30 px/s to the right and 5 px/s up
    print("moves on the ground at", xy_dot.round(3), "m/s")
    print("and in the image at", model.image_velocity(uv, xy_dot).round(3), "px/s")

    # Any image point of the ground can be the origin; then pixels become metres.
    floor = model.ground_position([[320.0, 400.0], [420.0, 400.0]], origin_uv=uv)
    print("100 px to the right are", f"{np.linalg.norm(floor[1] - floor[0]):.2f} m")


if __name__ == "__main__":
    main()
