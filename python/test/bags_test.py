# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import tutti
from support import InFolder, program, run, walk

POINTS = np.random.default_rng(1).normal(size=(50, 3)).astype(np.float32)


class Bags(InFolder):
    def write(self, name, trajectory):
        with tutti.BagWriter(self.path / name) as bag:
            bag.write_transform(trajectory.stamps[0], np.eye(4), "base_link", "lidar", is_static=True)
            for stamp, T in zip(trajectory.stamps, trajectory.matrices):
                bag.write_odometry("/odom", stamp, T)
                bag.write_transform(stamp, T, "odom", "base_link")
                bag.write_points("/points", stamp, POINTS, "lidar")
        return self.path / name

    def test_what_is_written_reads_back(self):
        trajectory = walk(20)
        for name in ("bag", "bag.mcap"):
            path = self.write(name, trajectory)
            again = tutti.read_bag_trajectory(path, "/odom")
            np.testing.assert_allclose(again.matrices, trajectory.matrices, atol=1e-12)
            np.testing.assert_allclose(again.stamps, trajectory.stamps, atol=1e-6)
            clouds = [message.decode() for message in tutti.read_bag(path, ["/points"])]
            self.assertEqual(len(clouds), 20)
            np.testing.assert_array_equal(clouds[3]["points"], POINTS)
            self.assertEqual((clouds[3]["frame_id"], clouds[3]["fields"]), ("lidar", ["x", "y", "z"]))
            one = next(iter(tutti.read_bag(path, ["/tf_static"]))).decode()["transforms"][0]
            self.assertEqual((one["frame_id"], one["child_frame_id"]), ("base_link", "lidar"))
            np.testing.assert_allclose(one["T"], np.eye(4))
            info = tutti.bag_info(path)
            self.assertEqual((info.messages, [t.count for t in info.topics if t.topic == "/odom"]), (61, [20]))
            self.assertIn("/odom", program("bag", "info", path))

    def test_bytes_travel_as_they_are(self):
        path = self.write("bag", walk(3))
        with tutti.BagWriter(self.path / "copy.mcap") as copy:
            for message in tutti.read_bag(path):
                copy.write(message.topic, message.type, message.log_time, message.data)
        self.assertEqual([m.data for m in tutti.read_bag(path)], [m.data for m in tutti.read_bag(self.path / "copy.mcap")])

    def test_wrong_input_is_refused(self):
        path = self.write("bag", walk(3))
        self.refuses("", tutti.BagWriter, path, error=OSError)  # it is there already
        self.refuses("nowhere", tutti.bag_info, self.path / "nowhere", error=OSError)
        self.refuses("'/none'", tutti.read_bag_trajectory, path, "/none")
        self.refuses("/points|Odometry", tutti.read_bag_trajectory, path, "/points")
        bag = tutti.BagWriter(self.path / "x.mcap")
        self.refuses("my/msg/Type", bag.write, "/x", "my/msg/Type", 1.0, b"")
        self.refuses("'Type'", bag.write, "/x", "Type", 1.0, b"")
        bag.write_points("/x", 1.0, POINTS)
        self.refuses("/x", bag.write_odometry, "/x", 1.0, np.eye(4))
        self.refuses("stamp", bag.write_odometry, "/y", -1.0, np.eye(4))
        self.refuses("T_odom_body", bag.write_odometry, "/y", 1.0, np.zeros((4, 4)))
        bag.write("/broken", "nav_msgs/msg/Odometry", 1.0, b"\x00\x01\x00\x00abc")
        bag.close()
        bag.close()
        self.refuses("closed", bag.write_points, "/x", 1.0, POINTS)
        self.refuses("", next(iter(tutti.read_bag(self.path / "x.mcap", ["/broken"]))).decode)
        whole = (self.path / "x.mcap").read_bytes()
        for cut in range(0, len(whole), 97):  # cut off anywhere it is read up to there, or refused
            (self.path / "cut.mcap").write_bytes(whole[:cut])
            try:
                list(tutti.read_bag(self.path / "cut.mcap"))
            except (ValueError, OSError):
                pass


if __name__ == "__main__":
    run()
