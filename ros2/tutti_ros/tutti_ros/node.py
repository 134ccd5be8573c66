# SPDX-License-Identifier: BSD-3-Clause
"""The node: subscribes odometry, scans, images, IMU samples and position fixes, feeds the robot program, publishes what it
answers (docs/ros.md)."""
import collections
import dataclasses

import rclpy
import rclpy.time
import tf2_ros
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, NavSatFix
from std_srvs.srv import Trigger
from visualization_msgs.msg import Marker, MarkerArray

from tutti_ros import poses
from tutti_ros.camera_topics import CameraTopics
from tutti_ros.connection import Connection
from tutti_ros.from_ros import OdometryNoise, cloud_of_livox, fix_of, odometry_of, pose_of, scan_of
from tutti_ros.link import Link, pose_from
from tutti_ros.ros_node import LATCHED, diagnostics, run
from tutti_ros.scan_topic import ScanTopic
from tutti_ros.situation import OnMap, diagnosis
from tutti_ros.to_ros import set_header, set_pose, set_transform, topic_part

PARAMETERS = {
    "socket": "",              # of tutti robot --feed
    "map_frame": "",           # empty: odom_frame with 'odom' at its end made 'map', else 'map'
    "odom_frame": "",          # empty: as odometry's header says
    "base_frame": "",          # empty: as odometry's child_frame_id says
    "T_body_lidar": "",        # "x y z qx qy qz qw"; empty: of tf2
    "antenna_m": "",           # "x y z" of the receiver's antenna in the body frame; empty: of tf2
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
}


