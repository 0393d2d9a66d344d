"""After edits2.py: tests of the tree."""
import re
from pathlib import Path
missing=[]
def sub(p, *pairs, optional=False):
    path=Path(p)
    if not path.exists(): missing.append(p); return
    s=path.read_text()
    for a,b in pairs:
        if a not in s: missing.append((p,a)); continue
        s=s.replace(a,b)
    path.write_text(s)
T="packages/pipros/tests/"
sub(T+"support/environments.py",
('    return sorted(file for folder in (SRC, *FACADES) for file in folder.rglob("*.py"))','    return [file for folder in (SRC, *FACADES) for file in files_below(folder, "*.py")]'),
('def source_files() -> list[Path]:','''def files_below(folder: Path, pattern: str = "*") -> list[Path]:
    """Return the files below a folder of `build` whose names match, sorted."""
    return sorted(
        Path(base, name)
        for base, _, names in os.walk(folder, followlinks=True)
        if not base.endswith("__pycache__")
        for name in fnmatch.filter(names, pattern)
    )


def source_files() -> list[Path]:'''),
('import os\nimport shutil\n','import fnmatch\nimport os\nimport shutil\n'))
def use(p, *pairs):
    sub(p, *pairs)
    path=Path(p)
    if path.exists():
        s=path.read_text()
        if "files_below(" in s and not re.search(r"import [^\n]*files_below", s):
            lines=s.split("\n")
            for i,l in enumerate(lines):
                if re.match(r"(from|import) (?!__future__)", l):
                    lines.insert(i,"from tests.support.environments import files_below"); break
            path.write_text("\n".join(lines))
