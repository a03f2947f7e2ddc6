"""What real depth sensors make of the truth: noise, steps, shadows at edges, holes."""

import dataclasses
import itertools
import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt8

from toponav.core.camera import Camera, PanoramaCamera
from toponav.core.errors import InputError, did_you_mean
from toponav.sim.sensor_noise_kernels import mark_shadows, measure

__all__ = ["SENSORS", "DepthSensor", "DepthSensorNoise", "depth_sensor"]


@dataclass(frozen=True)
class DepthSensor:
    """How a kind of depth sensor errs. A hole reads 0, as in GraphNav's recordings."""

    name: str
    """Kind of sensor."""
    nearest_m: float
    """Nothing nearer is seen."""
    farthest_m: float
    """Nothing farther is seen."""
    baseline_m: float = 0.0
    """Distance from projector or second camera to the camera; 0 for time of flight."""
    focal_px: float = 0.0
    """Focal length of the sensor's own image, which sets the size of disparities."""
    disparity_step_px: float = 0.0
    """Disparities are whole numbers of this; 0 for none."""
    disparity_noise_px: float = 0.0
    """Standard deviation of a disparity; depth then varies with its square."""
    noise_floor_m: float = 0.0
    """Standard deviation of depth at no distance."""
    noise_per_m2: float = 0.0
    """What the deviation grows by with the square of the depth."""
    tilt_noise: float = 0.0
    """What the deviation grows by on slanted surfaces: this over the root of the depth, times the
    square of the angle over what is left to 90 degrees."""
    edge_jitter_px: float = 0.0
    """Standard deviation of where a pixel looks, in pixels of the rendered image."""
    flying_share: float = 0.0
    """Share of pixels at an edge that lie between near and far."""
    grazing_rad: float = math.radians(80.0)
    """About the angle between ray and surface normal beyond which nothing comes back."""
    dropout_share: float = 0.0
    """Share of pixels lost at the farthest depth; falls with the square of depth."""
    dark_below: float = 0.0
    """Brightness, 0 to 1, below which surfaces at the farthest depth are lost."""

    def __post_init__(self) -> None:
        stereo = self.disparity_step_px > 0 or self.disparity_noise_px > 0
        numbers = [each for each in dataclasses.astuple(self) if not isinstance(each, str)]
        checks = {
            "nearest_m": 0.0 <= self.nearest_m < self.farthest_m,
            "baseline_m": self.baseline_m > 0 or not stereo,
            "focal_px": self.focal_px > 0 or not (stereo or self.baseline_m > 0),
            "grazing_rad": 0.0 < self.grazing_rad <= math.pi / 2,
        }
        for field, holds in checks.items():
            if not holds or not all(0.0 <= each < math.inf for each in numbers):
                raise InputError(
                    f"{field} is out of range, got {getattr(self, field)}",
                    where=f"DepthSensor {self.name!r}",
                    remedy="numbers from 0 up, nearest below farthest, and a baseline and a focal "
                    "length for what measures disparities",
                )

    def numbers(self) -> tuple[float, ...]:
        """The model as the compiled loop takes it."""
        return (
            self.nearest_m,
            self.farthest_m,
            self.baseline_m * self.focal_px,
            self.disparity_step_px,
            self.disparity_noise_px,
            self.noise_floor_m,
            self.noise_per_m2,
            self.tilt_noise,
            self.edge_jitter_px,
            self.flying_share,
            math.cos(self.grazing_rad),
            self.dropout_share,
            self.dark_below,
        )


KINECT_V1 = DepthSensor(
    "kinect_v1",
    nearest_m=0.5,
    farthest_m=5.0,
    baseline_m=0.075,
    focal_px=580.0,
    disparity_step_px=0.125,
    noise_floor_m=0.0012,
    noise_per_m2=0.0014,
    tilt_noise=0.0001,
    edge_jitter_px=0.5,
    dropout_share=0.02,
    dark_below=0.05,
)
"""Structured light (Kinect for Xbox 360, Xtion, Astra: what TurtleBots carry).

Depth noise grows with the square of depth, 1.4 mm at 1 m and 3.6 cm at 5 m (Khoshelham and
Elberink 2012, Sensors 12, 1437, equation 11), a little more on slanted surfaces, and edges wander
by a fraction of a pixel (Nguyen, Izadi and Lovell 2012, 3DIMPVT, equations 1-3). Disparities are
whole eighths of a pixel, and the projector 7.5 cm beside the camera leaves shadows (Konolige and
Mihelich 2011, Technical description of Kinect calibration).
"""

KINECT_V2 = DepthSensor(
    "kinect_v2",
    nearest_m=0.5,
    farthest_m=4.5,
    noise_floor_m=0.0012,
    noise_per_m2=0.00025,
    tilt_noise=0.0001,
    flying_share=0.6,
    grazing_rad=math.radians(83.0),
    dropout_share=0.01,
    dark_below=0.08,
)
"""Time of flight (Kinect One, Azure Kinect and the like): little noise, no shadows, and pixels
that fly between near and far at edges; dark surfaces are lost (Fankhauser et al. 2015, Kinect v2
for mobile robot navigation, ICAR, equations for indoor noise, rounded)."""

