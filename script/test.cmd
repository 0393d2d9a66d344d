@rem What script/test does on Linux; see tests.support.windows_here.
@set PYTHON=python
@for %%p in (py.exe) do @if not "%%~$PATH:p"=="" set PYTHON=py
@%PYTHON% "%~dp0..\packages\pipros\tests\support\windows_here.py" test %*
