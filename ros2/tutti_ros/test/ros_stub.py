# SPDX-License-Identifier: BSD-3-Clause
"""As much of ROS 2 as the node touches: message types with checked fields, CDR both ways, and an rclpy that keeps what is
published. No ROS is on the machines that Tutti is tested on."""
import array
import struct
import sys
import types

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "std_msgs/ColorRGBA": "float32 r, float32 g, float32 b, float32 a",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position, geometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header, geometry_msgs/Pose pose",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose, float64[36] covariance",
    "geometry_msgs/PoseWithCovarianceStamped": "std_msgs/Header header, geometry_msgs/PoseWithCovariance pose",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear, geometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist, float64[36] covariance",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header, string child_frame_id, geometry_msgs/Transform transform",
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "nav_msgs/Odometry": "std_msgs/Header header, string child_frame_id, geometry_msgs/PoseWithCovariance pose, "
                         "geometry_msgs/TwistWithCovariance twist",
    "nav_msgs/MapMetaData": "builtin_interfaces/Time map_load_time, float32 resolution, uint32 width, uint32 height, "
                            "geometry_msgs/Pose origin",
    "nav_msgs/OccupancyGrid": "std_msgs/Header header, nav_msgs/MapMetaData info, int8[] data",
    "nav_msgs/Path": "std_msgs/Header header, geometry_msgs/PoseStamped[] poses",
    "sensor_msgs/BatteryState": "std_msgs/Header header, float32 voltage, float32 temperature, float32 current, float32 charge, "
                                "float32 capacity, float32 design_capacity, float32 percentage, uint8 power_supply_status, "
                                "uint8 power_supply_health, uint8 power_supply_technology, bool present, "
                                "float32[] cell_voltage, float32[] cell_temperature, string location, string serial_number",
    "sensor_msgs/PointField": "string name, uint32 offset, uint8 datatype, uint32 count",
    "sensor_msgs/PointCloud2": "std_msgs/Header header, uint32 height, uint32 width, sensor_msgs/PointField[] fields, "
                               "bool is_bigendian, uint32 point_step, uint32 row_step, uint8[] data, bool is_dense",
    "sensor_msgs/RegionOfInterest": "uint32 x_offset, uint32 y_offset, uint32 height, uint32 width, bool do_rectify",
    "sensor_msgs/CameraInfo": "std_msgs/Header header, uint32 height, uint32 width, string distortion_model, float64[] d, "
                              "float64[9] k, float64[9] r, float64[12] p, uint32 binning_x, uint32 binning_y, "
                              "sensor_msgs/RegionOfInterest roi",
    "sensor_msgs/Image": "std_msgs/Header header, uint32 height, uint32 width, string encoding, uint8 is_bigendian, "
                         "uint32 step, uint8[] data",
    "sensor_msgs/CompressedImage": "std_msgs/Header header, string format, uint8[] data",
    "sensor_msgs/Imu": "std_msgs/Header header, geometry_msgs/Quaternion orientation, float64[9] orientation_covariance, "
                       "geometry_msgs/Vector3 angular_velocity, float64[9] angular_velocity_covariance, "
                       "geometry_msgs/Vector3 linear_acceleration, float64[9] linear_acceleration_covariance",
    "sensor_msgs/NavSatStatus": "int8 status, uint16 service",
    "sensor_msgs/NavSatFix": "std_msgs/Header header, sensor_msgs/NavSatStatus status, float64 latitude, float64 longitude, "
                             "float64 altitude, float64[9] position_covariance, uint8 position_covariance_type",
    "diagnostic_msgs/KeyValue": "string key, string value",
    "diagnostic_msgs/DiagnosticStatus": "byte level, string name, string message, string hardware_id, "
                                        "diagnostic_msgs/KeyValue[] values",
    "diagnostic_msgs/DiagnosticArray": "std_msgs/Header header, diagnostic_msgs/DiagnosticStatus[] status",
    "visualization_msgs/Marker": "std_msgs/Header header, string ns, int32 id, int32 type, int32 action, "
                                 "geometry_msgs/Pose pose, geometry_msgs/Vector3 scale, std_msgs/ColorRGBA color, "
                                 "builtin_interfaces/Time lifetime, bool frame_locked, geometry_msgs/Point[] points, "
                                 "std_msgs/ColorRGBA[] colors, string texture_resource, sensor_msgs/CompressedImage texture, "
                                 "geometry_msgs/Point[] uv_coordinates, string text, string mesh_resource, string mesh_filename, "
                                 "uint8[] mesh_data, bool mesh_use_embedded_materials",
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers",
}
NUMBERS = {"int8": "b", "uint16": "H", "int32": "i", "uint32": "I", "uint8": "B", "float32": "f", "float64": "d", "bool": "?"}
CONSTANTS = {"visualization_msgs/Marker": {"SPHERE": 2, "TEXT_VIEW_FACING": 9, "ADD": 0, "DELETEALL": 3}}
TYPES = {}


