"""--ros-args where nothing of ROS is started, and the options of simulated time with ROS."""

import pytest

from automax_ros.cli.main import main


@pytest.fixture
def rack(automax):
    automax.write("rack.yaml", "rack: LINE1\nslots:\n  0: {module: 57C435, tasks: {TASK: {priority: 5}}}\n")
    automax.write("TASK.BLK", "100 CALL SCAN_LOOP(TICKS=2)\n110 END\n")
    return automax


def test_word_alone_is_allowed_everywhere(rack):
    """Launch files always pass it."""
    assert rack("check", "rack.yaml", "--ros-args").code == 0
    assert rack("run", "rack.yaml", "--simulated", "--duration", "0.1", "--ros-args").code == 0
    assert rack("--ros-args", "--", "check", "rack.yaml").code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["check", "rack.yaml", "--ros-args", "-r", "__ns:=/x"], "--ros-args: this subcommand makes no ROS nodes"),
        (["run", "rack.yaml", "--simulated", "--ros-args", "-p", "A:=1"], "with --simulated nothing of ROS is started"),
        (["run", "rack.yaml", "--ros-args", "-r", "__ns:=x"], "'x' is not a namespace of ROS"),
        (["run", "rack.yaml", "--ros-args", "--params-file", "none.yaml"], "none.yaml: cannot be read"),
        (["ctl", "PM1", "--ros-args", "--bad", "--", "status"], "unknown option '--bad'"),
        (["run", "rack.yaml", "--ros"], "--ros belongs to --simulated"),
        (["run", "rack.yaml", "--simulated", "--rate", "2"], "--rate belongs to --simulated --ros"),
    ],
)
def test_what_cannot_be_is_wrong_usage(rack, words, said):
    result = rack(*words)
    assert result.code == 2
    assert said in result.err
    assert result.out == ""


def test_arguments_of_ros_before_the_subcommand_do_not_hide_it(capsys):
    assert main(["--ros-args", "-r", "a:=b", "--", "blocks", "--ros-args", "-p", "x:=1"]) == 2
    assert "automax blocks: error: --ros-args: this subcommand makes no ROS nodes" in capsys.readouterr().err
