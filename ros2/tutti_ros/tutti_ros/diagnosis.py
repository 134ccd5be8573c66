# SPDX-License-Identifier: BSD-3-Clause
"""The robot's report on /diagnostics."""
OK, WARN, ERROR = 0, 1, 2  # diagnostic_msgs/DiagnosticStatus
COUNTED = ("odometry", "odometry_missed", "scans", "scans_missed", "fixes", "images", "imu", "corrections", "refused", "jumps", "forgotten_while_away")


def diagnosis_of_inactive():
    return WARN, "inactive: nothing is heard or published until it is activated", {"connection": "inactive"}


def diagnosis(link, correction, situation, trouble, is_alive=True):
    """(level, message, {key: value}). `correction`, `situation`: the robot's last, or None. `trouble`: what was not taken, newest
    last."""
    values = {"connection": link.state, "reason": link.why, "waiting": len(link.waiting), "kept": len(link.kept),
              **{key: link.counts[key] for key in COUNTED}}
    if link.welcome:
        values["robot"] = f"{link.welcome.robot_name} ({link.welcome.robot}), session {link.welcome.session}"
    if correction:
        values["map"] = f"epoch {correction.map_epoch}, revision {correction.map_revision}"
        values["in_map"] = correction.in_map
        values["dropped_corrections"] = correction.dropped
    if situation:  # what the robot reports of itself; what is counted here stands above it
        values = {**{value.name: value.text for value in situation.status}, **values}
    mates = situation.team_mate if situation else []
    values["team_mates"] = ", ".join(mate.name + ("" if mate.same_component else " (not merged yet)") for mate in mates)
    alerts = [alert.text for alert in situation.alert] if situation else []
    values.update({f"alert {i}": text for i, text in enumerate(alerts)})
    values.update({f"trouble {i}": text for i, text in enumerate(trouble)})
    level, text = OK, "fed, and on the map" if correction and correction.in_map else "fed, not in a map yet"
    if not is_alive:
        level, text = ERROR, "the thread of the feed has ended: see the node's output"
    elif link.state != "feeding":
        level, text = ERROR, f"no robot program: {link.why}"
    elif not link.counts["odometry"]:
        level, text = WARN, "no odometry was said yet"
    elif alerts or trouble:
        level, text = WARN, (alerts or trouble)[-1]
    return level, text, {key: str(value) for key, value in values.items()}