def default(kind):
    if kind.endswith("]"):
        base, _, length = kind[:-1].partition("[")
        return [0.0] * int(length) if length else (array.array(NUMBERS[base]) if base in ("uint8", "int8") else [])
    if kind in TYPES:
        return TYPES[kind]()
    return {"string": "", "byte": b"\0", "bool": False}.get(kind, 0.0 if kind.startswith("float") else 0)


def check(kind, value, what):
    """As rosidl's Python does: an int is no float."""
    expected = {"string": str, "byte": bytes, "bool": bool}.get(kind) or TYPES.get(kind)
    if kind.endswith("]"):
        expected = (list, array.array, bytes)
        length = kind[:-1].partition("[")[2]
        assert not length or len(value) == int(length) and all(isinstance(x, float) for x in value), what
    elif expected is None:
        expected = float if kind.startswith("float") else int
        assert expected is float or value >= 0 or kind in ("int8", "int32"), what
    assert isinstance(value, expected) and (expected is not int or not isinstance(value, bool)), (what, kind, value)


def make_type(name, definition):
    fields = [tuple(words.split()) for words in definition.split(", ")]

    def init(self):
        for kind, field in fields:
            object.__setattr__(self, field, default(kind))

    def set_checked(self, field, value):
        check(kinds[field], value, f"{name}.{field}")
        object.__setattr__(self, field, value)

    kinds = {field: kind for kind, field in fields}
    return type(name.split("/")[1], (), {"__init__": init, "__setattr__": set_checked, "fields_": fields, "name_": name,
                                         **CONSTANTS.get(name, {})})


for type_name, text in DEFINITIONS.items():
    TYPES[type_name] = make_type(type_name, text)


class Reader:
    """In XCDR1 alignment counts from the end of the encapsulation header."""

    def __init__(self, cdr):
        self.order, self.data, self.at = "<" if cdr[1] & 1 else ">", memoryview(cdr)[4:], 0

    def number(self, code):
        size = struct.calcsize("=" + code)
        self.at += -self.at % size
        value, = struct.unpack_from(self.order + code, self.data, self.at)
        self.at += size
        return value

    def read(self, kind):
        if kind in NUMBERS:
            return self.number(NUMBERS[kind])
        if kind.endswith("]"):
            base, _, length = kind[:-1].partition("[")
            count = int(length) if length else self.number("I")
            if base in ("uint8", "int8"):
                self.at += count
                return array.array(NUMBERS[base], bytes(self.data[self.at - count:self.at]))
            return [self.read(base) for _ in range(count)]
        if kind == "string":
            count = self.number("I")
            self.at += count
            return bytes(self.data[self.at - count:self.at - 1]).decode()
        out = TYPES[kind]()
        for field_kind, field in out.fields_:
            setattr(out, field, self.read(field_kind))
        return out


class Writer:
    def __init__(self):
        self.out = bytearray()

    def number(self, code, value):
        self.out += bytes(-len(self.out) % struct.calcsize("=" + code)) + struct.pack("<" + code, value)

    def write(self, kind, value):
        if kind in NUMBERS:
            self.number(NUMBERS[kind], value)
        elif kind.endswith("]"):
            base, _, length = kind[:-1].partition("[")
            if not length:
                self.number("I", len(value))
            if base in ("uint8", "int8"):
                self.out += array.array(NUMBERS[base], value).tobytes()
            else:
                for x in value:
                    self.write(base, x)
        elif kind == "string":
            self.number("I", len(value.encode()) + 1)
            self.out += value.encode() + b"\0"
        else:
            for field_kind, field in value.fields_:
                self.write(field_kind, getattr(value, field))


def decode(kind, cdr):
    return Reader(cdr).read(kind)


def encode(kind, message):
    writer = Writer()
    writer.write(kind, message)
    return b"\0\1\0\0" + bytes(writer.out)


class Publisher:
    """As rclpy's it takes messages, or their bytes."""

    def __init__(self, kind):
        self.kind, self.said = kind, []

    def publish(self, message):
        self.said.append(decode(self.kind.name_, message) if isinstance(message, bytes) else message)

    def get_subscription_count(self):
        return 1


class Logger:
    def warning(self, text, **_):
        pass

    info = warning


class Clock:
    def now(self):
        return self

    def to_msg(self):
        return TYPES["builtin_interfaces/Time"]()


class Subscription(tuple):
    """(topic, type)"""
    topic_name = property(lambda self: self[0] if self[0].startswith("/") else "/r1/" + self[0])


