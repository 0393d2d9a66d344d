"""Maps that both sides read, serve and save, byte by byte."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pipros.msg import load_message_class
from tests.support.both_navigation import both_nodes
from tests.support.navigation_oracle import add_to
from tests.support.ros import RosSystem

YAML = """image: {image}
resolution: 0.05
origin: [-1.5, 2.25, 0.3]
negate: {negate}
occupied_thresh: 0.65
free_thresh: 0.196
mode: {mode}
"""


def write_images(folder: Path) -> list[str]:
    """Write pictures in the formats that both sides read; return their names."""
    numbers = np.random.default_rng(1)
    grey = numbers.integers(0, 256, (5, 256)).astype(np.uint8)
    grey[0] = np.arange(256)
    colours = numbers.integers(1, 256, (4, 60, 3)).astype(np.uint8)
    alpha = numbers.integers(0, 3, (4, 60, 1)).astype(np.uint8) * 127
    wide = grey.astype(np.uint16) * 257
    pictures = {
        "grey.pgm": grey, "grey.png": grey, "grey.bmp": grey, "grey.tif": grey, "grey.jpg": grey[:, :48],
        "wide.png": wide, "colours.png": colours, "colours.ppm": colours,
        "alpha.png": np.concatenate((colours, alpha), axis=2),
        "grey_alpha.png": np.concatenate((grey[:4, :60, None], alpha), axis=2),
        "bits.png": grey > 128,
    }  # fmt: skip
    for name, pixels in pictures.items():
        Image.fromarray(pixels).save(folder / name)
    return list(pictures)


def test_maps_are_read_byte_by_byte(plain_ros: RosSystem) -> None:
    home = plain_ros.home
    files = []
    for image in write_images(home):
        for mode in ("trinary", "scale", "raw"):
            for negate in (0, 1):
                files.append(home / f"{image}.{mode}.{negate}.yaml")
                files[-1].write_text(YAML.format(image=image, mode=mode, negate=negate))
    bad = [home / "missing.yaml", home / "no_image.yaml", home / "bad_mode.yaml"]
    bad[1].write_text(YAML.format(image="none.pgm", mode="raw", negate=0))
    bad[2].write_text(YAML.format(image="grey.pgm", mode="grey", negate=0))

    with both_nodes(plain_ros, "map_server", "map_server", {}, arguments=[str(files[0])]) as both:
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
        for inbox in published.values():
            assert len(inbox.wait(1 + len(files))) == 1 + len(files)
        for file in bad:
            results = both.call("change_map", "nav_msgs/LoadMap", map_url=str(file))
            assert [result.result for result in results] == [255, 255], file
        ours, theirs = (result.map.data for result in both.call("static_map", "nav_msgs/GetMap"))
        assert ours == theirs
        assert both.interface("pipros") == both.interface("genuine")


@pytest.mark.parametrize("options", [[], ["--occ", "80", "--free", "10"], ["-f", "kept", "--free", "0"]])
def test_maps_are_saved_byte_by_byte(plain_ros: RosSystem, options: list[str]) -> None:
    plain_ros.serve_master()
    folder = add_to(plain_ros.genuine)
    from pipros.basics.env import Environment
    from pipros.node import Node

    message: Any = load_message_class("nav_msgs/OccupancyGrid")()
    message.info.width, message.info.height, message.info.resolution = 256, 2, 0.0123456
    message.info.origin.position.x, message.info.origin.position.y = -12.3456789, 1e-7
    message.info.origin.orientation.z, message.info.origin.orientation.w = 0.6, -0.8
    message.data = [*range(-128, 128), *reversed(range(-128, 128))]
    saved = []
    with Node("test", environment=Environment(master_uri=plain_ros.master_uri)) as node:
        node.advertise("/map", type(message), latch=True).publish(message)
        for side, command in (
            (plain_ros.pipros, ["rosrun", "map_server", "map_saver"]),
            (plain_ros.genuine, [folder / "lib/map_server/map_saver"]),
        ):
            ended = side.run(*command, *options)
            assert ended.returncode == 0, ended.output
            name = "kept" if "-f" in options else "map"
            files = [plain_ros.home / f"{name}.{suffix}" for suffix in ("pgm", "yaml")]
            saved.append([file.read_bytes() for file in files])
            for file in files:
                file.unlink()
    assert saved[0] == saved[1]


@pytest.mark.parametrize(
    ("program", "arguments"),
    [
        ("map_saver", ["-h"]),
        ("map_saver", ["--occ", "0"]),
        ("map_server", []),
        ("map_server", ["missing.yaml"]),
    ],
)
def test_exit_codes(plain_ros: RosSystem, program: str, arguments: list[str]) -> None:
    plain_ros.serve_master()
    folder = add_to(plain_ros.genuine)
    ours = plain_ros.pipros.run("rosrun", "map_server", program, *arguments)
    theirs = plain_ros.genuine.run(folder / "lib/map_server" / program, *arguments)

    assert ours.returncode == theirs.returncode, theirs.output
