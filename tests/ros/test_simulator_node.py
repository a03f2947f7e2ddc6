"""The simulator's topics and services, as another node of the same process meets them."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from toponav.core.camera import PinholeCamera
from toponav.core.geometry import Pose2
from toponav.sim.simulation import Simulation
from toponav.worlds.free_space import FreeSpace
from toponav.worlds.generate.office import generate_office
from toponav.worlds.scene import Scene

pytestmark = [
    pytest.mark.ros,
    pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning"),
]
_PATIENCE = 4000


@pytest.fixture(scope="module")
def scene() -> Scene:
    return generate_office(3, "small")


@pytest.fixture(scope="module")
def middle(scene: Scene) -> Pose2:
    """Where there is most room."""
    free = FreeSpace.of(scene, 0.3)
    row, col = np.unravel_index(np.argmax(free.clearance_m), free.clearance_m.shape)
    x_m, y_m = scene.grid.center_of(int(row), int(col))
    return Pose2(x_m, y_m, 0.0)


class Lab:
    """A simulated robot, and a node beside it that listens, commands and asks."""

    def __init__(self, scene: Scene, middle: Pose2, robot: str, **config: Any) -> None:
        import rclpy

        from toponav.ros.presets import robot_preset
        from toponav.ros.sim_node import SimNode, SimNodeConfig

        simulation = Simulation(scene, PinholeCamera())
        self.preset = robot_preset(robot)
        self.sim = SimNode(simulation, middle, SimNodeConfig(self.preset, **config))
        self.other = rclpy.create_node("other")
        self.heard: dict[str, list[Any]] = {}

    def close(self) -> None:
        self.sim.destroy_node()
        self.other.destroy_node()

    def run(self, until: Callable[[], bool]) -> None:
        """Both nodes live until this holds."""
        import rclpy

        left = [_PATIENCE]

        def is_over() -> bool:
            rclpy.spin_once(self.other, timeout_sec=0.001)
            left[0] -= 1
            return until() or left[0] < 0

        self.sim.run(is_over)
        assert left[0] >= 0, "what was waited for did not happen"

    def listen(self, kind: Any, topic: str, quality: Any) -> list[Any]:
        heard: list[Any] = []
        self.other.create_subscription(kind, topic, heard.append, quality)
        return heard

    def call(self, kind: Any, name: str, **fields: Any) -> Any:
        client = self.other.create_client(kind, f"/toponav_sim/{name}")
        self.run(client.service_is_ready)
        waiting = client.call_async(kind.Request(**fields))
        self.run(waiting.done)
        return waiting.result()


@pytest.fixture
def lab(ros: None, scene: Scene, middle: Pose2) -> Iterator[Lab]:
    made = Lab(scene, middle, "toponav", rate=0.0)
    yield made
    made.close()


def test_pictures_come_with_the_calibration_of_their_moment(lab: Lab) -> None:
    from sensor_msgs.msg import CameraInfo, Image

    from toponav.ros import _fill, _qos

    images = lab.listen(Image, "/camera/depth/image_raw", _qos.SENSOR)
    infos = lab.listen(CameraInfo, "/camera/depth/camera_info", _qos.SENSOR)
    lab.run(lambda: len(images) >= 3 and len(infos) >= 3)
    stamps = [_fill.stamp_ns(each.header) for each in images]
    known = {_fill.stamp_ns(each.header) for each in infos}
    assert len(known & set(stamps)) >= 2
    image, info = images[0], infos[0]
    assert (image.encoding, image.width, image.height) == ("32FC1", info.width, info.height)
    assert image.header.frame_id == info.header.frame_id == "camera_depth_optical_frame"
    depth_m = np.frombuffer(bytes(image.data), np.float32)
    assert 0.1 < depth_m.max() <= 3.5
    # 150 degrees across.
    assert info.k[0] == pytest.approx(info.width / 2 / np.tan(np.radians(75)), rel=1e-3)


def test_who_comes_late_gets_the_floor_plan_and_where_the_camera_is(lab: Lab) -> None:
    from nav_msgs.msg import OccupancyGrid
    from tf2_msgs.msg import TFMessage

    from toponav.ros import _qos

    lab.run(lambda: lab.sim.robot.time_ns > 1e9)
    maps = lab.listen(OccupancyGrid, "/map", _qos.LATCHED)
    frames = lab.listen(TFMessage, "/tf_static", _qos.LATCHED)
    lab.run(lambda: bool(maps) and bool(frames))
    assert len(maps[0].data) == maps[0].info.width * maps[0].info.height
    assert 100 in maps[0].data
    placed = {each.child_frame_id: each for each in frames[0].transforms}
    assert placed["camera_link"].transform.translation.z == pytest.approx(0.6)
    optical = placed["camera_depth_optical_frame"].transform.rotation
    assert (optical.x, optical.y, optical.z, optical.w) == (-0.5, 0.5, -0.5, 0.5)


def test_the_clock_goes_on_over_a_reset_and_odometry_is_the_truth(lab: Lab, middle: Pose2) -> None:
    from nav_msgs.msg import Odometry
    from rosgraph_msgs.msg import Clock
    from toponav_msgs.srv import Reset

    from toponav.ros import _qos

    clocks = lab.listen(Clock, "/clock", _qos.RELIABLE)
    odometry = lab.listen(Odometry, "/odom", _qos.RELIABLE)
    lab.run(lambda: len(clocks) > 5)
    answer = lab.call(Reset, "reset", x=middle.x_m + 0.2, y=middle.y_m, yaw=1.0)
    assert answer.success
    odometry.clear()
    lab.run(lambda: len(odometry) > 5)
    times = [each.clock.sec + each.clock.nanosec / 1e9 for each in clocks]
    assert times == sorted(times)
    assert odometry[-1].pose.pose.position.x == pytest.approx(middle.x_m + 0.2, abs=0.01)
    assert odometry[-1].pose.covariance[0] > 0
    refused = lab.call(Reset, "reset", x=1e6, y=0.0, yaw=0.0)
    assert not refused.success
    assert "inside the scene" in refused.message


def test_a_paused_robot_moves_only_step_by_step(lab: Lab) -> None:
    from std_srvs.srv import SetBool
    from toponav_msgs.srv import Seed, Step

    assert not lab.call(Step, "step", steps=1).success
    assert lab.call(SetBool, "pause", data=True).success
    before_ns = lab.sim.robot.time_ns
    done = lab.call(Step, "step", steps=3)
    assert done.success
    assert lab.sim.robot.time_ns - before_ns == 600_000_000
    assert lab.call(Seed, "seed", seed=7).success


@pytest.mark.parametrize(
    ("robot", "topic", "stamped"),
    [
        ("toponav", "/cmd_vel", True),
        ("toponav", "/cmd_vel_unstamped", False),
        ("locobot", "/locobot/mobile_base/cmd_vel", False),
    ],
)
def test_both_kinds_of_commands_drive_and_end_half_a_second_later(
    robot: str, topic: str, stamped: bool, ros: None, scene: Scene, middle: Pose2
) -> None:
    from geometry_msgs.msg import Twist, TwistStamped

    from toponav.core.episode import Velocity
    from toponav.ros import _fill, _qos

    lab = Lab(scene, middle, robot, rate=0.0)
    try:
        commands = lab.other.create_publisher(
            TwistStamped if stamped else Twist, topic, _qos.RELIABLE
        )

        def speed() -> float:
            if lab.other.count_subscribers(topic):
                commands.publish(_fill.twist_message(Velocity(0.0, 0.5), stamped, 0))
            return lab.sim.robot.state.velocity.angular_rad_s

        lab.run(lambda: speed() > 0.4)
        lab.run(lambda: lab.sim.robot.state.velocity.angular_rad_s < 0.02)
    finally:
        lab.close()


def test_the_bumper_tells_of_a_touch(lab: Lab, scene: Scene, middle: Pose2) -> None:
    from geometry_msgs.msg import TwistStamped
    from std_msgs.msg import Bool

    from toponav.core.episode import Velocity
    from toponav.ros import _fill, _qos

    touches = lab.listen(Bool, "/bumper", _qos.RELIABLE)
    commands = lab.other.create_publisher(TwistStamped, "/cmd_vel", _qos.RELIABLE)

    def is_touching() -> bool:
        commands.publish(_fill.twist_message(Velocity(0.5, 0.0), True, 0))
        return any(each.data for each in touches)

    lab.run(is_touching)
    assert len(lab.sim.contacts) == 1
    assert lab.sim.contacts[0][1] in {"wall", "furniture", "clutter"}
