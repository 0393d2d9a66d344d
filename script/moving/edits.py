"""After move.py: make constants and paths name the new folders."""
import re, subprocess
from pathlib import Path
ROOT = Path.cwd()
ENV = "from tests.support.environments import {}\n"
def add_import(text, names):
    lines = text.split("\n")
    # after the docstring and __future__: before the first import line
    for i, line in enumerate(lines):
        if re.match(r"(from|import) (?!__future__)", line):
            lines.insert(i, ENV.format(", ".join(sorted(names))).rstrip()); return "\n".join(lines)
    raise SystemExit("no import")
SUBS = [
    (r'REPOSITORY / "tests"', "TESTS", "TESTS"),
    (r'REPOSITORY / "src"', "SRC", "SRC"),
    (r'REPOSITORY / "benchmarks"', "BENCHMARKS", "BENCHMARKS"),
    (r'Path\(__file__\)(?:\.resolve\(\))?\.parents\[[12]\] / "(support|browser|golden|graph|packages|courses)"', r'TESTS / "\1"', "TESTS"),
    (r'Path\(__file__\)\.resolve\(\)\.parents\[3\] / "docs"', 'REPOSITORY / "docs"', "REPOSITORY"),
    (r'Path\(__file__\)\.resolve\(\)\.parents\[3\] / "src"', 'SRC', "SRC"),
    (r'^ROOT = Path\(__file__\)(?:\.resolve\(\))?\.parents\[[23]\]', 'ROOT = REPOSITORY', "REPOSITORY"),
    (r'cwd=Path\(__file__\)\.parents\[2\]', 'cwd=REPOSITORY', "REPOSITORY"),
    (r'HERE\.parents\[2\] / "examples"', 'REPOSITORY / "examples"', "REPOSITORY"),
]
for file in sorted(ROOT.glob("packages/*/tests/**/*.py")):
    rel = str(file.relative_to(ROOT))
    if "/golden/recordings/" in rel or rel.endswith("support/environments.py"): continue
    text = file.read_text()
    if rel.endswith("golden/cli/record.py"):
        text = text.replace("sys.path.insert(0, str(HERE.parents[2]))", 'sys.path.insert(0, str(HERE.parents[4] / "build"))')
    needed = set()
    new = text
    for pattern, to, name in SUBS:
        changed = re.sub(pattern, to, new, flags=re.M)
        if changed != new: needed.add(name)
        new = changed
    if not rel.startswith("packages/pipros/"):
        kind = rel.split("/")[3]
        if kind in ("interop", "graph"):
            changed = re.sub(r'Path\(__file__\)\.parent / "programs"', f'TESTS / "{kind}" / "programs"', new)
            if changed != new: needed.add("TESTS")
            new = changed
    if new != text and needed:
        new = add_import(new, needed)
    if new != text: file.write_text(new)
# benchmarks
UP = 'os.path.abspath(os.path.join(__file__, "..", "..", "..", ".."))'
for file in sorted(ROOT.glob("packages/*/benchmarks/*.py")):
    text = new = file.read_text()
    new = new.replace('os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "src")', f'os.path.join({UP}, "build", "src")')
    new = new.replace('os.path.dirname(os.path.dirname(os.path.abspath(__file__)))', UP)
    new = re.sub(r'os\.path\.join\((REPOSITORY|ROOT), "src"', r'os.path.join(\1, "build", "src"', new)
    new = new.replace('os.path.join(REPOSITORY, "facades", part) for part in ("api", "internals")', 'os.path.join(REPOSITORY, "build", part) for part in ("facades", "internals")')
    new = re.sub(r'os\.path\.join\((REPOSITORY|ROOT), "tests"', r'os.path.join(\1, "build", "tests"', new)
    new = new.replace('sys.path.insert(0, str(Path(__file__).parents[1]))', 'sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "build"))')
    new = new.replace('Path(__file__).resolve().parents[1] / "examples"', 'Path(__file__).resolve().parents[3] / "examples"')
    new = new.replace('ROOT = Path(__file__).resolve().parent.parent', 'ROOT = Path(__file__).resolve().parents[3]').replace('ROOT / "tests"', 'ROOT / "build" / "tests"')
    if new != text: file.write_text(new)
# scripts
for file in [*ROOT.glob("script/*")]:
    if not file.is_file(): continue
    text = new = file.read_text()
    for v in ("ROOT", "REPOSITORY"):
        new = new.replace(f'{v} / "tests"', f'{v} / "build" / "tests"').replace(f'{v} / "src"', f'{v} / "build" / "src"')
    if new != text: file.write_text(new)
# conftests of rooms
KINDS = {"graph": "make_node master transport", "security": "make_node master", "chaos": "make_node master", "regressions": "make_node master"}
for kind, names in KINDS.items():
    for folder in ROOT.glob(f"packages/pipros-*/tests/{kind}"):
        lines = "".join(f"from tests.support.node_fixtures import {n} as {n}\n" for n in names.split())
        (folder / "conftest.py").write_text('"""Fixtures: a master and nodes in the test\'s own process."""\n\n' + lines)
def shared(kind, package, module, doc):
    """The fixtures of a conftest.py that several packages use become a module."""
    home = ROOT / f"packages/{package}/tests/{kind}"
    subprocess.run(["git", "mv", str(home / "conftest.py"), str(home / f"{module}.py")], check=True)
    subprocess.run(f"grep -rlE 'tests\\.{kind}\\.conftest' packages script --include=* | xargs -r sed -i 's/tests\\.{kind}\\.conftest/tests.{kind}.{module}/g'", shell=True, check=True)
    for folder in ROOT.glob(f"packages/*/tests/{kind}"):
        (folder / "conftest.py").write_text(f'"""{doc}"""\n\nfrom tests.{kind}.{module} import *  # noqa: F403\n')
shared("interop", "pipros", "fixtures", "Fixtures for tests with genuine ROS 1 on the other side.")
shared("browser", "pipros-page", "chromium", "Fixtures for the page in a real browser.")
env = ROOT / "packages/pipros/tests/support/environments.py"
text = env.read_text()
text = text.replace('REPOSITORY = Path(__file__).resolve().parents[2]', 'REPOSITORY = Path(__file__).resolve().parents[4]')
text = text.replace('SRC = REPOSITORY / "src"\nFACADES = (REPOSITORY / "facades" / "api", REPOSITORY / "facades" / "internals")\n', 'MERGED = REPOSITORY / "build"\n"""Links to the folders of all packages, by script/merge_packages.py."""\nSRC, TESTS, BENCHMARKS = MERGED / "src", MERGED / "tests", MERGED / "benchmarks"\nFACADES = (MERGED / "facades", MERGED / "internals")\n')
env.write_text(text)
subprocess.run(["git", "mv", "tests/conftest.py", "packages/conftest.py"], check=True)
subprocess.run(["git", "rm", "-q", "tests/__init__.py", "packages/pipros/tests/windows/__init__.py", "packages/pipros-page/tests/browser/__init__.py"], check=True)
