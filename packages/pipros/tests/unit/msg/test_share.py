"""The included packages are ROS packages in every respect."""

import re
from pathlib import Path

import pytest

from pipros.basics.errors import NotFound
from pipros.msg.importing.hook import installed_library
from pipros.msg.language.comments import comments_of
from pipros.msg.language.definition_files import DefinitionFiles
from pipros.msg.language.definitions import Definitions
from pipros.msg.language.parse import SECTION_MARK
from pipros.msg.language.spec import MessageSpec
from pipros.packages import shipped_folder
from pipros_workspace.index import SHIPPED_FOLDERS

WITH_DEFINITIONS = sorted(
    folder
    for share in SHIPPED_FOLDERS
    for folder in share.iterdir()
    if any((folder / kind).is_dir() for kind in ("msg", "srv"))
)


@pytest.mark.parametrize("folder", WITH_DEFINITIONS, ids=lambda folder: folder.name)
def test_an_included_package_declares_all_its_dependencies(folder: Path) -> None:
    texts = [file.read_text() for kind in ("msg", "srv", "action") for file in folder.glob(f"{kind}/*")]
    used = set(re.findall(r"^(\w+)/\w+", "\n".join(texts), re.MULTILINE))
    manifest = (folder / "package.xml").read_text()
    depends = re.findall(r"<depend>(\w+)</depend>", manifest)
    cmake = (folder / "CMakeLists.txt").read_text()

    assert used - {folder.name} <= set(depends)
    assert f"project({folder.name})\n" in cmake
    assert f"generate_messages({' '.join(['DEPENDENCIES', *depends] if depends else [])})\n" in cmake
    for kind, function in (("msg", "message"), ("srv", "service"), ("action", "action")):
        assert (f"add_{function}_files(DIRECTORY {kind})" in cmake) == (folder / kind).is_dir()


@pytest.mark.parametrize("package", ["", "..", "/etc"])
def test_an_invalid_package_name_is_not_treated_as_a_folder(package: str) -> None:
    with pytest.raises(NotFound, match="there is no package"):
        installed_library().files.file("msg", f"{package}/String")


# The included definitions have documentation that every parser reads as comments.


FILES = [
    file
    for kind in ("msg", "srv", "action")
    for share in SHIPPED_FOLDERS
    for file in sorted(share.glob(f"*/{kind}/*.{kind}"))
]


PACKAGES = sorted({file.parts[-3] for file in FILES})


LONGEST_LINE = 110


def parts(file: Path, definitions: Definitions) -> list[MessageSpec]:
    """Return the message of a file, or the parts of its service or action."""
    type_name = f"{file.parts[-3]}/{file.stem}"
    if file.suffix == ".msg":
        return [definitions.message(type_name)]
    if file.suffix == ".srv":
        service = definitions.service(type_name)
        return [service.request, service.response]
    return list(definitions.action(type_name).messages[:3])


@pytest.mark.parametrize("package", PACKAGES)
def test_every_type_field_and_constant_that_ships_has_a_comment(package: str) -> None:
    definitions = Definitions(DefinitionFiles(shipped_folder))
    without: list[str] = []
    for file in (file for file in FILES if file.parts[-3] == package):
        specs = parts(file, definitions)
        if not comments_of(specs[0].text).head:
            without.append(f"{file.name}: the whole")
        for spec in specs:
            of = comments_of(spec.text).of
            named = [*spec.constants, *spec.fields]
            without += [f"{file.name}: {item.name}" for item in named if not of.get(item.name)]
    assert without == []


@pytest.mark.parametrize("package", PACKAGES)
def test_the_comment_of_the_whole_is_separate_from_the_first_declaration(package: str) -> None:
    for file in (file for file in FILES if file.parts[-3] == package):
        before, _, after = file.read_text().partition("\n\n")
        assert all(line.startswith("# ") for line in before.splitlines()), file
        assert after or all(line.startswith("#") for line in file.read_text().splitlines()), file


def test_no_comment_follows_a_string_constant_whose_value_would_include_it() -> None:
    constants = [
        line
        for file in FILES
        for line in file.read_text().splitlines()
        if re.match(r"\s*string [^#]*=", line)
    ]
    assert constants == ["string DISABLE_HEARTBEAT_TIMEOUT_PARAM=/bond_disable_heartbeat_timeout"]


@pytest.mark.parametrize("package", PACKAGES)
def test_comments_contain_no_syntax_that_breaks_code_generators(package: str) -> None:
    for file in (file for file in FILES if file.parts[-3] == package):
        text = file.read_text()
        assert text.isascii(), file
        assert not re.search(r'["\\\t=]', "".join(re.findall("#.*", text))), file
        assert max(map(len, text.splitlines())) <= LONGEST_LINE, file
        sections = {".msg": 0, ".srv": 1, ".action": 2}[file.suffix]
        assert len(re.findall(f"^{SECTION_MARK}", text, re.MULTILINE)) == sections, file
