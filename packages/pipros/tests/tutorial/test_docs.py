"""Run the commands of five pages, and check that a test runs every other block (`blocks`).

A `console` block is a terminal. The lines after a command must appear in its output in that order; `...`
matches any text, or any lines if it is a whole line. A last command that does not exit runs until the end of
the page. A block with a title is a file.
"""

# needs numpy
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support import documents
from tests.support.absent_plugins import DELETED
from tests.support.environments import PACKAGES, REPOSITORY
from tests.support.ros import RosSystem
from tests.support.terminal import Terminal
from tests.support.waiting import wait_until
from tests.tutorial.blocks import BLOCK, NOT_RUN, READ_BY, RUN_HERE, SHOWN_BY

Key = tuple[str, tuple[str, ...]]


FILES = {"README.md": REPOSITORY / "README.md", **documents.pages()}
NAMES = {file: name for name, file in FILES.items()}


def pages() -> list[Path]:
    return [file for file in NAMES if file.suffix == ".md"]


def name_of(page: Path) -> str:
    return NAMES[page]


def blocks_in_other_words(page: Path) -> Iterator[str]:
    """Yield the blocks that neither this file nor a test in `READ_BY` takes from the page, except output.

    `test_how` has those of the tasks.
    """
    if name_of(page).startswith("how/"):
        return
    for language, title, content in BLOCK.findall(page.read_text()):
        is_run_here = name_of(page) in RUN_HERE and (title or language == "console")
        if not is_run_here and (name_of(page), language) not in READ_BY and language != "text":
            yield content


@pytest.mark.timeout(400)
@pytest.mark.parametrize("page", RUN_HERE)
def test_the_commands_of_a_page_print_the_output_shown(ros: RosSystem, page: str) -> None:
    text = documents.text_of(page)
    for language, title, content in BLOCK.findall(text):
        if title:
            path = ros.home / title.removeprefix("~/")
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content)
        elif language == "console":
            _type(ros, content)


def _type(ros: RosSystem, block: str) -> None:
    terminal = ros.pipros.open_terminal()
    commands = [part.partition("\n") for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]]
    for line, _, expected in commands:
        terminal.type(line)
        _wait_for(terminal, expected)
        if line == "roscore":
            ros.wait_for_publisher("/rosout_agg")
        elif line.startswith("rostopic pub") and not expected:
            ros.wait_for_publisher(line.split()[2])
        if line != commands[-1][0]:
            assert terminal.wait_for_prompt() == 0, terminal.text


def _wait_for(terminal: Terminal, expected: str) -> None:
    pattern = re.compile(_pattern(expected))
    wait_until(
        lambda: pattern.search(terminal.text), 60, lambda: f"{expected}in the output:\n{terminal.text}"
    )


def _pattern(expected: str) -> str:
    """A regular expression for the expected lines."""
    lines = [
        "(?:.*\n)*?" if line == "..." else re.escape(line).replace(r"\.\.\.", ".*") + r".*\n"
        for line in expected.splitlines()
    ]
    return "".join(lines)


def test_commands_have_no_comments_which_zsh_would_pass_on() -> None:
    commented = [
        f"{name_of(page)}: {line}"
        for page in pages()
        for language, _, content in BLOCK.findall(page.read_text())
        for line in content.splitlines()
        if (language == "sh" or (language == "console" and line.startswith("$ ")))
        and re.search(r"(^|\s)#(\s|$)", line)
    ]
    assert commented == []


def test_every_block_of_every_page_is_run_by_a_test_or_has_a_reason() -> None:
    keys = [*SHOWN_BY, *NOT_RUN]
    missing = [
        f"{name_of(page)}: {block}"
        for page in pages()
        for block in blocks_in_other_words(page)
        if not any(_is_about(key, page, block) for key in keys)
    ]
    assert missing == []


@pytest.mark.parametrize("key", [*SHOWN_BY, *NOT_RUN], ids=str)
def test_the_words_in_the_tables_mean_one_block(key: Key) -> None:
    found = [
        block for page in pages() for block in blocks_in_other_words(page) if _is_about(key, page, block)
    ]
    assert len(found) == 1


def _is_about(key: Key, page: Path, block: str) -> bool:
    name, words = key
    return name == name_of(page) and all(word in f"\n{block}" for word in words)


@pytest.mark.parametrize(("key", "test"), SHOWN_BY.items(), ids=str)
def test_the_named_test_reads_the_page_or_contains_the_words_of_the_block(key: Key, test: str) -> None:
    content = (REPOSITORY / test).read_text()
    assert Path(key[0]).name in content or not [word for word in key[1] if word not in content]


@pytest.mark.parametrize(("place", "test"), READ_BY.items(), ids=str)
def test_the_named_test_reads_the_page(place: tuple[str, str], test: str) -> None:
    page, language = place
    assert f"```{language}" in FILES[page].read_text()
    content = (REPOSITORY / test).read_text()
    names = [f"{name.replace('.', '/')}.py" for name in re.findall(r"from (tests[\w.]+)", content)]
    modules = [file for package in PACKAGES for name in names if (file := package / name).is_file()]
    assert any(Path(page).name in text for text in (content, *(each.read_text() for each in modules)))


def test_no_block_is_hidden_from_these_tests() -> None:
    """Blocks without a language, and indented ones, would be neither run nor listed."""
    hidden = []
    for page in pages():
        is_block = False
        for number, line in enumerate(page.read_text().splitlines(), 1):
            if line.lstrip().startswith("```"):
                is_block = not is_block
                if is_block and not re.match(r"```\w", line):
                    hidden.append(f"{name_of(page)}:{number}: {line}")
            elif not is_block and re.match(r" {4}(?!options:| {2}heading_level:)\S", line):
                hidden.append(f"{name_of(page)}:{number}: {line}")
    assert hidden == []


def test_the_documents_can_be_read_and_a_task_fits_on_a_screen() -> None:
    """A task's lines are those of text and commands, without the files that readers save; 150 characters."""
    assert 40_000 < sum(documents.words().values()) <= 45_000
    lengths = {}
    for page in pages():
        if name_of(page).startswith("how/") and name_of(page) != "how/index.md":
            text = re.sub(r"^```(?!sh\n|bat\n).*?^```$", "", page.read_text(), flags=re.MULTILINE | re.DOTALL)
            lines = [line for line in text.splitlines() if line and not line.startswith(("# ", "```"))]
            lengths[name_of(page)] = sum(len(line) // 150 + 1 for line in lines)
    assert len(lengths) >= 20
    assert {name: length for name, length in lengths.items() if length > 15} == {}


def test_no_document_assumes_an_index_a_site_or_a_place_outside_of_the_tree() -> None:
    """Once pipros is published, `pip install pipros` is what users type: this test then turns around."""
    index = r"pip install (?!--no-index)[^`\n]*(?<![\w./-])['\"]?pipros(?![\w/-])"
    found = []
    for page in [*pages(), *REPOSITORY.glob("p*/*/README.md"), REPOSITORY / "CONTRIBUTING.md"]:
        text = page.read_text()
        found += [f"{page}: {match}" for match in re.findall(rf"{index}|example\.(?:org|com|net)", text)]
        for link in re.findall(r"\]\(([^)#\s]+)", text):
            target = (page.parent / link).resolve()
            is_elsewhere = not target.is_relative_to(REPOSITORY) or not target.exists()
            is_removed = any(f"/pipros-{name}/" in str(target) for name in DELETED)
            if is_elsewhere and not is_removed and not re.match(r"https?:|<", link):
                found.append(f"{page}: {link}")
    assert found == []
