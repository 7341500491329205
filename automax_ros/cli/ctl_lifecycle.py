"""`automax ctl RACK lifecycle ...`: transitions and states of the rack's managed nodes, as `ros2 lifecycle` asks them.

Unlike all other actions they reach a rack that has no operator: its node ``rack`` may wait to be configured.
"""

from __future__ import annotations

import argparse

from automax_ros.cli.ctl_ask import Action, Ask
from automax_ros.cli.usage import UsageError
from automax_ros.core.text import quoted

STATE = "state"
_TRANSITIONS = ("configure", "activate", "deactivate", "cleanup", "shutdown")


def _add(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("transition", choices=(*_TRANSITIONS, STATE), help="what is asked for; state reads the state")
    parser.add_argument(
        "node", nargs="?", default="rack", metavar="NODE", help="a node, such as processor_1 (default: rack)"
    )


def _asks(given: argparse.Namespace) -> list[Ask]:
    if not given.node.isidentifier() or not given.node.isascii():
        raise UsageError(f"{quoted(given.node)} is not the name of a node", "such as rack, processor_1, udc_10")
    of = f"{given.transition} {given.node}"
    if given.transition == STATE:
        return [Ask(f"{given.node}/get_state", "lifecycle_msgs/GetState", of=of)]
    from lifecycle_msgs.msg import Transition

    wanted = {"transition": Transition(label=given.transition)}
    return [Ask(f"{given.node}/change_state", "lifecycle_msgs/ChangeState", wanted, of, _reason)]


def _reason(_: str) -> str:
    return "the rack's console and /rosout say why"


LIFECYCLE = Action(
    "configure, activate, deactivate, clean up or shut down the node `rack` or a module's; or read its state",
    _asks,
    _add,
    lambda answer: answer.current_state.label if hasattr(answer, "current_state") else "done",
    lambda state: [state],
    by_operator=False,
)
