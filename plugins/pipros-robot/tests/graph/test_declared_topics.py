"""The topics that shipped packages declare in package.xml are those of their programs and nodelets."""

from pipros.basics import names
from pipros.basics.env import Environment
from pipros.msg import load_message_class
from pipros.net.master_client import MasterClient
from pipros.node import Node
from pipros.packages.nodelets import shipped_nodelets
from pipros_workspace.manifest import read_manifest
from tests.support.environments import SHIPPED
from tests.support.ros import RosSystem
from tests.support.waiting import wait_until

OTHERS = """
  <param name="robot_description" value="&lt;robot name='r'>&lt;link name='a'/>&lt;link name='b'/>
    &lt;joint name='j' type='continuous'>&lt;parent link='a'/>&lt;child link='b'/>&lt;/joint>&lt;/robot>"/>
  <remap from="static_map" to="/static_map"/> <remap from="map" to="/map"/>
  <remap from="robot_description" to="/robot_description"/>
  <node pkg="map_server" type="map_server" name="map_server" args="$(find pipros_sim)/maps/room.yaml"/>
  <node pkg="tf" type="static_transform_publisher" name="m" args="2 2 0 0 0 0 map odom 100"/>
  <node pkg="tf" type="static_transform_publisher" name="o" args="0 0 0 0 0 0 odom base_link 100"/>
"""
"""What amcl, move_base and publishers of joints wait for."""


def test_programs_and_nodelets_have_the_topics_that_their_packages_declare(ros: RosSystem) -> None:
    folders = [file.parent for share in SHIPPED for file in share.glob("*/package.xml")]
    declared = [(folder.name, each) for folder in folders for each in read_manifest(folder).exports]
    declared = [(package, each) for package, each in declared if each.tag == "pipros" and each.children]
    launch, expected = [OTHERS], set()
    for number, (package, each) in enumerate(declared):
        node, args = each.attributes["node"], ""
        if f"{package}/{node}" in shipped_nodelets():
            package, node, args = "nodelet", "nodelet", f"standalone {package}/{node}"
        launch += [f'<node pkg="{package}" type="{node}" name="n" ns="g{number}" args="{args}"/>']
        for topic in each.children:
            full = names.resolve(topic.attributes["topic"], f"/g{number}/n")
            expected.add((topic.tag, full, topic.attributes["type"], f"/g{number}/n"))
    assert len(declared) > 15
    (ros.home / "all.launch").write_text(f"<launch>{''.join(launch)}</launch>")
    ros.serve_master()
    launched = ros.pipros.start("roslaunch", ros.home / "all.launch")
    with Node("test", environment=Environment(master_uri=ros.master_uri)) as node:
        for tag, topic, kind, _ in expected:
            if tag == "publishes":  # some programs work only for subscribers
                node.subscribe(topic, load_message_class(kind), lambda _: None)
        client = MasterClient(ros.master_uri, "/test")

        def missing() -> set[tuple[str, str, str, str]]:
            publishers, subscribers, _ = client.get_system_state()
            types = dict(client.get_topic_types())
            lists = (("publishes", publishers), ("subscribes", subscribers))
            found = {
                (tag, topic, types.get(topic, ""), n) for tag, each in lists for topic, ns in each for n in ns
            }
            return expected - found

        wait_until(lambda: not missing(), 120, lambda: f"{launched.output}\n{missing()}")
        client.close()
