# SPDX-License-Identifier: BSD-3-Clause
"""Images, depth and IMU samples: what messages say, and what waits for odometry. Run by tutti_ros_test.py."""
import math
import random
import struct
import unittest

import numpy as np
from made_messages import camera_info, file_image, image, imu
from tutti_ros import from_ros, poses
from tutti_ros.cameras import MOST_BYTES, MOST_IMU, Cameras
from tutti_ros.link import Feed

MS = 10**6


class Conversion(unittest.TestCase):
    def test_every_model_of_a_camera(self):
        """As src/tutti/bags/camera_test.cpp has them."""
        for model, d, kind in (("plumb_bob", (-0.3, 0.1, 0.0, 0.0, 0.0), "PINHOLE"), ("plumb_bob", (0.0,) * 4, "PINHOLE"),
                               ("plumb_bob", (-0.3, 0.1, 0.0, 0.0, 0.01), "RATIONAL"), ("", (), "PINHOLE"),
                               ("rational_polynomial", (0.1, 0.01, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0), "RATIONAL"),
                               ("fisheye", (0.01, 0.0, 0.0, 0.0), "EQUIDISTANT"), ("double_sphere", (0.1, 0.6), "DOUBLE_SPHERE")):
            camera = from_ros.camera_of(camera_info(model, d))
            self.assertEqual((camera.kind, camera.distortion), (kind, d[:4] if kind == "PINHOLE" else d))
            self.assertEqual((camera.fx, camera.fy, camera.cx, camera.cy), (460.0, 458.0, 370.0, 250.0))
        self.assertEqual([Feed.Camera.Kind.Value(kind) for kind in from_ros.CAMERA_KINDS], [0, 1, 2, 3])

    def test_cameras_that_a_robot_would_not_take(self):
        for message, text in ((camera_info("thin_prism", (1.0, 2.0)), "'thin_prism' with 2 numbers"),
                              (camera_info(d=(math.nan,) * 4), "expected finite"), (camera_info(width=0), "0 x 3 pixels"),
                              (camera_info(width=2**32 - 1, height=2**32 - 1), "expected 1 to"),
                              (camera_info("double_sphere", (2.0, 0.5)), "expected -1 < xi < 1")):
            with self.assertRaisesRegex(ValueError, text):
                from_ros.camera_of(message)
        for field, index, value, text in (("k", 0, 0.0, "is the camera calibrated"), ("k", 2, math.inf, "expected finite"),
                                          ("binning_x", None, 2, "binning 2 x 0")):
            message = camera_info()
            if index is None:
                setattr(message, field, value)
            else:
                getattr(message, field)[index] = value
            with self.assertRaisesRegex(ValueError, text):
                from_ros.camera_of(message)

    def test_images_become_grey(self):
        """The same bytes as src/tutti/bags/camera_test.cpp."""
        colour = b"\xff\x00\x00\x00\xff\x00\x00\x00\xff\x07"  # red, green, blue, and padding
        for encoding, width, height, step, data, grey in (
                ("rgb8", 3, 1, 10, colour, [54, 182, 18]), ("bgr8", 3, 1, 10, colour, [18, 182, 54]),
                ("8UC3", 3, 1, 9, colour, [18, 182, 54]), ("rgba8", 1, 1, 4, b"\xff\0\0\7", [54]),
                ("bgra8", 1, 2, 5, b"\xff\0\0\7?\0\0\xff\7", [18, 54]), ("mono8", 2, 2, 3, b"abxcd", list(b"abcd")),
                ("bayer_rggb8", 2, 2, 2, b"\x10\x20\x30\x40", [40, 48, 56, 64])):
            got = from_ros.grey_of(image(encoding, width, height, step, data))
            self.assertEqual((got.dtype, got.shape, got.ravel().tolist()), (np.uint8, (height, width), grey), encoding)
        for message, text in ((image("mono8", 2, 2, 3, b"abxc"), "2 x 2 pixels of 1 bytes, rows of 3 bytes, 4 bytes"),
                              (image("mono8", 2, 2, 1, b"abcd"), "rows of 1 bytes"), (image("mono8", 0, 2, 3, b""), "0 x 2"),
                              (image("rgb8", *(2**32 - 1,) * 3, b"abcd"), "4 bytes in all"),
                              (image("16UC1", 1, 1, 2, b"ab"), "encoding '16UC1'")):
            with self.assertRaisesRegex(ValueError, text):
                from_ros.grey_of(message)

    def test_depth_in_both_units_and_byte_orders(self):
        metres = [0.0, 1.2345, 65.6, -1.0, math.nan, math.inf, 65.4, 1e30]
        for order, big in (("<", 0), (">", 1)):
            data = b"".join(struct.pack(order + "f", x) for x in metres[:4]) + b"pad" + struct.pack(f"{order}4f", *metres[4:])
            got = from_ros.depth_of(image("32FC1", 4, 2, 19, data, big=big))
            self.assertEqual((got.dtype.str, got.ravel().tolist()), ("<u2", [0, 1235, 0, 0, 0, 0, 65400, 0]))
            data = struct.pack(order + "3H", 0, 1234, 65535)
            got = from_ros.depth_of(image("16UC1", 3, 1, 6, data, big=big))
            self.assertEqual(got.tobytes(), struct.pack("<3H", 0, 1234, 65535))
        for message, text in ((image("mono8", 1, 1, 1, b"a"), "expected 16UC1"), (image("16UC1", 2, 1, 4, b"abc"), "3 bytes"),
                              (image("32FC1", 2, 1, 4, b"abcdefgh"), "rows of 4 bytes")):
            with self.assertRaisesRegex(ValueError, text):
                from_ros.depth_of(message)

    def test_garbage_is_an_error_and_nothing_else(self):
        draw = random.Random(1)
        for _ in range(300):
            encoding = draw.choice(["mono8", "rgb8", "bayer_gbrg8", "16UC1", "32FC1", "", "bgra8"])
            numbers = [draw.choice([0, 1, 3, 7, 2**16, 2**31, 2**32 - 1]) for _ in range(3)]
            message = image(encoding, *numbers, draw.randbytes(draw.choice([0, 1, 64])), big=draw.randrange(2))
            for of in (from_ros.grey_of, from_ros.depth_of):
                try:
                    self.assertEqual(of(message).shape, (message.height, message.width))
                except ValueError:
                    pass

    def test_imu_samples(self):
        self.assertEqual(from_ros.imu_of(imu(7)), (7, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0)))
        with self.assertRaisesRegex(ValueError, "expected finite"):
            from_ros.imu_of(imu(7, gyro=(math.nan, 0.0, 0.0)))
        from_ros.check_imu_place((0.0, 0.0, 0.0005, 0.0, 0.0, 1.0, 0.0))
        with self.assertRaisesRegex(ValueError, "is 0.100 m from the body's origin"):
            from_ros.check_imu_place((0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 1.0))

    def test_the_calibration_is_beside_the_images(self):
        for images, info in (("/a/image_raw", "/a/camera_info"), ("/a/image_raw/compressed", "/a/camera_info"),
                             ("left/image_raw", "left/camera_info"), ("image_raw", "camera_info"), ("/image", "/camera_info"),
                             ("image/compressed", "camera_info")):
            self.assertEqual(from_ros.camera_info_topic(images), info)


