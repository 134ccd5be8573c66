# SPDX-License-Identifier: BSD-3-Clause
"""The node's subscription of scans, of the type in which they are published."""
import importlib

from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import PointCloud2

CLOUD, LIVOX = "sensor_msgs/msg/PointCloud2", ("livox_ros_driver2/msg/CustomMsg", "livox_ros_driver/msg/CustomMsg")


class ScanTopic:
    """PointCloud2, until somebody publishes a Livox's CustomMsg in its place. The points of that are subscribed as bytes: as
    20,000 objects of Python they would take longer than the LiDAR does."""

    def __init__(self, node, take_cloud, take_livox):
        self.node, self.take_cloud, self.take_livox = node, take_cloud, take_livox
        self._subscribe(CLOUD)

    def _subscribe(self, kind):
        if kind == CLOUD:
            made = self.node.create_subscription(PointCloud2, "points", self.take_cloud, qos_profile_sensor_data)
        else:
            messages = importlib.import_module(kind.split("/")[0] + ".msg")
            made = self.node.create_subscription(messages.CustomMsg, "points", self.take_livox, qos_profile_sensor_data, raw=True)
        self.kind, self.subscription = kind, made

    def look(self):
        """To be called now and then. A ValueError where the type that is published is not known here."""
        kinds = [publisher.topic_type for publisher in self.node.get_publishers_info_by_topic("points")]
        kind = next((kind for kind in (CLOUD, *LIVOX) if kind in kinds), self.kind)
        if kind == self.kind or self.kind in kinds:
            return
        before = self.subscription
        try:
            self._subscribe(kind)
        except ImportError as error:
            raise ValueError(f"they are {kind}, whose package is not sourced here ({error})") from error
        self.node.destroy_subscription(before)
