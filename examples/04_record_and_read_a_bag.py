"""Record drives of the expert as ROS 2 bags, and read one back: as arrays and as messages.

python examples/04_record_and_read_a_bag.py
"""

import tempfile
from pathlib import Path

from rosbags.highlevel import AnyReader

from toponav.core.camera import PinholeCamera
from toponav.data.collect import CollectConfig, collect
from toponav.data.dataset import trajectory_path
from toponav.data.storage import read_trajectory
from toponav.maps.construct import map_from_layout
from toponav.maps.spec import save_map
from toponav.worlds.generate.office import generate_office
from toponav.worlds.storage import save_scene


def main(out: Path) -> None:
    # Any saved scene with its map beside it will do. `offices-train` stands for a thousand.
    scene = generate_office(7, size="small")
    save_scene(scene, out / "office")
    save_map(map_from_layout(scene), out / "office" / "map.topo.json")

    # Killed half-way, the same call goes on where it stopped.
    config = CollectConfig(
        episodes=2,
        buildings=(str(out / "office"),),
        camera=PinholeCamera(width=80, height=60),
    )
    collect(out / "drives", config)
    bag = trajectory_path(out / "drives", 0)

    recording = read_trajectory(bag)
    start, goal = recording.metadata.plan.nodes[0], recording.metadata.plan.nodes[-1]
    print(f"{bag}: {start} to {goal}, {recording.end.outcome}")
    print(f"  {len(recording)} depth images of {recording.depth_mm.shape[1:]} pixels in mm")
    print(f"  mean speed {recording.velocity[:, 0].mean():.2f} m/s")

    # The same file opens in `ros2 bag`, Foxglove and every other tool that reads MCAP.
    with AnyReader([bag]) as reader:
        for connection in reader.connections:
            print(f"  {connection.msgcount:5d} {connection.msgtype:<28} {connection.topic}")


if __name__ == "__main__":
    main(Path(tempfile.mkdtemp(prefix="toponav-")))
