# SPDX-License-Identifier: BSD-3-Clause
"""The node: hands what it subscribes to the robot program as it comes, and publishes what that answers as it comes. The robot
reads and writes the bytes of ROS's messages itself (docs/ros.md)."""
import collections
import contextlib
import importlib
import struct

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.serialization import serialize_message
from std_srvs.srv import Empty, Trigger

from tutti_ros.connection import Connection
from tutti_ros.diagnosis import diagnosis, diagnosis_of_inactive
from tutti_ros.feed_messages import Feed
from tutti_ros.link import Link, stamp_ns, stamps_of_transforms
from tutti_ros.ros_node import LATCHED, best_effort, diagnostics, parameter, run

PARAMETERS = {
    "socket": "",              # of tutti robot --feed
    "map_frame": "",           # empty: odom_frame with 'odom' at its end made 'map', else 'map'
    "world_frame": "world",    # world -> map is published, too; empty: neither that nor the grid
    "grid": "/world/map",      # topic of the server's OccupancyGrid, which is published in this robot's map, as map
    "odom_frame": "",          # empty: as odometry's header says
    "base_frame": "",          # empty: as odometry's child_frame_id says
    "T_body_lidar": "",        # "x y z qx qy qz qw"; empty: as the robot's mission file or transforms say
    "antenna_m": "",           # "x y z" of the receiver's antenna in the body frame; empty: the same
    "use_scans": True,
    "use_fixes": True,
    "scans_deskewed": False,   # points' times are not looked at
    "images": "",              # topics of one camera or two: "left/image_raw,right/image_raw"; empty: none are subscribed
    "images_offset_s": 0.0,    # added to the images' stamps gives odometry's time
    "depth": "",               # topic of depth images registered to the one camera; empty: none
    "imu": "",                 # topic that goes with images; empty: none
    "transform_tolerance_s": 0.1,  # by which map -> odom is dated ahead
    "publish_tf": True,
    "path_period_s": 1.0,
    "autostart": True,         # false: it waits for somebody to configure and activate it, as nav2's lifecycle manager does
}
# How much odometry is to be trusted, as robots[].covariance of a mission file. Variances add up along the trajectory.
NOISE = {"translation_m_per_sqrt_m": 0.02, "translation_m_per_sqrt_deg": 0.001, "translation_m_per_sqrt_s": 0.003,
         "rotation_deg_per_sqrt_m": 0.1, "rotation_deg_per_sqrt_deg": 0.02, "rotation_deg_per_sqrt_s": 0.02}