REALSENSE_D435 = DepthSensor(
    "realsense_d435",
    nearest_m=0.2,
    farthest_m=10.0,
    baseline_m=0.05,
    focal_px=424.0,
    disparity_step_px=1 / 32,
    disparity_noise_px=0.08,
    edge_jitter_px=1.0,
    flying_share=0.3,
    dropout_share=0.1,
    dark_below=0.02,
)
"""Active stereo: 848 px over 90 degrees, 50 mm baseline, subpixel noise of 0.08 px, so that depth
varies by 0.4 % of it at 1 m and 4 % at 10 m; disparities of 1/32 px; wide shadows and ragged
edges (Grunnet-Jepsen, Sweetser and Woodfill, Tuning depth cameras for best performance, and
Grunnet-Jepsen et al., Subpixel linearity improvement; Intel RealSense documentation)."""

SENSORS = {sensor.name: sensor for sensor in (KINECT_V1, KINECT_V2, REALSENSE_D435)}
"""Sensors by name."""


def depth_sensor(name: str) -> DepthSensor:
    """The sensor of this name.

    Raises:
        InputError: If there is none; the message offers the nearest name.
    """
    if name not in SENSORS:
        raise InputError(
            f"no depth sensor is called '{name}'",
            where="sensor",
            remedy=did_you_mean(str(name), list(SENSORS)),
        )
    return SENSORS[name]


class DepthSensorNoise:
    """A depth sensor's errors for one camera.

    Args:
        sensor: The kind of sensor.
        camera: The camera; not an equirectangular panorama, which no such sensor takes.

    Example:
        >>> noise = DepthSensorNoise(depth_sensor("kinect_v1"), PinholeCamera())
        >>> flat = np.full((240, 320), 2.0, np.float32)
        >>> seen = noise(flat, np.random.default_rng(0))
        >>> bool(0.0 < seen[seen > 0].std() < 0.2)
        True
    """

    def __init__(self, sensor: DepthSensor, camera: Camera) -> None:
        self.sensor = sensor
        self.camera = camera
        self._rays = camera.rays_in_robot()
        self._parts = [slice(None)]
        pinhole = camera
        if isinstance(camera, PanoramaCamera):
            if camera.kind != "stitched":
                raise InputError(
                    "depth sensors are pinholes",
                    where=f"DepthSensor {sensor.name!r}",
                    remedy="use a PinholeCamera or a stitched PanoramaCamera",
                )
            pinhole = camera.quarter
            edges = [0, *range(camera.width // 8, camera.width, camera.width // 4), camera.width]
            self._parts = [slice(*pair) for pair in itertools.pairwise(edges)]
        self._shift_px = np.float32(sensor.baseline_m * (1.0 / pinhole.pixel_m))

    @property
    def renders_to_m(self) -> float:
        """How far the truth must be known, as a sensor sees farther than depths are clipped."""
        return max(self.camera.max_depth_m, self.sensor.farthest_m * 1.01)

    def __call__(
        self,
        depth_m: Float32[np.ndarray, "height width"],
        rng: np.random.Generator,
        rgb: UInt8[np.ndarray, "height width 3"] | None = None,
    ) -> Float32[np.ndarray, "height width"]:
        """What the sensor reports, clipped at the camera's maximum; 0 where it saw nothing.

        Args:
            depth_m: The truth, known to `renders_to_m`.
            rng: Source of all chance.
            rgb: Colours of the same image, so that dark surfaces can be lost.
        """
        shape = depth_m.shape
        dark = np.empty((0, 0), np.float32)
        if rgb is not None and self.sensor.dark_below > 0:
            dark = (rgb.mean(axis=-1, dtype=np.float32) / np.float32(255)) ** np.float32(2.2)
        normal = rng.standard_normal((2, *shape), np.float32)
        chance = rng.random((3, *shape), np.float32)
        noisy_m = np.empty(shape, np.float32)
        for part in self._parts:
            depth = np.ascontiguousarray(depth_m[:, part])
            hidden = np.zeros(depth.shape, bool)
            if self.sensor.baseline_m > 0:
                mark_shadows(depth, self._shift_px, hidden)
            seen = np.empty(depth.shape, np.float32)
            measure(
                depth,
                np.ascontiguousarray(self._rays[:, part]),
                hidden,
                np.ascontiguousarray(dark[:, part]),
                self.sensor.numbers(),
                np.ascontiguousarray(normal[:, :, part]),
                np.ascontiguousarray(chance[:, :, part]),
                seen,
            )
            noisy_m[:, part] = seen
        return np.minimum(noisy_m, np.float32(self.camera.max_depth_m))
