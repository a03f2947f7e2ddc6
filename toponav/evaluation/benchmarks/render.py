"""Frames a second of each depth camera, against plain embreex in the same run."""

import time
from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float32

from toponav.core.camera import PanoramaCamera, PinholeCamera
from toponav.core.geometry import Pose2
from toponav.evaluation.benchmarks.building import benchmark_suite
from toponav.evaluation.benchmarks.record import Benchmark
from toponav.sim.render import make_renderer
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.home import generate_home
from toponav.worlds.scene import Scene

__all__ = ["frames_per_second", "furnished_rates", "measure_render"]

_CAMERAS = {
    "320x240": PinholeCamera(),
    "80x60": PinholeCamera(width=80, height=60),
    "panorama_512x128": PinholeCamera(width=512, height=128, hfov_rad=np.pi / 2),
}
_HOME_SEED = 0
_FRAMES = {"grid": 200, "packets": 20, "embreex": 20}


def measure_render(repeats: int = 5, seed: int = 0) -> Benchmark:
    """Frames per second of processor time of each camera: medians over interleaved repeats.

    The baseline gets its ray directions ready-made, and only the call of `run` is timed.

    Args:
        repeats: How often each camera is timed.
        seed: Seed of the viewpoints.
    """
    suite = benchmark_suite(episodes=1)
    scene = suite.scene
    metrics: dict[str, float] = {}
    for size, camera in _CAMERAS.items():
        rates = frames_per_second(scene, camera, repeats, seed)
        names = {
            "packets": f"depth_{size}_fps_per_core",
            "grid": f"grid_depth_{size}_fps_per_core",
            "embreex": f"embreex_depth_{size}_fps_per_core",
        }
        for backend, values in rates.items():
            metrics[names[backend]] = float(np.median(values))
        for backend, prefix in (("packets", ""), ("grid", "grid_")):
            ratio = np.median(rates[backend] / rates["embreex"])
            metrics[f"{prefix}depth_{size}_speedup_over_embreex"] = float(ratio)
    home = generate_home(_HOME_SEED)
    metrics |= furnished_rates(home, repeats, seed)
    settings = {
        "building": scene.name,
        "furnished": {"home_seed": _HOME_SEED, "triangles": len(home.mesh.faces)},
        "triangles": len(scene.mesh.faces),
        "seed": seed,
        "repeats": repeats,
        "frames_per_repeat": _FRAMES,
        "per_core": "frames per second of processor time of one process with one thread",
    }
    return Benchmark("render", metrics, settings)


def furnished_rates(
    home: Scene, repeats: int, seed: int = 0, frames: int = _FRAMES["packets"]
) -> dict[str, float]:
    """Median rates of the panorama in colour and depth, and of depth, where furniture stands.

    Args:
        home: A building with an explicit mesh, textures and furniture.
        repeats: How often each camera is timed, cameras taking turns.
        seed: Seed of the viewpoints.
        frames: How many frames each camera renders at a time.
    """
    panorama = make_renderer(home, PanoramaCamera())
    depth = make_renderer(home, PinholeCamera())
    shots: dict[str, Callable[[Pose2], object]] = {
        "panorama_rgbd_128x512_fps_per_core": lambda pose: panorama.render_images(
            pose, ("rgb", "depth")
        ),
        "panorama_rgbd_semantic_128x512_fps_per_core": lambda pose: panorama.render_images(
            pose, ("rgb", "depth", "semantic")
        ),
        "panorama_all_128x512_fps_per_core": panorama.render_images,
        "depth_320x240_furnished_fps_per_core": depth.render,
    }
    poses = _viewpoints(home, frames, seed)
    for shoot in shots.values():
        shoot(poses[0])
    rates: dict[str, list[float]] = {name: [] for name in shots}
    for _ in range(repeats):
        for name, shoot in shots.items():
            start_s = time.process_time()
            for pose in poses:
                shoot(pose)
            rates[name].append(frames / (time.process_time() - start_s))
    return {name: float(np.median(values)) for name, values in rates.items()}


def frames_per_second(
    scene: Scene,
    camera: PinholeCamera,
    repeats: int,
    seed: int = 0,
    frames: Mapping[str, int] = _FRAMES,
) -> dict[str, np.ndarray]:
    """Rates of each backend in each repeat, backends taking turns.

    Args:
        scene: An extruded building.
        camera: The camera.
        repeats: How often each backend is timed.
        seed: Seed of the viewpoints.
        frames: How many frames each backend renders at a time.
    """
    poses = _viewpoints(scene, max(frames.values()), seed)
    shots: dict[str, Callable[[int], object]] = {}
    for backend in ("grid", "packets"):
        renderer = make_renderer(scene, camera, backend)
        shots[backend] = lambda k, renderer=renderer: renderer.render(poses[k])  # type: ignore[misc]
    shots["embreex"] = _plain_embreex(scene, camera, poses[: frames["embreex"]])
    for shoot in shots.values():
        shoot(0)
    rates = {backend: np.empty(repeats) for backend in shots}
    for repeat in range(repeats):
        for backend, shoot in shots.items():
            start_s = time.process_time()
            for k in range(frames[backend]):
                shoot(k)
            rates[backend][repeat] = frames[backend] / (time.process_time() - start_s)
    return rates


def _viewpoints(scene: Scene, count: int, seed: int) -> list[Pose2]:
    """Random free poses."""
    rng = np.random.default_rng(seed)
    cells = np.argwhere(FreeSpace.of(scene, 0.2).component == 1)
    chosen = cells[rng.integers(len(cells), size=count)]
    return [
        Pose2(*scene.grid.center_of(int(row), int(col)), float(rng.uniform(-np.pi, np.pi)))
        for row, col in chosen
    ]


def _plain_embreex(
    scene: Scene, camera: PinholeCamera, poses: list[Pose2]
) -> Callable[[int], Float32[np.ndarray, " rays"]]:
    """A call of embreex's own `run` for each pose, with everything around it done before."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    embree = EmbreeScene()
    mesh = TriangleMesh(embree, scene.mesh.vertices_m, scene.mesh.faces)
    rays = camera.rays_in_robot().reshape(-1, 3)
    ready = []
    for pose in poses:
        cosine, sine = np.cos(pose.yaw_rad), np.sin(pose.yaw_rad)
        turn = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float32)
        place = np.array([pose.x_m, pose.y_m, camera.mount_height_m], np.float32)
        ready.append((np.tile(place, (len(rays), 1)), rays @ turn))

    def shoot(k: int) -> Float32[np.ndarray, " rays"]:
        assert mesh is not None  # must outlive the calls
        depth_m: Float32[np.ndarray, " rays"] = embree.run(
            *ready[k], dists=camera.max_depth_m, query="DISTANCE"
        )
        return depth_m

    return shoot