class Waiting(unittest.TestCase):
    """Cameras alone: what odometry has reached."""
    TURNED = (0.0, 0.0, 0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # 90 degrees about z

    def cameras(self, count=1, **more):
        self.known = {"r1/camera": (0.1, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0), "r1/imu": self.TURNED}

        def place(frame):
            if frame not in self.known:
                raise ValueError(f"no transform from '{frame}'")
            return self.known[frame]

        return Cameras([f"{side}/image_raw" for side in ("left", "right")[:count]], place=place, **more)

    def see(self, cameras, stamp_ns, which=0, data=b"abcdefghijkl"):
        cameras.add_image(cameras.streams[which], image("mono8", 4, 3, 4, data, stamp_ns))

    def ready(self, count=1, **more):
        """With cameras that are known, and odometry at 1 s."""
        cameras = self.cameras(count, **more)
        for i, stream in enumerate(cameras.streams):
            self.assertTrue(cameras.add_info(stream, camera_info()))
            self.see(cameras, 1 + i, i)
        cameras.add_odometry(1000 * MS)
        self.assertTrue(cameras.look())
        self.assertEqual(cameras.due()[0], [])  # of before all odometry
        return cameras

    def stamps(self, cameras):
        said, left_out = cameras.due()
        self.assertEqual(left_out, [])
        return [what[0] for add, what in said if add == "add_images"]

    def test_what_is_missing_is_said_until_it_is_there(self):
        cameras = self.cameras(imu="imu")
        self.known.clear()
        self.assertFalse(cameras.look())
        self.assertEqual(cameras.missing, ["no images are used: left/camera_info: no sensor_msgs/CameraInfo that can be taken",
                                           "no IMU is used: imu: no sample"])
        with self.assertRaisesRegex(ValueError, "thin_prism"):
            cameras.add_info(cameras.streams[0], camera_info("thin_prism", (1.0,)))
        self.assertTrue(cameras.add_info(cameras.streams[0], camera_info()))
        self.assertFalse(cameras.add_info(cameras.streams[0], camera_info(width=9)))  # the first counts
        self.assertFalse(cameras.look())
        self.assertIn("left/image_raw: no image", cameras.missing[0])
        self.see(cameras, 5)
        cameras.add_imu(imu(5))
        self.assertFalse(cameras.look())
        self.assertIn("no transform from 'r1/camera'", cameras.missing[0])
        self.assertEqual(cameras.sensors(), Feed.Sensors())
        self.known["r1/camera"] = poses.IDENTITY
        self.known["r1/imu"] = (0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
        self.assertTrue(cameras.look())
        self.assertEqual(cameras.missing, ["no IMU is used: is 0.500 m from the body's origin, expected 0"])
        camera = cameras.sensors().camera[0]
        self.assertEqual((camera.width_px, camera.kind, list(camera.distortion)), (4, Feed.Camera.PINHOLE, [-0.3, 0.1, 0.0, 0.0]))
        self.assertFalse(cameras.look())

    def test_images_wait_for_odometry_and_do_not_come_late(self):
        cameras = self.ready()
        for ms in (1010, 1020, 1100):
            self.see(cameras, ms * MS)
        self.assertEqual(self.stamps(cameras), [])
        cameras.add_odometry(1050 * MS)
        self.assertEqual(self.stamps(cameras), [1010 * MS, 1020 * MS])
        cameras.add_odometry(1601 * MS)
        said, left_out = cameras.due()
        self.assertEqual(said, [])
        self.assertIn("left/image_raw: an image comes 0.5 s after odometry of its time", left_out[0])
        with self.assertRaisesRegex(ValueError, "two publishers, or a clock that began anew"):
            self.see(cameras, 1100 * MS)
        with self.assertRaisesRegex(ValueError, "by another clock"):
            self.see(cameras, 12_000 * MS)
        offset = self.ready(offset_s=-0.02)
        self.see(offset, 1030 * MS)
        offset.add_odometry(1012 * MS)
        self.assertEqual(self.stamps(offset), [1010 * MS])

    def test_two_cameras(self):
        cameras = self.ready(2)
        self.see(cameras, 1010 * MS, 0, b"l" * 12)
        cameras.add_odometry(1020 * MS)
        self.assertEqual(self.stamps(cameras), [])  # the other's may come
        self.see(cameras, 1013 * MS, 1, b"r" * 12)
        (_, (stamp_ns, images, depth)), = cameras.due()[0]
        self.assertEqual((stamp_ns, images, depth), (1010 * MS, [(0, True, b"l" * 12), (1, True, b"r" * 12)], None))
        self.see(cameras, 1030 * MS, 0)
        self.see(cameras, 1036 * MS, 1)  # of no moment
        cameras.add_odometry(1040 * MS)
        (_, (_, images, _)), = cameras.due()[0]
        self.assertEqual(len(images), 1)
        for stamp_ms, data in ((1047, b"r"), (1052, b"s"), (1055, b"t")):
            self.see(cameras, stamp_ms * MS, 1, data * 12)
        self.see(cameras, 1051 * MS, 0)
        cameras.add_odometry(1052 * MS)
        (_, (_, images, _)), = cameras.due()[0]
        self.assertEqual(images[1], (1, True, b"s" * 12))  # the nearest
        self.see(cameras, 1062 * MS, 0)
        cameras.add_odometry(1361 * MS)
        self.assertEqual(self.stamps(cameras), [])
        cameras.add_odometry(1362 * MS)
        self.assertEqual(self.stamps(cameras), [1062 * MS])  # without the other's
        self.see(cameras, 1365 * MS, 0)
        cameras.add_odometry(1370 * MS)
        self.assertEqual(self.stamps(cameras), [])
        self.assertEqual(len(cameras.due(is_last=True)[0]), 1)
        for bad in (["a/i", "b/i", "c/i"], ["a/left", "a/right"]):
            with self.assertRaisesRegex(ValueError, "expected the topics of one or two cameras"):
                Cameras(bad)

    def test_images_of_another_size_are_left_out(self):
        cameras = self.ready()
        cameras.add_image(cameras.streams[0], image("mono8", 2, 1, 2, b"ab", 1010 * MS))
        cameras.add_odometry(1020 * MS)
        self.assertEqual(cameras.due(), ([], ["left/image_raw: an image of 2 x 1 pixels, expected 4 x 3"]))

    def test_files_are_passed_on(self):
        cameras = self.cameras()
        cameras = Cameras(["left/image_raw/compressed"], place=cameras.place)
        stream = cameras.streams[0]
        cameras.add_info(stream, camera_info())
        with self.assertRaisesRegex(ValueError, "of no bytes"):
            cameras.add_image(stream, file_image(b""))
        cameras.add_image(stream, file_image(b"a JPEG", 1010 * MS))
        cameras.look()
        cameras.add_odometry(1000 * MS)
        cameras.add_odometry(1020 * MS)
        self.assertEqual(cameras.due()[0], [("add_images", (1010 * MS, [(0, False, b"a JPEG")], None))])

    def test_depth_is_of_one_camera(self):
        cameras = self.ready(depth="depth/image")
        depth = lambda ms, width=4, frame="r1/camera": cameras.add_image(
            cameras.depth, image("16UC1", width, 3, 2 * width, b"\1\2" * 3 * width, ms * MS, frame))
        self.see(cameras, 1010 * MS)
        cameras.add_odometry(1020 * MS)
        self.assertEqual(self.stamps(cameras), [1010 * MS])  # not known yet
        self.assertIn("no depth is used: depth/image: no image", cameras.missing)
        self.assertTrue(depth(1030))
        self.assertTrue(cameras.look())
        self.assertAlmostEqual(cameras.sensors().depth.unit_m, 0.001)
        self.see(cameras, 1045 * MS)
        self.see(cameras, 1065 * MS)
        cameras.add_odometry(1070 * MS)
        self.assertEqual(cameras.due()[0], [])  # nearer depth may come
        self.assertFalse(depth(1066, width=2))
        ((_, (stamp_ns, _, data)), (_, (_, _, no_data))), left_out = cameras.due()
        self.assertEqual((stamp_ns, data, no_data), (1045 * MS, b"\1\2" * 12, None))
        self.assertEqual(left_out, ["depth/image: an image of 2 x 3 pixels, expected 4 x 3"])
        another = camera_info()
        another.k[0] = 470.0
        self.assertTrue(cameras.add_info(cameras.depth, another))
        self.assertTrue(cameras.look())
        self.assertIn("no depth is used: depth/image: fx, fy, cx, cy (470.0,", cameras.missing[0])
        self.assertFalse(cameras.sensors().HasField("depth"))
        for frame, width, text in (("r1/depth", 4, "0.100 m and 0.0000 rad from 'r1/camera'"), ("r1/camera", 2, "expected")):
            cameras = self.ready(depth="depth/image")
            self.known["r1/depth"] = (0.1, 0.1, 0.2, 0.0, 0.0, 0.0, 1.0)
            depth(1030, width, frame)
            self.assertFalse(cameras.look())
            self.assertIn(text, cameras.missing[0])
        for count, topic in ((2, "depth/image"), (0, "depth/image"), (1, "depth/image/compressedDepth")):
            with self.assertRaisesRegex(ValueError, "parameter 'depth'"):
                self.cameras(count, depth=topic)

    def test_imu_samples_go_in_batches_in_the_axes_of_the_body(self):
        cameras = self.ready(imu="imu")
        cameras.add_imu(imu(1000 * MS))
        self.assertTrue(cameras.look())
        self.assertTrue(cameras.sensors().HasField("imu"))
        for ms in range(1005, 1120, 5):
            cameras.add_imu(imu(ms * MS))
        cameras.add_odometry(1049 * MS)
        self.assertEqual(cameras.due()[0], [])
        cameras.add_odometry(1050 * MS)
        (add, (stamps, gyro, accelerometer)), = cameras.due()[0]
        self.assertEqual((add, stamps), ("add_imu", [ms * MS for ms in range(1000, 1055, 5)]))
        np.testing.assert_allclose(gyro[:3] + accelerometer[-3:], [-2.0, 1.0, 3.0, -5.0, 4.0, 6.0], atol=1e-12)
        self.see(cameras, 1060 * MS)
        cameras.add_odometry(1060 * MS)
        self.assertEqual([(add, what[0]) for add, what in cameras.due()[0]],
                         [("add_imu", [1055 * MS, 1060 * MS]), ("add_images", 1060 * MS)])
        cameras.add_odometry(1070 * MS)
        self.assertEqual(cameras.due()[0], [])
        self.assertEqual([(add, what[0]) for add, what in cameras.due(is_last=True)[0]],
                         [("add_imu", [1065 * MS, 1070 * MS])])
        with self.assertRaisesRegex(ValueError, "two publishers"):
            cameras.add_imu(imu(1000 * MS))
        with self.assertRaisesRegex(ValueError, "without 'images'"):
            Cameras(imu="imu")

    def test_memory_is_bounded(self):
        cameras = self.cameras()
        large = bytes(1000 * 1000)
        for i in range(60):
            cameras.add_image(cameras.streams[0], image("mono8", 1000, 1000, 1000, large, 10**9 + i))
        self.assertLessEqual(sum(len(one.data) for one in cameras.streams[0].waiting), MOST_BYTES)
        cameras.samples.extend([(0, (), ())] * MOST_IMU)
        cameras.add_imu(imu(10**9))
        self.assertEqual((len(cameras.samples), cameras.samples[-1][0]), (MOST_IMU, 10**9))
        cameras.add_odometry(10**9 + 501 * MS)
        cameras.due()
        self.assertEqual(len(cameras.streams[0].waiting), 0)  # nobody knows the camera, and they are too late by now
