# SPDX-License-Identifier: BSD-3-Clause
"""What is known of the robot on its map, of what it said: T_map_odom, its way, team-mates, and how it is."""
import math

from tutti_ros.link import pose_from
from tutti_ros.poses import IDENTITY, angle, times

OK, WARN, ERROR = 0, 1, 2  # diagnostic_msgs/DiagnosticStatus
TAIL_STEP_M, TAIL_STEP_RAD = 0.1, 0.1
LONGEST_TAIL = 20_000


class OnMap:
    """Lists are replaced, never changed: path() may be called while another thread adds."""

    def __init__(self):
        self.T_map_odom = None       # none before a robot was there
        self.way = []                # [(stamp_ns, T_map_body)] as the map corrects it
        self.tail = []               # [(stamp_ns, T_odom_body)] behind the way
        self.correction, self.situation = None, None

    def take(self, kind, message):
        if kind == "welcome" and message.HasField("T_map_odom"):
            self.T_map_odom = pose_from(message.T_map_odom)
        elif kind == "correction":
            self.correction, self.T_map_odom = message, pose_from(message.T_map_odom)
        elif kind == "situation":
            self.situation = message
        elif kind == "way":
            numbers = message.T_map_body
            self.way = [(stamp_ns, tuple(numbers[7 * i:7 * i + 7])) for i, stamp_ns in enumerate(message.stamp_ns)]
            newest_ns = self.way[-1][0] if self.way else 0
            self.tail = [sample for sample in self.tail if sample[0] > newest_ns]

    def add_odometry(self, stamp_ns, T_odom_body):
        if self.tail and math.dist(self.tail[-1][1][:3], T_odom_body[:3]) < TAIL_STEP_M \
                and angle(self.tail[-1][1], T_odom_body) < TAIL_STEP_RAD:
            return
        self.tail = self.tail[-LONGEST_TAIL + 1:] + [(stamp_ns, T_odom_body)]

    def path(self):
        """[(stamp_ns, T_map_body)]: the way, and odometry since, corrected as the robot is now."""
        T_map_odom = self.T_map_odom or IDENTITY
        way, tail = self.way, self.tail
        return way + [(stamp_ns, times(T_map_odom, pose)) for stamp_ns, pose in tail]

    def team_mates(self):
        """[(name, stamp_ns in its own time, T_map_body)] of those whose place is known."""
        if not self.situation:
            return []
        return [(mate.name, mate.stamp_ns, pose_from(mate.T_map_body)) for mate in self.situation.team_mate
                if mate.same_component]


def diagnosis(link, on_map, trouble, is_alive=True):
    """(level, message, {key: value}) for /diagnostics. `trouble`: what kept messages from becoming samples, newest last."""
    values = {"connection": link.state, "reason": link.why, "waiting": len(link.waiting), "kept": len(link.kept),
              **{key: link.counts[key] for key in ("odometry", "scans", "fixes", "images", "imu", "corrections", "refused",
                                                   "jumps", "odometry_left_out", "forgotten_while_away")}}
    if link.welcome:
        values["robot"] = f"{link.welcome.robot_name} ({link.welcome.robot}), session {link.welcome.session}"
    if on_map.correction:
        values["map"] = f"epoch {on_map.correction.map_epoch}, revision {on_map.correction.map_revision}"
        values["in_map"] = on_map.correction.in_map
        values["dropped_corrections"] = on_map.correction.dropped
    if on_map.situation:  # what the robot reports of itself; what is counted here stands above it
        values = {**{value.name: value.text for value in on_map.situation.status}, **values}
    mates = on_map.situation.team_mate if on_map.situation else []
    values["team_mates"] = ", ".join(mate.name + ("" if mate.same_component else " (not joined yet)") for mate in mates)
    alerts = [alert.text for alert in on_map.situation.alert] if on_map.situation else []
    values.update({f"alert {i}": text for i, text in enumerate(alerts)})
    values.update({f"trouble {i}": text for i, text in enumerate(trouble)})
    level, text = OK, "fed, and on the map" if on_map.correction and on_map.correction.in_map else "fed, not in a map yet"
    if not is_alive:
        level, text = ERROR, "the thread of the feed has ended: see the node's output"
    elif link.state != "feeding":
        level, text = ERROR, f"no robot program: {link.why}"
    elif not link.counts["odometry"]:
        level, text = WARN, "no odometry was said yet"
    elif alerts or trouble:
        level, text = WARN, (alerts or trouble)[-1]
    return level, text, {key: str(value) for key, value in values.items()}
