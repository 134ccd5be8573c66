# SPDX-License-Identifier: BSD-3-Clause
"""Two robots and a mapping server in one program, with a transport of its own: bytes in lists; examples/library/embed.cpp in
Python. Each robot walks twice round a circle with odometry that turns too much; the server finds the closures and joins
both maps, and what it sends back straightens the robots' own trajectories."""
import numpy as np
import tutti

RADIUS_M, STEP_M, STEP_S, STEPS = 10.0, 0.1, 0.1, 1256


def turned(angle, x=0.0, y=0.0):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, 0], [0, 0, 0, 1.0]])


def truth(robot, seconds):
    """T_world_body: they walk on circles half a metre apart."""
    radius, angle = RADIUS_M + 0.5 * robot, seconds / STEP_S * STEP_M / RADIUS_M
    return turned(angle + np.pi / 2, radius * np.cos(angle), radius * np.sin(angle))


class Verifier:
    """Yours compares what the submaps carry (submap.points); this one knows the truth."""

    @staticmethod
    def middle(submap):
        k = len(submap.keyframes) // 2
        return submap.first_index + k, truth(submap.robot, submap.keyframes.stamps[k])

    def is_candidate(self, first, second):
        if first.robot == second.robot and second.index < first.index + 3:
            return False
        T = np.linalg.inv(self.middle(first)[1]) @ self.middle(second)[1]
        return np.linalg.norm(T[:3, 3]) < 3.0

    def verify(self, first, second):
        (a, T_world_a), (b, T_world_b) = self.middle(first), self.middle(second)
        return [tutti.Closure(a, b, np.linalg.inv(T_world_a) @ T_world_b, 1e-4 * np.eye(6))]


robots = [tutti.RobotAgent(r) for r in range(2)]
server = tutti.MapServer([0, 1], Verifier())
odometry = [[np.eye(4)], [np.eye(4)]]
covariance = np.diag([1e-6] * 3 + [1e-5] * 3)  # of a step, m2 and rad2
for step in range(STEPS + 1):
    now = step * STEP_S
    for r, robot in enumerate(robots):
        if step > 0:
            motion = np.linalg.inv(truth(r, now - STEP_S)) @ truth(r, now) @ turned(0.0005)
            odometry[r].append(odometry[r][-1] @ motion)
        robot.add_odometry(now, odometry[r][-1], covariance)
        if step == STEPS:
            robot.finish()
        for message in robot.take_outgoing():  # your transport
            server.receive(message)
    for job in server.take_jobs():  # or in a thread
        server.receive(server.verify(job))
    if server.has_news() and (step % 100 == 0 or step == STEPS):
        graph = server.optimise()
        for robot in robots:
            robot.receive(graph)

print(f"the map: {len(server.graph())} nodes, {server.closures} closures")
stamps = STEP_S * np.arange(STEPS + 1)
for r, robot in enumerate(robots):
    reference = tutti.Trajectory.from_matrices(stamps, [truth(r, t) for t in stamps])
    before = tutti.ate(tutti.Trajectory.from_matrices(stamps, odometry[r]), reference)
    after = tutti.ate(robot.corrected, reference)
    print(f"robot {r}: RMSE {before.rmse_m:.2f} m by odometry, {after.rmse_m:.2f} m corrected")
    assert after.rmse_m < 0.5 * before.rmse_m
