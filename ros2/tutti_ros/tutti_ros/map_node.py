# SPDX-License-Identifier: BSD-3-Clause
"""The node beside a server: publishes the joint map as nav_msgs/OccupancyGrid (docs/ros.md)."""
import array
import time

from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node

from tutti_ros.ros_node import LATCHED, diagnostics, parameter, run
from tutti_ros.server_map import ServerMap

PARAMETERS = {
    "map": "",          # file of the server's map: map.tutti in its --state folder
    "map_frame": "world",  # _N behind it where the map that is shown is of component N
    "period_s": 5.0,    # between two maps, at least
    "program": "tutti",
}
LOOK_S = 0.25


class MapNode(Node):
    def __init__(self):
        super().__init__("tutti_map")
        given = {name: parameter(self, name, default) for name, default in PARAMETERS.items()}
        if not given["map"]:
            raise ValueError("parameter 'map' is empty, expected STATE/map.tutti of tutti server --state STATE")
        self.frame = given["map_frame"]
        self.source = ServerMap(given["map"], given["period_s"], given["program"])
        self.publisher = self.create_publisher(OccupancyGrid, "map", LATCHED)
        self.diagnostics_publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(LOOK_S, self.look)
        self.create_timer(1.0, self.publish_diagnostics)

    def destroy_node(self):
        self.source.close()
        return super().destroy_node()

    def look(self):
        grid = self.source.look(time.monotonic())
        if grid is None:
            return
        out = OccupancyGrid()
        out.header.stamp = out.info.map_load_time = self.get_clock().now().to_msg()
        out.header.frame_id = self.frame + (f"_{grid.component}" if grid.component else "")
        out.info.resolution = grid.resolution_m
        out.info.height, out.info.width = grid.cells.shape
        at, turn = grid.origin_in_world()
        out.info.origin.position.x, out.info.origin.position.y, out.info.origin.position.z = at
        place = out.info.origin.orientation
        place.x, place.y, place.z, place.w = turn
        out.data = array.array("b", grid.cells.tobytes())
        self.publisher.publish(out)

    def publish_diagnostics(self):
        self.diagnostics_publisher.publish(diagnostics(self, "server's map", *self.source.diagnosis(time.monotonic())))


def main():
    run(MapNode)
