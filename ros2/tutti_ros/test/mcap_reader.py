# SPDX-License-Identifier: BSD-3-Clause
"""Messages of an MCAP file, one after the other: as much as tests need. Zstd by libzstd, which Tutti needs itself."""
import ctypes
import ctypes.util
import struct


def unzstd(data, size):
    name = ctypes.util.find_library("zstd") or "libzstd.so.1"
    zstd = ctypes.CDLL(name)
    zstd.ZSTD_decompress.restype = ctypes.c_size_t
    zstd.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    out = ctypes.create_string_buffer(size)
    if zstd.ZSTD_decompress(out, size, data, len(data)) != size:
        raise ValueError("a chunk that zstd does not decode")
    return out.raw


def records(data):
    at = 0
    while at < len(data):
        kind, size = struct.unpack_from("<BQ", data, at)
        yield kind, data[at + 9:at + 9 + size]
        at += 9 + size


def messages(data):
    """(topic, CDR bytes) of a whole file."""
    topics = {}

    def of(content):
        for kind, body in content:
            if kind == 4:  # channel
                channel, _, size = struct.unpack_from("<HHI", body)
                topics[channel] = body[8:8 + size].decode()
            elif kind == 5:  # message
                yield topics[struct.unpack_from("<H", body)[0]], body[22:]
            elif kind == 6:  # chunk
                size, = struct.unpack_from("<Q", body, 16)
                word, = struct.unpack_from("<I", body, 28)
                compression = body[32:32 + word]
                inner = body[32 + word + 8:]
                yield from of(records(unzstd(inner, size) if compression == b"zstd" else inner))
    yield from of(records(data[8:-8]))
