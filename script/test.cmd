@rem What script/test does on Linux; see windows_here.py.
@set PYTHON=python
@for %%p in (py.exe) do @if not "%%~$PATH:p"=="" set PYTHON=py
@%PYTHON% "%~dp0windows_here.py" test %*