class Node:
    given = {}  # parameters

    def __init__(self, name):
        self.name, self.made, self.callbacks, self.qos, self.raw = name, {}, {}, {}, {}
        self.published = {}  # {topic: types}
        self.live, self.destroyed = [], []  # (what, name, the thing) of what was made and is there, and what is no more

    def declare_parameter(self, name, value, descriptor=None):
        """As rclpy's: another type than the default's is refused, but where it may change."""
        given = self.given.get(name, value)
        assert descriptor or type(given) is type(value), f"InvalidParameterTypeException: {name}"
        return types.SimpleNamespace(value=given)

    def create_publisher(self, kind, topic, qos):
        self.made[topic], self.qos[topic] = Publisher(kind), qos
        return self._live(self.made[topic], "publisher", topic)

    def create_subscription(self, kind, topic, callback, qos, raw=False):
        self.callbacks[topic], self.qos[topic], self.raw[topic] = callback, qos, raw
        return self._live(Subscription((topic, kind)), "subscription", topic)

    def _live(self, one, what, name):
        self.live.append((what, name, one))
        return one

    def alive(self):
        return sorted((what, name) for what, name, _ in self.live)

    def destroy_subscription(self, one):
        place, = [i for i, (_, _, made) in enumerate(self.live) if made is one]  # once
        self.destroyed.append(self.live.pop(place)[2])

    destroy_publisher = destroy_service = destroy_timer = destroy_subscription

    def get_publishers_info_by_topic(self, topic):
        return [types.SimpleNamespace(topic_type=kind) for kind in self.published.get(topic, [])]

    def create_service(self, kind, name, callback):
        self.callbacks[name] = callback
        return self._live(object(), "service", name)

    def create_timer(self, period_s, callback):
        assert isinstance(period_s, float)
        self.callbacks[callback.__name__] = callback
        return self._live(object(), "timer", callback.__name__)

    def get_logger(self):
        return Logger()

    def get_clock(self):
        return Clock()

    def get_fully_qualified_name(self):
        return "/r1/" + self.name

    def destroy_node(self):
        pass


class LifecycleNode(Node):
    """As rclpy's: a transition from another state is an error, and so is what a callback throws, of which nothing is said."""

    TRANSITIONS = {"configure": ("unconfigured", "inactive"), "activate": ("inactive", "active"),
                   "deactivate": ("active", "inactive"), "cleanup": ("inactive", "unconfigured"), "shutdown": (None, "finalized")}
    SUCCESS, FAILURE, ERROR = "success", "failure", "error"

    def __init__(self, name):
        super().__init__(name)
        self.state = "unconfigured"

    def trigger(self, transition):
        begin, end = self.TRANSITIONS[transition]
        if begin not in (None, self.state):
            raise RuntimeError(f"RCLError: Transition is not registered: {transition} from {self.state}")

        def called(callback):
            try:
                return callback(self.state)
            except Exception:
                return self.ERROR
        said = called(getattr(self, "on_" + transition))
        if said == self.SUCCESS:
            self.state = end
        elif said == self.ERROR:
            self.state = "unconfigured" if called(self.on_error) == self.SUCCESS else "finalized"
        return said

    def on_configure(self, state):
        return self.SUCCESS

    on_activate = on_deactivate = on_cleanup = on_shutdown = on_error = on_configure

    def trigger_configure(self):
        return self.trigger("configure")

    def trigger_activate(self):
        return self.trigger("activate")


def install():
    """Puts the modules that the node imports where it finds them."""
    def module(name, **has):
        sys.modules[name] = types.ModuleType(name)
        sys.modules[name].__dict__.update(has)
        return sys.modules[name]

    executors = module("rclpy.executors", ExternalShutdownException=type("ExternalShutdownException", (Exception,), {}))
    module("rclpy.node", Node=Node)
    module("rclpy.lifecycle", LifecycleNode=LifecycleNode, TransitionCallbackReturn=LifecycleNode)
    module("rclpy.qos", DurabilityPolicy=types.SimpleNamespace(TRANSIENT_LOCAL="transient local"),
           ReliabilityPolicy=types.SimpleNamespace(RELIABLE="reliable", BEST_EFFORT="best effort"),
           QoSProfile=lambda **what: what, qos_profile_sensor_data="sensor data")
    module("rcl_interfaces.msg", ParameterDescriptor=lambda **what: what)
    module("rclpy", init=lambda: None, try_shutdown=lambda: None, ok=lambda: True, executors=executors)
    module("rclpy.serialization", serialize_message=lambda message: encode(message.name_, message))
    module("std_srvs.srv", Trigger=object, Empty=object)
    module("nav2_msgs.srv", SetInitialPose=object)
    module("livox_ros_driver2.msg", CustomMsg=type("CustomMsg", (), {}))  # whose messages are taken as bytes
    for name, made in TYPES.items():
        package, word = name.split("/")
        found = sys.modules.get(package + ".msg") or module(package + ".msg")
        setattr(found, word, made)
