"""After edits.py: configuration and scripts."""
import re, glob
paths=sorted(glob.glob("packages/*/src"))+sorted(glob.glob("packages/*/facades"))
lst="[\n"+"".join(f'  "{x}",\n' for x in paths)+"]"
def edit(p, f):
    s=open(p).read(); n=f(s); open(p,"w").write(n)
def project(s):
    s=s.replace('dev-mode-dirs = ["src", "facades/api", "facades/internals"]','dev-mode-dirs = ["build/src", "build/facades", "build/internals", "build"] # see script/merge_packages.py')
    s=s.replace('only-include = ["src/pipros", "facades"]\nsources = ["src", "facades/api", "facades/internals"]\n',f'# One line for each folder of each package.\nsources = {lst}\nonly-include = {lst.replace(chr(34)+"packages/pipros/src"+chr(34),chr(34)+"packages/pipros/src/pipros"+chr(34))}\n')
    s=s.replace('"src/pipros.pth" = "pipros.pth"','"packages/pipros/src/pipros.pth" = "pipros.pth"')
    s=s.replace('"src/pipros/web/page/vendor','"packages/pipros-page/src/pipros/web/page/vendor')
    s=s.replace('src = [".", "src", "facades/api", "facades/internals"]','src = [".", "packages/*", "packages/*/src", "packages/*/facades"]')
    s=s.replace('extend-exclude = ["script/moving", "examples/catkin_ws/src/composiv_tryouts", "tests/courses"]','extend-exclude = ["build", "examples/catkin_ws/src/composiv_tryouts", "packages/pipros/tests/courses"]')
    s=re.sub(r'^"(benchmarks|tests)/\*\*"', r'"packages/*/\1/**"', s, flags=re.M)
    s=s.replace('"tests/interop/programs/examine','"packages/pipros/tests/interop/programs/examine')
    s=re.sub(r'^"src/pipros/', '"packages/*/src/pipros/', s, flags=re.M)
    s=s.replace('"facades/**"','"packages/*/facades/**"').replace('"facades/api/','"packages/pipros/facades/')
    s=s.replace('files = ["src/pipros", "facades"]\nmypy_path = "src:facades/api:facades/internals"','files = ["packages/*/src/pipros", "packages/*/facades"]\nmypy_path = "'+":".join(paths)+'"\nexplicit_package_bases = true')
    s=s.replace('rooms declare theirs in src/pipros/ROOM/room.py.','rooms declare theirs in ROOM/room.py.')
    s=s.replace('testpaths = ["tests"]\npythonpath = ["."]','testpaths = ["packages"]\npythonpath = ["build"]')
    s=s.replace('source = ["src/pipros", "facades"]','source = ["packages"]').replace('omit = ["*/pipros/share/*"]','omit = ["*/pipros/share/*", "*/tests/*", "*/benchmarks/*", "*/plugins/*"]')
    return s
edit("pyproject.toml", project)
def rooms(s):
    s=re.sub(r'f"[\w/*-]*src/pipros/\{room.name\}"','f"packages/*/src/pipros/{room.name}"',s)
    s=re.sub(r'f"[\w/*-]*src/pipros/share/\{name\}"','f"packages/*/src/pipros/share/{name}"',s)
    s=re.sub(r'f"[\w/*-]*facades/\{name\}"','f"packages/*/facades/{name}"',s)
    s=s.replace('source = str(root / "src")','source = str(root / "build" / "src")')
    return s.replace('    source = root.resolve() / "src"\n','    from merge_packages import merge\n\n    merge(root.resolve())\n    source = root.resolve() / "build" / "src"\n')
edit("script/build_rooms.py", rooms)
def stubs(s):
    s=s.replace('source = Path(self.root) / "src"','source = Path(self.root) / "build" / "src"')
    s=re.sub(r'folder\.name for folder in share\.iterdir\(\) if f"[\w/*-]*src/pipros/share/\{folder\.name\}" not in excluded','folder.name\n            for folder in share.iterdir()\n            if f"packages/*/src/pipros/share/{folder.name}" not in excluded',s)
    return s.replace('glob("facades/*/*/__init__.py")','glob("packages/*/facades/*/__init__.py")')
edit("script/stubs_hook.py", stubs)
def venv(s):
    s=s.replace('"$PWD/src" 2>/dev/null','"$PWD/packages" 2>/dev/null')
    s=re.sub(r'cat pyproject.toml \S*src/pipros/\*/room.py','cat pyproject.toml packages/*/src/pipros/*/room.py',s)
    return s.replace('# Console scripts contain the folder','# New files at the top of a package are linked.\ncommand -v "$python" >/dev/null && "$python" script/merge_packages.py\n\n# Console scripts contain the folder')
edit("script/venv", venv)
edit("script/check", lambda s: re.sub(r'MYPYPATH=src\S* \.venv/bin/mypy --explicit-package-bases \S*tests/support tests/conftest.py \S*tests/tutorial script/\*\.py','MYPYPATH=build/src:build/facades:build/internals:script:packages/pipros .venv/bin/mypy packages/pipros/tests/support packages/conftest.py packages/pipros/tests/tutorial script/*.py',s))
def coverage(s):
    s=s.replace('for tests in packages/pipros/tests/unit/*; do','for tests in packages/*/tests/unit/*; do')
    s=re.sub(r'packages/pipros/tests/unit/\{bag,launch,libraries,master,simulation,wire,workspace\}','packages/pipros/tests/unit/{bag,launch,libraries,master,wire,workspace} packages/pipros-robot/tests/unit/simulation',s)
    return s.replace('case " ${half[*]} tests/unit/__pycache__ " in *" $tests "*) ;;','case " ${half[*]} $(dirname "$tests")/__pycache__ " in *" $tests "*) ;;').replace('${half[*]} packages/pipros/tests/unit/__pycache__','${half[*]} $(dirname "$tests")/__pycache__')
edit("script/coverage", coverage)
for p in ("script/rooms","script/newest","script/long",".ci/run"):
    edit(p, lambda s: re.sub(r'packages/pipros/tests/unit\b(?!/)','packages/*/tests/unit',s))
edit("script/fresh", lambda s: s.replace('--ignore=packages/pipros/tests/unit','--ignore-glob=*/tests/unit').replace('~/pipros/tests/tutorial/','~/pipros/packages/pipros/tests/tutorial/').replace('./plugins/*','./packages/pipros-data/plugins/*'))
def bench(s):
    s=re.sub(r'(?<!/)\bbenchmarks/\$name\.py','build/benchmarks/$name.py',s).replace('names=$(cd benchmarks &&','names=$(cd build/benchmarks &&').replace('exec "$venv','export PYTHONPATH=$PWD/build/benchmarks # they import each other\nexec "$venv')
    i=s.index('if [ ! -f'); return s[:i]+'python3 script/merge_packages.py\n'+s[i:]
edit("script/bench", bench)
for p in glob.glob("packages/*/src/pipros/*/room.py"): edit(p, lambda s: s.replace('"api/','"'))
