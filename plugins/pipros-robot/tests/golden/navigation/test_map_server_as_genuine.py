"""Maps that pipros reads, serves and saves as genuine map_server and map_saver did, byte by byte."""

from typing import Any

import numpy as np
import pytest

from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.node import Node
from tests.support.both_navigation import both_nodes
from tests.support.recordings import Recording
from tests.support.ros import RosSystem

YAML = """image: {image}
resolution: 0.05
origin: [-1.5, 2.25, 0.3]
negate: {negate}
occupied_thresh: 0.65
free_thresh: 0.196
mode: {mode}
"""


PICTURES = (
    "grey.pgm", "grey.png", "grey.bmp", "grey.tif", "grey.jpg", "wide.png", "colours.png", "colours.ppm",
    "alpha.png", "grey_alpha.png", "bits.png",
)  # fmt: skip


def test_maps_are_read_byte_by_byte(ros: RosSystem, recording: Recording) -> None:
    home = ros.home
    files = []
    for image in PICTURES:
        (home / image).write_bytes(recording.take(f"file {image}").tobytes())
        for mode in ("trinary", "scale", "raw"):
            for negate in (0, 1):
                files.append(home / f"{image}.{mode}.{negate}.yaml")
                files[-1].write_text(YAML.format(image=image, mode=mode, negate=negate))
    bad = [home / "missing.yaml", home / "no_image.yaml", home / "bad_mode.yaml"]
    bad[1].write_text(YAML.format(image="none.pgm", mode="raw", negate=0))
    bad[2].write_text(YAML.format(image="grey.pgm", mode="grey", negate=0))

    with both_nodes(ros, recording, "map_server", "map_server", {}, arguments=[str(files[0])]) as both:
        published = both.inboxes("map", "nav_msgs/OccupancyGrid")
        metadata = both.inboxes("map_metadata", "nav_msgs/MapMetaData")
        for inbox in (*published.values(), *metadata.values()):
            inbox.wait(1)
        wrong = []
        for file in files:
            results = both.call("change_map", "nav_msgs/LoadMap", map_url=str(file))
            assert [(result.result, len(result.map.data)) for result in results] == [(0, 0)] * 2
            ours, theirs = (result.map for result in both.call("static_map", "nav_msgs/GetMap"))
            ours.header.stamp = ours.info.map_load_time = theirs.header.stamp = theirs.info.map_load_time
            ours.header.seq = theirs.header.seq
            if ours != theirs:
                wrong.append((file.name, np.count_nonzero(np.array(ours.data) != np.array(theirs.data))))
        assert wrong == []
        assert len(published["pipros"].wait(1 + len(files))) == 1 + len(files) == recording.value("maps")
        for file in bad:
            results = both.call("change_map", "nav_msgs/LoadMap", map_url=str(file))
            assert [result.result for result in results] == [255, 255], file
        ours, theirs = (result.map.data for result in both.call("static_map", "nav_msgs/GetMap"))
        assert ours == theirs
        assert both.interface("pipros") == both.interface("genuine")


@pytest.mark.parametrize("options", [[], ["--occ", "80", "--free", "10"], ["-f", "kept", "--free", "0"]])
def test_maps_are_saved_byte_by_byte(ros: RosSystem, recording: Recording, options: list[str]) -> None:
    ros.serve_master()
    message: Any = load_message_class("nav_msgs/OccupancyGrid")()
    message.info.width, message.info.height, message.info.resolution = 256, 2, 0.0123456
    message.info.origin.position.x, message.info.origin.position.y = -12.3456789, 1e-7
    message.info.origin.orientation.z, message.info.origin.orientation.w = 0.6, -0.8
    message.data = [*range(-128, 128), *reversed(range(-128, 128))]
    message = recording.give("publish /map", message)
    recording.give("arguments", options)
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        node.advertise("/map", type(message), latch=True).publish(message)
        ended = ros.pipros.run("rosrun", "map_server", "map_saver", *options)

    assert ended.returncode == 0, ended.output
    files = recording.value("files")
    assert sorted(files) == (["kept.pgm", "kept.yaml"] if "-f" in options else ["map.pgm", "map.yaml"])
    for name, content in files.items():
        assert (ros.home / name).read_bytes() == content.tobytes(), name


@pytest.mark.parametrize(("program", "arguments"), [
    ("map_saver", ["-h"]), ("map_saver", ["--occ", "0"]), ("map_server", []),
    ("map_server", ["missing.yaml"]),
])  # fmt: skip
def test_exit_codes(ros: RosSystem, recording: Recording, program: str, arguments: list[str]) -> None:
    ros.serve_master()
    recording.give("arguments", arguments)
    ended = ros.pipros.run("rosrun", "map_server", program, *arguments)

    assert ended.returncode == recording.value("exit code"), ended.output
