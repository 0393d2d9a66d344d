import os
import sys
from pathlib import Path

import pytest

import pipros
from pipros.basics.errors import NotFound
from pipros.basics.names import is_legal_base
from pipros.safe.expr_walk import ExpressionError
from pipros_tools.launch import param_types, substitute
from pipros_tools.launch.budget import LAUNCH_INCLUDES
from pipros_tools.launch.load_context import CommandFailed, LoadContext
from pipros_tools.launch.model import (
    NODE_SETTINGS,
    LaunchError,
    LaunchNode,
    NodeSetting,
    Output,
    Place,
    WorkingFolder,
)
from pipros_tools.launch.roscore import STANDARD_PARAMETERS
from pipros_tools.launch.substitute import Substitution, SubstitutionError, UnsetArgument, anonymous_name
from pipros_tools.launch.xml import INCLUDE_LIMIT, load
from roslaunch.core import Node
from tests.support.constants import Constants


def write(folder: Path, name: str, content: str) -> str:
    file = folder / name
    file.write_text(content)
    return str(file)


def test_an_error_names_file_line_column_and_element(tmp_path: Path) -> None:
    file = write(tmp_path, "a.launch", '<launch>\n\n  <node pkg="p" name="n"/>\n</launch>')
    with pytest.raises(LaunchError) as error:
        load([file])
    assert error.value.places == (Place(file, 3, 3),)
    assert error.value.element == '<node pkg="p" name="n"/>'
    assert str(error.value).splitlines()[-1] == f'  in {file}:3:3: <node pkg="p" name="n"/>'


def test_an_error_in_an_included_file_names_the_includes(tmp_path: Path) -> None:
    inner = write(tmp_path, "inner.launch", "<launch>\n <param/>\n</launch>")
    middle = write(tmp_path, "middle.launch", f'<launch>\n\n <include file="{inner}"/>\n</launch>')
    outer = write(tmp_path, "outer.launch", f'<launch><include file="{middle}"/></launch>')
    with pytest.raises(LaunchError) as error:
        load([outer])
    assert error.value.places == (Place(inner, 2, 2), Place(middle, 3, 2), Place(outer, 1, 9))


def test_malformed_xml_is_refused_with_its_place(tmp_path: Path) -> None:
    file = write(tmp_path, "a.launch", "<launch>\n <node>\n</launch>")
    with pytest.raises(LaunchError, match="Invalid roslaunch XML syntax: mismatched tag") as error:
        load([file])
    assert error.value.places == (Place(file, 3, 3),)


@pytest.mark.parametrize(("text", "error"), [
    ('<!DOCTYPE launch [<!ENTITY a "b">]><launch>&a;</launch>', "document type"),
    ('<launch><include file="/nope.launch"/></launch>', r"cannot read \[/nope.launch\]: No such file"),
    ("<launch>\n <rosparam>\n  a: 1\n  b: 'x\n </rosparam></launch>", r"invalid YAML:\n/.*/a.launch:[45]:"),
])  # fmt: skip
def test_what_cannot_be_loaded_is_named(tmp_path: Path, text: str, error: str) -> None:
    with pytest.raises(LaunchError, match=error):
        load([write(tmp_path, "a.launch", text)])


def test_a_file_that_includes_itself_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path, "loop.launch", '<launch><include file="$(dirname)/loop.launch"/></launch>')
    with pytest.raises(LaunchError, match=f"includes are nested more than {INCLUDE_LIMIT} deep") as error:
        load([file])
    assert len(error.value.places) < 10


def test_a_bad_yaml_file_is_named_with_its_line(tmp_path: Path) -> None:
    bad = write(tmp_path, "p.yaml", "a: 1\nb: [\n")
    file = write(tmp_path, "a.launch", f'<launch><rosparam file="{bad}"/></launch>')
    with pytest.raises(LaunchError, match=f"contains invalid YAML:\n{bad}:3:1"):
        load([file])


