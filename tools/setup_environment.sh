#!/usr/bin/env bash
# Builds or refreshes .venv: dependencies, this package (editable), its messages and hot modules. Called by `make setup`.
#   tools/setup_environment.sh [PYTHON]     PYTHON: interpreter for .venv; without it an existing .venv is kept
# Quick when nothing changed: .venv/setup.stamp holds a hash of all that the environment depends on, written last.
set -euo pipefail
cd "$(dirname "$0")/.."
wanted=${1-}
venv=$PWD/.venv
stamp=$venv/setup.stamp

fail() {
    echo "error: $*" >&2
    exit 1
}

supported() {
    "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info < (3, 14))' 2>/dev/null
}

find_python() {
    local candidate
    for candidate in python3 python3.13 python3.12 python3.11 python3.10; do
        if supported "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    fail "no Python 3.10 to 3.13 found on PATH: install one, or name it: make setup PYTHON=/path/to/python3.12"
}

interpreter_of() {
    "$1" -c 'import os, sys; print(sys.version.split()[0], os.path.realpath(sys.executable))' 2>/dev/null || true
}

# The folder's path counts too: a virtual environment that was moved or copied does not work.
fingerprint() {
    {
        echo "$PWD"
        cat pyproject.toml setup.py package.xml automax_ros/__init__.py tools/setup_environment.sh \
            tools/build_messages.py tools/compiler_parts.py tools/message_code.py tools/message_libraries.py \
            msg_defs/package.xml
        tail -n +1 msg_defs/msg/*.msg msg_defs/srv/*.srv
    } | sha256sum
}

# pip is told not to compile: it does so on one core, and compiles tests that nobody imports.
install() {
    "$venv/bin/python" -m pip install --quiet --disable-pip-version-check --no-compile "$@"
}

# What the messages are built with, a line each. setup.py is read, not run: it needs setuptools, which may not be there yet.
needed_by_messages() {
    "$venv/bin/python" - <<'END'
import ast

with open("setup.py", encoding="utf-8") as file:
    tree = ast.parse(file.read())
stated = {ast.unparse(node.targets[0]): node.value for node in tree.body if isinstance(node, ast.Assign)}
needed, extras = (ast.literal_eval(stated[name]) for name in ("NEEDED", "EXTRAS"))
print(*needed, *extras["ros"], *extras["build"], sep="\n")
END
}

# Programs start in half the time, also where Python is told not to write what it has compiled. Not all that others
# wrote can be compiled: that does not matter.
compile_python() {
    "$venv/bin/python" -m compileall -qq -j 0 -x '/tests?/' "$venv/lib" || true
    "$venv/bin/python" -m compileall -q -j 0 automax_ros
}

# The hot modules as machine code: built again when their sources have changed, left out where plain Python is wanted.
compile_ahead() {
    [ "${AUTOMAX_COMPILED-}" = off ] || "$venv/bin/python" tools/build_compiled.py ||
        echo "the modules could not be compiled ahead of time: plain Python runs instead"
}

# Two makes at once: the second waits, then finds everything done.
if command -v flock >/dev/null; then
    exec 9<.
    flock 9
fi

if [ -n "$wanted" ]; then
    supported "$wanted" || fail "$wanted is not a Python 3.10 to 3.13"
    if [ -e "$venv" ] && [ "$(interpreter_of "$wanted")" != "$(interpreter_of "$venv/bin/python")" ]; then
        rm -rf "$venv"
    fi
fi
current=$(fingerprint)
if [ -e "$stamp" ] && [ "$(cat "$stamp")" = "$current" ] && [ -x "$venv/bin/automax" ]; then
    compile_ahead
    exit 0
fi
# An environment that is whole but out of date, or that an interrupted setup left, is carried on with. One whose Python is
# gone, or that was moved here from another folder (its programs name their interpreter by full path), starts afresh.
if ! supported "$venv/bin/python" || ! grep -qs "$venv/bin" "$venv/bin/pip"; then
    rm -rf "$venv"
    python=${wanted:-$(find_python)}
    echo "creating .venv with $("$python" --version)"
    "$python" -m venv "$venv" || fail "cannot create .venv (Debian, Ubuntu: sudo apt install python3-venv)"
fi
rm -f "$stamp"
echo "installing dependencies into .venv (about a minute the first time) ..."
needed_by_messages >"$venv/needed.txt"
install -r "$venv/needed.txt"
# The messages are compiled while pip, which mostly waits, brings the rest. A setup that fails or is interrupted ends when
# pip has ended too, which holds the lock until then: half a package would look like a whole one.
trap wait EXIT
install --use-pep517 --editable '.[ros,build,plot,panel,docs,test]' &
rest=$!
"$venv/bin/python" tools/build_messages.py
wait "$rest"
# Once more, should the rest have brought another version of what they were built with: quick where it has not.
"$venv/bin/python" tools/build_messages.py
compile_python
echo "$current" >"$stamp"
compile_ahead
