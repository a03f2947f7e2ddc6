"""ROS 2: the simulator and the agents as nodes; only the `*_node` modules import rclpy."""