def test_a_global_key_of_rosparam_keeps_its_name_in_a_namespace(tmp_path: Path) -> None:
    # as genuine roslaunch: fleets set /use_sim_time or a shared frame in each robot's group
    yaml = "{/a: 1, b/: 2, c: {/d/e: 3, f: 4}}"
    places = f'<rosparam>{yaml}</rosparam><rosparam param="k">{{/g: 5, h: 6}}</rosparam>'
    node = f'<node pkg="p" type="t" name="n"><rosparam>{yaml.replace("a", "i")}</rosparam></node>'
    file = write(tmp_path, "a.launch", f'<launch><group ns="r">{places}{node}</group></launch>')
    expected = {"/a": 1, "/r/b": 2, "/d/e": 3, "/r/c/f": 4, "/g": 5, "/r/k/h": 6}
    assert load([file]).params == {**expected, "/i": 1, "/r/n/b": 2, "/r/n/c/f": 4}


def test_an_unset_argument_is_named_with_its_file(tmp_path: Path) -> None:
    file = write(tmp_path, "a.launch", '<launch><arg name="x"/><param name="p" value="$(arg x)"/></launch>')
    with pytest.raises(LaunchError) as error:
        load([file])
    assert error.value.reason == f"[{file}] requires the 'x' arg to be set"
    assert (load([file], {"x": "7"}).params, load([file], unset_as="").params) == ({"/p": 7}, {"/p": ""})


def test_warnings_name_the_place(tmp_path: Path) -> None:
    file = write(tmp_path, "a.launch", '<launch>\n <group colour="red"><shape/></group>\n</launch>')
    assert load([file]).warnings == (
        f"[{file}:2:2] unknown <group> attribute 'colour'",
        f"unrecognized tag shape in {file}:2:22",
    )


def test_two_nodes_of_one_name_are_both_named(tmp_path: Path) -> None:
    node = '<node pkg="p" type="t" name="n"/>'
    file = write(tmp_path, "a.launch", f"<launch>\n{node}\n{node}\n</launch>")
    with pytest.raises(LaunchError, match=r"multiple nodes named \[/n\]") as error:
        load([file])
    assert f"{file}:2:1" in str(error.value)
    assert f"{file}:3:1" in str(error.value)


def test_several_files_make_one_launch(tmp_path: Path) -> None:
    one = write(tmp_path, "1.launch", '<launch><node pkg="p" type="t" name="a"/></launch>')
    two = write(tmp_path, "2.launch", '<launch><node pkg="p" type="t" name="b"/></launch>')
    launch = load([one, two], texts=['<launch><param name="c" value="1"/></launch>'])
    assert [node.full_name for node in launch.nodes] == ["/a", "/b"]
    assert (launch.files, launch.params) == ((one, two), {"/c": 1})


def test_the_namespace_of_the_environment_is_around_everything(tmp_path: Path, monkeypatch) -> None:
    file = write(tmp_path, "a.launch", '<launch><node pkg="p" type="t" name="a"/></launch>')
    monkeypatch.setenv("ROS_NAMESPACE", "robot")
    assert load([file]).nodes[0].full_name == "/robot/a"


def test_the_arguments_of_the_named_files_are_listed(tmp_path: Path) -> None:
    inner = write(tmp_path, "inner.launch", '<launch><arg name="hidden" default="1"/></launch>')
    file = write(
        tmp_path,
        "a.launch",
        f'<launch><arg name="x" doc="the x"/><arg name="y" default="2"/><include file="{inner}"/></launch>',
    )
    launch = load([file], unset_as="")
    assert [(argument.name, argument.is_required, argument.doc) for argument in launch.arguments] == [
        ("x", True, "the x"),
        ("y", False, None),
    ]


def test_an_unknown_machine_is_an_error_only_at_launch() -> None:
    text = '<launch><node pkg="p" type="t" name="n" machine="m"/></launch>'
    launch = load([], texts=[text])
    with pytest.raises(LaunchError, match=r"unknown machine \[m\]"):
        launch.check_machines()


def test_output_and_folder_default_to_none() -> None:
    text = (
        '<launch><node pkg="p" type="t" name="a"/><node pkg="p" type="t" name="b" cwd="ros_home"/>'
        '<node pkg="p" type="t" name="c" cwd="ROS_HOME" output="log"/></launch>'
    )
    folders = [node.working_folder for node in load([], texts=[text]).nodes]
    assert folders == [None, WorkingFolder.ROS_HOME, WorkingFolder.ROS_HOME]
    assert [node.output for node in load([], texts=[text]).nodes] == [None, None, Output.LOG]
    with pytest.raises(LaunchError, match="cwd must be one of"):
        load([], texts=['<launch><node pkg="p" type="t" name="b" cwd="NODE"/></launch>'])


