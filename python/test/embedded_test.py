# SPDX-License-Identifier: BSD-3-Clause
import threading

import numpy as np
import tutti
from support import InFolder, run, shift

STEP = np.diag([1e-6] * 3 + [1e-5] * 3)


def submaps_of(robot=0, n=300, **settings):
    agent = tutti.RobotAgent(robot, settings={"submap.duration_s": 5, **settings})
    for i in range(n):
        agent.add_odometry(0.1 * i, shift(0.05 * i), STEP)
    agent.finish()
    return agent, agent.take_outgoing()


class Nothing:
    def is_candidate(self, first, second):
        return True

    def verify(self, first, second):
        return None


class Embedded(InFolder):
    def test_messages_make_a_map(self):
        agent, messages = submaps_of()
        server = tutti.MapServer([0], Nothing())
        for message in messages[::-1] + messages:  # in any order, any number of times
            server.receive(message)
        jobs = server.take_jobs()
        self.assertEqual(len(jobs), len(messages) * (len(messages) - 1) // 2)
        for job in jobs:
            server.receive(server.verify(job))
        self.assertTrue(server.has_news())
        update = agent.receive(server.optimise())
        self.assertGreater(update.synchronised, 10)
        self.assertEqual((update.constraints, update.disagrees, server.closures, server.components), (0, False, 0, 1))
        np.testing.assert_allclose(server.trajectories()[0].positions, agent.corrected.positions, atol=1e-3)
        np.testing.assert_allclose(agent.T_map_body, shift(0.05 * 299), atol=1e-9)
        self.assertEqual(agent.covariance.shape, (6, 6))
        self.assertEqual(agent.take_errors(), [])

    def test_scans_travel(self):
        agent = tutti.RobotAgent(3, settings={"submap.duration_s": 2})
        points = np.random.default_rng(1).uniform(-5, 5, (2000, 3))
        points[7] = np.nan
        for i in range(60):
            agent.add_odometry(0.1 * i, shift(0.05 * i), STEP)
            agent.add_scan(0.1 * i, points.astype(np.float32), None if i % 2 else np.full(2000, 0.01) if i else np.zeros(2000))
        agent.finish()
        seen = []

        class Looks(Nothing):
            def verify(self, first, second):
                seen.append((first.points, second.points, first.robot, len(first.keyframes)))

        server = tutti.MapServer([3], Looks())
        for message in agent.take_outgoing():
            server.receive(message)
        job = server.take_jobs()[0]
        server.verify(job)
        self.assertIsNone(job.first.points)
        self.assertEqual((seen[0][0].shape[1], seen[0][0].dtype, seen[0][2]), (3, np.float32, 3))

    def test_what_a_verifier_raises_is_raised(self):
        class Broken(Nothing):
            def verify(self, first, second):
                raise KeyError("mine")

        server = tutti.MapServer([0], Broken())
        for message in submaps_of()[1]:
            server.receive(message)
        job = server.take_jobs()[0]
        with self.assertRaises(KeyError):
            server.verify(job)
        server.give_back(job)
        self.assertEqual(len(server.take_jobs()), 1)

    def test_threads_may_share_them(self):
        agent, messages = submaps_of(n=600)
        server = tutti.MapServer([0], Nothing())
        failed = []

        def work(k):
            try:
                for message in messages[k:]:
                    server.receive(message)
                    for job in server.take_jobs():
                        server.receive(server.verify(job))
                    agent.receive(server.optimise())
            except Exception as error:  # reported below
                failed.append(error)

        threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
        self.assertEqual(failed, [])
        self.assertFalse(any(thread.is_alive() for thread in threads))

    def test_wrong_input_is_refused(self):
        agent, messages = submaps_of()
        server = tutti.MapServer([1])
        self.refuses("0", server.receive, messages[0])  # of an unknown robot
        for bad in (b"", b"TU", messages[0][:-3], b"\xff" * 100):
            self.refuses("", server.receive, bad)
            self.refuses("", agent.receive, bad)
        self.refuses("", server.receive, "text", error=TypeError)
        self.refuses("submap.nonsense", tutti.RobotAgent, 0, settings={"submap.nonsense": 1})
        self.refuses("duration_s|must be", tutti.RobotAgent, 0, settings={"submap.duration_s": -1})
        self.refuses("policy", tutti.RobotAgent, 0, settings={"policy.name": "luck"})
        self.refuses("is_candidate", tutti.MapServer, [0], verifier=3)
        self.refuses("'magic'", tutti.MapServer, [0], verifier="magic")
        self.refuses("", tutti.RobotAgent, -1, error=TypeError)
        self.refuses("stamp", agent.add_odometry, 1.0, np.eye(4), STEP)  # back in time
        self.refuses("stamp|nan", agent.add_odometry, np.nan, np.eye(4), STEP)
        self.refuses("T_odom_body|(3, 3)", agent.add_odometry, 99.0, np.eye(3), STEP)
        self.refuses("negative variance", agent.add_odometry, 99.0, np.eye(4), -STEP)
        self.refuses("age_s: are 2", agent.add_scan, 30.0, np.zeros((3, 3)), [0, 0])


if __name__ == "__main__":
    run()