GRID = "nav_msgs/msg/OccupancyGrid"
ODOMETRY, TRANSFORMS, PATH = "nav_msgs/msg/Odometry", "tf2_msgs/msg/TFMessage", "nav_msgs/msg/Path"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
CLOUD = "sensor_msgs/msg/PointCloud2"
LIVOX = tuple(f"{package}/msg/CustomMsg" for package in ("livox_ros_driver2", "livox_ros_driver", "livox_interfaces"))
COMPRESSED = ("/compressed", "/compressedDepth")  # as image_transport names topics of CompressedImage
TF_QOS = QoSProfile(depth=100)
STATIC_QOS = QoSProfile(depth=100, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
IMAGES_QOS, IMU_QOS = best_effort(10), best_effort(2000)  # how long the node may be blocked
ODOMETRY_DEPTH = 1000  # the same: 5 s at 200 Hz, as of tutti robot --ros


def message_type(name):
    package, _, word = name.split("/")
    return getattr(importlib.import_module(package + ".msg"), word)


def camera_info_topic(images):
    """Where the CameraInfo of a topic of images is: beside it."""
    folder = (images.rpartition("/")[0] if images.endswith(COMPRESSED) else images).rpartition("/")
    return f"{folder[0]}{folder[1]}camera_info"


class TuttiNode(LifecycleNode):
    """A managed node (design.ros2.org/articles/node_lifecycle.html): while it is active it is connected to the robot, subscribes
    and publishes; otherwise it only says in /diagnostics that it is not. Parameters are read once, whatever its state."""

    def __init__(self):
        super().__init__("tutti_ros")
        for name, default in PARAMETERS.items():
            setattr(self, name, parameter(self, name, default))
        if not self.socket:
            raise ValueError("parameter 'socket' is empty, expected the SOCKET of tutti robot --feed SOCKET")
        self.settings = self._settings()
        self.trouble = collections.deque(maxlen=5)
        self.transform_ns = -1  # stamp of the last map -> odom (and world -> map)
        self.link = self.connection = None  # while it is active
        self.while_active = []  # what it subscribes, publishes and serves then, after how that is destroyed
        self.diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(1.0, self.publish_diagnostics)
        if self.autostart and not self.trigger_configure() == self.trigger_activate() == TransitionCallbackReturn.SUCCESS:
            raise RuntimeError("tutti_ros could not be activated: see its log")

    # Its states.
    def on_activate(self, state):
        try:
            self._begin()
        except Exception as error:  # which rclpy would drop
            self.get_logger().error(f"not activated: {error!r}")
            raise
        return super().on_activate(state)

    def on_deactivate(self, state):
        self._end()
        return super().on_deactivate(state)

    def on_shutdown(self, state):
        self._end()
        return super().on_shutdown(state)

    def on_error(self, state):
        self._end()
        return super().on_error(state)

    def destroy_node(self):
        self._end()
        return super().destroy_node()

    def _begin(self):
        self.correction, self.situation = None, None
        self.transform = None  # the last one
        self.link = Link(client_name=b"tutti_ros", sensors=Feed.Sensors(scans=self.use_scans), ros=self.settings)
        self.connection = Connection(self.socket, self.link, self.hear)
        self.outputs, self.topic_names = {}, {}  # publishers; subscribed topics, as ROS calls them
        for topic, kind, qos in (("/tf", TRANSFORMS, TF_QOS), ("corrected_path", PATH, LATCHED),
                                 ("corrected_pose", POSE, 10), ("localised_pose", POSE, 10),
                                 ("team_mates", "visualization_msgs/msg/MarkerArray", LATCHED)):
            self._advertise(topic, kind, qos)
        self._subscribe_all()
        self._serve(Trigger, "~/end_recording", self.end_recording)
        self._serve(Empty, "reinitialize_global_localization", self.search_anew)  # nav2's names
        with contextlib.suppress(ImportError):  # nav2_msgs are not everywhere
            self._serve(importlib.import_module("nav2_msgs.srv").SetInitialPose, "set_initial_pose", self.set_start_pose)
        self._every(self.path_period_s, self.ask_for_path)
        self.connection.start()

    def _end(self):
        if self.connection is None:
            return
        self.connection.stop()  # nothing is published after it
        for destroy, one in reversed(self.while_active):
            destroy(one)
        self.while_active.clear()
        self.link = self.connection = None

    def _keep(self, destroy, one):
        self.while_active.append((destroy, one))
        return one

    def _advertise(self, topic, kind, qos):
        self.outputs[topic] = self._keep(self.destroy_publisher, self.create_publisher(message_type(kind), topic, qos))

    def _serve(self, kind, name, answer):
        self._keep(self.destroy_service, self.create_service(kind, name, answer))

    def _every(self, period_s, act):
        self._keep(self.destroy_timer, self.create_timer(period_s, act))

    def _settings(self):
        """How the robot is to read the messages, and in which frames it answers."""
        noise = [parameter(self, "noise." + name, default) for name, default in NOISE.items()]
        out = Feed.Ros(images=[topic.strip().encode() for topic in self.images.split(",") if topic.strip()],
                       depth=self.depth.encode(), imu=self.imu.encode(), images_offset_s=self.images_offset_s,
                       p_body_antenna=self._numbers("antenna_m", "x y z"), scans_deskewed=self.scans_deskewed,
                       body_frame=self.base_frame.encode(), noise=noise, odom_frame=self.odom_frame.encode(),
                       map_frame=self.map_frame.encode(), world_frame=self.world_frame.encode(), tolerance_s=self.transform_tolerance_s)
        names = "x y z qx qy qz qw"
        if pose := self._numbers("T_body_lidar", names):
            out.T_body_lidar.CopyFrom(Feed.Pose(**dict(zip(names.split(), pose))))
        return out

    def _numbers(self, parameter, expected):
        text = getattr(self, parameter)
        numbers = [float(word) for word in text.split()]
        if numbers and len(numbers) != len(expected.split()):
            raise ValueError(f"parameter '{parameter}' is '{text}', expected '{expected}'")
        return numbers

    def complain(self, what):
        if what not in self.trouble:
            self.trouble.append(what)
        self.get_logger().warning(what, throttle_duration_sec=5.0)

    # From ROS.
    def _subscribe(self, topic, kind, qos, add, *more):
        take = lambda cdr: self.take(add, topic, kind, bytes(cdr), *more)
        subscription = self._keep(self.destroy_subscription,
                                  self.create_subscription(message_type(kind), topic, take, qos, raw=True))
        self.topic_names[topic] = subscription.topic_name  # as it is remapped
        return subscription

    def _subscribe_all(self):
        link, sensor_qos = self.link, qos_profile_sensor_data
        take_static = lambda topic, kind, cdr: link.add_lasting(topic, kind, cdr, key=cdr)
        self._subscribe("/tf_static", TRANSFORMS, STATIC_QOS, take_static)
        self._subscribe("/tf", TRANSFORMS, TF_QOS, link.add_moving)
        self._subscribe("odom", ODOMETRY, best_effort(ODOMETRY_DEPTH), self.add_odometry)
        if self.grid and self.world_frame:
            self._subscribe(self.grid, GRID, LATCHED, link.add_lasting)
        self._subscribe("battery_state", "sensor_msgs/msg/BatteryState", sensor_qos, link.add_once)
        self._subscribe("initialpose", POSE, 1, link.add_once)  # reliable, as RViz sends it
        if self.use_scans:
            self.scans = CLOUD, self._subscribe("points", CLOUD, sensor_qos, link.add, "scans")
            self._every(1.0, self.look_for_scans)
        if self.use_fixes:
            self._subscribe("fix", "sensor_msgs/msg/NavSatFix", sensor_qos, link.add, "fixes")
        for topic in [topic.decode() for topic in link.hello["ros"].images] + [self.depth] * bool(self.depth):
            kind = "sensor_msgs/msg/" + ("CompressedImage" if topic.endswith(COMPRESSED) else "Image")
            self._subscribe(topic, kind, IMAGES_QOS, link.add, "images")
            self._subscribe(camera_info_topic(topic), "sensor_msgs/msg/CameraInfo", IMAGES_QOS, link.add_lasting)
        if self.imu:
            self._subscribe(self.imu, "sensor_msgs/msg/Imu", IMU_QOS, link.add, "imu")

    def take(self, add, topic, *what):
        try:
            self._tell(add, topic, *what)
        except ValueError as error:
            self.complain(f"{self.topic_names.get(topic, topic)}: {error}")

    def _tell(self, add, *what):
        """Hands something to the link; nothing where the node was deactivated while it was on its way."""
        if self.connection is None:
            return
        with self.connection.lock:
            add(*what)
        self.connection.wake()

    def add_odometry(self, topic, kind, cdr):
        self.link.add(topic, kind, cdr, "odometry")
        if self.link.state != "feeding" and self.transform:  # the last correction, so that nobody loses the map
            out, at_ns = bytearray(self.transform), stamp_ns(cdr) + int(self.transform_tolerance_s * 1e9)
            for at in stamps_of_transforms(self.transform):
                struct.pack_into("<iI", out, at, *divmod(at_ns, 10**9))
            self.publish_transform(bytes(out))

    def look_for_scans(self):
        """PointCloud2, until somebody publishes a Livox's CustomMsg in its place."""
        kinds = [publisher.topic_type for publisher in self.get_publishers_info_by_topic("points")]
        before, subscription = self.scans
        kind = next((kind for kind in (CLOUD, *LIVOX) if kind in kinds), before)
        if kind == before or before in kinds:
            return
        try:
            self.scans = kind, self._subscribe("points", kind, qos_profile_sensor_data, self.link.add, "scans")
        except ImportError as error:
            self.complain(f"points: they are {kind}, whose package is not sourced here ({error})")
            return
        self.while_active.remove((self.destroy_subscription, subscription))
        self.destroy_subscription(subscription)

    def end_recording(self, request, response):
        self._tell(self.link.end_recording)
        response.success, response.message = True, "told the robot; it says when everything is stored"
        return response

    def search_anew(self, request, response):
        """A robot that localises in a map forgets where it is, and searches the whole map."""
        self._tell(self.link.add_search)
        return response

    def set_start_pose(self, request, response):
        self.take(self.link.add_once, "initialpose", POSE, serialize_message(request.pose))
        return response

    # From the robot, in the thread of the connection.
    def hear(self, kind, message):
        if not rclpy.ok():  # interrupted: nothing can be published any more
            return
        log = self.get_logger()
        if kind == "raw":
            self.publish(message.topic.decode(), message.type.decode(), message.data)
        elif kind in ("correction", "situation"):
            setattr(self, kind, message)
        elif kind in ("refused", "closed"):
            self.complain(f"{kind}: {message.why}")
        elif kind == "jump":
            log.warning(f"jump by {message.translation_m:.2f} m: {message.why}")
        elif kind == "note":
            log.info(message.text)
        elif kind in ("welcome", "ended"):
            log.info(f"{kind}: {message.robot_name if kind == 'welcome' else 'everything is stored'}")

    def publish(self, topic, kind, data):
        if topic == "/tf":
            self.transform = data
            self.publish_transform(data)
            return
        if topic not in self.outputs:
            self._advertise(topic, kind, LATCHED)
        self.outputs[topic].publish(data)

    def publish_transform(self, data):
        """Once for each stamp: what a robot is sent again was published while it was away, and tf2 warns of repetitions."""
        at_ns = stamp_ns(data, 8)
        if self.publish_tf and at_ns > self.transform_ns:
            self.transform_ns = at_ns
            self.outputs["/tf"].publish(data)

    def ask_for_path(self):
        if self.outputs["corrected_path"].get_subscription_count():
            self.take(self.link.add_once, "corrected_path", PATH)

    def publish_diagnostics(self):
        if self.connection is None:
            level, text, values = diagnosis_of_inactive()
        else:
            with self.connection.lock:
                level, text, values = diagnosis(self.link, self.correction, self.situation, list(self.trouble),
                                                self.connection.is_alive())
        self.trouble.clear()
        self.diagnostics_publisher.publish(diagnostics(self, "live feed", level, text, values))


def main():
    run(TuttiNode)
