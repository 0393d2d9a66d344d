@rem What script/demo does on Linux; see windows_here.py.
@set PYTHON=python
@where /q py && set PYTHON=py
@%PYTHON% "%~dp0windows_here.py" demo %*