class TuttiNode(Node):
    def __init__(self):
        super().__init__("tutti_ros")
        for name, default in PARAMETERS.items():
            setattr(self, name, self.declare_parameter(name, default).value)
        noise = OdometryNoise(**{f.name: float(self.declare_parameter("noise." + f.name, f.default).value)
                                 for f in dataclasses.fields(OdometryNoise)})
        if not self.socket:
            raise ValueError("parameter 'socket' is empty, expected the SOCKET of tutti robot --feed SOCKET")
        self.frames = None  # map, odom, base
        self.stated_lidar = self._numbers("T_body_lidar", "x y z qx qy qz qw")
        self.stated_antenna = self._numbers("antenna_m", "x y z")
        self.sensor_poses = {}
        self.camera_topics = CameraTopics(self)
        self.on_map, self.trouble = OnMap(), collections.deque(maxlen=5)
        self.mate_publishers, self.newest_tf_ns = {}, -1
        self.link = Link(noise, has_scans=self.use_scans)
        self.connection = Connection(self.socket, self.link, self.hear)
        self.tf_broadcaster = tf2_ros.TransformBroadcaster(self)
        self.tf_buffer = tf2_ros.Buffer()
        self.tf_listener = tf2_ros.TransformListener(self.tf_buffer, self)
        self.pose_publisher = self.create_publisher(PoseWithCovarianceStamped, "corrected_pose", 10)
        self.path_publisher = self.create_publisher(Path, "corrected_path", LATCHED)
        self.marker_publisher = self.create_publisher(MarkerArray, "team_mates", LATCHED)
        self.diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_subscription(Odometry, "odom", self.take_odometry, qos_profile_sensor_data)
        if self.use_scans:
            self.scan_topic = ScanTopic(self, self.take_points, self.take_livox)
            self.create_timer(1.0, self.look_for_scans)
        if self.use_fixes:
            self.create_subscription(NavSatFix, "fix", self.take_fix, qos_profile_sensor_data)
        self.create_subscription(BatteryState, "battery_state", self.take_battery, qos_profile_sensor_data)
        self.create_service(Trigger, "~/end_recording", self.end_recording)
        self.create_timer(self.path_period_s, self.publish_path)
        self.create_timer(1.0, self.publish_diagnostics)
        self.connection.start()

    def destroy_node(self):
        self.connection.stop()
        return super().destroy_node()

    def _numbers(self, parameter, expected):
        text = getattr(self, parameter)
        numbers = tuple(float(word) for word in text.split())
        if numbers and len(numbers) != len(expected.split()):
            raise ValueError(f"parameter '{parameter}' is '{text}', expected '{expected}'")
        return numbers

    def complain(self, what):
        if what not in self.trouble:
            self.trouble.append(what)
        self.get_logger().warning(what, throttle_duration_sec=5.0)

    # From ROS.
    def take_odometry(self, message):
        if self.frames is None:
            odom = self.odom_frame or message.header.frame_id
            of_odom = odom[:-len("odom")] + "map" if odom.endswith("odom") else "map"
            self.frames = (self.map_frame or of_odom, odom, self.base_frame or message.child_frame_id)
        try:
            stamp_ns, pose = odometry_of(message)
            with self.connection.lock:
                self.link.add_odometry(stamp_ns, pose)
                self.on_map.add_odometry(stamp_ns, pose)
                is_away = self.link.state != "feeding"
        except ValueError as error:
            self.complain(f"odometry: {error}")
            return
        self.connection.wake()
        self.camera_topics.take_odometry(stamp_ns)
        if is_away and self.on_map.T_map_odom:  # the last correction, so that nobody loses the map
            self.publish_transform(stamp_ns, self.on_map.T_map_odom)

    def take_points(self, message):
        if self.frames is None:
            return
        try:
            T_body_lidar = self.stated_lidar or self.sensor_pose(message.header.frame_id)
            stamp_ns, points, ages = scan_of(message, T_body_lidar, self.scans_deskewed)
            with self.connection.lock:
                self.link.add_scan(stamp_ns, points, ages)
        except ValueError as error:
            self.complain(f"points: {error}")
            return
        self.connection.wake()

    def take_livox(self, cdr):
        try:
            self.take_points(cloud_of_livox(cdr))
        except ValueError as error:
            self.complain(f"points: {error}")

    def look_for_scans(self):
        try:
            self.scan_topic.look()
        except ValueError as error:
            self.complain(f"points: {error}")

    def take_fix(self, message):
        if self.frames is None:
            return
        try:
            fix = fix_of(message)
            if fix is None:
                return
            antenna = self.antenna(message.header.frame_id)
            with self.connection.lock:
                self.link.add_fix(*fix, antenna)
        except ValueError as error:
            self.complain(f"fixes: {error}")
            return
        self.connection.wake()

    def take_battery(self, message):
        with self.connection.lock:
            self.link.set_health(message.voltage, message.percentage)
        self.connection.wake()

    def antenna(self, frame_id):
        """In the body frame. Its length is all that a fix is off by where nothing says where it is."""
        try:
            return self.stated_antenna or self.sensor_pose(frame_id)[:3]
        except ValueError as error:
            self.complain(f"fixes are taken as of an antenna at the body's origin: {error}")
            return (0.0, 0.0, 0.0)

    def sensor_pose(self, frame_id):
        """T_body_sensor, asked of tf2 once: sensors are bolted on. A ValueError where it is not known yet."""
        if self.frames is None:
            raise ValueError("no odometry has said yet which frame is the body")
        base = self.frames[2]
        if frame_id == base:
            return poses.IDENTITY
        if frame_id not in self.sensor_poses:
            try:
                said = self.tf_buffer.lookup_transform(base, frame_id, rclpy.time.Time()).transform
            except tf2_ros.TransformException as error:
                raise ValueError(error) from error
            self.sensor_poses[frame_id] = pose_of(said.translation, said.rotation)
        return self.sensor_poses[frame_id]

    def end_recording(self, request, response):
        self.camera_topics.say(is_last=True)
        with self.connection.lock:
            self.link.end_recording()
        self.connection.wake()
        response.success, response.message = True, "told the robot; it says when everything is stored"
        return response

    # From the robot, in the thread of the connection.
    def hear(self, kind, message):
        if not rclpy.ok():  # interrupted: nothing can be published any more
            return
        with self.connection.lock:
            self.on_map.take(kind, message)
        if kind == "correction":
            self.publish_transform(message.stamp_ns, pose_from(message.T_map_odom))
            self.publish_pose(message)
        elif kind == "situation":
            self.publish_team_mates()
        elif kind == "way":
            self.publish_path()
        elif kind == "jump":
            self.get_logger().warning(f"jump by {message.translation_m:.2f} m: {message.why}")
        elif kind in ("refused", "closed"):
            self.get_logger().warning(f"{kind}: {message.why}", throttle_duration_sec=5.0)
        elif kind in ("welcome", "ended"):
            self.get_logger().info(f"{kind}: {message.robot_name if kind == 'welcome' else 'everything is stored'}")

    def publish_transform(self, stamp_ns, T_map_odom):
        """Once for each stamp: what a robot is told again was published while it was away, and tf2 warns of repetitions."""
        if self.publish_tf and self.frames and stamp_ns > self.newest_tf_ns:
            self.newest_tf_ns = stamp_ns
            out = TransformStamped()
            ahead_ns = int(self.transform_tolerance_s * 1e9)
            set_transform(out, stamp_ns + ahead_ns, self.frames[0], self.frames[1], T_map_odom)
            self.tf_broadcaster.sendTransform(out)

    def publish_pose(self, correction):
        out, T_map_body = PoseWithCovarianceStamped(), pose_from(correction.T_map_body)
        set_header(out.header, correction.stamp_ns, self.frames[0])
        set_pose(out.pose.pose, T_map_body)
        R, t = poses.rotation(pose_from(correction.T_map_odom)), correction.T_map_odom
        T_odom_map = (*(-R.T @ (t.x, t.y, t.z)), -t.qx, -t.qy, -t.qz, t.qw)
        covariance = poses.body_covariance_in_map(correction.T_map_odom_covariance,
                                                  poses.times(T_odom_map, T_map_body), T_map_body)
        out.pose.covariance = [float(x) for x in covariance.ravel()]
        self.pose_publisher.publish(out)

    def publish_path(self):
        if not self.frames or not self.path_publisher.get_subscription_count():
            return
        path = self.on_map.path()
        if not path:
            return
        out = Path()
        set_header(out.header, path[-1][0], self.frames[0])
        for stamp_ns, pose in path:
            at = PoseStamped()
            set_header(at.header, stamp_ns, self.frames[0])
            set_pose(at.pose, pose)
            out.poses.append(at)
        self.path_publisher.publish(out)

    def publish_team_mates(self):
        if not self.frames:
            return
        with self.connection.lock:
            mates = self.on_map.team_mates()
        out = MarkerArray()
        clear = Marker()
        set_header(clear.header, 0, self.frames[0])
        clear.action = Marker.DELETEALL
        out.markers.append(clear)
        for i, (name, stamp_ns, pose) in enumerate(mates):
            out.markers += [self._marker(2 * i, Marker.SPHERE, pose, ""),
                            self._marker(2 * i + 1, Marker.TEXT_VIEW_FACING, (*pose[:2], pose[2] + 0.8, *pose[3:]), name)]
            topic = f"team_mates/{topic_part(name)}/pose"
            if topic not in self.mate_publishers:
                self.mate_publishers[topic] = self.create_publisher(PoseStamped, topic, LATCHED)
            at = PoseStamped()
            set_header(at.header, stamp_ns, self.frames[0])
            set_pose(at.pose, pose)
            self.mate_publishers[topic].publish(at)
        self.marker_publisher.publish(out)

    def _marker(self, number, kind, pose, text):
        out = Marker()
        set_header(out.header, 0, self.frames[0])  # stamp 0: the newest transform
        out.ns, out.id, out.type, out.action, out.text = "team_mates", number, kind, Marker.ADD, text
        set_pose(out.pose, pose)
        out.scale.x = out.scale.y = out.scale.z = 0.5
        out.color.r, out.color.g, out.color.b, out.color.a = 1.0, 0.6, 0.1, 1.0
        return out

    def publish_diagnostics(self):
        for what in self.camera_topics.look():
            self.complain(what)
        with self.connection.lock:
            level, text, values = diagnosis(self.link, self.on_map, list(self.trouble), self.connection.is_alive())
        self.trouble.clear()
        self.diagnostics_publisher.publish(diagnostics(self, "live feed", level, text, values))


def main():
    run(TuttiNode)