def test_the_includes_of_each_file_are_known(tmp_path: Path) -> None:
    inner = write(tmp_path, "inner.launch", "<launch/>")
    outer = write(tmp_path, "outer.launch", f'<launch><include file="{inner}"/></launch>')
    assert load([outer]).includes == ((outer, inner),)


def test_arguments_can_be_read_without_the_rest() -> None:
    text = '<launch><arg name="a" default="1"/><node/><include file="/nope"/></launch>'
    launch = load([], texts=[text], arguments_only=True)
    assert [argument.name for argument in launch.arguments] == ["a"]


RESOURCES = Path(pipros.__file__).parent / "share" / "roslaunch" / "resources"


@pytest.mark.parametrize("file", sorted(RESOURCES.iterdir()), ids=lambda file: file.name)
def test_the_examples_that_ship_can_be_loaded(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own_commands = str(Path(sys.executable).parent)  # one parameter is the output of a command
    monkeypatch.setenv("PATH", os.pathsep.join([own_commands, os.environ["PATH"]]))
    arguments = {"who": "x", "address": "localhost"} if "arg" in file.read_text() else {}
    assert load([str(file)], arguments).files[0] == str(file)


def test_the_core_configuration_equals_that_of_roscore() -> None:
    launch = load([str(RESOURCES / "roscore.xml")])
    assert launch.params == STANDARD_PARAMETERS
    assert [node.full_name for node in launch.nodes] == ["/rosout"]


def test_arguments_that_double_each_other_are_refused(tmp_path: Path) -> None:
    doubling = "".join(
        f'<arg name="a{number + 1}" value="$(arg a{number})$(arg a{number})"/>' for number in range(40)
    )
    file = write(tmp_path, "a.launch", f'<launch><arg name="a0" value="0123456789"/>{doubling}</launch>')
    with pytest.raises(
        LaunchError, match="the substitutions insert too many characters: the limit is 1048576"
    ) as error:
        load([file])
    assert 'name="a17"' in error.value.element


def test_the_total_length_of_substitutions_is_limited(tmp_path: Path, constants: Constants) -> None:
    params = "".join(f'<param name="p{number}" value="$(arg a)"/>' for number in range(9))
    file = write(
        tmp_path, "a.launch", f'<launch><arg name="a" value="{"x" * 900}"/><group>{params}</group></launch>'
    )
    constants(LAUNCH_FILES_BYTES=20000)
    assert len(load([file]).params) == 9
    constants(LAUNCH_FILES_BYTES=5000)
    with pytest.raises(LaunchError, match=r"the files of this launch.* are too large: the limit is 5000"):
        load([file])


@pytest.mark.parametrize(
    "element", ['<param name="p" textfile="{}"/>', '<rosparam file="{}" param="p"/>', '<include file="{}"/>']
)
def test_a_file_that_is_read_many_times_counts_each_time(tmp_path, element: str, constants) -> None:
    other = write(tmp_path, "other", f"<launch><!--{'x' * 900}--></launch>")
    file = write(tmp_path, "a.launch", f"<launch>{element.format(other) * 9}</launch>")
    constants(LAUNCH_FILES_BYTES=5000)
    with pytest.raises(LaunchError, match="too large: the limit is 5000"):
        load([file])


def test_files_that_include_each_other_twice_are_refused(tmp_path: Path, constants: Constants) -> None:
    for depth in range(30):
        include = f'<include file="{tmp_path / f"i{depth + 1}.launch"}"/>'
        write(tmp_path, f"i{depth}.launch", f"<launch>{include * 2}</launch>")
    write(tmp_path, "i30.launch", "<launch/>")
    assert LAUNCH_INCLUDES == 10_000
    constants(LAUNCH_INCLUDES=500)
    with pytest.raises(LaunchError, match="too many files are included: the limit is 500"):
        load([str(tmp_path / "i0.launch")])


def test_an_expression_converts_only_the_arguments_that_it_names(monkeypatch: pytest.MonkeyPatch) -> None:
    converted: list[object] = []

    def convert(value: object, kind: str) -> object:
        converted.append(value)
        return param_types.convert(value, kind)

    monkeypatch.setattr(substitute, "convert", convert)
    arguments = "".join(f'<arg name="x{number}" default="{number}"/>' for number in range(100))
    text = f'<launch>{arguments}<param name="p" value="$(eval x7 + arg(\'x9\'))"/></launch>'

    assert (load([], texts=[text]).params, converted) == ({"/p": 16}, ["7", "9"])


def test_the_last_of_many_remappings_of_a_name_wins() -> None:
    remappings = "".join(f'<remap from="a{number % 3000}" to="b{number}"/>' for number in range(6000))
    launch = load([], texts=[f'<launch>{remappings}<node name="n" pkg="p" type="t"/></launch>'])

    assert launch.nodes[0].remappings == tuple((f"a{each}", f"b{each + 3000}") for each in range(3000))


# Each setting of nodes is read from launch files, and passes through `roslaunch.core` unchanged.


@pytest.mark.parametrize("setting", [each for each in NODE_SETTINGS if each.xml], ids=lambda each: each.xml)
def test_each_setting_is_read_and_passes_through_the_library(setting: NodeSetting) -> None:
    text = {bool: "true", float: "2.5"}.get(type(setting.default), "sample")
    choices = [each.value for each in setting.choices or ()]
    attributes = {"pkg": "p", "type": "t", "name": "n", setting.xml: [text, *choices][-1]}
    written = " ".join(f"{name}='{value}'" for name, value in attributes.items())
    node = f"<node {written}><remap from='a' to='b'/><env name='A' value='1'/></node>"
    launch = load([], texts=[f"<launch><arg name='ros2_python' default='python'/>{node}</launch>"])

    found = launch.nodes[0]
    kept = Node.from_model(found).to_model()
    usual = getattr(LaunchNode("p", "t", "n"), setting.field)
    assert usual is None or isinstance(getattr(found, setting.field), type(usual))
    assert getattr(found, setting.field) != usual
    assert (kept, kept.place, launch.warnings) == (found, found.place, ())


def find(package: str, path: str) -> str:
    if package != "talkers":
        raise NotFound(f"package [{package}] not found")
    return str(Path("/ws/talkers") / path) if path else "/ws/talkers"


@pytest.fixture
def substitution() -> Substitution:
    return Substitution(
        find=find, environment={"HOME": "/home/ada"}, make_anonymous=lambda base: f"{base}_unique",
        arguments={"a": "3", "b": "true", "s": "hi there", "unset": None}, folder="/launch",
    )  # fmt: skip


@pytest.mark.parametrize(("text", "result"), [
    ("nothing to do: $x $ ( )", "nothing to do: $x $ ( )"), ("$(arg a)$(arg b)", "3true"),
    ("$( arg  a )", "3"), ("x/$(arg s)/y", "x/hi there/y"), ("$$(arg a)", "$3"), ("$(arg a))", "3)"),
    ("$(env HOME)/x", "/home/ada/x"), ("$(optenv HOME none)", "/home/ada"),
    ("$(optenv NOPE a b  c)", "a b c"), ("$(optenv NOPE)", ""),
    ("$(anon n)-$(anon n)", "n_unique-n_unique"), ("$(dirname)/x", "/launch/x"),
    ("$(find talkers)", "/ws/talkers"), ("$(find talkers)/", "/ws/talkers"),
    ("$(find talkers)/launch/x.launch", "/ws/talkers/launch/x.launch"),
    ("$(find talkers)/$(arg a)", "/ws/talkers/3"), ("--x=$(find talkers)/y --z", "--x=/ws/talkers/y --z"),
    ("$(find talkers)/a:$(find talkers)/b", "/ws/talkers/a:/ws/talkers/b"),
    ("$(find talkers)$(find talkers)/b", "/ws/talkers//ws/talkers/b"),
    ("$(find talkers)$x", "/ws/talkers/$x"),
    ("$(find talkers) $(find talkers)", "/ws/talkers /ws/talkers"),
    ("$(eval optenv('NOPE', 7) + 1)", "8"), ("$(eval s.title().split())", "['Hi', 'There']"),
    ("$(eval ','.join([c + 'x' for c in s.split()]))", "hix,therex"),
    ("$(eval list(map(float, '1 2'.split())))", "[1.0, 2.0]"), ("$(eval a + 1)", "4"),
    ("$(eval arg('a') + 1)", "4"), ("$(eval not b)", "False"), ("$(eval s + '!')", "hi there!"),
    ("$(eval 'x)' + env('HOME'))", "x)/home/ada"), ("$(eval optenv('NOPE', 'd'))", "d"),
    ("$(eval find('talkers') + dirname())", "/ws/talkers/launch"),
    ("$(eval anon('n') == anon('n'))", "True"), ("$()", "$()"), ("$(arg a", "$(arg a"),
])  # fmt: skip
def test_substitutions_are_made_as_noetic_makes_them(
    substitution: Substitution, text: str, result: str
) -> None:
    assert substitution.resolve(text) == result


@pytest.mark.parametrize(("text", "complaint"), [
    ("$(arg unset)", "requires the 'unset' arg to be set"),
    ("$(arg nope)", "requires the 'nope' arg to be set"), ("$(arg)", "must specify a variable name"),
    ("$(arg a b)", "may only specify one arg"), ("$(env NOPE)", "environment variable 'NOPE' is not set"),
    ("$(env)", "only accepts one argument"), ("$(optenv)", "must specify an environment variable"),
    ("$(anon)", "must specify a name"), ("$(anon a b)", "may only specify one name"),
    ("$(find)", "only accepts one argument"), ("$(foo x)", r"Unknown substitution command \[foo x\]"),
    ("x$(eval 1)", r"Unknown substitution command \[eval 1\]"),
    ("$(dirname x)", "Unknown substitution command"), ("$(arg $(arg a))", "Dollar signs"),
    ("$(optenv X (y))", "Invalid left parenthesis"), ("$(eval __import__('os'))", "double underscore"),
    ("$(eval arg('nope'))", "requires the 'nope' arg"),
])  # fmt: skip
def test_a_bad_substitution_is_explained(substitution: Substitution, text: str, complaint: str) -> None:
    with pytest.raises(SubstitutionError, match=complaint):
        substitution.resolve(text)


@pytest.mark.parametrize("text", ["$(eval nope)", "$(eval 1/0)", "$(eval s.encode())", "$(eval 9**9**9)"])
def test_a_bad_expression_is_refused(substitution: Substitution, text: str) -> None:
    with pytest.raises(ExpressionError):
        substitution.resolve(text)


def test_an_unknown_package_is_named(substitution: Substitution) -> None:
    for text in ("$(find nope)/x", "$(eval find('nope'))"):
        with pytest.raises(NotFound, match="nope"):
            substitution.resolve(text)


def test_dirname_needs_a_file(substitution: Substitution) -> None:
    substitution.folder = None
    with pytest.raises(SubstitutionError, match=r"Cannot substitute \$\(dirname\)"):
        substitution.resolve("$(dirname)")


def test_unset_arguments_can_be_tolerated(substitution: Substitution) -> None:
    substitution.unset_as = ""
    assert substitution.resolve("x$(arg unset)y") == "xy"
    substitution.unset_as = None
    with pytest.raises(UnsetArgument):
        substitution.resolve("$(arg unset)")


def test_anonymous_names_are_legal_and_differ() -> None:
    first, second = anonymous_name("n"), anonymous_name("n")
    assert first != second
    assert is_legal_base(first)


PYTHON = f'"{Path(sys.executable).as_posix()}"'


def test_a_command_in_python_prints_any_text_on_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipros_tools.launch.load_context.ON_WINDOWS", True)
    monkeypatch.delenv("PYTHONIOENCODING", raising=False)
    for name, value in (("LC_ALL", "C"), ("PYTHONCOERCECLOCALE", "0"), ("PYTHONUTF8", "0")):
        monkeypatch.setenv(name, value)  # on Linux, a pipe has a poor encoding only with these
    assert LoadContext.of_process().run_command(f'{PYTHON} -c "print(chr(0x4e2d))"').strip() == "中"


def test_on_windows_the_variable_home_names_the_users_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = str(Path.home())
    monkeypatch.setattr("pipros_tools.launch.load_context.ON_WINDOWS", True)
    monkeypatch.setattr("os.path.expanduser", lambda _: expected)
    monkeypatch.delenv("HOME", raising=False)
    assert LoadContext.of_process().environment["HOME"] == expected
    monkeypatch.setenv("HOME", "/chosen")
    assert LoadContext.of_process().environment["HOME"] == "/chosen"


def test_an_absent_xacro_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        "pipros_tools.launch.load_context.program_environment", lambda _: {"PATH": "/nowhere"}
    )
    with pytest.raises(CommandFailed, match=r"no such command .* comes from PyPI: .*pip install .*urdf"):
        LoadContext.of_process().run_command("xacro robot.xacro")