W="packages/pipros-page/tests/unit/web/"
use(W+"test_tabs.py",('sorted(PAGE.rglob("*.js"))','files_below(PAGE, "*.js")'))
use(W+"test_page_files.py",('sorted(file for file in (SRC).rglob("*.js") if "vendor" not in file.parts)','[file for file in files_below(SRC, "*.js") if "vendor" not in file.parts]'),
('for pattern in ("*.py", "*.js") for file in folder.rglob(pattern)','for pattern in ("*.py", "*.js") for file in files_below(folder, pattern)'))
use("packages/pipros-assistants/tests/unit/assistants/test_server.py",('sorted(FOLDER.rglob("*.py"))','files_below(FOLDER, "*.py")'))
use(T+"typing/test_installed_types.py",('for file in folder.rglob("*.py")]','for file in files_below(folder, "*.py")]'))
use(T+"tree/test_other_systems.py",('sorted(file for file in folder.rglob("*.py") if "share" not in import_path(file).parts)','[file for file in files_below(folder, "*.py") if "share" not in import_path(file).parts]'))
use(T+"tree/test_facades_are_thin.py",('for file in internals.rglob("*.py"))','for file in files_below(internals, "*.py"))'))
sub(T+"tree/test_no_binaries.py",('(".ci", ".github", "benchmarks", "docs", "examples", "facades", "plugins", "script", "src", "tests")','(".ci", ".github", "docs", "examples", "packages", "script")'),
('CORPUS = TESTS / "fuzz" / "corpus"','CORPUS = (TESTS / "fuzz" / "corpus").resolve()'),
('BENCHMARKS = BENCHMARKS / "recorded"','RECORDED = (BENCHMARKS / "recorded").resolve()'),
('file.is_relative_to(BENCHMARKS)','file.is_relative_to(RECORDED)'),
('file.is_relative_to(FOLDER)','file.is_relative_to(FOLDER.resolve())'))
use(T+"tree/test_support_recordings.py",('== set(FOLDER.rglob("*.json.gz"))','== set(files_below(FOLDER, "*.json.gz"))'),('in FOLDER.rglob("*.json.gz"):','in files_below(FOLDER, "*.json.gz"):'),('"PYTHONPATH": str(REPOSITORY)','"PYTHONPATH": str(MERGED)'))
use(T+"tree/test_packaging.py",('''    assert wheel["only-include"] == ["packages/pipros/src/pipros", "facades"]
    assert [REPOSITORY / folder for folder in wheel["sources"]] == [SRC, *FACADES]
''','''    folders = {str(file.relative_to(REPOSITORY)) for file in REPOSITORY.glob("packages/*/[sf][ra]c*")}
    assert set(wheel["sources"]) == folders
    assert set(wheel["only-include"]) == folders - {"packages/pipros/src"} | {"packages/pipros/src/pipros"}
'''),
('any(package.is_relative_to(REPOSITORY / folder) for folder in PROJECT["tool"]["mypy"]["files"])','PROJECT["tool"]["mypy"]["files"] == ["packages/*/src/pipros", "packages/*/facades"]'),
('for path in sorted(SHARE.rglob("*"))','for path in files_below(SHARE)'),
('for path in share.rglob("*") if path.is_file() and','for path in files_below(share) if'),
('for name in ("facades", "script", "src"):','for name in ("packages", "script"):'))
sub(T+"tree/test_release.py",('("metadata_hook.py", "build_rooms.py")','("metadata_hook.py", "build_rooms.py", "merge_packages.py")'),('(folder / "src").symlink_to(SRC)','(folder / "packages").symlink_to(REPOSITORY / "packages")'))
use(T+"unit/workspace/test_python2.py",('list((SRC).rglob("*.py"))','files_below(SRC, "*.py")'))
use(T+"tutorial/test_installed_wheel.py",('SHARE.rglob("*") if file.is_file() and "__pycache__" not in file.parts','files_below(SHARE)'))
use(T+"support/every_program.py",('sorted(SHARE.rglob("*"))','files_below(SHARE)'))
s=Path(T+"support/every_program.py").read_text()
Path(T+"support/every_program.py").write_text(s.replace('SHARE = ROOT / "src" / "pipros" / "share"','SHARE = ROOT / "build" / "src" / "pipros" / "share"'))
sub(T+"support/absent_rooms.py",('REPOSITORY.glob("packages/pipros/src/pipros/*/room.py")','REPOSITORY.glob("packages/*/src/pipros/*/room.py")'))
use(T+"tree/test_rooms.py",('PREFIXES = ("packages/pipros/src/pipros", "facades")\n\n\n','\n\n'),
('    path = str(file.relative_to(REPOSITORY))\n','    path = str(import_path(file))\n'),
('''    for prefix in PREFIXES:
        for file in sorted((REPOSITORY / prefix).rglob("*")):
            is_program = os.access(file, os.X_OK) and file.suffix == ""
            if file.is_file() and (file.suffix == ".py" or is_program):
                yield file
''','''    for root in (SRC, *FACADES):
        for file in files_below(root):
            if file.suffix == ".py" or (os.access(file, os.X_OK) and file.suffix == ""):
                yield file
'''),
('for path, name in PATHS.items() if path.startswith("facades")','for path, name in PATHS.items() if "/" not in path'),
('if not (REPOSITORY / path).exists()]','if not any((root / path).exists() for root in (SRC, *FACADES))]'),
('import REPOSITORY, SRC\n','import FACADES, REPOSITORY, SRC, files_below, import_path\n'))
sub("script/build_rooms.py",('"""Return the paths in the source tree that are left out."""','"""Return the paths that are left out, relative to the folders on `sys.path`."""'),
('f"packages/*/src/pipros/{room.name}"','f"pipros/{room.name}"'),('f"packages/*/src/pipros/share/{name}" for','f"pipros/share/{name}" for'),('*(f"packages/*/facades/{name}" for name in room.facades)','*room.facades'))
sub("script/stubs_hook.py",('if f"packages/*/src/pipros/share/{folder.name}" not in excluded','if f"pipros/share/{folder.name}" not in excluded'),
('[f"/{path}" for path in excluded]','[f"/packages/*/{root}/{path}" for path in excluded for root in ("src", "facades")]'))
sub(T+"tree/test_prose.py",('''    "src",
    "facades",
''','''    "packages",
'''),('    "benchmarks",\n    "tests",\n',''),('"packages/pipros/tests/golden/",','"packages/pipros/tests/golden/",\n    "packages/pipros-page/tests/golden/",\n    "packages/pipros-robot/tests/golden/",'),
('        and share not in file.parents\n','        and not share & {each.name for each in file.parents}\n'),('    share = SRC / "pipros" / "share"\n','    share = {"share"}\n'))
sub(T+"tree/test_history.py",('        "src",\n        "facades",\n','        "src",\n        "facades",\n        "packages/*/src",\n        "packages/*/facades",\n'))
sub(T+"tree/test_contributing.py",(r'\b(?:script|tests|src|docs)/[\w./-]*\w',r'\b(?:script|packages|docs)/[\w./-]*\w'),('path != "src/pipros/share/NAME"','path != "packages/pipros/src/pipros/share/NAME"'))
print(missing)
