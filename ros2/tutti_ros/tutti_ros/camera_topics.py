# SPDX-License-Identifier: BSD-3-Clause
"""The node's cameras and IMU: their subscriptions, and what these say to the Link."""
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, Imu

from tutti_ros.cameras import Cameras
from tutti_ros.ros_node import best_effort

IMAGES_DEPTH, IMU_DEPTH = 10, 2000  # how long the node may be held up


class CameraTopics:
    """Subscribes what the node's parameters name: nothing without `images`."""

    def __init__(self, node):
        self.node = node
        images = [topic.strip() for topic in node.images.split(",") if topic.strip()]
        self.cameras = Cameras(images, node.depth, node.imu, node.images_offset_s, node.sensor_pose)
        for stream in self.cameras.streams:
            self._subscribe(CameraInfo, stream.info, self.cameras.add_info, stream)
            self._subscribe(CompressedImage if stream.is_compressed else Image, stream.topic, self.cameras.add_image, stream)
        if node.depth:
            self._subscribe(CameraInfo, self.cameras.depth.info, self.cameras.add_info, self.cameras.depth)
            self._subscribe(Image, node.depth, self.cameras.add_image, self.cameras.depth)
        if node.imu:
            self._subscribe(Imu, node.imu, self.cameras.add_imu, depth=IMU_DEPTH)

    def _subscribe(self, kind, topic, add, *stream, depth=IMAGES_DEPTH):
        take = lambda message: self._take(topic, add, *stream, message)
        self.node.create_subscription(kind, topic, take, best_effort(depth))

    def _take(self, topic, add, *what):
        try:
            if add(*what):
                self.look()
        except ValueError as error:
            self.node.complain(f"{topic}: {error}")
            return
        self.say()

    def take_odometry(self, stamp_ns):
        self.cameras.add_odometry(stamp_ns)
        self.say()

    def say(self, is_last=False):
        """What odometry has reached."""
        said, left_out = self.cameras.due(is_last)
        connection = self.node.connection
        try:
            with connection.lock:
                for add, what in said:
                    getattr(connection.link, add)(*what)
        except ValueError as error:
            left_out.append(f"images: {error}")
        for why in left_out:
            self.node.complain(why)
        if said:
            connection.wake()

    def look(self):
        """The robot is greeted anew where more is known of its sensors. What is still missing, in words."""
        if self.cameras.look():
            with self.node.connection.lock:
                self.node.link.set_sensors(self.cameras.sensors())
            self.node.connection.again()
        return self.cameras.missing
