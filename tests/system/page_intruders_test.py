#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Strangers at the page of a real server, without any credential: what they send is refused within bounds of memory and
time, others are served meanwhile, and the server ends when it is asked to. Skips without nats-server.

usage: page_intruders_test.py TUTTI_PROGRAM SOURCE_DIR [Plain.TEST | WithCredentials.TEST...]
"""
import contextlib
import gzip
import json
import pathlib
import re
import resource
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest

TUTTI = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else None
PATIENCE_S = 60  # of a busy machine
MOST_MEMORY = 150e6  # bytes more than before: some copies of the page, and what the kernel holds is not counted
HEAD_S = 10  # as the server promises
DEADLINE_S = 25  # of one connection: handshake and head, on a busy machine
MANY = 64  # connections
SOON_S = 8  # an answer to somebody else during an attack, on a busy machine; before its bounds the page took 10 s and more
MOST_SENT = 16e6  # bytes: the server passes over 4 MB before it closes, and the kernel of this side holds some


class Plain(unittest.TestCase):
    """Without credentials: HTTP, to this machine."""
    with_credentials = False

    def setUp(self):
        if not shutil.which("nats-server", path="/usr/sbin:/usr/bin:/usr/local/bin"):
            self.skipTest("TUTTI_ALL_SKIPPED: missing: nats-server")
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="tutti-intruders-"))
        self.addCleanup(shutil.rmtree, self.folder, True)
        command = [TUTTI, "server", "--mission", "cave", "--state", self.folder / "server", "--view", "0"]
        if self.with_credentials:
            subprocess.run([TUTTI, "pki", "init", "--mission", "cave", "--pki", self.folder / "pki"], check=True)
            command += ["--pki", self.folder / "pki"]
        self.server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.server.stderr.close)
        self.addCleanup(self.server.wait)
        self.addCleanup(self.server.kill)
        for line in self.server.stderr:
            if found := re.search(r"the page is at https?://127\.0\.0\.1:(\d+)/", line):
                self.port = int(found[1])
                break
        else:
            self.fail("the server ended")
        threading.Thread(target=self.server.stderr.read, daemon=True).start()
        self.assertEqual(self.ask("GET / HTTP/1.1")[0], 200)
        self.page = json.loads((self.folder / "server/page/status.json").read_text())["pid"]
        pathlib.Path(f"/proc/{self.page}/clear_refs").write_text("5")  # the peak begins anew
        self.before = self.peak()

    def peak(self):
        status = pathlib.Path(f"/proc/{self.page}/status").read_text()
        return 1024 * int(re.search(r"VmHWM:\s+(\d+) kB", status)[1])

    @contextlib.contextmanager
    def connected(self, source="127.0.0.1"):
        raw = socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S, source_address=(source, 0))
        if self.with_credentials:
            context = ssl.create_default_context()
            context.check_hostname = False
            context.verify_mode = ssl.CERT_NONE
            raw = context.wrap_socket(raw)
        with raw:
            yield raw

    @staticmethod
    def answer(connection):
        """(status, bytes of body): as the server has ended the connection, or the body is whole; 0 for no answer."""
        data = b""
        with contextlib.suppress(ConnectionError, ssl.SSLError):
            while some := connection.recv(1 << 16):
                data += some
        head, _, body = data.partition(b"\r\n\r\n")
        found = re.match(rb"HTTP/1.1 (\d+)", head)
        return int(found[1]) if found else 0, len(body)

    def ask(self, line, *headers, body=b""):
        with self.connected() as connection:
            text = "\r\n".join([line, "Host: 127.0.0.1", "Connection: close", *headers, "", ""])
            with contextlib.suppress(ConnectionError, ssl.SSLError):
                connection.sendall(text.encode() + body)
            return self.answer(connection)

    def floods(self, begin, block):
        """How many bytes go through until the server ends it, and the status of its answer."""
        sent = 0
        with self.connected() as connection:
            with contextlib.suppress(ConnectionError, ssl.SSLError, TimeoutError):
                connection.sendall(begin)
                while sent < 4 * MOST_SENT:
                    connection.sendall(block)
                    sent += len(block)
            return sent, self.answer(connection)[0]

    @contextlib.contextmanager
    def trickling(self, begins):
        """Connections that begin so, and go on by a byte every half second."""
        done = threading.Event()

        def trickle():
            while not done.wait(0.5):
                for one in list(connections):
                    with contextlib.suppress(OSError):
                        one.sendall(b"a")

        with contextlib.ExitStack() as held:
            connections = []
            thread = threading.Thread(target=trickle)
            thread.start()
            try:
                for connect, begin in begins:
                    connections.append(held.enter_context(connect()))
                    connections[-1].sendall(begin)
                yield
            finally:
                done.set()
                thread.join()

    @contextlib.contextmanager
    def crowd(self, count, addresses, begin, then=b"", period_s=0.3):
        """Peers of so many addresses that say one thing, then another again and again; who is put out comes back."""
        done = threading.Event()

        def talk(source):
            with self.connected(source) as one:
                one.sendall(begin)
                while not done.wait(period_s):
                    one.sendall(then)
                    one.settimeout(0.01)
                    with contextlib.suppress(TimeoutError):
                        if not one.recv(65536):
                            return
                    one.settimeout(PATIENCE_S)

        def come_again(source):
            while not done.is_set():
                with contextlib.suppress(OSError):
                    talk(source)
                done.wait(0.1)

        threads = [threading.Thread(target=come_again, args=[f"127.0.0.{2 + i % addresses}"], daemon=True)
                   for i in range(count)]
        for thread in threads:
            thread.start()
        try:
            yield
        finally:
            done.set()

    def is_served_meanwhile(self, seconds=4.0):
        """Somebody of another address is, every time, soon."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.assertLess(self.is_well(), SOON_S)
            time.sleep(0.3)

    def is_well(self):
        """The server lives, its memory has not grown much, and it serves others."""
        self.assertLess(self.peak() - self.before, MOST_MEMORY)
        begin = time.monotonic()
        status = 0
        while status == 0 and time.monotonic() < begin + SOON_S:  # all places taken: as a browser, it asks again
            with contextlib.suppress(ConnectionError, ssl.SSLError):
                status, size = self.ask("GET / HTTP/1.1")
        self.assertEqual(status, 200)
        self.assertGreater(size, 100_000)
        return time.monotonic() - begin

    def test_thousands_of_ranges_are_one_page(self):
        _, size = self.ask("GET / HTTP/1.1")
        for _ in range(4):
            self.assertEqual(self.ask("GET / HTTP/1.1", "Range: bytes=" + ",".join(["0-"] * 2000)), (200, size))
        self.is_well()

    def test_lines_and_headers_without_end_are_cut_off(self):
        for begin, block in [(b"GET /", b"a" * 65536), (b"GET / HTTP/1.1\r\nA: ", b"a" * 65536),
                             (b"GET / HTTP/1.1\r\n", b"A: b\r\n" * 10000), (b"", b"\r\n" * 30000)]:
            sent, status = self.floods(begin, block)
            self.assertLess(sent, MOST_SENT, begin)
            self.assertIn(status, (0, 400, 414, 431), begin)
        self.is_well()

    def test_bodies_without_bound_are_not_read(self):
        bomb = gzip.compress(gzip.compress(bytes(1 << 28)))
        post = "POST /api/login HTTP/1.1"
        for expected, headers, body in [
                (411, ["Transfer-Encoding: chunked"], b"ffffff\r\n" + b"a" * (1 << 24)),
                (411, [], b"a" * (1 << 24)),
                (413, ["Content-Length: 99999999999"], b"a" * (1 << 24)),
                (413, ["Content-Length: 2000000"], b"a" * 2000000),
                (415, [f"Content-Length: {len(bomb)}", "Content-Encoding: gzip"], bomb),
                (415, ["Content-Length: 100", "Content-Type: multipart/form-data; boundary=a"], b"--a\r\n" * 20)]:
            status, _ = self.ask(post, "X-Tutti: 1", *headers, body=body)
            self.assertIn(status, (0, expected), headers)  # 0: the answer was lost, because bytes came after the end
        self.is_well()

    def test_a_request_that_trickles_has_a_deadline(self):
        begin = time.monotonic()
        with self.connected() as connection:
            with contextlib.suppress(ConnectionError, ssl.SSLError):
                while time.monotonic() - begin < 3 * DEADLINE_S:
                    connection.sendall(b"G")
                    time.sleep(0.2)
        took = time.monotonic() - begin
        self.assertGreater(took, HEAD_S / 2)
        self.assertLess(took, DEADLINE_S)

    def test_many_that_trickle_or_are_silent_keep_nobody_out(self):
        def plain():
            return socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S)
        slow = b"\x16\x03\x01\x02\x00" if self.with_credentials else b"G"  # a handshake's begin, a request's
        with self.trickling([(plain, slow)] * MANY):
            for _ in range(3):
                self.assertLess(self.is_well(), HEAD_S, "before their time is over")

    def test_bodies_that_trickle_keep_nobody_out(self):
        for addresses in (1, MANY):
            with self.crowd(MANY, addresses, b"POST /api/login HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Tutti: 1\r\n"
                                             b"Content-Length: 4000\r\n\r\n", b"a", 0.25):
                self.is_served_meanwhile()

    def test_short_questions_without_end_keep_nobody_out(self):
        short = b"GET /api/none HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
        for count, addresses in (MANY, 1), (300, 250):
            with self.crowd(count, addresses, short, short):
                self.is_served_meanwhile()

    def test_ten_thousand_silent_connections_keep_nobody_out(self):
        most = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most[1], most[1]))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, most)
        count = min(10_000, most[1] - 200)
        for addresses in (1, 200):
            with contextlib.ExitStack() as held:
                def come():
                    for i in range(count):
                        one = held.enter_context(socket.socket())
                        one.setblocking(False)
                        one.bind((f"127.0.0.{2 + i % addresses}", 0))
                        one.connect_ex(("127.0.0.1", self.port))
                thread = threading.Thread(target=come)
                thread.start()
                self.is_served_meanwhile()
                thread.join()

    def test_nested_json_takes_neither_memory_nor_the_end(self):
        def post(path, size):
            return (f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Tutti: 1\r\nConnection: close\r\n"
                    f"Content-Length: {size}\r\n\r\n").encode() + b"[" * size
        for path, size in ("/api/decide", 2 << 20), ("/api/decide", 64 << 10), ("/api/mark", 2 << 20):
            with self.connected() as connection:
                with contextlib.suppress(ConnectionError, ssl.SSLError):
                    connection.sendall(post(path, size))
                self.assertIn(self.answer(connection)[0], (0, 401) if self.with_credentials else (0, 400, 413, 503))
            with self.crowd(MANY, MANY, post(path, size)):
                self.is_served_meanwhile(2.0)
        with self.crowd(MANY, MANY, post("/api/mark", 2 << 20)):
            time.sleep(1)
            begin = time.monotonic()
            self.server.send_signal(signal.SIGTERM)
            self.assertEqual(self.server.wait(timeout=PATIENCE_S), 0)
            self.assertLess(time.monotonic() - begin, SOON_S)

    def test_nobody_keeps_the_server_from_ending(self):
        login = b"POST /api/login HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Tutti: 1\r\nContent-Length: 4096\r\n\r\n{"
        with self.trickling([(self.connected, begin) for begin in [
                b"GET / HT", login, b"GET /api/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"]] * 8):
            time.sleep(1)
            begin = time.monotonic()
            self.server.send_signal(signal.SIGTERM)
            self.assertEqual(self.server.wait(timeout=PATIENCE_S), 0)
            self.assertLess(time.monotonic() - begin, HEAD_S, "before their time is over")


class WithCredentials(Plain):
    """With --pki: HTTPS, of strangers who have no credential."""
    with_credentials = True


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
