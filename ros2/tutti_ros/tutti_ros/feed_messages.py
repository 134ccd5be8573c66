# SPDX-License-Identifier: BSD-3-Clause
"""The feed's protobuf messages: as setup.py had protoc make them for the installed package, or of Tutti's build folder."""
try:
    from tutti_ros.feed_pb2 import Feed
except ModuleNotFoundError as missing:
    if missing.name != "tutti_ros.feed_pb2":
        raise
    from tutti.v1.feed_pb2 import Feed

__all__ = ["Feed"]
