# SPDX-License-Identifier: BSD-3-Clause
"""A thread that has a Link to the robot program's socket, and tries again for ever when it is not there."""
import select
import socket
import threading

from google.protobuf.message import DecodeError


class Connection(threading.Thread):
    """`heard(kind, message)` is called in this thread, `lock` not held. `lock` guards the Link."""

    def __init__(self, path, link, heard):
        super().__init__(name="tutti feed", daemon=True)
        self.path, self.link, self.heard = path, link, heard
        self.lock = threading.Lock()
        self.wakes, self.waker = socket.socketpair()
        self.waker.setblocking(False)
        self.ending = threading.Event()

    def wake(self):
        """There is something to send."""
        try:
            self.waker.send(b".")
        except BlockingIOError:  # it is awake
            pass

    def stop(self):
        self.ending.set()
        self.wake()
        if self.ident is not None:  # it was started
            self.join(5.0)
        self.wakes.close()
        self.waker.close()

    def run(self):
        while not self.ending.is_set():
            why = "the robot has ended"
            try:
                with socket.socket(socket.AF_UNIX) as robot:
                    robot.settimeout(5.0)
                    robot.connect(str(self.path))
                    robot.settimeout(None)
                    self._talk(robot)
            except (OSError, ValueError, DecodeError) as error:
                why = f"{self.path}: {error}"
            with self.lock:
                wait_s = self.link.lost(why)
            self.ending.wait(wait_s)

    def _talk(self, robot):
        with self.lock:
            out = memoryview(self.link.connected())  # whose rest is no copy
        robot.setblocking(False)
        while not self.ending.is_set():
            readable, writable, _ = select.select([robot, self.wakes], [robot] if out else [], [])
            if self.wakes in readable:
                self.wakes.recv(4096)
            if robot in readable:
                data = robot.recv(1 << 20)
                if not data:
                    return
                with self.lock:
                    said = self.link.hear(data)
                for kind, message in said:
                    self.heard(kind, message)
            if robot in writable:
                out = out[robot.send(out):]
            if not out:
                with self.lock:
                    out = memoryview(self.link.next_frame())
